"""Rounds: models, scans held against other tags, sensors that have changed; whose turn it is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Reading, Scan
from lupin_twin.estimate import FitFailed, fit
from lupin_twin.estimate.engine import TagPast, readings_of
from lupin_twin.estimate.grading import Tally
from lupin_twin.field.idw import Abandoned
from lupin_twin.runtime.estimate_rounds import (
    FIRST_FIT,
    FIT_PERIOD_S,
    ROUND_REST_S,
    Done,
    Fit,
    Loaded,
    Round,
    Watch,
)
from tests.support.estimates import DAY_S

S = NANOSECONDS_PER_SECOND
HOUR_NS = 3600 * S
MODEL: Any = object()
OTHER_MODEL: Any = object()


def house(until_s: int, *, tags: int = 12, every_s: int = 150) -> list[TagPast]:
    """What was read of a warm and of a cool end until then, one tag after the other."""
    chance = np.random.default_rng(1)
    places = chance.uniform((0.0, 0.0), (4.0, 8.0), (tags, 2))
    read: list[list[tuple[int, float]]] = [[] for _ in range(tags)]
    for number, at_s in enumerate(range(0, until_s, every_s)):
        tag = number % tags
        value = 21.0 + 4.0 * math.sin(2.0 * math.pi * at_s / DAY_S) + 0.4 * places[tag][1]
        read[tag].append((at_s * S, value + chance.normal(0.0, 0.2)))
    return [
        TagPast(f"tag-{tag}", float(places[tag][0]), float(places[tag][1]), tuple(read[tag]))
        for tag in range(tags)
    ]


def newest(pasts: list[TagPast]) -> dict[str, int]:
    return {past.tag_id: past.readings[-1][0] for past in pasts}


def test_a_round_fits_a_model_where_it_has_none_and_keeps_one_that_it_has() -> None:
    pasts = house(6 * 3600)
    done = Round("t", DAY_S, None, {}, {}).run(pasts, 6 * HOUR_NS)
    assert done.loaded.model == fit(readings_of(pasts, 6 * HOUR_NS, DAY_S), day_length_s=DAY_S)
    assert done.graded == Tally(), "nothing new was received"
    again = Round("t", DAY_S, done.loaded.model, {}, {}).run(pasts, 6 * HOUR_NS)
    assert again.loaded.model is done.loaded.model
    assert [check.tag_id for check in again.loaded.checks] == [past.tag_id for past in pasts]
    check = again.loaded.checks[3]
    assert (check.observed_at_ns, check.measured) == pasts[3].readings[-1]
    assert abs(check.measured - check.expected) < 4.0 * check.expected_sd
    with pytest.raises(Abandoned):
        Round("t", DAY_S, None, {}, {}).run(pasts, 6 * HOUR_NS, lambda: True)


def test_nine_of_ten_scans_lie_where_other_tags_put_them() -> None:
    total = Tally()
    for hour in range(24, 30):
        pasts = house(hour * 3600)
        graded = Round("t", DAY_S, None, newest(pasts), {}).run(pasts, hour * HOUR_NS).graded
        total = Tally(total.scans + graded.scans, total.inside + graded.inside)
    assert total.scans == 6 * 12
    assert 0.8 <= (total.share or 0.0) <= 1.0


def test_only_what_is_new_is_graded_and_a_reading_that_is_off_is_not_inside() -> None:
    pasts = house(26 * 3600)
    stamp_ns = 26 * HOUR_NS - S
    pasts[2] = TagPast("tag-2", pasts[2].x, pasts[2].y, (*pasts[2].readings, (stamp_ns, 60.0)))
    round_ = Round("t", DAY_S, None, {"tag-2": stamp_ns, "gone": S}, {})
    assert round_.run(pasts, 26 * HOUR_NS).graded == Tally(1, 0)
    late = Round("t", DAY_S, None, {"tag-2": stamp_ns - S}, {})
    assert late.run(pasts, 26 * HOUR_NS).graded == Tally(), "there is a newer one"


def test_of_too_few_tags_nothing_is_graded() -> None:
    pasts = house(6 * 3600, tags=4)
    assert Round("t", DAY_S, None, newest(pasts), {}).run(pasts, 6 * HOUR_NS).graded == Tally()


def test_what_a_changed_sensor_reads_is_left_out_since_then_and_not_graded() -> None:
    pasts = house(30 * 3600)
    odd = pasts[2]
    since_ns = next(ns for ns, _ in odd.readings if ns > 26 * HOUR_NS)
    moved = tuple((ns, value + (6.0 if ns >= since_ns else 0.0)) for ns, value in odd.readings)
    pasts[2] = TagPast(odd.tag_id, odd.x, odd.y, moved)
    first = Round("t", DAY_S, None, newest(pasts), {}).run(pasts, 30 * HOUR_NS)
    assert first.loaded.changed == {odd.tag_id: since_ns}
    assert first.graded.scans == 11
    [check] = [one for one in first.loaded.checks if one.tag_id == odd.tag_id]
    assert (check.observed_at_ns, check.measured) == moved[-1]
    assert check.offset == pytest.approx(6.0, abs=1.0)
    assert check.measured - check.expected == pytest.approx(6.0, abs=1.5)
    at_s = (since_ns - 30 * HOUR_NS) / S
    of_odd = first.loaded.readings
    assert of_odd.time_s[of_odd.tag == 2].max() < at_s
    anew = Round("t", DAY_S, None, {}, first.loaded.changed).run(pasts, 30 * HOUR_NS)
    assert anew.loaded.changed == first.loaded.changed, "to the nanosecond"


# --- whose turn it is ---------------------------------------------------------------------------


def scan(stamp_ns: int = S, tag_id: str = "a", **values: float) -> Scan:
    return Scan(tag_id, stamp_ns, tuple(Reading(name, value) for name, value in values.items()))


def done(model: Any = MODEL, scans: int = 4, inside: int = 3) -> Done:
    loaded: Any = Loaded(0, model, None, ())  # type: ignore[arg-type]
    return Done(Tally(scans, inside), loaded)


def received(watch: Watch, sensor: str, times: int) -> bool:
    return sum(watch.add(scan(n * S, "a", **{sensor: 20.0})) for n in range(times)) > 0


def take_turn(watch: Watch, at_s: float, outcome: Done | Exception | None = None) -> Round:
    due = watch.due(at_s)
    assert due is not None
    watch.begin(due, at_s)
    watch.end(due, done() if outcome is None else outcome, at_s, int(at_s * S) + 1)
    return due


def test_the_first_round_comes_with_the_tenth_reading() -> None:
    watch = Watch(DAY_S)
    assert not received(watch, "co2", FIRST_FIT - 1)
    watch.add(scan(co2=math.nan))
    assert watch.due(0.0) is None
    assert watch.add(scan(co2=400.0, light=5.0)), "it need not be looked for"
    assert watch.due(0.0) == Round("co2", DAY_S, None, {}, {})
    assert watch.fit("co2") == watch.fit("light") == Fit()


def test_later_rounds_come_with_scans_and_rest_in_between() -> None:
    watch = Watch(DAY_S)
    received(watch, "co2", 100)
    take_turn(watch, 0.0)
    assert watch.fit("co2") == Fit(MODEL, 1)
    assert watch.due(1e9) is None, "nothing was received since"
    watch.add(scan(7 * S, co2=1.0))
    watch.add(scan(5 * S, co2=1.0))
    watch.add(scan(6 * S, "b", co2=1.0))
    assert watch.due(ROUND_REST_S - 0.1) is None
    due = take_turn(watch, ROUND_REST_S)
    assert due == Round("co2", DAY_S, MODEL, {"a": 7 * S, "b": 6 * S}, {})
    assert watch.record("co2", S).week == Tally(8, 6)
    assert watch.record("light", S).week == Tally()


def test_a_model_is_fitted_anew_after_five_minutes_or_when_much_was_received() -> None:
    watch = Watch(DAY_S)
    received(watch, "co2", 100)
    assert take_turn(watch, 0.0).model is None
    received(watch, "co2", 49)
    assert watch.due(0.0) is None
    received(watch, "co2", 1)
    assert take_turn(watch, 0.0, done(OTHER_MODEL)).model is None
    received(watch, "co2", 1)
    assert take_turn(watch, 60.0).model is OTHER_MODEL
    received(watch, "co2", 1)
    assert take_turn(watch, FIT_PERIOD_S - 1.0).model is MODEL
    received(watch, "co2", 1)
    assert take_turn(watch, FIT_PERIOD_S + 30.0).model is None


def test_one_round_at_a_time_and_the_longest_waiting_first() -> None:
    watch = Watch(DAY_S)
    received(watch, "light", FIRST_FIT)
    received(watch, "co2", FIRST_FIT)
    due = watch.due(0.0)
    assert due is not None
    watch.begin(due, 0.0)
    assert watch.due(0.0) is None
    watch.end(due, done(), 0.0, S)
    assert {due.sensor, take_turn(watch, 5.0).sensor} == {"light", "co2"}
    for sensor in ("light", "co2"):
        received(watch, sensor, 1)
    assert take_turn(watch, 90.0).sensor == due.sensor


def test_a_round_that_fails_keeps_what_was_and_says_why() -> None:
    watch = Watch(DAY_S)
    received(watch, "co2", FIRST_FIT)
    take_turn(watch, 0.0, done(MODEL, 90, 10))
    before = watch.loaded("co2")
    assert watch.distrusted(S) == ["co2"]
    received(watch, "co2", FIRST_FIT)
    take_turn(watch, 100.0, FitFailed("singular"))
    assert watch.fit("co2") == Fit(MODEL, 1, "singular")
    assert (watch.failed, watch.problems()) == (1, {"co2": "singular"})
    assert watch.loaded("co2") is before
    assert watch.record("co2", S).week == Tally(90, 10)
    received(watch, "co2", 10)
    take_turn(watch, 1_000.0)
    assert watch.problems() == {}


def test_what_is_restored_is_learnt_from_and_not_graded() -> None:
    watch = Watch(DAY_S)
    received(watch, "co2", FIRST_FIT)
    take_turn(watch, 0.0)
    watch.add(scan(99 * S, co2=1.0), is_new=False)
    due = watch.due(100.0)
    assert due is not None
    assert due.received == {}
