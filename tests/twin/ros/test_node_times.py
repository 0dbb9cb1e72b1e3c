"""`/twin/times` over real DDS: the times of observations, beside the state that they belong to."""

import time
from typing import Any

from lupin_msgs.msg import Observation, TwinTimes

from lupin_twin.core.clock import LATCHED_AFTER_S
from tests.support.messages import inspection, scan
from tests.support.processes import OFTEN, twin_node
from tests.support.ros import Peer, latched


def stamp_of(msg: Any) -> tuple[int, int]:
    return msg.header.stamp.sec, msg.header.stamp.nanosec


def paired(states: list[Any], times: list[Any]) -> tuple[Any, Any] | None:
    """A state and the times of the same stamp."""
    by_stamp = {stamp_of(each): each for each in times}
    return next(((s, by_stamp[stamp_of(s)]) for s in states if stamp_of(s) in by_stamp), None)


def test_a_robot_whose_clock_stepped_back_causes_a_warning_with_its_name(domain: int) -> None:
    """It is not ignored silently, and its messages are in the history at their time."""
    with twin_node(domain, *OFTEN) as twin, Peer(domain) as robot:
        robot.wait_for_twin()
        robot.observe(
            scan("1", {"co2": 1.0}, stamp_s=2000.0), scan("1", {"co2": 1.0}, stamp_s=1990)
        )
        robot.tag("1")
        assert "late stamps" not in twin.output
        robot.observe(*(scan("1", {"co2": 2.0}, stamp_s=1400.0 + i) for i in range(10)))
        robot.until(lambda: "late stamps" in twin.output, "a warning")
        robot.observe(scan("marker"))
        robot.tag("marker")
        [stored] = [tag for tag in robot.states[-1].tags if tag.tag_id == "1"]
        [line] = [line for line in twin.output.splitlines() if "late stamps" in line]
    assert "WARN" in line
    assert "late stamps on /floranova/observations: 6 observations in a row from source" in line
    assert "'test'" in line
    assert "by 596 s" in line
    assert stored.readings[0].value == 1.0


def test_latched_messages_of_two_robots_with_one_name_cause_no_warning(domain: int) -> None:
    """Both have latched the same hour; to the starting twin, the second repeats that time."""
    with Peer(domain, "one") as one, Peer(domain, "two") as two:
        for robot, tag_id in ((one, "a"), (two, "b")):
            robot.observe(*(scan(tag_id, {"co2": 1.0}, stamp_s=1000.0 + i) for i in range(40)))
        latched_at_s = time.monotonic()
        one.until(lambda: time.monotonic() > latched_at_s + 2 * LATCHED_AFTER_S, "an old latch")
        with twin_node(domain, *OFTEN) as twin:
            one.state(lambda state: len(state.tags) == 2, "both tags")
            for robot in (one, two):
                robot.observe(scan(f"marker {robot.node.get_name()}"))
            one.state(lambda state: len(state.tags) == 4, "both markers")
            assert "late stamps" not in twin.output


def test_the_times_come_with_the_state_latched_and_with_its_stamp(domain: int) -> None:
    failed = scan("1", status=Observation.STATUS_SCAN_FAILED, stamp_s=7300.0)
    failed.status_detail = "not decoded"
    with twin_node(domain, *OFTEN), Peer(domain) as robot:
        robot.wait_for_twin()
        robot.observe(
            scan("1", {"co2": 400.0, "light": 1.0}, stamp_s=10.0),
            inspection("1", stamp_s=3610.0),
            scan("1", {"light": 2.0}, stamp_s=7210.0),
            failed,
            scan("marker"),
        )
        robot.tag("marker")
        with Peer(domain, "late") as late:
            times: list[Any] = []
            late.node.create_subscription(TwinTimes, "/twin/times", times.append, latched(1))
            late.listen()
            pair = late.until(lambda: paired(late.states, times), "a state and its times")
    assert pair is not None
    state, of_state = pair
    assert of_state.header.frame_id == state.header.frame_id == "map"
    assert [tag.tag_id for tag in of_state.tags] == [tag.tag_id for tag in state.tags]
    tag = of_state.tags[0]
    assert list(tag.sensors) == [reading.name for reading in state.tags[0].readings]
    assert [time.sec for time in tag.observed_at] == [10, 7210]
    assert (tag.looked_at.sec, tag.last_try.sec) == (3610, 7300)
    assert (tag.last_try_status, tag.last_try_detail) == (2, "not decoded")
    assert state.tags[0].last_observed.sec == 7210, "the failed try is apart from it"
