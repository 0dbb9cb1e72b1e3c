"""A journal's answers as plain JSON, to compare those of one file with those of another.

A query is a list: its name, and its arguments.
"""

import gzip
import json
import math
import shutil
import sqlite3
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from lupin_twin.core.past import SeriesRequest
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import series
from lupin_twin.journal.writes import rows

JOURNALS: Final = Path(__file__).parents[1] / "fixtures" / "journals"
NAMES: Final = sorted(
    str(path.relative_to(JOURNALS).with_suffix("")) for path in JOURNALS.rglob("*.sqlite")
)


def old(name: str, folder: Path) -> Path:
    """A journal as a twin finds it."""
    return Path(shutil.copy(JOURNALS / f"{name}.sqlite", folder / "j.sqlite"))


def answers(name: str) -> list[tuple[list[Any], Any]]:
    """Queries, with the answers of the old build; an estimate now uses other readings of a day."""
    text = gzip.decompress((JOURNALS / f"{Path(name).name}.answers.json.gz").read_bytes())
    # Infinite values are stored as null now.
    found: list[tuple[list[Any], Any]] = json.loads(text, parse_constant=lambda _: math.nan)
    return [(query, right) for query, right in found if query[0] in _ANSWERS]


def answer(connection: sqlite3.Connection, query: list[Any]) -> Any:
    kind, *arguments = query
    return json.loads(json.dumps(_ANSWERS[kind](connection, *arguments)))


def _state(connection: sqlite3.Connection, at_ns: int) -> Any:
    return [asdict(tag) for tag in state_at(connection, at_ns, "map").tags]


def _series(connection: sqlite3.Connection, *arguments: Any) -> Any:
    *request, now_ns = arguments
    past = series(connection, SeriesRequest(*request), now_ns)
    entries = zip(past.stamps_ns, past.counts, past.means, past.minima, past.maxima, strict=True)
    return [past.start_ns, past.end_ns, past.bucket_ns, list(entries)]


def _export(connection: sqlite3.Connection, *arguments: Any) -> Any:
    return [list(asdict(row).values()) for lot in rows(connection, *arguments) for row in lot]


_ANSWERS: dict[str, Callable[..., Any]] = {"state": _state, "series": _series, "export": _export}


def same(one: Any, other: Any) -> bool:
    """Whether two answers are equal, apart from the last digits of a mean."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, float) and isinstance(other, float):
        both_nan = math.isnan(one) and math.isnan(other)
        return both_nan or math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-9)
    return bool(one == other)
