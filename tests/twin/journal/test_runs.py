from __future__ import annotations

import pytest

from lupin_twin.journal.runs import (
    CORRECTION_NS,
    Clock,
    Turn,
    simulation_goes_on,
    turn_of,
)

S = 1_000_000_000
WALL = 1_763_700_000 * S


def wall(at_ns: int) -> Clock:
    return Clock(at_ns, at_ns, is_simulated=False)


def sim(at_s: float, wall_s: float) -> Clock:
    return Clock(int(at_s * S), WALL + int(wall_s * S), is_simulated=True)


@pytest.mark.parametrize(
    ("back_ns", "turn"),
    [
        (-S, None),
        (0, None),
        (1, Turn.STEP),
        (CORRECTION_NS, Turn.STEP),
        (CORRECTION_NS + 1, Turn.BACK),
    ],
)
def test_a_wall_clock_goes_on_unless_it_is_set_back_by_more_than_a_correction(
    back_ns: int, turn: Turn | None
) -> None:
    assert turn_of(wall(WALL), wall(WALL - back_ns), 0) is turn


@pytest.mark.parametrize(
    ("jumped_ns", "turn"), [(CORRECTION_NS, None), (CORRECTION_NS + 1, Turn.AHEAD)]
)
def test_a_wall_clock_may_jump_ahead(jumped_ns: int, turn: Turn | None) -> None:
    assert turn_of(wall(WALL), wall(WALL + S), jumped_ns) is turn


def test_any_step_back_of_a_simulated_clock_is_a_new_run() -> None:
    assert turn_of(sim(10, 0), sim(9.999, 1), 0) is Turn.BACK
    assert turn_of(sim(10, 0), sim(10, 1), 10**12) is None
    assert turn_of(sim(10, 0), wall(WALL), 0) is Turn.BACK


def test_a_twin_that_restarts_beside_a_simulation_is_in_the_same_run() -> None:
    last = sim(3600, 3600)
    assert simulation_goes_on(sim(0, 0), last, sim(3605, 3605))


def test_a_simulation_that_was_paused_meanwhile_is_the_same() -> None:
    last = sim(3600, 3600)
    assert simulation_goes_on(sim(0, 0), last, sim(3600, 4000))


def test_todays_simulation_is_another_than_yesterdays_though_its_clock_is_further_on() -> None:
    last = sim(3600, 3600)
    assert not simulation_goes_on(sim(0, 0), last, sim(3700, 86_400))


@pytest.mark.parametrize(("back_s", "is_same"), [(300, True), (300.001, False)])
def test_a_wall_clock_that_was_set_back_does_not_make_yesterdays_simulation_todays(
    back_s: float, is_same: bool
) -> None:
    last = sim(3600, 3600)
    assert simulation_goes_on(sim(0, 0), last, sim(3605, 3600 - back_s)) is is_same


def test_a_simulation_that_has_started_over_is_another() -> None:
    last = sim(3600, 3600)
    assert not simulation_goes_on(sim(0, 0), last, sim(3599.9, 3601))


def test_a_fast_simulation_may_have_begun_since() -> None:
    # 20 times as fast: 500 s of it pass in 25 s.
    last = sim(400, 20)
    assert not simulation_goes_on(sim(0, 0), last, sim(500, 45))
    assert simulation_goes_on(sim(0, 0), last, sim(500, 25))
