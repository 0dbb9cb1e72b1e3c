"""What listeners get of a twin that is silent: a sign of life, for the line is not what failed."""

from dataclasses import replace

from tests.bridge.test_bridge import Stage, state
from tests.support.waiting import until

SECOND = 1_000_000_000


async def test_while_the_twin_is_silent_its_status_comes_again_and_again() -> None:
    now_s = 100.0

    def a_second_later(reason: str) -> bool:
        nonlocal now_s
        now_s += 1.0
        return stage.ear.reasons.count(reason) >= 3

    async with Stage(lambda: now_s) as stage:
        await until(lambda: a_second_later("never_seen"), "the status, again and again")
        stage.script.tell(state(1))
        await until(lambda: a_second_later("stale"), "the silence, again and again")
        told = [frame for frame in stage.ear.heard if frame["type"] == "status"]
        ages_s = [frame["state_age_seconds"] for frame in told if frame["reason"] == "stale"]
        assert ages_s == sorted(set(ages_s)), "each as of then"


async def test_a_twin_without_a_clock_has_not_been_silent_since_the_year_1970() -> None:
    async with Stage() as stage:
        stage.bridge.liveness.stale_after_s = 0.3
        clockless = replace(state(0).snapshot, clock="none")
        stage.script.tell(replace(state(0), snapshot=clockless))
        await until(lambda: "no_clock" in stage.ear.reasons, "that to be told")
        stage.script.tell(state(7))
        await until(lambda: stage.ear.reasons[-1] == "stale", "the silence to be noticed")
        await until(lambda: stage.bridge.alarms.now.alarms, "its alarm")
    (silent,) = stage.bridge.alarms.now.alarms
    assert (silent.reason.kind, silent.raised_at_ns) == ("silent", 7)


async def test_a_twin_whose_clock_stops_is_silent_since_its_last_time() -> None:
    async with Stage() as stage:
        stage.script.tell(state(7))
        for clock in ("stopped", "doubted"):
            without = replace(state(8).snapshot, clock=clock)
            stage.script.tell(replace(state(8), snapshot=without))
        await until(lambda: stage.bridge.alarms.now.page.active, "its alarm")
        (silent,) = stage.bridge.alarms.now.page.active
        assert (silent.reason.kind, silent.raised_at_ns) == ("silent", 7)
        stage.script.tell(state(9))
        await until(lambda: not stage.bridge.alarms.now.page.active, "its end")


async def test_a_clock_that_goes_back_withdraws_the_silences_of_what_has_not_been_yet() -> None:
    async with Stage() as stage:
        board = stage.bridge.alarms

        def raised_ns() -> list[int]:
            return [alarm.raised_at_ns for alarm in board.now.alarms]

        for last, back in ((7 * SECOND, 9 * SECOND), (3 * SECOND, None)):
            stage.script.tell(state(last))
            stopped = replace(state(last).snapshot, clock="stopped")
            stage.script.tell(replace(state(last), snapshot=stopped))
            await until(lambda: board.now.page.active, "its alarm")
            if back is not None:
                stage.script.tell(state(back))
                await until(lambda: not board.now.page.active, "its end")
        assert raised_ns() == [3 * SECOND]
