"""Rows of the past as CSV (RFC 4180), for spreadsheets and programs. Pure."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Final

from lupin_bridge.judge.ranges import Sensors
from lupin_bridge.past import moments
from lupin_bridge.past.query import ExportQuery
from lupin_twin.past import PastRow, seconds

MEDIA_TYPE: Final = "text/csv; charset=utf-8; header=present"
HEADER: Final = b"time_iso,stamp,tag_id,x_m,y_m,sensor,unit,value,status,source\r\n"

# Names come again and again: so many are kept as they are written, some 100 bytes each.
_NAMES: Final = 20_000

_NEEDS_QUOTES: Final = re.compile(r'[",;\r\n\t]')
# A spreadsheet takes what begins so for a formula, at the beginning of a cell or, where it parts
# cells by another sign than the comma, behind that one. Names come from the robot, and whoever
# opens the file must not run what they say.
_FORMULA: Final = re.compile(r"(^|[;\t\r\n])(?=[=+\-@\uff1d\uff0b\uff0d\uff20\t\r\n])")
_UNSAFE_IN_NAME: Final = re.compile(r"[^A-Za-z0-9._-]")


def lines(rows: Iterable[PastRow], sensors: Sensors) -> bytes:
    """Rows as lines of CSV; what is not known or not finite is empty."""
    written = []
    begins: tuple[int, str, float, float] | None = None
    beginning, units = "", dict[str, str]()
    for row in rows:
        scan = (row.stamp_ns, row.tag_id, row.x, row.y)
        if scan != begins:  # the readings of a scan share it
            begins = scan
            beginning = (
                f"{moments.iso(row.stamp_ns)},{seconds(row.stamp_ns)},"
                f"{cell(row.tag_id)},{number(row.x)},{number(row.y)}"
            )
        unit = units.get(row.sensor)
        if unit is None:
            unit = cell(sensors.named(row.sensor).unit) if row.sensor else ""
            units[row.sensor] = unit
        written.append(
            f"{beginning},{cell(row.sensor)},{unit},{number(row.value)},{row.status},"
            f"{cell(row.source)}\r\n"
        )
    return "".join(written).encode("utf-8", "replace")


@lru_cache(maxsize=_NAMES)
def cell(text: str) -> str:
    """A text as a cell: one that a spreadsheet would take for a formula gets a `'` in front."""
    text = _FORMULA.sub(r"\1'", text)
    if _NEEDS_QUOTES.search(text):
        return '"' + text.replace('"', '""') + '"'
    return text


def number(value: float) -> str:
    """A number in the fewest digits that say exactly it; empty: not finite."""
    return repr(value) if value - value == 0.0 else ""


def file_name(asked: ExportQuery, end_ns: int | None) -> str:
    """A name that says which tag, sensor and period; `end_ns` is now, where that is known."""
    of = [_UNSAFE_IN_NAME.sub("_", text) for text in (asked.tag_id, asked.sensor_type) if text]
    since = ["from", moments.compact(asked.start_ns)] if asked.start_ns else []
    end_ns = asked.end_ns or end_ns
    until = ["to", moments.compact(end_ns)] if end_ns else []
    return "_".join(["lupin-twin", *of, *since, *until]) + ".csv"
