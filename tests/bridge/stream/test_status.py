"""Status: live, or offline for one of four reasons."""

from typing import Any, get_args

import pytest

from lupin_bridge.bridge import WATCH_PERIOD_S
from lupin_bridge.feed.source import TwinUpdate
from lupin_bridge.stream import schema
from lupin_bridge.stream.frames import STALE_AFTER_S, Liveness, Reason, Status
from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.drops import Counts, Recent
from lupin_twin.core.parameters import World
from lupin_twin.core.state import ClockState, Snapshot
from lupin_twin.ros.convert import map_of
from tests.support.messages import occupancy_grid


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


def test_the_log_has_observations_before_the_twin_is_received() -> None:
    status = Liveness(lambda: World("simulated", 1_440.0)).status(5.0)
    assert (status.reason, status.update.origin, status.day_length_s) == (
        *("never_seen", "simulated"),
        1_440.0,
    )


def test_the_most_specific_reason_comes_first() -> None:
    liveness = received(0.0)
    liveness.thread_dead = True
    assert liveness.status(0.0).reason == "thread_dead"
    liveness.shutting_down = True
    assert liveness.status(0.0).reason == "shutting_down"


@pytest.mark.parametrize("reason", get_args(Reason))
@pytest.mark.parametrize("age_s", [None, 1.23456])
def test_every_status_has_a_frame_of_the_contract(reason: Reason, age_s: float | None) -> None:
    frame = schema.StatusFrame.model_validate(Status(reason, age_s).frame())
    assert (frame.twin == "live") == (reason in ("live", "paused"))
    assert frame.reason == reason
    assert frame.has_map is False
    assert frame.message
    assert frame.state_age_seconds == (None if age_s is None else 1.235)


def test_more_than_one_twin_is_reported_while_they_live() -> None:
    liveness = received(0.0, twin_count=2)
    assert liveness.status(0.0).is_live
    assert liveness.status(0.0).message.startswith("2 twins publish on the same topic")
    assert "silent" in liveness.status(10.0).message


def test_which_changes_are_news_for_clients_and_which_for_people() -> None:
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
