from __future__ import annotations

import pytest

from lupin_twin.journal.runs import (
    CORRECTION_NS,
    Carries,
    Clock,
    Ending,
    Run,
    carried_at_start,
    goes_on,
    is_new_run,
)

S = 1_000_000_000
WALL = 1_763_700_000 * S


def wall(at_ns: int) -> Clock:
    return Clock(at_ns, at_ns, is_simulated=False)


def sim(at_s: float, wall_s: float) -> Clock:
    return Clock(int(at_s * S), WALL + int(wall_s * S), is_simulated=True)


def ended(begun: Clock, last: Clock) -> Ending:
    return Ending(Run(1, begun), last)


@pytest.mark.parametrize(
    ("back_ns", "is_same"), [(-S, True), (CORRECTION_NS, True), (CORRECTION_NS + 1, False)]
)
def test_a_wall_clock_goes_on_unless_it_is_set_back_by_more_than_a_correction(
    back_ns: int, is_same: bool
) -> None:
    ending = ended(wall(WALL), wall(WALL + 1000 * S))
    assert goes_on(ending, wall(WALL + 1000 * S - back_ns)) is is_same
    assert is_new_run(wall(WALL), wall(WALL - back_ns)) is not is_same


def test_a_twin_that_restarts_beside_a_simulation_is_in_the_same_run() -> None:
    ending = ended(sim(0, 0), sim(3600, 3600))
    assert goes_on(ending, sim(3605, 3605))


def test_a_simulation_that_was_paused_meanwhile_is_the_same() -> None:
    ending = ended(sim(0, 0), sim(3600, 3600))
    assert goes_on(ending, sim(3600, 4000))


def test_todays_simulation_is_another_than_yesterdays_though_its_clock_is_further_on() -> None:
    ending = ended(sim(0, 0), sim(3600, 3600))
    assert not goes_on(ending, sim(3700, 86_400))


@pytest.mark.parametrize(("back_s", "is_same"), [(60, True), (60.001, False)])
def test_a_wall_clock_that_was_set_back_does_not_make_yesterdays_simulation_todays(
    back_s: float, is_same: bool
) -> None:
    ending = ended(sim(0, 0), sim(3600, 3600))
    assert goes_on(ending, sim(3605, 3600 - back_s)) is is_same


def test_a_simulation_that_has_started_over_is_another() -> None:
    ending = ended(sim(0, 0), sim(3600, 3600))
    assert not goes_on(ending, sim(3599.9, 3601))


def test_a_fast_simulation_may_have_begun_since() -> None:
    # 20 times as fast: 500 s of it pass in 25 s.
    ending = ended(sim(0, 0), sim(400, 20))
    assert not goes_on(ending, sim(500, 45))
    assert goes_on(ending, sim(500, 25))


def test_a_simulation_carries_nothing_into_another_and_a_house_its_places() -> None:
    assert carried_at_start(sim(0, 0)) is Carries.NOTHING
    assert carried_at_start(wall(WALL)) is Carries.PLACES


def test_any_step_back_of_a_simulated_clock_is_a_new_run() -> None:
    assert is_new_run(sim(10, 0), sim(9.999, 1))
    assert not is_new_run(sim(10, 0), sim(10, 1))


def test_arrivals_lie_near_their_stamps_in_every_run() -> None:
    assert Run(1, wall(WALL)).lead_ns == 0
    assert Run(1, sim(5, 7)).lead_ns == WALL + 2 * S
