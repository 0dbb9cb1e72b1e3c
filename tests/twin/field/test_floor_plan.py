"""The latest map in the log: unchanged, no larger than a row may be."""

import base64
import json
import zlib
from pathlib import Path

import numpy as np
import pytest

from lupin_twin.field.explored import MAX_PACKED_CELLS, map_of, text_of
from lupin_twin.journal.writer import Journal
from tests.support import maps
from tests.support.journal import CLOCK, LIMITS, select
from tests.support.waiting import wait_for

FLOOR = maps.map_of([[0, 100, -1], [0, 0, 50]], resolution=0.05, origin_x=-1.5, origin_yaw=0.25)
OTHER = maps.map_of([[0, 0]])
TOO_LARGE = maps.map_of(np.zeros((4_001, 4_000), np.int8))


def test_a_map_is_read_back_unchanged() -> None:
    found = map_of(text_of(FLOOR), revision=7)
    assert found.shows_the_same_as(FLOOR)
    assert (found.stamp_ns, found.revision) == (FLOOR.stamp_ns, 7)


def test_a_floor_of_two_hectares_is_a_tenth_of_a_megabyte() -> None:
    rows = np.zeros((2_000, 4_000), np.int8)
    rows[::40] = 100
    rows[:, ::160] = -1
    assert 0 < len(text_of(maps.map_of(rows))) < 100_000


def test_a_map_that_is_too_large_for_a_row_is_not_stored() -> None:
    noise = np.random.default_rng(1).integers(0, 100, (1_200, 1_200))
    assert text_of(maps.map_of(noise)) == ""
    assert text_of(TOO_LARGE) == ""


@pytest.mark.parametrize(
    "changed",
    [
        {"width": 4},
        {"width": 10_000_000, "height": 10_000_000},
        {"width": MAX_PACKED_CELLS, "height": 1},
        {"width": "3"},
        {"resolution": 0.0},
        {"origin_x": None},
        {"cells": "no base64"},
        {"cells": base64.b64encode(b"no zlib").decode()},
        {"cells": base64.b64encode(zlib.compress(bytes(50_000_000))).decode()},
        {"cells": 5},
        {"more": 1},
    ],
)
def test_a_text_that_is_no_map_is_refused(changed: dict[str, object]) -> None:
    text = json.dumps({**json.loads(text_of(FLOOR)), **changed})
    with pytest.raises(ValueError, match=r"."):
        map_of(text, revision=1)
    for other in ("", "[]", "null"):
        with pytest.raises(ValueError, match=r"."):
            map_of(other, revision=1)


def stored_map(path: Path) -> list[tuple[object, ...]]:
    return select(path, "SELECT value FROM meta WHERE key = 'map'")


def test_the_journal_has_the_latest_map_and_none_where_that_is_too_large(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    for floor in (FLOOR, OTHER, TOO_LARGE):
        journal = Journal(path, "test", LIMITS)
        try:
            journal.begin(CLOCK)
            journal.write_map(floor)
            wait_for(lambda it=floor: stored_map(path) == [(text_of(it),)], "the map in the file")  # type: ignore[misc]
        finally:
            journal.close()
