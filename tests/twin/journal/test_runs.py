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
    # It may jump ahead by as much as that.
    assert turn_of(wall(WALL), wall(WALL + S), CORRECTION_NS) is None
    assert turn_of(wall(WALL), wall(WALL + S), CORRECTION_NS + 1) is Turn.AHEAD


def test_any_step_back_of_a_simulated_clock_is_a_new_run() -> None:
    assert turn_of(sim(10, 0), sim(9.999, 1), 0) is Turn.BACK
    assert turn_of(sim(10, 0), sim(10, 1), 10**12) is None
    assert turn_of(sim(10, 0), wall(WALL), 0) is Turn.BACK


@pytest.mark.parametrize(
    ("last", "now", "goes_on"),
    [
        (sim(3600, 3600), sim(3605, 3605), True),  # the twin alone was started again
        (sim(3600, 3600), sim(3600, 4000), True),  # paused meanwhile
        (sim(3600, 3600), sim(3700, 86_400), False),  # today's, though further on
        (sim(3600, 3600), sim(3599.9, 3601), False),  # started over
        (sim(3600, 3600), sim(3605, 3300), True),  # the wall's clock was corrected
        (sim(3600, 3600), sim(3605, 3299.999), False),  # the wall's clock was set back
        (sim(400, 20), sim(500, 45), False),  # 20 times as fast, it may have begun since
        (sim(400, 20), sim(500, 25), True),
    ],
)
def test_a_simulation_goes_on_if_no_other_could_have_come_so_far(
    last: Clock, now: Clock, *, goes_on: bool
) -> None:
    assert simulation_goes_on(sim(0, 0), last, now) is goes_on
