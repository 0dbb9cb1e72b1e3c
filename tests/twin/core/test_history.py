"""What was observed before: in its order, once each, within its bounds."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.core import history as history_module
from lupin_twin.core import ingest
from lupin_twin.core.history import History, PastAttempt, PastScan, TagHistory
from lupin_twin.core.state import Attempt, Inspection, Reading, Scan, TwinStore
from tests.support.store import SCAN_FAILED, S, failed_look, look, scan


def stamps_s(past: tuple[PastScan, ...] | tuple[PastAttempt, ...]) -> list[float]:
    return [each.stamp_ns / S for each in past]


def values(history: History, sensor: str, tag_id: str = "1") -> list[tuple[float, float]]:
    return [
        (past.stamp_ns / S, reading.value)
        for past in history.of(tag_id).scans
        for reading in past.readings
        if reading.name == sensor
    ]


def test_scans_that_brought_readings_are_kept_and_every_try() -> None:
    history = History()
    assert history.of("1") == TagHistory()
    history.add(scan("1", at_s=1.0, co2=400.0))
    history.add(look("1", at_s=2.0))
    history.add(failed_look("1", at_s=3.0))
    history.add(Scan("1", 4 * S, status=1, status_detail="blocked"))
    past = history.of("1")
    assert past.scans == (PastScan(S, (Reading("co2", 400.0),)),)
    assert past.attempts == (
        PastAttempt(Attempt(S), 0),
        PastAttempt(Attempt(2 * S), 1),
        PastAttempt(Attempt(3 * S, SCAN_FAILED), 1),
        PastAttempt(Attempt(4 * S, 1, "blocked"), 0),
    )


def test_what_was_heard_is_known_by_kind_stamp_and_source() -> None:
    history = History()
    history.add(scan("1", at_s=5.0, source="a", co2=1.0))
    assert history.news(scan("1", at_s=5.0, source="a", co2=9.0)) is None
    for other in (
        scan("2", at_s=5.0, source="a"),
        scan("1", at_s=6.0, source="a"),
        scan("1", at_s=5.0, source="b"),
        replace(look("1", at_s=5.0), source="a"),
    ):
        assert history.news(other) == other


def test_what_has_no_stamp_of_its_own_is_known_by_the_moment_it_came() -> None:
    history = History()
    for at_s in (1.0, 2.0):
        history.add(replace(scan("1", at_s=at_s, co2=1.0), own_stamp_ns=0))
    assert stamps_s(history.of("1").scans) == [1.0, 2.0]


def test_the_histories_of_all_tags_are_bounded_and_a_tag_makes_room_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(history_module, "MAX_HISTORY_ITEMS", 6)
    history = History()
    for at_s in (1.0, 2.0):
        history.add(scan("1", at_s=at_s, co2=at_s))  # a try and a reading each
    history.add(scan("2", at_s=3.0, co2=3.0))
    assert [stamps_s(history.of(t).scans) for t in ("1", "2")] == [[1.0, 2.0], [3.0]]
    history.add(scan("1", at_s=4.0, co2=4.0))
    assert stamps_s(history.of("1").scans)[-1] == 4.0
    assert len(history.of("1").scans) + len(history.of("1").attempts) == 4
    history.add(scan("3", at_s=5.0, co2=5.0))
    assert history.of("3") == TagHistory()
    assert stamps_s(history.of("2").scans) == [3.0]


def test_after_a_clock_that_went_back_nothing_is_later_and_news_is_news() -> None:
    history = History()
    for at_s in (40.0, 3600.0):
        history.add(scan("1", at_s=at_s, co2=at_s))
    history.hold_to(50 * S)
    assert stamps_s(history.of("1").scans) == stamps_s(history.of("1").attempts) == [40.0, 50.0]
    history.add(scan("1", at_s=3600.0, co2=1.0))
    assert values(history, "co2") == [(40.0, 40.0), (50.0, 3600.0), (3600.0, 1.0)]


# --- against a model ----------------------------------------------------------------------------

WRITES = st.lists(
    st.builds(
        lambda at_s, sensor, value, source: scan(
            "1", at_s, source=source, **({sensor: value} if sensor else {})
        ),
        st.integers(1, 12),
        st.sampled_from(["", "co2", "light"]),
        st.integers(0, 3).map(float),
        st.sampled_from(["a", "b"]),
    )
    | st.builds(lambda at_s: look("1", at_s), st.integers(1, 12)),
    max_size=20,
)


@given(WRITES, st.integers(1, 6))
def test_against_the_plainest_history(writes: list[Scan | Inspection], buffer_len: int) -> None:
    """All of it, sorted by stamp, each once, and of that the newest."""
    history = History(buffer_len)
    scans: dict[tuple[int, str], dict[str, float]] = {}
    tries: dict[tuple[int, int, str], None] = {}
    for write in writes:
        history.add(write)
        tries.setdefault((write.stamp_ns, isinstance(write, Inspection), write.source))
        if isinstance(write, Scan) and write.readings:
            readings = {r.name: r.value for r in write.readings}
            scans.setdefault((write.stamp_ns, write.source), {}).update(readings)
    past = history.of("1")
    newest = sorted(tries, key=lambda key: key[0])[-buffer_len:]
    if len(tries) <= buffer_len:  # of what was pushed out, heard again, nothing can be known
        assert [(each.stamp_ns, each.kind) for each in past.attempts] == [key[:2] for key in newest]
    if len(scans) <= buffer_len:
        expected = sorted(scans.items(), key=lambda item: item[0][0])
        assert [
            (each.stamp_ns, {r.name: r.value for r in each.readings}) for each in past.scans
        ] == [(stamp_ns, readings) for (stamp_ns, _), readings in expected]
    assert len(past.attempts) <= buffer_len
    assert len(past.scans) <= buffer_len


# --- with what the log has not yet ----------------------------------------------------------------

WRITTEN = (
    scan("1", at_s=10.0, co2=400.0, light=1.0),
    look("1", at_s=3610.0),
    scan("1", at_s=7210.0, light=2.0),
    scan("1", at_s=7300.0, succeeded=False),
)


@pytest.mark.parametrize("missing", [0, 1])
def test_what_the_newest_state_shows_is_there_once_whether_the_log_has_it_or_not(
    missing: int,
) -> None:
    store, every = TwinStore(), History()
    of_log = History()
    for write in WRITTEN:
        assert ingest.apply(write, store, every) is None
    for write in WRITTEN[: len(WRITTEN) - missing]:
        of_log.add(write)
    of_log.complete(store.snapshot(0, "map").tags[0])
    found, expected = of_log.of("1"), every.of("1")
    assert found.scans == expected.scans
    assert [past.what for past in found.attempts] == [past.what for past in expected.attempts]
    assert [past.kind for past in found.attempts] == [0, 1, 0, None if missing else 0]


@given(
    st.lists(
        st.tuples(st.integers(1, 5), st.sets(st.sampled_from(["co2", "light"])), st.booleans()),
        max_size=12,
    )
)
def test_of_a_log_that_lacks_the_last_write_nothing_is_missing(
    steps: list[tuple[int, set[str], bool]],
) -> None:
    store, every, of_log = TwinStore(), History(), History()
    at_s = 0
    for number, (wait_s, sensors, is_look) in enumerate(steps, 1):
        at_s += wait_s
        readings = tuple(Reading(name, float(number)) for name in sorted(sensors))
        write = look("1", at_s) if is_look else Scan("1", at_s * S, readings)
        assert ingest.apply(write, store, every) is None
        if number < len(steps):
            of_log.add(write)
    for tag in store.snapshot(0, "map").tags:
        of_log.complete(tag)
    assert of_log.of("1").scans == every.of("1").scans
    assert [past.what for past in of_log.of("1").attempts] == [
        past.what for past in every.of("1").attempts
    ]
