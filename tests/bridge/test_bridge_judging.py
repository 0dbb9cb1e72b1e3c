"""A defect in judging costs a tag, or a state, its status; the frames go on."""

import asyncio
from typing import Any

import pytest

from lupin_bridge.feed.source import TwinUnavailableError, TwinUpdate
from lupin_bridge.judge.verdict import Health, judge_site
from lupin_bridge.stream.hub import Client
from lupin_twin.core.past import PastWrite
from lupin_twin.core.state import Reading, Snapshot, TagState
from tests.bridge.test_bridge import Ear, Stage
from tests.support.waiting import until


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

    async def query(*_: object) -> tuple[PastWrite, ...]:
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
        stage.bridge.join(Client(delta, delta=True))
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
