from __future__ import annotations

from pathlib import Path

import pytest

from lupin_twin.journal.reading import runs
from lupin_twin.journal.spans import FOREVER_NS, Span
from lupin_twin.journal.tallies import Count, Tallies
from lupin_twin.past import HOUR_NS, SLOT_NS, Grid, NotRemembered
from tests.support.journal import scan
from tests.support.past_reference import Reference
from tests.support.past_strategy import BEGUN, MINUTE, lived, upkeep

HOURS = Grid(BEGUN, BEGUN + 10 * HOUR_NS, HOUR_NS)


def told(reference: Reference, start_ns: int, end_ns: int, grid: Grid = HOURS) -> dict[int, int]:
    span = Span(runs(reference.file._connection)[1], start_ns, end_ns)
    counts = Tallies(reference.file._connection).counts("scan", span, grid)
    return {index: count.n for index, count in counts.items()}


def write(reference: Reference, *minutes: float) -> None:
    reference.write(scan(at_ns=BEGUN + int(minute * MINUTE)) for minute in minutes)


def test_counts_come_off_tallies_and_what_is_not_in_them_yet(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite", []) as reference:
        write(reference, *range(0, 180, 10))
        upkeep(reference)
        connection = reference.file._connection
        connection.execute("DELETE FROM scan")  # were one read, it would be missed
        write(reference, 5, 205)
        assert told(reference, 0, FOREVER_NS) == {0: 7, 1: 6, 2: 6, 3: 1}
        slots = Grid(BEGUN, BEGUN + 10 * HOUR_NS, 6 * SLOT_NS)
        assert told(reference, 0, FOREVER_NS, slots) == {0: 4, 1: 3, 2: 3, 3: 3, 4: 3, 5: 3, 6: 1}


def test_of_a_slot_that_spans_share_its_own_scans_count(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite", []) as reference:
        write(reference, 0, 61, 62, 63, 128)
        upkeep(reference)
        cut = BEGUN + 62 * MINUTE
        assert told(reference, 0, cut) == {0: 1, 1: 1}
        assert told(reference, cut, FOREVER_NS) == {1: 2, 2: 1}
        # A slot with nothing beside the span needs none.
        reference.file._connection.execute("DELETE FROM scan")
        assert told(reference, BEGUN + 127 * MINUTE, FOREVER_NS) == {2: 1}
        assert told(reference, 0, BEGUN + 127 * MINUTE) == {0: 1, 1: 3}


def test_extents_are_as_long_as_no_gap_in_them_matters(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite", []) as reference:
        write(reference, 0, 1, 9, 30, 59)
        upkeep(reference)
        write(reference, 70)
        connection = reference.file._connection
        span = Span(runs(connection)[1], 0, FOREVER_NS)
        tallies = Tallies(connection)

        def extents(longest: int) -> list[tuple[int, int]]:
            found = tallies.extents(span, longest * MINUTE)
            return sorted(((a - BEGUN) // MINUTE, (b - BEGUN) // MINUTE) for a, b in found)

        assert extents(29) == [(0, 59), (70, 70)]
        assert extents(28) == [(0, 1), (9, 9), (30, 30), (59, 59), (70, 70)]
        assert tallies.tries(span) == 6
        assert tallies.ends(span) == (BEGUN, BEGUN + 70 * MINUTE)
        assert sorted(tallies.spread(span)) == [
            BEGUN + minute * MINUTE for minute in (0, 1, 9, 30, 59, 70)
        ]


def test_two_counts_are_one() -> None:
    assert Count(1, 5, 5, 5).and_(Count(2, 5, 2, 3)) == Count(3, 10, 2, 5)


def test_while_a_damaged_file_is_read_the_house_is_not_told_of(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite", []) as reference:
        connection = reference.file._connection
        connection.execute("INSERT INTO meta VALUES ('salvage', 'x')")
        with pytest.raises(NotRemembered, match="ask again") as caught:
            Tallies(connection)
        assert not caught.value.is_lasting
