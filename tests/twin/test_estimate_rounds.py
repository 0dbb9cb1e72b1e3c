"""Scans held against what was foretold for them; tags that have changed; whose turn it is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from lupin_twin.estimate_rounds import (
    HOLD_SHARE,
    MAX_GRADED,
    ROUND_REST_S,
    Done,
    Heard,
    Loaded,
    Round,
    Watch,
    load,
)
from lupin_twin.estimates import TagPast, fitted, readings_of
from lupin_twin.grading import Tally
from lupin_twin.state import NANOSECONDS_PER_SECOND, Reading, Scan
from tests.support.estimates import DAY_S

S = NANOSECONDS_PER_SECOND
HOUR_NS = 3600 * S
MODEL: Any = object()
OTHER_MODEL: Any = object()


def house(
    until_s: int, *, day_s: float = DAY_S, every_s: int = 300, tags: int = 6
) -> list[TagPast]:
    """What was read of a warm and of a cool end until then, one tag after the other."""
    chance = np.random.default_rng(1)
    places = chance.uniform((0.0, 0.0), (4.0, 8.0), (tags, 2))
    read: list[list[tuple[int, float]]] = [[] for _ in range(tags)]
    for number, at_s in enumerate(range(0, until_s, every_s)):
        tag = number % tags
        value = 21.0 + 4.0 * math.sin(2.0 * math.pi * at_s / day_s) + 0.4 * places[tag][1]
        read[tag].append((at_s * S, value + chance.normal(0.0, 0.2)))
    return [
        TagPast(f"tag-{tag}", float(places[tag][0]), float(places[tag][1]), tuple(read[tag]))
        for tag in range(tags)
    ]


def until(pasts: list[TagPast], at_ns: int) -> list[TagPast]:
    return [
        TagPast(one.tag_id, one.x, one.y, tuple(read for read in one.readings if read[0] <= at_ns))
        for one in pasts
    ]


def heard(pasts: list[TagPast], after_ns: int, until_ns: int) -> tuple[Heard, ...]:
    found = [
        Heard(one.tag_id, ns, value)
        for one in pasts
        for ns, value in one.readings
        if after_ns < ns <= until_ns
    ]
    return tuple(sorted(found, key=lambda one: one.stamp_ns))


def graded(pasts: list[TagPast], told_day_s: float, begin_s: int, end_s: int) -> Tally:
    """All scans of a time in rounds, as a twin that is told this day's length has them."""
    begin_ns, hold_ns = begin_s * S, int(HOLD_SHARE * told_day_s * S)
    model = fitted(readings_of(until(pasts, begin_ns), begin_ns, told_day_s), told_day_s)
    before = Round("t", model, (), None, None).run(until(pasts, begin_ns), begin_ns)
    total = Tally()
    for at_ns in range(begin_ns, end_s * S, hold_ns):
        then_ns = at_ns + hold_ns
        round_ = Round("t", model, heard(pasts, at_ns, then_ns), before.loaded, before.foretelling)
        before = round_.run(until(pasts, then_ns), then_ns)
        total = Tally(total.scans + before.graded.scans, total.inside + before.graded.inside)
    return total


def test_nine_of_ten_scans_lie_where_they_were_foretold() -> None:
    tally = graded(house(30 * 3600), DAY_S, 24 * 3600, 30 * 3600)
    assert tally.scans >= 70
    assert tally.is_credible, tally


def test_a_day_that_is_sixty_times_too_long_is_not_trusted() -> None:
    """The simulated robot's day, taken for one of the sun's."""
    day_s = DAY_S / 60.0
    pasts = house(14 * int(day_s), day_s=day_s, every_s=10)
    right = graded(pasts, day_s, 13 * int(day_s), 13 * int(day_s) + 500)
    assert right.is_credible, right
    wrong = graded(pasts, DAY_S, 7 * int(day_s), 14 * int(day_s))
    assert not wrong.is_credible, wrong


def test_what_was_known_before_or_is_nobodys_is_not_graded() -> None:
    at_ns = 12 * HOUR_NS
    pasts = until(house(13 * 3600), at_ns)
    loaded = load(fitted(readings_of(pasts, at_ns, DAY_S), DAY_S), pasts, at_ns, {})
    places = {"tag-0": (pasts[0].x, pasts[0].y)}
    newest_ns = max(ns for past in pasts for ns, _ in past.readings)
    [expected] = [check.expected for check in loaded.checks if check.tag_id == "tag-0"]
    near, far = Heard("tag-0", at_ns + S, expected), Heard("tag-0", at_ns + S, expected + 50.0)
    assert loaded.grade([near, far], places) == Tally(2, 1)
    assert loaded.grade([Heard("tag-0", newest_ns, expected)], places) == Tally()
    assert loaded.grade([Heard("nobody", at_ns + S, expected)], places) == Tally()


def test_a_tag_that_has_changed_is_left_out_and_told_since_when() -> None:
    pasts = house(30 * 3600, tags=8)
    at_ns = 29 * HOUR_NS
    odd = pasts[2]
    since_ns = next(ns for ns, _ in odd.readings if ns > 26 * HOUR_NS)
    moved = tuple((ns, value + (6.0 if ns >= since_ns else 0.0)) for ns, value in odd.readings)
    pasts[2] = TagPast(odd.tag_id, odd.x, odd.y, moved)
    pasts = until(pasts, at_ns)
    model = fitted(readings_of(until(pasts, 26 * HOUR_NS), 26 * HOUR_NS, DAY_S), DAY_S)
    first = load(model, pasts, at_ns, {})
    assert list(first.changed) == [odd.tag_id]
    assert first.changed[odd.tag_id] >= since_ns
    [check] = [check for check in first.checks if check.tag_id == odd.tag_id]
    assert check.measured == pasts[2].readings[-1][1]
    assert check.observed_at_ns == pasts[2].readings[-1][0]
    assert check.offset == pytest.approx(6.0, abs=2.0)
    assert abs(check.measured - check.expected) > 3.0
    again = load(model, pasts, at_ns + 60 * S, first.changed)
    assert again.changed == first.changed, "to the nanosecond"
    is_off = [Heard(odd.tag_id, at_ns + S, check.measured)]
    assert first.grade(is_off, {odd.tag_id: (odd.x, odd.y)}) == Tally(), "nothing is foretold"


# --- whose turn it is ---------------------------------------------------------------------------


def scan(stamp_ns: int = S, **values: float) -> Scan:
    return Scan("a", stamp_ns, tuple(Reading(name, value) for name, value in values.items()))


def done(model: Any, scans: int = 4, inside: int = 3) -> Done:
    loaded: Any = Loaded(0, model, None, ())  # type: ignore[arg-type]
    return Done(Tally(scans, inside), loaded, loaded)


def test_a_round_comes_with_the_first_model_and_then_with_scans() -> None:
    watch = Watch(DAY_S)
    watch.hear(scan(co2=400.0))
    assert watch.due({}, 0.0) is None
    first = watch.due({"co2": MODEL}, 0.0)
    assert first == Round("co2", MODEL, (), None, None), "nothing was foretold before"
    assert watch.begin(first) == 0
    assert watch.due({"co2": MODEL}, 0.0) is None, "one at a time"
    watch.end(done(MODEL), 0.0625, S)
    assert watch.loaded("co2") is not None
    assert watch.record("co2", S).week == Tally(4, 3)
    assert watch.due({"co2": MODEL}, 0.0625 + ROUND_REST_S) is None, "nothing was heard since"
    watch.hear(scan(2 * S, co2=410.0, light=5.0))
    watch.hear(scan(3 * S, co2=math.nan))
    assert watch.due({"co2": MODEL}, ROUND_REST_S) is None, "too soon"
    due = watch.due({"co2": MODEL}, 0.0625 + ROUND_REST_S)
    assert due is not None
    assert due.heard == (Heard("a", 2 * S, 410.0),)
    assert due.before is watch.loaded("co2")


def test_another_model_is_a_reason_too_and_the_longest_waiting_comes_first() -> None:
    watch = Watch(DAY_S)
    for at_s in (0.0, 20.0):
        due = watch.due({"a": MODEL, "b": MODEL}, at_s)
        assert due is not None
        assert due.sensor == ("a" if at_s == 0.0 else "b")
        watch.begin(due)
        watch.end(done(MODEL), at_s, S)
    assert watch.due({"a": MODEL, "b": MODEL}, 90.0) is None
    other = watch.due({"a": OTHER_MODEL, "b": OTHER_MODEL}, 90.0)
    assert other is not None
    assert (other.sensor, other.model) == ("a", OTHER_MODEL)


def test_a_flood_is_sampled_and_told() -> None:
    watch = Watch(DAY_S)
    due = watch.due({"co2": MODEL}, 0.0)
    assert due is not None
    watch.begin(due)
    watch.end(done(MODEL), 0.0, S)
    for number in range(MAX_GRADED + 3):
        watch.hear(scan(number * S, co2=400.0))
    due = watch.due({"co2": MODEL}, ROUND_REST_S)
    assert due is not None
    assert len(due.heard) == MAX_GRADED
    assert watch.begin(due) == 3
    assert watch.skipped == 3


def test_a_round_that_fails_changes_nothing() -> None:
    watch = Watch(DAY_S)
    due = watch.due({"co2": MODEL}, 0.0)
    assert due is not None
    watch.begin(due)
    watch.end(done(MODEL, 90, 10), 2.0, S)
    before = watch.loaded("co2")
    assert watch.distrusted(S) == ["co2"]
    watch.hear(scan(co2=1.0))
    due = watch.due({"co2": MODEL}, 2.0 + ROUND_REST_S)
    assert due is not None
    watch.begin(due)
    watch.end(ValueError("why"), 100.0, S)
    assert watch.loaded("co2") is before
    assert watch.record("co2", S).week == Tally(90, 10)
