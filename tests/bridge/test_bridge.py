"""From a source to connections: pace, status, watch, judging; and nothing is left behind."""

import asyncio
import itertools
import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Self, cast

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lupin_bridge.alarms.board import Change, board_of
from lupin_bridge.bridge import ALARMS_REST_S, Bridge
from lupin_bridge.feed.relay import Relay
from lupin_bridge.feed.source import ThreadState, TwinUnavailableError, TwinUpdate
from lupin_bridge.judge.verdict import Health, judge_site
from lupin_bridge.notify.channels import Channels
from lupin_bridge.notify.destinations import Targets
from lupin_bridge.notify.webhook import Webhook
from lupin_bridge.serving.admission import Limits
from lupin_bridge.settings import Secrets, Settings
from lupin_bridge.stream.hub import Client
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL, Condition
from lupin_twin.core.parameters import World
from lupin_twin.core.past import NotRemembered
from lupin_twin.core.state import Observation, Reading, Snapshot, TagState
from lupin_twin.runtime.workers import Workers
from tests.bridge.stream.test_frames import received
from tests.support.seen import alarm
from tests.support.store import logged
from tests.support.waiting import until


class Script:
    """A source that reports what the test makes it report. Real sources have their own tests."""

    world = World()
    problems: tuple[str, ...] = ()

    def __init__(self) -> None:
        self.tell: Callable[[TwinUpdate], None]
        self.die: Callable[[], None]
        self.thread = ThreadState()
        self.workers = Workers("script")
        self.relay = Relay(lambda: cast("Any", self), cast("Any", self))  # with no clients

    async def start(
        self, on_state: Callable[[TwinUpdate], None], on_death: Callable[[], None]
    ) -> None:
        self.tell, self.die = on_state, on_death

    async def stop(self) -> None:
        self.thread = ThreadState(is_alive=False)
        self.workers.close()

    async def ask(self, *_: object) -> tuple[Observation, ...]:
        raise NotRemembered("nothing")

    def journal(self) -> Condition:
        return UNKNOWN_JOURNAL


class Ear:
    """A connection that always takes a frame."""

    can_take = True

    def __init__(self) -> None:
        self.frames: list[dict[str, Any]] = []

    def write(self, wire: bytes) -> None:
        self.frames.append(json.loads(received(wire)))

    def dismiss(self, code: int, reason: str) -> None:
        raise AssertionError(f"dismissed: {code} {reason}")

    @property
    def states(self) -> list[dict[str, Any]]:
        return [frame for frame in self.frames if frame["type"] == "state"]

    @property
    def reasons(self) -> list[str]:
        return [frame["reason"] for frame in self.frames if frame["type"] == "status"]


def state(number: int) -> TwinUpdate:
    """The state after that many changes."""
    return TwinUpdate(Snapshot(number, "map", (TagState(f"t{number}"),)), f"r{number}")


class Stage:
    """A bridge between a scripted source and a connection."""

    def __init__(self, clock: Callable[[], float] = time.monotonic, **limits: Any) -> None:
        self.script, self.ear, self.clock = Script(), Ear(), clock
        self.bridge = Bridge(self.script, Settings(), clock, limits=Limits(**limits))  # type: ignore[arg-type]

    async def __aenter__(self) -> Self:
        await self.bridge.start()
        self.bridge.hub.join(Client(self.ear), self.clock())
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.bridge.stop()


class Beat:
    """A bridge whose clock and frame timer belong to the test."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_s = 100.0
        self.waits_s: list[float] = []
        self._monkeypatch = monkeypatch
        self._number = 0
        self.stage: Stage
        self.send: Any

    def hold(self, stage: Stage) -> None:
        self.stage = stage
        loop = asyncio.get_running_loop()
        call_later = loop.call_later

        def noting(delay_s: float, callback: Any, *args: Any, **more: Any) -> Any:
            if getattr(callback, "__self__", None) is stage.bridge:  # the next frame
                self.waits_s.append(delay_s)
                self.send = callback
                delay_s = 1_000_000.0  # the test lets it happen
            return call_later(delay_s, callback, *args, **more)

        self._monkeypatch.setattr(loop, "call_later", noting)

    def change(self, at_s: float) -> float:
        """Report a change; returns how long it waited until it was sent."""
        self.now_s = at_s
        self._number += 1
        newest = f"r{self._number}"
        self.stage.script.tell(state(self._number))
        while self.stage.ear.states[-1]["revision"] != newest:
            self.now_s += self.waits_s.pop()
            self.send()
        return self.now_s - at_s


async def test_no_change_waits_when_the_producer_keeps_to_the_rate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Single ones may be late by up to an interval: the others do not wait for them."""
    beat = Beat(monkeypatch)
    late_s = [0.0, 0.09, 0.0, 0.03, 0.0, 0.099, 0.0, 0.0] * 20
    async with Stage(clock=lambda: beat.now_s, frames_per_s=10.0) as stage:
        beat.hold(stage)
        waits = [beat.change(100.0 + n / 10 + late) for n, late in enumerate(late_s)]
        assert waits == [0.0] * len(late_s)


@settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(pauses_s=st.lists(st.floats(0.0, 0.3), min_size=1, max_size=60))
def test_the_mean_rate_holds_whatever_the_producer_does(
    monkeypatch: pytest.MonkeyPatch, pauses_s: list[float]
) -> None:
    async def test() -> None:
        beat, sent_s = Beat(monkeypatch), list[float]()
        async with Stage(clock=lambda: beat.now_s, frames_per_s=10.0) as stage:
            beat.hold(stage)
            at_s = 100.0
            for pause_s in pauses_s:
                at_s = max(at_s + pause_s, beat.now_s)
                at_s += beat.change(at_s)
                sent_s.append(at_s)
        for first, last in itertools.combinations(range(len(sent_s)), 2):
            frames = last - first + 1
            assert frames <= (sent_s[last] - sent_s[first]) * 10.0 + 2.0 + 1e-6

    asyncio.run(test())


async def test_a_frame_carries_the_latest_of_all_changes_and_heartbeats_beside_it_are_omitted() -> (
    None
):
    async with Stage(frames_per_s=50.0) as stage:
        for number in range(1, 101):
            stage.script.tell(state(number))
        await until(lambda: stage.ear.states[-1]["revision"] == "r100", "the latest")
        assert stage.ear.states[0]["revision"] == "r1"
        assert len(stage.ear.states) < 50  # a few, or more on a busy machine
        assert stage.bridge.latest == state(100)
    async with Stage(frames_per_s=100.0) as stage:
        for number in (1, 1, 1, 1, 2):
            stage.script.tell(state(number))
        await until(lambda: len(stage.ear.states) == 2, "the change")
        assert stage.ear.states[-1]["revision"] == "r2"


async def test_a_status_is_sent_when_it_changes_and_only_then() -> None:
    now_s = 100.0
    async with Stage(lambda: now_s) as stage:
        stage.bridge.liveness.stale_after_s = 0.3
        assert stage.ear.reasons == ["never_seen"]
        stage.script.tell(state(1))
        assert stage.ear.reasons == ["never_seen", "live"]
        now_s += 0.5
        await until(lambda: len(stage.ear.reasons) == 3, "the silence to be noticed")
        stage.script.tell(state(2))
        await until(lambda: len(stage.ear.reasons) == 4, "the twin to be back")
        stage.script.die()
        stage.script.die()
        stage.bridge.announce_shutdown()
    assert stage.ear.reasons == [
        "never_seen",
        "live",
        "stale",
        "live",
        "thread_dead",
        "shutting_down",
    ]


async def test_a_busy_memory_at_the_start_is_queried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lupin_bridge.alarms.feed.LEARN_AGAIN_S", 0.01)
    hour_ns = 3_600 * 10**9
    async with Stage() as stage:
        answers = iter([NotRemembered("busy"), TwinUnavailableError("gone")])
        tag_id = f"t{4 * hour_ns}"

        async def query(*_: object) -> tuple[Observation, ...]:
            for error in answers:
                raise error
            return tuple(
                logged(n, 1, tag_id, hour_ns * n, 0, 0, ("co2",), (400.0,)) for n in range(1, 5)
            )

        monkeypatch.setattr(stage.script, "ask", query)
        stage.script.tell(state(4 * hour_ns))

        def is_learnt() -> bool:
            stage.script.tell(state(4 * hour_ns))  # judged again with the next frame
            return stage.bridge.seen().holds_ns.get(tag_id) == 3 * hour_ns

        await until(is_learnt, "the rhythm")


async def test_a_client_with_a_low_rate_gets_the_latest_although_nothing_more_happens() -> None:
    now_s = 100.0
    async with Stage(clock=lambda: now_s, frames_per_s=100.0) as stage:
        stage.bridge.liveness.stale_after_s = math.inf  # no status carries it along
        rare = Ear()
        stage.bridge.hub.join(Client(rare, min_interval_s=0.3), stage.clock())
        for number in range(1, 6):
            stage.script.tell(state(number))
        now_s += 0.1
        await until(lambda: stage.ear.states[-1]["revision"] == "r5", "the latest")
        assert [frame["revision"] for frame in rare.states] == ["r1"]
        now_s += 0.3
        await until(lambda: rare.states[-1]["revision"] == "r5", "the newest in its time")
        assert [frame["revision"] for frame in rare.states] == ["r1", "r5"]


async def test_alarms_are_sent_at_once_and_those_right_after_once_a_second() -> None:
    async with Stage() as stage:
        await stage.bridge.alarm_feed.stop()  # only those of the test

        def put(tag_ids: Sequence[str]) -> None:
            found = board_of(map(alarm, tag_ids))
            stage.bridge.alarms.put(found, Change(()), "heard", 1)

        def reported() -> list[int]:
            frames = [frame for frame in stage.ear.frames if frame["type"] == "alarms"]
            return [len(frame["alarms"]) for frame in frames if frame["alarms"]]

        stage.script.tell(state(1))
        loop = asyncio.get_running_loop()
        put("a")
        await until(lambda: reported() == [1], "the first")
        first_s = loop.time()
        for count in range(2, 6):
            put("abcde"[:count])
            for _ in range(5):  # as a frame would, if it were written now
                await asyncio.wrap_future(stage.script.workers.submit(lambda _: None))
        await until(lambda: reported()[-1] == 5, "the latest")
        assert reported() == [1, 5]
        assert loop.time() - first_s > 0.8 * ALARMS_REST_S


async def test_a_channel_that_fails_on_an_alarm_costs_the_page_no_alarms(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    hook = Settings(webhook_url="http://127.0.0.1:9/hook")
    stage = Stage()
    stage.bridge.outward = Channels(Targets.of(hook, Secrets(webhook_secret="s" * 16)))
    async with stage:
        await stage.bridge.alarm_feed.stop()  # only those of the test
        stage.script.tell(state(1))
        monkeypatch.setattr(Webhook, "on_alarms", lambda *_: 1 / 0)
        stage.bridge.alarms.put(board_of([alarm("a")]), Change(()), "heard", 1)
        await until(lambda: any(it.get("alarms") for it in stage.ear.frames), "the alarm")
    assert "webhook had an error with changed alarms" in caplog.text


SECOND = 1_000_000_000


async def test_while_the_twin_is_silent_its_status_is_repeated() -> None:
    now_s = 100.0

    def a_second_later(reason: str) -> bool:
        nonlocal now_s
        now_s += 1.0
        return stage.ear.reasons.count(reason) >= 3

    async with Stage(lambda: now_s) as stage:
        await until(lambda: a_second_later("never_seen"), "the status, again and again")
        stage.script.tell(state(1))
        await until(lambda: a_second_later("stale"), "the silence, again and again")
        reported = [frame for frame in stage.ear.frames if frame["type"] == "status"]
        ages_s = [frame["state_age_seconds"] for frame in reported if frame["reason"] == "stale"]
        assert ages_s == sorted(set(ages_s)), "each as of then"


async def test_a_twin_whose_clock_stops_is_silent_since_its_last_time_and_not_since_1970() -> None:
    async with Stage() as stage:
        stage.bridge.liveness.stale_after_s = 0.3
        clockless = replace(state(0).snapshot, clock="none")
        stage.script.tell(replace(state(0), snapshot=clockless))
        await until(lambda: "no_clock" in stage.ear.reasons, "that to be told")
        stage.script.tell(state(7))
        for clock in ("stopped", "doubted"):
            without = replace(state(8).snapshot, clock=clock)
            stage.script.tell(replace(state(8), snapshot=without))
        await until(lambda: stage.ear.reasons[-1] == "stale", "the silence to be noticed")
        await until(lambda: stage.bridge.alarms.now.active, "its alarm")
        (silent,) = stage.bridge.alarms.now.active
        assert (silent.reason.kind, silent.raised_at_ns) == ("silent", 7)
        stage.bridge.liveness.stale_after_s = math.inf
        stage.script.tell(state(9))
        await until(lambda: not stage.bridge.alarms.now.active, "its end")


async def test_a_clock_that_goes_back_withdraws_the_silences_of_its_future() -> None:
    async with Stage() as stage:
        board = stage.bridge.alarms

        def raised_ns() -> list[int]:
            return [alarm.raised_at_ns for alarm in board.now.alarms]

        for last, back in ((7 * SECOND, 9 * SECOND), (3 * SECOND, None)):
            stage.script.tell(state(last))
            stopped = replace(state(last).snapshot, clock="stopped")
            stage.script.tell(replace(state(last), snapshot=stopped))
            await until(lambda: board.now.active, "its alarm")
            if back is not None:
                stage.script.tell(state(back))
                await until(lambda: not board.now.active, "its end")
        assert raised_ns() == [3 * SECOND]


def judged_state(number: int) -> TwinUpdate:
    """The state after that many scans of two tags."""
    stamp_ns = number * 10**9
    readings = (Reading("temperature", 24.0, stamp_ns),)
    tags = tuple(
        TagState(tag_id, readings=readings, last_observed_ns=stamp_ns) for tag_id in ("bad", "good")
    )
    return TwinUpdate(Snapshot(stamp_ns, "map", tags), f"r{number}")


@pytest.mark.parametrize("error", [None, TwinUnavailableError("not yet")])
async def test_a_robot_is_not_reported_as_stopped_before_the_log_was_read(
    error: Exception | None,
) -> None:
    requested, may_answer = asyncio.Event(), asyncio.Event()

    async def query(*_: object) -> tuple[Observation, ...]:
        requested.set()
        await may_answer.wait()
        if error is not None:
            raise error
        return ()

    stage = Stage(frames_per_s=1000.0)
    stage.script.ask = query  # type: ignore[method-assign]
    tags = judged_state(1).snapshot.tags
    async with stage:
        for number in (1, 2):
            later = TwinUpdate(Snapshot((2_000 + number) * 10**9, "map", tags), f"r{number}")
            stage.script.tell(later)
            await until(lambda: len(stage.ear.states) == number, "the frame")  # noqa: B023
            greenhouse = stage.ear.states[-1]["health"]["house"]
            if number == 1:
                assert greenhouse["verdict"] == "healthy"
                await requested.wait()
                may_answer.set()
                await until(lambda: stage.bridge.judge.knows_recent, "the log's word")
        assert [reason["kind"] for reason in greenhouse["reasons"]] == ["stopped"]


async def test_a_state_that_cannot_be_judged_is_sent_with_everything_unknown(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    is_broken = False

    def judge(*args: Any, **more: Any) -> Health:
        if is_broken:
            raise ZeroDivisionError("a defect")
        return judge_site(*args, **more)

    monkeypatch.setattr("lupin_bridge.judge.judging.judge_site", judge)

    def verdicts(frame: dict[str, Any]) -> list[str]:
        health = frame["health"]
        return [health["house"]["verdict"], *(tag["verdict"] for tag in health["tags"].values())]

    delta = Ear()
    async with Stage(frames_per_s=1000.0) as stage:
        stage.bridge.hub.join(Client(delta, delta=True), stage.clock())
        for number, is_broken in enumerate((False, True, True, False), start=1):
            stage.script.tell(judged_state(number))
            await until(lambda: len(stage.ear.states) == number, "the frame")  # noqa: B023
            wanted = "unknown" if is_broken else "healthy"
            assert verdicts(stage.ear.states[-1]) == [wanted] * 3
        assert [verdicts(frame) for frame in delta.frames if frame["type"] == "delta"] == [
            ["unknown"] * 3,
            ["unknown"],
            ["healthy"] * 3,
        ]
        assert caplog.text.count("ZeroDivisionError: a defect") == 1
        assert b"lupin_judge_errors_total 2.0" in stage.bridge.metrics.text()
