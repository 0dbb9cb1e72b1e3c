"""What is sent beside the states: status, alarms, verdicts, and the accuracy of estimates."""

import asyncio
import json
import math
from typing import Any, get_args

import pytest

from lupin_bridge.alarms.board import board_of
from lupin_bridge.bridge import WATCH_PERIOD_S, current_reports
from lupin_bridge.feed.source import TwinUnavailableError, TwinUpdate
from lupin_bridge.judge.judging import NOTHING_JUDGED, Judge
from lupin_bridge.judge.verdict import Verdict
from lupin_bridge.past.fields import all_changed, quality
from lupin_bridge.stream import schema
from lupin_bridge.stream.estimate_schema import EstimateQualities
from lupin_bridge.stream.frames import (
    MAX_IN_FRAME,
    STALE_AFTER_S,
    Liveness,
    Reason,
    Status,
    alarms_in_frame,
)
from lupin_bridge.stream.state_json import alarms_body, judgement
from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.drops import Counts, Recent
from lupin_twin.core.parameters import World
from lupin_twin.core.past import PastRefused
from lupin_twin.core.state import ClockState, Pose, Reading, Snapshot, TagState
from lupin_twin.estimate.grading import Record, Tally
from lupin_twin.field.engine import FieldRefused
from lupin_twin.ros.convert import map_of
from lupin_twin.runtime.estimates import MAX_SENSORS, Report, TagCheck, sensors_of
from tests.support.messages import occupancy_grid
from tests.support.seen import BY_LIGHT, NOW_NS, S, alarm, tag


def update(clock: ClockState = "running", **says: Any) -> TwinUpdate:
    return TwinUpdate(Snapshot(0, "map", (), clock=clock), "r", **says)


def live(age_s: float = 0.1, **says: Any) -> Status:
    return Status("live", age_s, update(**says))


def received(at_s: float, clock: ClockState = "running", **says: Any) -> Liveness:
    return Liveness(update=update(clock, **says), updated_s=at_s)


def test_a_twin_is_live_until_it_was_silent_for_the_documented_time() -> None:
    assert Liveness().status(5.0) == Status("never_seen", None)
    liveness = received(100.0)
    assert liveness.status(99.0).state_age_s == 0.0, "an age is never negative"
    assert liveness.status(100.0 + STALE_AFTER_S - 0.001).reason == "live"
    assert liveness.status(100.0 + STALE_AFTER_S).reason == "stale"
    # Three missed publications are no accident, and a client knows by 3.5 s.
    assert 3.0 <= STALE_AFTER_S < STALE_AFTER_S + WATCH_PERIOD_S <= 3.5


def test_the_most_specific_reason_comes_first_and_the_log_is_known_before_the_twin() -> None:
    liveness = received(0.0)
    liveness.thread_dead = True
    assert liveness.status(0.0).reason == "thread_dead"
    liveness.shutting_down = True
    assert liveness.status(0.0).reason == "shutting_down"
    status = Liveness(lambda: World("simulated", 1_440.0), lambda: ("no archive",)).status(5.0)
    found = (status.reason, status.update.origin, status.day_length_s)
    assert found == ("never_seen", "simulated", 1_440.0)
    assert status.frame()["input_problems"] == ["no archive"]


@pytest.mark.parametrize("reason", get_args(Reason))
@pytest.mark.parametrize("age_s", [None, 1.23456])
def test_every_status_has_a_frame_of_the_contract(reason: Reason, age_s: float | None) -> None:
    frame = schema.StatusFrame.model_validate(Status(reason, age_s).frame())
    assert (frame.twin == "live") == (reason in ("live", "paused"))
    assert frame.reason == reason
    assert frame.has_map is False
    assert frame.message
    assert frame.state_age_seconds == (None if age_s is None else 1.235)


def test_which_changes_are_news_for_clients_and_which_for_people() -> None:
    liveness = received(0.0, twin_count=2)
    assert liveness.status(0.0).is_live
    assert liveness.status(0.0).message.startswith("2 twins publish on the same topic")
    assert "silent" in liveness.status(10.0).message
    now = live()
    assert now.is_news_after(None)
    assert not live(0.9).is_news_after(now), "an age alone is none"
    for more in (Status("stale", 3.0), live(twin_count=2)):
        assert more.is_news_after(now)
        assert more.message != now.message
    recorded = live(origin="recorded")
    assert recorded.is_news_after(now)
    assert schema.StatusFrame.model_validate(recorded.frame()).origin == "recorded"
    unheard = live(input_problems=("use UDP",))
    assert unheard.is_live
    assert unheard.is_news_after(now)
    assert unheard.message == now.message
    assert schema.StatusFrame.model_validate(unheard.frame()).input_problems == ["use UDP"]
    mapped = live(occupancy_map=map_of(occupancy_grid([[0, 100]]), 1))
    assert mapped.is_news_after(now)
    assert schema.StatusFrame.model_validate(mapped.frame()).has_map
    assert mapped.message == now.message


@pytest.mark.parametrize(
    ("clock", "reason"),
    [
        ("running", "live"),
        ("paused", "paused"),
        ("stopped", "clock_stopped"),
        ("none", "no_clock"),
        ("doubted", "clock_doubted"),
    ],
)
def test_a_clock_that_does_not_run_is_reported_unless_the_twin_is_silent(
    clock: ClockState, reason: Reason
) -> None:
    liveness = received(0.0, clock)
    assert liveness.status(0.1).reason == reason
    assert liveness.status(10.0).reason == "stale"


def test_drops_are_news_when_they_grow_by_much_and_when_they_are_long_ago() -> None:
    def status(count: int) -> Status:
        return live(counts=Counts(recent=(Recent("frame", "dropped a message", count),)))

    assert status(1).is_news_after(live())
    assert status(4).is_news_after(status(3))
    assert not status(5).is_news_after(status(4))
    assert live().is_news_after(status(1))
    assert status(1).message == live().message
    [drop] = schema.StatusFrame.model_validate(status(5).frame()).drops
    assert (drop.reason, drop.message, drop.count) == ("frame", "dropped a message", 5)


def test_a_change_of_a_channels_state_is_news() -> None:
    def status(detail: str) -> Status:
        return Status("live", 0.1, outward={"mqtt": detail})

    failing, well = status("refused"), status("")
    assert failing.is_news_after(well)
    assert status("no answer").is_news_after(failing)
    assert well.is_news_after(failing)
    assert not status("refused").is_news_after(failing)
    assert failing.message == well.message, "the channel has logged it"
    (reported,) = schema.StatusFrame.model_validate(failing.frame()).outward
    assert (reported.channel, reported.is_failing, reported.detail) == ("mqtt", True, "refused")


def test_a_change_of_the_journals_state_is_news() -> None:
    def status(state: JournalState, detail: str = "", **more: Any) -> Status:
        return live(journal=Condition(state, detail, **more))

    failing = status(JournalState.FAILING, "no room")
    assert failing.is_news_after(live())
    assert failing.message == live().message, "the twin has logged it"
    assert status(JournalState.FAILING, "read-only").is_news_after(failing)
    recording = status(JournalState.RECORDING, written=1)
    assert recording.is_news_after(failing)
    assert not status(JournalState.RECORDING, written=2, waiting=3).is_news_after(recording)
    aside = status(JournalState.RECORDING, quarantined="/old")
    assert aside.is_news_after(recording)
    assert schema.StatusFrame.model_validate(aside.frame()).journal.set_aside == "/old"
    # Its delay changes every second.
    slow = status(JournalState.SLOW, "2 s behind")
    assert not status(JournalState.SLOW, "3 s behind").is_news_after(slow)
    reported = schema.StatusFrame.model_validate(slow.frame()).journal
    assert (reported.state, reported.detail, reported.simulated) == ("slow", "2 s behind", None)
    filled = status(JournalState.RECORDING, simulated_ns=(1_000_000_002, 3_000_000_000))
    stretch = schema.StatusFrame.model_validate(filled.frame()).journal.simulated
    assert stretch is not None
    assert (stretch.start.sec, stretch.start.nanosec, stretch.end.sec) == (1, 2, 3)


def test_an_answer_without_alarms_or_verdicts_says_so() -> None:
    body = alarms_body([], "starting", None)
    assert body == {"alarms": [], "source": "starting", "since": None}
    schema.Alarms.model_validate(body)
    judged = schema.Judgement.model_validate_json(judgement(NOTHING_JUDGED), strict=True)
    assert (judged.house.verdict, judged.tags) == ("unknown", {})


def test_the_alarms_of_a_frame_are_limited_with_the_active_ones_first() -> None:
    for active in (MAX_IN_FRAME - 1, MAX_IN_FRAME + 1):
        alarms = [alarm(str(number)) for number in range(active)]
        over = [alarm(f"over {number}", cleared_ns=NOW_NS) for number in range(2)]
        found = alarms_in_frame(board_of([*over, *alarms]), NOW_NS)
        assert len(found) == MAX_IN_FRAME
        assert sum(one.is_active for one in found) == min(active, MAX_IN_FRAME)


def test_the_worst_alarm_is_in_a_frame_however_many_came_later() -> None:
    first = alarm("first", raised_ns=1)
    later = [alarm(str(number), Verdict.STRESSED) for number in range(MAX_IN_FRAME)]
    assert first in alarms_in_frame(board_of([first, *later]), NOW_NS)


def test_a_value_held_only_by_the_deadband_has_its_limit_and_what_clears_it() -> None:
    """From 18 to 26 °C the deadband is 0.4."""
    judge = Judge(BY_LIGHT)
    for at_ns, value in ((NOW_NS, 17.9), (NOW_NS + S, 18.1)):
        judged = judge.see(Snapshot(at_ns, "map", (tag("a", at_ns, temperature=value),)))
    body = schema.Judgement.model_validate_json(judgement(judged), strict=True)
    (reason,) = body.tags["a"].reasons
    assert (reason.limit, reason.release) == (18.0, 18.4)


def test_the_hit_rate_of_estimates() -> None:
    report = Report(5 * S, True, "why", Record(3 * S + 7, Tally(10, 9), Tally(70, 30)))
    body = json.loads(quality({"co2": report, "ph": Report(S)}))
    EstimateQualities.model_validate(body)
    assert body["sensors"]["co2"] == {
        "fitted_at": {"sec": 5, "nanosec": 0},
        "fit_problem": "why",
        "graded_since": {"sec": 3, "nanosec": 7},
        "day": {"scans": 10, "inside": 9},
        "week": {"scans": 70, "inside": 30},
        "share_day": 0.9,
        "share_week": 30 / 70,
        "is_trusted": False,
    }
    bare = body["sensors"]["ph"]
    assert (bare["fitted_at"], bare["graded_since"], bare["share_day"]) == (None, None, None)
    assert bare["is_trusted"] is None


HERE = Pose(1.0, 2.0, 0.5, 0.0, 0.0, 0.0, 1.0)


def report(at_ns: int, changed: dict[str, int | None]) -> Report:
    tags = tuple(
        TagCheck(tag_id, 1.0, 1, 1.0, 1.0, 0.0, 0.0, since) for tag_id, since in changed.items()
    )
    return Report(at_ns, is_fitted=True, tags=tags)


def snapshot(**latest: int) -> Snapshot:
    tags = [
        TagState(name, pose=HERE, readings=(Reading(name, 1.0, at_ns),))
        for name, at_ns in latest.items()
    ]
    return Snapshot(100, "map", tuple(tags))


def test_estimates_use_finite_readings_of_pinned_tags_and_changed_ones_are_listed() -> None:
    tags = (
        TagState("a", pose=HERE, readings=(Reading("co2", 1.0, 5), Reading("light", math.nan, 9))),
        TagState("b", pose=HERE, readings=(Reading("co2", 1.0, 7),)),
        TagState("c", readings=(Reading("co2", 1.0, 8),)),
    )
    assert sensors_of(Snapshot(100, "map", tags)) == ["co2"]
    known = {"co2": report(9, {"a": None, "b": 3}), "light": report(9, {"b": 4, "c": 5})}
    assert all_changed(known) == {"b": {"co2": 3, "light": 4}, "c": {"light": 5}}


class Stage:
    """Rounds of reports, and what they show."""

    def __init__(self) -> None:
        self.requested: list[str] = []
        self.snapshot = snapshot()
        self.known: dict[str, Report] = {}
        self.answers: dict[str, Report] = {}
        self.error: Exception = TwinUnavailableError("nobody is there")

    async def update(self) -> dict[str, dict[str, int]]:
        self.known = await current_reports(self.snapshot, self.report_on, self.known)
        return all_changed(self.known)

    async def report_on(self, sensor: str, snapshot: Snapshot) -> Report:
        assert snapshot is self.snapshot
        self.requested.append(sensor)
        if sensor not in self.answers:
            raise self.error
        return self.answers[sensor]


async def test_changes_are_passed_on_in_their_current_form() -> None:
    stage = Stage()
    stage.snapshot = snapshot(co2=5, light=6)
    stage.answers = {"co2": report(9, {"co2": None}), "light": report(4, {})}
    assert await stage.update() == {}
    assert stage.requested == ["co2", "light"]
    stage.answers["co2"] = report(9, {"co2": 5})
    for _ in range(2):
        assert await stage.update() == {"co2": {"co2": 5}}
    stage.snapshot = snapshot(light=6)
    assert await stage.update() == {}, "no tag has that sensor any more"


@pytest.mark.parametrize(
    "error",
    [
        TwinUnavailableError("nobody is there"),
        # A clock that went back, and a name that is too long.
        PastRefused("at is 9 s, later than now, 8 s"),
        FieldRefused("sensor_type has 300 characters, the limit is 256"),
    ],
)
async def test_where_a_report_fails_the_last_one_holds(error: Exception) -> None:
    stage = Stage()
    stage.snapshot, stage.error = snapshot(co2=5, light=6), error
    stage.answers = {"co2": report(9, {"co2": 5}), "light": report(9, {})}
    await stage.update()
    stage.answers = {"light": report(9, {"light": 6})}
    assert await stage.update() == {"co2": {"co2": 5}, "light": {"light": 6}}


def test_the_number_of_queried_sensors_is_limited() -> None:
    stage = Stage()
    names = [f"s{number:02}" for number in range(MAX_SENSORS + 1)]
    stage.snapshot = snapshot(**dict.fromkeys(names, 1))
    stage.answers = dict.fromkeys(names, report(9, {}))
    asyncio.run(stage.update())
    assert stage.requested == names[:-1]
