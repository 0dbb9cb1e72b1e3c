"""Rows as CSV: read back to the last digit, with nothing that a spreadsheet executes."""

import csv
import io
import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.judge.judging import own_sensors
from lupin_bridge.past import bodies
from lupin_bridge.query_string import OfExport
from lupin_twin.core.past import PastRow

NS = 10**9
SENSORS = own_sensors()
ROW = PastRow(1_795_270_500 * NS + 5, "7", 1.5, -2.0, "co2", 412.5, 0, "robot-1")
FAILED = PastRow(1_795_270_501 * NS, "7", math.nan, math.nan, "", math.nan, 2, "robot-1")


def read(*rows: PastRow) -> list[dict[str, str]]:
    """What a CSV reader makes of the header and these rows."""
    text = (bodies.CSV_HEADER + bodies.csv_lines(rows, SENSORS)).decode()
    return list(csv.DictReader(io.StringIO(text, newline=""), strict=True))


def test_rows_of_one_scan_and_of_the_next_have_their_own_times() -> None:
    rows = read(ROW, ROW, FAILED, ROW)
    assert [row["stamp"][9:12] for row in rows] == ["0.0", "0.0", "1.0", "0.0"]


def test_a_line_ends_as_in_rfc_4180() -> None:
    text = bodies.CSV_HEADER + bodies.csv_lines([ROW, FAILED], SENSORS)
    assert text.count(b"\r\n") == text.count(b"\n") == 3
    assert text.endswith(b"\r\n")
    assert bodies.csv_lines([], SENSORS) == b""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a=b", "a=b"),
        ("=1+1", "'=1+1"),
        ("@SUM(A1)", "'@SUM(A1)"),
        ("\uff1d1", "'\uff1d1"),
        ("\t=1", "\"'\t'=1\""),
        ("a;=1", '"a;\'=1"'),
        ("a,b", '"a,b"'),
        ('say "x"', '"say ""x"""'),
        ("two\r\nlines", '"two\r\'\nlines"'),
    ],
)
def test_a_name_is_never_a_formula_and_is_quoted_where_necessary(text: str, expected: str) -> None:
    assert bodies.csv_cell(text) == expected


@given(st.text(), st.text(), st.text())
def test_names_are_read_back_apart_from_the_formula_guard(
    tag_id: str, sensor: str, source: str
) -> None:
    (row,) = read(PastRow(0, tag_id, 0.0, 0.0, sensor, 1.0, 0, source))
    for name, text in (("tag_id", tag_id), ("sensor", sensor), ("source", source)):
        assert row[name].replace("'", "") == text.replace("'", "")
        assert not row[name].startswith(("=", "+", "-", "@", "\t", "\r", "\n"))


@given(st.floats())
def test_numbers_are_read_back_to_the_last_bit_and_stay_numbers(value: float) -> None:
    (row,) = read(PastRow(1, "7", value, value, "co2", value, 0, ""))
    if math.isfinite(value):
        assert Fraction(float(row["value"])) == Fraction(float(row["x_m"])) == Fraction(value)
    else:
        assert row["value"] == row["x_m"] == row["y_m"] == ""


@pytest.mark.parametrize(
    ("requested", "now_ns", "expected"),
    [
        (OfExport(), None, "lupin-twin.csv"),
        (OfExport(), 86_400 * NS, "lupin-twin_to_19700102T000000Z.csv"),
        (
            OfExport(None, "1", tag_id='"; x=\r\né'),
            5,
            "lupin-twin____x_____to_19700101T000001Z.csv",
        ),
    ],
)
def test_the_file_name_describes_the_content(
    requested: OfExport, now_ns: int | None, expected: str
) -> None:
    assert bodies.export_file_name(requested, now_ns, "csv") == expected
