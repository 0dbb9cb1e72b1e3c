"""A producer whose clock has gone back is found, and none whose messages come as messages do."""

import pytest

from lupin_twin.core.clock import APART_S, FEW, MAX_SOURCES, OTHERS, Late, Lateness

S = 1_000_000_000


class Robot:
    """Messages of one source, a second apart as they are heard."""

    def __init__(self, lateness: Lateness, source: str = "robot", kind: int = 0) -> None:
        self.lateness, self.source, self.kind = lateness, source, kind
        self.now_s = 1000.0

    def says(self, *stamps_s: float, was_latched: bool = False, every_s: float = 1.0) -> list[Late]:
        """Whatever is said of messages with these stamps."""
        found = []
        for stamp_s in stamps_s:
            self.now_s += every_s
            late = self.lateness.see(
                self.source,
                self.kind,
                round(stamp_s * S),
                was_latched=was_latched,
                now_s=self.now_s,
            )
            found += [late] if late else []
        return found


@pytest.fixture
def robot() -> Robot:
    return Robot(Lateness())


def test_a_clock_that_stepped_back_is_told_after_a_few_and_counted_with_them(robot: Robot) -> None:
    robot.says(1000.0, 1001.0)
    assert robot.says(*(400.0 + i for i in range(FEW))) == []
    assert robot.lateness.counts == {}
    assert robot.says(410.0) == [Late("robot", FEW + 1, 591.0, "robot", FEW + 1)]
    assert robot.lateness.counts == {"robot": FEW + 1}
    more = robot.says(411.0, 412.0)
    assert [(late.run, late.news) for late in more] == [(FEW + 2, 1), (FEW + 3, 1)]
    assert robot.lateness.counts == {"robot": FEW + 3}
    assert robot.says(1002.0) == [], "it has caught up"
    assert robot.says(*(400.0 + i for i in range(FEW))) == []
    assert robot.lateness.counts == {"robot": FEW + 3}


def test_kinds_have_an_order_each(robot: Robot) -> None:
    looks = Robot(robot.lateness, kind=1)
    for at_s in range(1000, 1040):
        assert robot.says(at_s) == []
        assert looks.says(at_s - 60.0) == []


def test_what_a_second_robot_of_the_same_name_has_latched_is_no_matter(robot: Robot) -> None:
    """Fifty each, of the same hour, one after the other at once."""
    stamps = [1000.0 + i for i in range(50)]
    assert robot.says(*stamps, was_latched=True, every_s=0.001) == []
    assert robot.says(*stamps, was_latched=True, every_s=0.001) == []
    assert robot.lateness.counts == {}
    # And both go on.
    for at_s in range(1100, 1130):
        assert robot.says(at_s, at_s - 0.5) == []


def test_a_clock_that_is_wrong_in_every_way_is_found_too(robot: Robot) -> None:
    """Its messages seem to come out of a latch: DDS stamps them by the same clock."""
    robot.says(1000.0)
    assert robot.says(*(400.0 + i for i in range(FEW)), was_latched=True, every_s=APART_S) == []
    assert len(robot.says(410.0, was_latched=True, every_s=APART_S)) == 1


def test_a_clock_that_goes_back_for_all_makes_nobody_late(robot: Robot) -> None:
    robot.says(1000.0)
    robot.lateness.clamp_to(50 * S)
    assert robot.says(*(51.0 + i for i in range(20))) == []


def test_names_are_bounded_and_the_rest_is_counted_together() -> None:
    lateness = Lateness()
    for number in range(3 * MAX_SOURCES):
        Robot(lateness, f"robot {number}").says(1000.0, *[400.0] * (FEW + 1))
    assert len(lateness.counts) == MAX_SOURCES + 1
    assert lateness.counts["robot 0"] == FEW + 1
    assert lateness.counts[OTHERS] == 2 * MAX_SOURCES * (FEW + 1)
