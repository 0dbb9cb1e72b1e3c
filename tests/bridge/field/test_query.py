"""A field's query string, Accept, ETag and headers, without a server."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from urllib.parse import unquote

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import FORMATS, JSON, NPY, PNG, FieldFormat
from lupin_bridge.field.query import FieldQuery
from lupin_bridge.query_string import read
from lupin_twin.field.engine import FieldRefused, FieldRequest

BOX = {"bbox_min_x": "-1", "bbox_min_y": "0.5", "bbox_max_x": "2e1", "bbox_max_y": "3"}
REQUEST = FieldRequest("co2", 0.1, -1.0, 0.5, 20.0, 3.0)


def parse(pairs: Sequence[tuple[str, str]]) -> FieldQuery:
    names = [name for name, _ in pairs]
    own = [] if "sensor_type" in names else [("sensor_type", "co2")]
    return read(FieldQuery, [*own, *pairs], FieldRefused)


# --- parsing ------------------------------------------------------------------------------------


def test_a_full_query() -> None:
    query = parse([("sensor_type", "co2"), ("resolution", "0.25"), *BOX.items(), ("scale", "4")])
    assert query == FieldQuery("co2", 0.25, -1.0, 0.5, 20.0, 3.0, 4)
    assert query.box == (-1.0, 0.5, 20.0, 3.0)


def test_what_is_left_out_has_a_default_and_the_box_is_left_to_the_server() -> None:
    query = parse([("sensor_type", "co2")])
    assert query == FieldQuery("co2")
    assert query.box is None
    assert query.request((0.0, 1.0, 2.0, 3.0), 400) == FieldRequest("co2", 0.1, 0.0, 1.0, 2.0, 3.0)


def test_a_box_of_the_query_comes_before_the_default_one() -> None:
    query = parse([("sensor_type", "co2"), *BOX.items()])
    assert query.request((0.0, 1.0, 2.0, 3.0), 1) == REQUEST


def test_cells_of_a_default_box_are_wide_enough_unless_the_query_says_how_wide() -> None:
    whole = (0.0, 1.0, 2.0, 3.0)
    coarser = parse([("sensor_type", "co2")]).request(whole, 399)
    assert coarser == FieldRequest("co2", 0.2, *whole)
    fixed = parse([("sensor_type", "co2"), ("resolution", "0.1")]).request(whole, 399)
    assert fixed == FieldRequest("co2", 0.1, *whole)


@pytest.mark.parametrize(
    ("text", "number"),
    [("1", 1.0), (".5", 0.5), ("+2.", 2.0), (" 2", 2.0), ("1e-9", 1e-9), ("1E300", 1e300)],
)
def test_numbers_as_people_and_programs_write_them(text: str, number: float) -> None:
    assert parse([("resolution", text)]).resolution == number


def test_infinity_is_left_for_get_fields_own_check() -> None:
    assert parse([("resolution", "inf")]).resolution == math.inf


@pytest.mark.parametrize("left_out", field_query.BOX_NAMES)
def test_an_incomplete_box_is_refused_by_the_name_of_what_is_missing(left_out: str) -> None:
    given_box = [(name, value) for name, value in BOX.items() if name != left_out]
    with pytest.raises(FieldRefused, match=f"incomplete: {left_out} is missing"):
        _ = parse(given_box).box


@pytest.mark.parametrize("name", ["sensor", "Resolution", "bbox", "", "x" * 5_000])
def test_an_unknown_parameter_is_refused_and_the_known_ones_are_named(name: str) -> None:
    with pytest.raises(FieldRefused, match="unknown, expected sensor_type, resolution") as refused:
        parse([(name, "1")])
    assert repr(name[:64]) in str(refused.value)
    assert len(str(refused.value)) < 300


@pytest.mark.parametrize("name", ["resolution", *field_query.BOX_NAMES])
@pytest.mark.parametrize("text", ["", "one", "1,5", "0x10", "1m", "1 0", "٣", "9" * 5_000 + "x"])
def test_what_is_no_number_is_refused_with_its_name_and_value(name: str, text: str) -> None:
    values = {**BOX, name: text}
    with pytest.raises(FieldRefused, match=f"{name} is .*should be a valid number") as refused:
        parse(list(values.items()))
    assert repr(text[:64]) in str(refused.value)


@pytest.mark.parametrize("text", ["0", "-1", "1001", "1.5", "", "²", "٣", "1e2", "9" * 5_000, "x"])
def test_a_scale_out_of_its_range_is_refused(text: str) -> None:
    with pytest.raises(FieldRefused, match=f"^scale is '{text[:64]}': "):
        parse([("scale", text)])


@pytest.mark.parametrize("scale", [1, 1000])
def test_both_ends_of_the_scale_belong_to_it(scale: int) -> None:
    assert parse([("scale", str(scale))]).scale == scale


def test_a_picture_may_have_as_many_pixels_as_a_field_has_cells() -> None:
    query = FieldQuery("co2", 0.1, scale=10)
    field_query.check_scale(query, PNG, cells=100, max_cells=10_000)
    with pytest.raises(FieldRefused, match="10100 pixels, the limit is 10000"):
        field_query.check_scale(query, PNG, cells=101, max_cells=10_000)


@pytest.mark.parametrize("field_format", [JSON, NPY])
def test_only_a_picture_can_be_scaled(field_format: FieldFormat) -> None:
    query = FieldQuery("co2", 0.1, scale=2)
    with pytest.raises(FieldRefused, match="scale is 2, but only a PNG"):
        field_query.check_scale(query, field_format, cells=1, max_cells=10)
    field_query.check_scale(replace(query, scale=1), field_format, cells=1, max_cells=10)


# --- Accept (RFC 9110, section 12.5.1) ----------------------------------------------------------


@pytest.mark.parametrize(
    ("accept", "expected"),
    [
        (None, JSON),
        ("", JSON),
        ("  ", JSON),
        ("*/*", JSON),
        ("application/json", JSON),
        ("image/png", PNG),
        ("IMAGE/PNG", PNG),
        ("application/x-npy", NPY),
        ("image/*", PNG),
        ("application/*", JSON),
        ("image/avif,image/webp,image/png,*/*;q=0.8", PNG),  # an <img> in a browser
        ("text/html,application/xml;q=0.9,*/*;q=0.8", JSON),  # its address bar
        ("application/json;q=0.5, image/png;q=0.7", PNG),
        ("application/json;q=0, */*", PNG),
        ("application/*;q=0.2, image/png;q=0.1", JSON),
        ("*/*, application/json;q=0.1, image/png;q=0.2", NPY),
        ("application/json; charset=utf-8", JSON),
        ("image/png;q=high, application/x-npy;q=0.1", NPY),
        ("image/png;q=nan, application/x-npy;q=0.1", NPY),
        ("image/png;q=7, application/x-npy", PNG),
        ("text/html", None),
        ("application/json;q=0", None),
        (",;q=,/", None),
    ],
)
def test_accept_decides_the_format(accept: str | None, expected: FieldFormat | None) -> None:
    assert field_query.negotiate(accept) == expected


@given(st.text(st.characters(codec="latin-1"), max_size=60))
def test_any_accept_header_gives_a_format_or_none(accept: str) -> None:
    assert field_query.negotiate(accept) in (None, *FORMATS)


# --- ETag (RFC 9110, sections 8.8.3 and 13.1.2) ---------------------------------------------------


@pytest.mark.parametrize(
    ("if_none_match", "holds"),
    [
        (None, False),
        ("", False),
        ('"abc"', True),
        ('W/"abc"', True),
        ('"x", "abc"', True),
        ('"x","abc" ,"y"', True),
        ("*", True),
        ('"ab"', False),
        ("abc", False),
        ('"abc', False),
    ],
)
def test_if_none_match_names_the_tag_or_does_not(if_none_match: str | None, holds: bool) -> None:
    assert field_query.matches(if_none_match, '"abc"') is holds


# --- headers ------------------------------------------------------------------------------------


def test_metadata_goes_into_headers_that_any_client_can_read() -> None:
    headers = field_query.headers({"Unit": "°C", "Value-Min": "-1.5"}, "co2.json")
    assert headers == {
        "X-Field-Unit": "%C2%B0C",
        "X-Field-Value-Min": "-1.5",
        "Content-Disposition": 'inline; filename="co2.json"',
    }


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
