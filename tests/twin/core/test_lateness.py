"""A producer whose clock has gone back is detected, and normal delays are not."""

import pytest

from lupin_twin.core.clock import APART_S, FEW, MAX_SOURCES, OTHERS, Lateness
from lupin_twin.core.drops import Drop

S = 1_000_000_000


class Robot:
    """Messages of one source, received a second apart."""

    def __init__(self, lateness: Lateness, source: str = "robot", kind: int = 0) -> None:
        self.lateness, self.source, self.kind = lateness, source, kind
        self.now_s = 1000.0

    def findings(
        self, *stamps_s: float, was_latched: bool = False, every_s: float = 1.0
    ) -> list[Drop]:
        """The findings for messages with these stamps."""
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


def test_a_clock_that_stepped_back_is_reported_after_a_few_messages(robot: Robot) -> None:
    robot.findings(1000.0, 1001.0)
    assert robot.findings(*(400.0 + i for i in range(FEW))) == []
    assert robot.lateness.counts == {}
    [late] = robot.findings(410.0)
    assert (late.case, late.count) == ("robot", FEW + 1)
    assert f"{FEW + 1} observations in a row from source 'robot'" in late.why
    assert "the last by 591 s" in late.why
    assert robot.lateness.counts == {"robot": FEW + 1}
    more = robot.findings(411.0, 412.0)
    assert [late.count for late in more] == [1, 1]
    assert robot.lateness.counts == {"robot": FEW + 3}
    assert robot.findings(1002.0) == [], "it has caught up"
    assert robot.findings(*(400.0 + i for i in range(FEW))) == []
    assert robot.lateness.counts == {"robot": FEW + 3}


def test_each_kind_has_its_own_order(robot: Robot) -> None:
    looks = Robot(robot.lateness, kind=1)
    for at_s in range(1000, 1040):
        assert robot.findings(at_s) == []
        assert looks.findings(at_s - 60.0) == []


def test_a_clock_that_is_entirely_wrong_is_detected_too(robot: Robot) -> None:
    """Its messages look latched: DDS stamps them with the same clock."""
    robot.findings(1000.0)
    assert robot.findings(*(400.0 + i for i in range(FEW)), was_latched=True, every_s=APART_S) == []
    assert len(robot.findings(410.0, was_latched=True, every_s=APART_S)) == 1


def test_a_clock_that_goes_back_for_everyone_makes_nobody_late(robot: Robot) -> None:
    robot.findings(1000.0)
    robot.lateness.clamp_to(50 * S)
    assert robot.findings(*(51.0 + i for i in range(20))) == []


def test_names_are_limited_and_the_others_are_counted_together() -> None:
    lateness = Lateness()
    for number in range(3 * MAX_SOURCES):
        Robot(lateness, f"robot {number}").findings(1000.0, *[400.0] * (FEW + 1))
    assert len(lateness.counts) == MAX_SOURCES + 1
    assert lateness.counts["robot 0"] == FEW + 1
    assert lateness.counts[OTHERS] == 2 * MAX_SOURCES * (FEW + 1)
