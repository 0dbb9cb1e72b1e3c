"""A field's query string, Accept, ETag and headers, without a server."""

import re
from collections.abc import Sequence
from urllib.parse import unquote

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from lupin_bridge import field as field_query
from lupin_bridge.field import FORMATS, JSON, NPY, PNG, FieldFormat, FieldQuery
from lupin_bridge.query_string import read
from lupin_twin.core.past import PastRefused
from lupin_twin.field.engine import FieldRequest

BOX = {"bbox_min_x": "-1", "bbox_min_y": "0.5", "bbox_max_x": "2e1", "bbox_max_y": "3"}


def parse(pairs: Sequence[tuple[str, str]]) -> FieldQuery:
    names = [name for name, _ in pairs]
    own = [] if "sensor_type" in names else [("sensor_type", "co2")]
    return read(FieldQuery, [*own, *pairs])


# --- parsing ------------------------------------------------------------------------------------


def test_omitted_values_have_defaults_and_the_server_chooses_the_box() -> None:
    query = parse([("sensor_type", "co2")])
    assert query == FieldQuery("co2")
    assert query.box is None
    assert query.request((0.0, 1.0, 2.0, 3.0), 400) == FieldRequest("co2", 0.1, 0.0, 1.0, 2.0, 3.0)


def test_cells_of_a_default_box_get_wide_enough_unless_the_query_sets_their_size() -> None:
    whole = (0.0, 1.0, 2.0, 3.0)
    coarser = parse([("sensor_type", "co2")]).request(whole, 399)
    assert coarser == FieldRequest("co2", 0.2, *whole)
    fixed = parse([("sensor_type", "co2"), ("resolution", "0.1")]).request(whole, 399)
    assert fixed == FieldRequest("co2", 0.1, *whole)


@pytest.mark.parametrize("text", ["0", "-1", "1001", "1.5", "", "²", "٣", "1e2", "9" * 5_000, "x"])
def test_a_scale_out_of_range_is_refused(text: str) -> None:
    with pytest.raises(PastRefused, match=f"^scale is '{text[:64]}': "):
        parse([("scale", text)])


# --- Accept (RFC 9110, section 12.5.1) ----------------------------------------------------------


@pytest.mark.parametrize(
    ("accept", "expected"),
    [
        (None, JSON),
        ("IMAGE/PNG", PNG),
        ("image/*", PNG),
        ("application/*", JSON),
        ("image/avif,image/webp,image/png,*/*;q=0.8", PNG),  # an <img> in a browser
        ("application/json;q=0.5, image/png;q=0.7", PNG),
        ("application/json;q=0, */*", PNG),
        ("application/*;q=0.2, image/png;q=0.1", JSON),
        ("*/*, application/json;q=0.1, image/png;q=0.2", NPY),
        ("application/json; charset=utf-8", JSON),
        ("image/png;q=high, application/x-npy;q=0.1", NPY),
        ("text/html", None),
        (",;q=,/", None),
    ],
)
def test_accept_chooses_the_format(accept: str | None, expected: FieldFormat | None) -> None:
    assert field_query.negotiate(accept) == expected


@given(st.text(st.characters(codec="latin-1"), max_size=60))
def test_any_accept_header_chooses_a_format_or_none(accept: str) -> None:
    assert field_query.negotiate(accept) in (None, *FORMATS)


# --- headers ------------------------------------------------------------------------------------


@example("  a b ")
@example(" ")
@given(st.text(st.characters(codec="utf-8"), max_size=40))
def test_no_sensor_name_can_break_out_of_a_header_or_a_folder(name: str) -> None:
    headers = field_query.headers({"Sensor": name}, f"{name}.png")
    for value in headers.values():
        assert re.fullmatch(r"[\x20-\x7e]*", value), "a header is one line of ASCII"
        assert value == value.strip(), "or it would not be sent"
    assert unquote(headers["X-Field-Sensor"]) == name
    file_name = re.fullmatch(r'inline; filename="(.*)"', headers["Content-Disposition"])
    assert file_name is not None
    assert re.fullmatch(r"[A-Za-z0-9._-]+", file_name[1])
