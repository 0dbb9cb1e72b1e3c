from __future__ import annotations

from pathlib import Path

import pytest

from lupin_twin.journal.happenings import OfHouse, OfTag
from lupin_twin.journal.reading import runs
from lupin_twin.journal.spans import FOREVER_NS, Span
from lupin_twin.past import HOUR_NS, SLOT_NS, Event, grid
from tests.support.journal import look, scan
from tests.support.past_strategy import BEGUN, MINUTE, give_up, lived, upkeep


def test_short_buckets_are_for_few_tries_that_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_twin.journal.happenings.MAX_TRIES", 60)
    with lived(tmp_path / "j.sqlite", []) as reference:
        reference.write(scan(at_ns=BEGUN + minute * MINUTE) for minute in range(60))
        upkeep(reference)
        connection = reference.file._connection
        house = OfHouse(connection)
        span = Span(runs(connection)[1], BEGUN, BEGUN + HOUR_NS)
        short = grid(BEGUN, BEGUN + HOUR_NS, 50)
        assert house.least_bucket_ns([span], short) == 0
        reference.write([look(at_ns=BEGUN)])
        assert OfHouse(connection).least_bucket_ns([span], short) == SLOT_NS
        assert house.least_bucket_ns([span], grid(BEGUN, BEGUN + HOUR_NS, 12)) == 0
        monkeypatch.setattr("lupin_twin.journal.happenings.MAX_TRIES", 99)
        give_up(reference, BEGUN + 3 * MINUTE)
        assert OfHouse(connection).least_bucket_ns([span], short) == SLOT_NS
        assert OfTag(connection, "7").least_bucket_ns([span], short) == 0


def test_a_tag_and_the_house_say_the_same_of_a_house_of_one_tag(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite", []) as reference:
        stamps = [BEGUN + minute * MINUTE for minute in (0, 3, 59, 61, 400)]
        reference.write(scan(at_ns=stamp_ns) for stamp_ns in stamps)
        reference.write([look(at_ns=BEGUN + 5, anomaly=True)])
        upkeep(reference)
        connection = reference.file._connection
        run = runs(connection)[1]
        spans = [Span(run, 0, FOREVER_NS), Span(run, BEGUN + 1, BEGUN + 61 * MINUTE)]
        for span in spans:
            one, house = OfTag(connection, "7"), OfHouse(connection)
            assert one.ends(span) == house.ends(span)
            assert one.tries(span) == house.tries(span)
            assert sorted(one.stamps(span)) == sorted(house.stamps(span))
            for event in (Event.SCANS, Event.LOOKS, Event.PESTS_SEEN):
                hours = grid(BEGUN, BEGUN + 10 * HOUR_NS, 10)
                assert one.counts(event, span, hours) == house.counts(event, span, hours)
                assert one.entries(event, span, 9) == house.entries(event, span, 9)
        assert OfTag(connection, "8").ends(spans[0]) is None
