"""Which readings count, when a model is fitted, and what an estimate is made of."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from lupin_twin.estimate import MAX_EXACT, NOTHING, STRONG_NATS, FitFailed, Model, Readings
from lupin_twin.estimates import (
    FIRST_FIT,
    FIRST_FITTED,
    FIT_PERIOD_S,
    FIT_REST_S,
    FIT_SLOW_S,
    MAX_FITTED,
    MAX_READINGS,
    MAX_TAGS,
    PER_MANY_TAGS,
    EstimateJob,
    EstimateRequest,
    Fit,
    Models,
    TagPast,
    cost_s,
    fitted,
    gains_of_longer_days,
    moment_of,
    past_of,
    readings_of,
)
from lupin_twin.fields import FieldRefused, FieldRequest
from lupin_twin.history import PastScan
from lupin_twin.idw import Abandoned
from lupin_twin.state import NANOSECONDS_PER_SECOND, Pose, Reading, TagState
from tests.support.estimates import DAY_S, a_day, many_tags

S = NANOSECONDS_PER_SECOND
HERE = Pose(1.0, 2.0, 0.5, 0.0, 0.0, 0.0, 1.0)
MODEL: Any = object()


def box(sensor: str = "temperature", resolution: float = 0.5) -> FieldRequest:
    return FieldRequest(sensor, resolution, 0.0, 0.0, 4.0, 8.0)


def tag_past(index: int, *hours: float) -> TagPast:
    readings = tuple((int(hour * 3600 * S), 20.0 + hour) for hour in hours)
    return TagPast(f"tag-{index}", float(index), 0.0, readings)


def test_a_tag_remembers_its_scans_and_what_the_state_tells() -> None:
    scans = [
        PastScan(5 * S, (Reading("temperature", 21.0), Reading("humidity", 50.0))),
        PastScan(6 * S, (Reading("temperature", math.nan),)),
        PastScan(7 * S, (Reading("temperature", 22.0),)),
    ]
    newest = (Reading("temperature", 22.0, 7 * S), Reading("light", 800.0, 2 * S))
    tag = TagState("tag-1", pose=HERE, readings=newest)
    found = past_of(tag, scans, "temperature")
    assert found == TagPast("tag-1", 1.0, 2.0, ((5 * S, 21.0), (7 * S, 22.0)))
    assert past_of(tag, [], "light") == TagPast("tag-1", 1.0, 2.0, ((2 * S, 800.0),))
    assert past_of(tag, scans, "co2") is None
    past_float32 = TagState("tag-1", pose=HERE, readings=(Reading("co2", 1e39, S),))
    assert past_of(past_float32, [], "co2") is None
    assert past_of(TagState("tag-1", readings=newest), scans, "temperature") is None


def test_readings_are_told_by_seconds_before_the_moment() -> None:
    readings = readings_of(
        [tag_past(0, 1.0, 2.0), tag_past(1), tag_past(2, 2.5)], int(3600e9 * 3), DAY_S
    )
    assert readings.time_s.tolist() == [-7200.0, -3600.0, -1800.0]
    assert readings.tag.tolist() == [0, 0, 1]
    assert readings.xy.tolist() == [[0.0, 0.0], [2.0, 0.0]], "who has read nothing is left out"


def test_what_is_later_or_older_than_a_day_does_not_count() -> None:
    tags = [tag_past(0, 1.0, 26.0)]
    at_ns = int(25.0 * 3600 * S)
    assert readings_of(tags, at_ns, DAY_S).value.tolist() == [21.0]
    with pytest.raises(FieldRefused, match=r"no tag has a reading of the 86400 s before"):
        readings_of(tags, at_ns + S, DAY_S)
    assert len(readings_of(tags, at_ns + S, 2 * DAY_S)) == 1


def test_many_tags_share_what_can_be_reckoned_with() -> None:
    hours = [index / 2.0 for index in range(40)]
    at_ns = int(24 * 3600 * S)
    most = readings_of([tag_past(index, *hours) for index in range(MAX_EXACT)], at_ns, DAY_S)
    assert len(most) == MAX_READINGS
    assert most.time_s.min() == (hours[-32] - 24.0) * 3600.0, "fewer, but of the day"
    many = readings_of([tag_past(index, *hours) for index in range(MAX_EXACT + 1)], at_ns, DAY_S)
    assert len(many) == PER_MANY_TAGS * (MAX_EXACT + 1)
    assert many.time_s.min() == most.time_s.min()
    few = readings_of([tag_past(index, *hours) for index in range(3)], at_ns, DAY_S)
    assert len(few) == 3 * 32
    assert len(readings_of([tag_past(index, 1.0) for index in range(MAX_TAGS)], at_ns, DAY_S))
    with pytest.raises(FieldRefused, match=r"10001 tags have this sensor, .* of 10000 at most"):
        readings_of([tag_past(index, 1.0) for index in range(MAX_TAGS + 1)], at_ns, DAY_S)


def test_a_large_house_s_model_is_learnt_from_some_of_its_readings() -> None:
    day = a_day(tags=30, passes=16)
    model = fitted(day, DAY_S)
    assert len(day) > MAX_FITTED
    assert model == fitted(day, DAY_S), "the same ones every time"
    first = fitted(day, DAY_S, most=FIRST_FITTED)
    assert first == fitted(day, DAY_S, most=FIRST_FITTED) != model
    assert first.scale.centre == pytest.approx(model.scale.centre, abs=1.0)
    mean, sd = model.posterior(day, DAY_S).points(day.xy)
    assert np.isfinite(mean).all()
    assert sd.max() < 1.0


def test_many_tags_model_is_learnt_from_groups_of_them_and_serves_all() -> None:
    many = many_tags(80, 8, 12.0)
    model = fitted(many, DAY_S)
    at_s = float(many.time_s.max())
    mean, sd = model.posterior(many, at_s).points(many.xy)
    true = np.sin(2.0 * np.pi * at_s / DAY_S) + 0.5 * np.sin(many.xy[:, 0])
    assert (np.abs(mean - true) <= 1.645 * sd).mean() > 0.8
    assert sd.max() < 0.5
    with pytest.raises(Abandoned):
        fitted(many, DAY_S, lambda: True)


def test_an_estimate_without_a_model_is_fitted_for_itself() -> None:
    request = EstimateRequest(box())
    tags = [tag_past(index, 1.0 + index / 3.0, 2.0) for index in range(3)]
    estimate = EstimateJob(request, None, DAY_S).compute(tags, int(3 * 3600 * S))
    assert (estimate.sample_count, estimate.reading_count) == (3, 6)
    assert (estimate.grid.width, estimate.grid.height) == (8, 16)
    assert np.isfinite(estimate.grid.mean).all()
    assert (estimate.grid.sd > 0.0).all()


def test_an_estimate_of_now_is_one_of_the_last_minute_or_of_the_newest_reading() -> None:
    hour_ns = 3600 * S
    tags = [tag_past(0, 0.5, 1.0), tag_past(1, 2.0)]
    assert moment_of(tags, hour_ns + 59 * S, DAY_S) == hour_ns
    assert moment_of(tags, hour_ns + 60 * S, DAY_S) == hour_ns + 60 * S
    late = [TagPast("late", 0.0, 0.0, ((hour_ns + 7 * S, 20.0), (2 * hour_ns, 20.0)))]
    assert moment_of(late, hour_ns + 59 * S, DAY_S) == hour_ns + 7 * S
    assert moment_of([], 25 * S, 1440.0) == 25 * S, "a minute of that day is a second"


def test_what_nobody_waits_for_ends_between_two_steps() -> None:
    asked: list[None] = []

    def should_stop() -> bool:
        asked.append(None)
        return len(asked) == 3

    tags = [tag_past(index, 1.0, 2.0) for index in range(3)]
    with pytest.raises(Abandoned):
        EstimateJob(EstimateRequest(box()), None, DAY_S).compute(tags, 3 * 3600 * S, should_stop)


def test_a_tag_that_has_changed_is_left_out_since_then() -> None:
    tags = [tag_past(index, 1.0 + index / 3.0, 2.0) for index in range(3)]

    def made_of(at_h: float, since_h: float) -> int:
        changed = {"tag-1": int(since_h * 3600 * S), "gone": 0}
        asked = EstimateRequest(box(), int(at_h * 3600 * S))
        return EstimateJob(asked, None, DAY_S, changed).compute(tags, 0).sample_count

    assert made_of(3.0, 2.5) == 2
    assert made_of(2.4, 2.5) == 3


@pytest.mark.parametrize("at_ns", [-1, 11 * S])
def test_a_moment_that_has_not_come_is_refused(at_ns: int) -> None:
    EstimateRequest(box(), 10 * S).check(10 * S, 1_000)
    with pytest.raises(FieldRefused, match=r"at is .* s, the limits are 0 and now, 10.0 s"):
        EstimateRequest(box(), at_ns).check(10 * S, 1_000)


def test_a_box_is_refused_as_a_field_is() -> None:
    with pytest.raises(FieldRefused, match="127"):
        EstimateRequest(box()).check(S, 127)
    EstimateRequest(box()).check(S, 128)
    assert cost_s(EstimateRequest(box()), 3, 128) < cost_s(EstimateRequest(box()), 30, 128)


# --- whose turn it is ---------------------------------------------------------------------------


def heard(models: Models, sensor: str, times: int) -> bool:
    return sum(models.hear([Reading(sensor, 20.0)]) for _ in range(times)) > 0


def test_the_first_fit_comes_with_the_tenth_reading() -> None:
    models = Models()
    assert not heard(models, "temperature", FIRST_FIT - 1)
    models.hear([Reading("temperature", math.nan)])
    assert models.due(0.0) is None
    tenth = (Reading("temperature", 20.0), Reading("light", 5.0))
    assert models.hear(tenth), "it need not be looked for"
    assert models.due(0.0) == "temperature"
    assert not heard(models, "temperature", 2 * FIRST_FIT)


def test_the_first_model_is_made_of_few_readings_and_soon_of_all() -> None:
    models = Models()
    heard(models, "co2", 300)
    assert models.begin("co2", 0.0) == FIRST_FITTED
    models.end("co2", MODEL, S)
    assert models.due(FIT_REST_S - 1.0) is None
    assert models.due(FIT_REST_S) == "co2", "nothing was heard since, but most was left out"
    assert models.begin("co2", FIT_REST_S) == MAX_FITTED
    models.end("co2", MODEL, 2 * S)
    heard(models, "co2", 1)
    assert models.due(FIT_REST_S + FIT_PERIOD_S - 1.0) is None


def test_one_fit_at_a_time_and_the_longest_waiting_first() -> None:
    models = Models()
    for sensor in ("light", "co2"):
        heard(models, sensor, FIRST_FIT)
    models.begin("light", 0.0)
    assert models.due(0.0) is None
    models.end("light", MODEL, S)
    heard(models, "light", 2 * FIRST_FIT)
    assert models.due(FIT_REST_S) == "co2"
    assert models.of("light") == Fit(MODEL, S)
    assert models.of("co2") == Fit()
    assert models.serving() == {"light": MODEL}


def test_a_model_is_fitted_anew_after_five_minutes_or_when_much_was_heard() -> None:
    models = Models()
    heard(models, "co2", FIRST_FIT)
    models.begin("co2", 100.0)
    models.end("co2", MODEL, S)
    assert models.due(100.0 + 10 * FIT_PERIOD_S) is None, "nothing was heard since"
    heard(models, "co2", 1)
    assert models.due(100.0 + FIT_PERIOD_S - 1.0) is None
    assert models.due(100.0 + FIT_PERIOD_S) == "co2"
    heard(models, "co2", FIRST_FIT // 2 - 1)
    assert models.due(100.0 + FIT_REST_S) == "co2"
    assert models.due(100.0 + FIT_REST_S - 1.0) is None


def test_a_fit_that_fails_or_takes_long_keeps_the_last_and_says_why() -> None:
    models = Models()
    heard(models, "co2", FIRST_FIT)
    models.begin("co2", 0.0)
    models.end("co2", MODEL, S)
    models.begin("co2", FIT_PERIOD_S)
    models.end("co2", FitFailed("singular"), 2 * S)
    assert models.of("co2") == Fit(MODEL, S, "singular")
    assert (models.failed, models.problems()) == (1, {"co2": "singular"})
    models.begin("co2", 1000.0)
    models.due(1000.0 + FIT_SLOW_S)
    assert models.of("co2").problem == "singular"
    models.due(1000.1 + FIT_SLOW_S)
    assert models.of("co2") == Fit(MODEL, S, "a fit takes longer than 120 s")
    models.end("co2", MODEL, 3 * S)
    assert models.of("co2") == Fit(MODEL, 3 * S)
    assert isinstance(fitted(Readings(*_one()), DAY_S), Model)


def test_the_day_s_length_is_wrong_where_all_sensors_together_say_so_and_one_clearly() -> None:
    models = Models()
    for sensor in ("co2", "light", "new"):
        heard(models, sensor, FIRST_FIT - (sensor == "new"))
    for sensor in ("co2", "light"):
        models.begin(sensor, 0.0)
        models.end(sensor, MODEL, S)
    models.weigh("co2", (1.0, 2.0, STRONG_NATS))
    assert models.problems().keys() == {"co2", "light"}
    assert "some 64 times as long as day_length_s" in models.of("light").problem
    assert models.of("new") == Fit(), "there is no model to be distrusted"
    models.begin("light", FIT_PERIOD_S)
    models.end("light", FitFailed("singular"), 2 * S)
    assert models.of("light").problem == "singular"
    models.weigh("light", (0.0, 0.0, -0.5))
    assert models.day_problem == "", "the other one says it is right"
    models.weigh("co2", (0.0, 0.0, STRONG_NATS - 0.5))
    models.weigh("light", (0.0, 0.0, STRONG_NATS - 0.5))
    assert models.day_problem == "", "neither is clear"


def test_readings_of_many_days_tell_how_long_one_is() -> None:
    day = a_day()
    tags = [
        TagPast(
            f"tag-{tag}",
            float(x),
            float(y),
            tuple(
                (int(at_s * S), float(value))
                for at_s, value in zip(
                    day.time_s[day.tag == tag], day.value[day.tag == tag], strict=True
                )
            ),
        )
        for tag, (x, y) in enumerate(day.xy)
    ]
    at_ns = int(DAY_S * S)
    assert gains_of_longer_days(tags, at_ns, DAY_S / 60.0)[-1] > 2.0 * STRONG_NATS
    assert gains_of_longer_days(tags, at_ns, DAY_S) == NOTHING, "of one day, none"


def _one() -> tuple[Any, Any, Any, Any]:
    return [0.0], [0], [20.0], [(0.0, 0.0)]
