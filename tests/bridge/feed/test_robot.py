"""What is stored of a robot: the latest of each, a bounded trail, and a plan until it is done."""

import pytest

from lupin_bridge.feed.source import TRAIL_POINTS, Battery, Plan, Position, Robot, RobotLog

S = 10**9


def position(x: float, at_s: float, y: float = 0.0) -> Position:
    return Position(x, y, 0.0, int(at_s * S))


def drive(log: RobotLog, *positions: Position) -> None:
    for each in positions:
        log.take(Robot(position=each), each.at_ns)


def places(log: RobotLog) -> list[float]:
    return [it.x for it in log.trail]


def test_the_latest_of_each_is_stored_with_or_without_a_clock_and_only_changes_reported() -> None:
    log = RobotLog()
    here, full = position(1.0, 100.0), Battery(64.0, 90 * S)
    assert log.take(Robot(position=here), 100 * S)
    assert log.take(Robot(battery=full), 101 * S)
    assert log.now == Robot(here, None, full)
    assert not log.take(Robot(), 102 * S)
    assert not log.take(Robot(position=here), 103 * S)
    assert not log.take(Robot(position=position(9.0, 99.0)), 104 * S), "an older one"
    assert log.now.position == here
    log = RobotLog()
    # With a clock that stands still, the last one is the latest.
    for x in (1.0, 2.0):
        log.take(Robot(position=position(x, 50.0)), None)
        assert log.now == Robot(position(x, 50.0))


def test_points_of_a_trail_are_apart_and_it_covers_an_hour_also_of_a_silent_robot() -> None:
    log = RobotLog()
    drive(
        log,
        position(0.0, 100.0),
        position(5.0, 100.9),
        position(0.09, 102.0),
        position(0.1, 103.0),
        position(0.3, 104.0),
    )
    assert places(log) == [0.0, 0.1, 0.3]
    log = RobotLog()
    drive(log, position(0.0, 100.0), position(1.0, 200.0))
    log.take(Robot(), 3_700 * S)
    assert places(log) == [0.0, 1.0]
    log.take(Robot(), 3_700 * S + 1)
    assert places(log) == [1.0]
    log.take(Robot(), 9_999 * S)
    assert places(log) == []
    assert log.now.position is not None, "where it was last is still known"
    log = RobotLog()
    drive(log, *(position(float(second), 100.0 + second) for second in range(3_600)))
    trail = places(log)
    assert TRAIL_POINTS / 2 < len(trail) <= TRAIL_POINTS
    assert (trail[0], trail[-1]) == (0.0, 3_599.0)
    assert trail == sorted(trail)
    assert max(b - a for a, b in zip(trail[-300:], trail[-299:], strict=False)) == 1.0


@pytest.mark.parametrize(("back_s", "is_known"), [(10.0, True), (10.1, False)])
def test_a_clock_that_goes_back_removes_the_future(back_s: float, is_known: bool) -> None:
    log = RobotLog()
    log.take(
        Robot(position(1.0, 100.0), Plan(((3.0, 0.0),), 100 * S), Battery(50.0, 100 * S)), 100 * S
    )
    log.take(Robot(), int((100 - back_s) * S))
    assert (log.now != Robot()) is is_known
    assert bool(log.trail) is is_known
    log.take(Robot(position=position(2.0, 20.0)), 20 * S)
    assert log.now.position == (position(2.0, 20.0) if not is_known else log.now.position)


def test_a_plan_is_done_at_its_end_and_an_empty_or_old_one_is_ignored() -> None:
    other = RobotLog()
    for at in range(6):
        there = Plan(((float(at), 0.0), (5.0, 0.0)), (100 + at) * S)
        other.take(Robot(position=position(float(at), 100.5 + at), plan=there), (101 + at) * S)
        assert (other.now.plan is None) is (at == 5)
    log = RobotLog()
    there = Plan(((9.0, 0.0),), 100 * S)
    again = Plan(((9.0, 0.0),), 800 * S)
    plans = []
    for received, now_ns in (
        (there, 100 * S),
        (None, 700 * S),
        (None, 700 * S + 1),
        (again, 800 * S),
        (Plan((), 801 * S), 801 * S),
    ):
        log.take(Robot(plan=received), now_ns)
        plans.append(log.now.plan)
    assert plans == [there, there, None, again, None]
    log = RobotLog()
    round_trip = Plan(((0.0, 0.0), (5.0, 0.0), (0.0, 0.1)), 99 * S)
    log.take(Robot(plan=round_trip), 99 * S)
    plans = []
    for x, at_s in ((0.0, 100.0), (5.0, 110.0), (0.3, 120.0)):
        drive(log, position(x, at_s))
        plans.append(log.now.plan)
    assert plans == [None, round_trip, None]
