"""The robot's layer over DDS, in `serve` and `web`, from publishers of standard messages only."""

import math
import re
import time
from collections.abc import Iterator
from threading import Event, Thread
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose, PoseStamped, PoseWithCovarianceStamped, Quaternion
from nav_msgs.msg import Odometry, Path
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState

from lupin_bridge.stream import routes_schema
from tests.support.live import serve_and_web, wait_until_ready
from tests.support.messages import scan
from tests.support.processes import constants, limits
from tests.support.waiting import PATIENCE_S
from tests.support.web import Bridge, Listener, bridge

QUICK = ("--ros-args", "-p", "state_publish_rate_hz:=10.0")
# No machine is too busy for an answer.
PATIENT = limits(answer_timeout_s=PATIENCE_S)
OFTEN = constants(**{"lupin_bridge.bridge:ROBOT_PERIOD_S": 0.1})
Json = dict[str, Any]


@pytest.fixture(scope="module")
def both() -> Iterator[tuple[Bridge, Bridge]]:
    with serve_and_web(*QUICK, of_both=(*PATIENT, *OFTEN)) as (twin, apart):
        twin.peer.observe(scan("1", {"co2": 400.0}, (0.0, 0.0)))
        for live in (twin, apart):
            wait_until_ready(live)
            live.tag("1")
        yield twin, apart


@pytest.fixture
def alone() -> Iterator[Bridge]:
    with bridge(*PATIENT, *QUICK) as running:
        running.peer.observe(scan("1", {"co2": 400.0}, (0.0, 0.0)))
        running.tag("1")
        yield running


def stamped(message: Any, live: Bridge, frame_id: str = "map", ago_s: float = 0.0) -> Any:
    message.header.frame_id = frame_id
    now = live.peer.node.get_clock().now().nanoseconds - int(ago_s * 1e9)
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, 10**9)
    return message


def on_floor(x: float, y: float, yaw: float = 0.0) -> Pose:
    return Pose(
        position=Point(x=x, y=y), orientation=Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))
    )


def amcl(x: float, y: float, yaw: float = 0.0) -> PoseWithCovarianceStamped:
    message = PoseWithCovarianceStamped()
    message.pose.pose = on_floor(x, y, yaw)
    return message


def robot(live: Bridge) -> Json:
    answer: Json = live.json("/api/robot")
    routes_schema.Robot.model_validate(answer)
    return answer


def at(live: Bridge, x: float) -> Json | None:
    """The robot in the state, once it is at this position."""
    reported = robot(live)
    return reported if reported["position"] and reported["position"]["x"] == x else None


def until_at(live: Bridge, x: float) -> Json:
    reported = live.peer.until(lambda: at(live, x), f"the robot at {x} m")
    assert reported is not None
    return reported


def assert_no_robot(client: Listener) -> None:
    """With none of the next states, and not between them."""
    kinds = [client.next()["type"] for _ in range(4)]
    assert "state" in kinds
    assert "robot" not in kinds


def dropped(live: Bridge, name: str, reason: str) -> float:
    [line] = [
        line
        for line in live.get("/metrics").text.splitlines()
        if line.startswith(f'{name}_total{{reason="{reason}"}}')
    ] or [" 0"]
    return float(line.rpartition(" ")[2])


def test_serve_and_web_show_pose_plan_and_battery_from_standard_messages(
    both: tuple[Bridge, Bridge],
) -> None:
    twin, _ = both
    way = Path(poses=[PoseStamped(pose=on_floor(0.05 * i, 1.0)) for i in range(200)])
    twin.peer.publish("/plan", stamped(way, twin))
    battery = BatteryState(percentage=0.64)
    # As drivers do: neither latched nor in the map's frame.
    volatile = twin.peer.node.create_publisher(BatteryState, "/battery_state", 10)
    pose = stamped(amcl(2.1, 3.4, math.pi / 2), twin, ago_s=30.0)
    twin.peer.publish("/amcl_pose", pose, depth=1)

    for live in both:

        def reported(live: Bridge = live) -> Json | None:
            volatile.publish(stamped(battery, twin, "base_link"))
            found = at(live, 2.1)
            return found if found and found["battery"] and found["plan"] else None

        found = twin.peer.until(reported, "the robot, its plan and its battery")
        assert found is not None
        stamp = pose.header.stamp
        assert found["position"] == {
            "x": 2.1,
            "y": 3.4,
            "heading": pytest.approx(math.pi / 2, abs=1e-3),
            "observed_at": {"sec": stamp.sec, "nanosec": stamp.nanosec},
        }
        assert found["battery"]["percent"] == 64.0
        points = found["plan"]["points"]
        assert (points[0], points[-1]) == ([0.0, 1.0], [9.95, 1.0])
        assert len(points) <= 60
        last = found["trail"][-1]
        assert (last["x"], last["y"]) == (2.1, 3.4)


def test_a_robot_frame_comes_after_the_first_state_and_then_on_change_alone(
    both: tuple[Bridge, Bridge],
) -> None:
    twin, _ = both
    twin.peer.publish("/amcl_pose", stamped(amcl(1.0, 1.0), twin), depth=1)
    for live in both:
        until_at(live, 1.0)
        with live.listen() as client:
            kinds = [client.next()["type"] for _ in range(2)]
            assert kinds == ["status", "state"]
            frame = client.until("robot")
            routes_schema.RobotFrame.model_validate(frame)
            assert frame["position"]["x"] == 1.0
            assert "trail" not in frame
            assert_no_robot(client)


def test_another_frame_and_an_invalid_position_are_dropped_named_and_counted(
    both: tuple[Bridge, Bridge],
) -> None:
    twin, apart = both
    twin.peer.publish("/amcl_pose", stamped(amcl(4.0, 4.0), twin), depth=1)
    for live in both:
        until_at(live, 4.0)
    for message, reason in (
        (stamped(amcl(5.0, 5.0), twin, "odom"), "frame"),
        (stamped(amcl(math.nan, 5.0), twin), "pose"),
        (stamped(amcl(5.0, 5.0), twin, ago_s=-3_600.0), "rejected"),
    ):
        for live, name in ((twin, "lupin_dropped"), (apart, "lupin_web_dropped")):
            before = dropped(live, name, reason)
            twin.peer.publish("/amcl_pose", message, depth=1)
            twin.peer.until(
                lambda live=live, name=name, reason=reason, before=before: (
                    dropped(  # type: ignore[misc]
                        live, name, reason
                    )
                    > before
                ),
                f"a drop by {reason}",
            )
            assert at(live, 4.0)
    for live in both:
        text = " ".join(it["message"] for it in live.json("/readyz")["drops"])
        assert "'odom', expected 'map'" in text
        assert "amcl_pose" in text
        assert "(nan, 5) m" in text
        assert re.search(
            r"its stamp is 3[56]\d\d s ahead of the twin's time, the limit is 10 s", text
        )


def test_before_the_first_message_nothing_is_known_and_odometry_is_recognised_by_its_type(
    alone: Bridge,
) -> None:
    assert robot(alone) == {"position": None, "plan": None, "battery": None, "trail": []}
    with alone.listen() as client:
        assert_no_robot(client)
    message = Odometry()
    message.pose.pose = on_floor(7.0, 8.0)
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    publisher = alone.peer.node.create_publisher(Odometry, "/amcl_pose", best_effort)

    def reported() -> Json | None:
        publisher.publish(stamped(message, alone))
        return at(alone, 7.0)

    alone.peer.until(reported, "the odometry")


def test_a_topic_of_another_type_is_named_and_does_no_harm(alone: Bridge) -> None:
    alone.peer.publish("/amcl_pose", Clock())
    alone.process.wait_for_output("amcl_pose is published as rosgraph_msgs/msg/Clock, and not used")
    alone.peer.publish("/plan", stamped(Path(poses=[PoseStamped()]), alone))
    alone.peer.until(lambda: robot(alone)["plan"], "the plan")


def test_a_flood_of_poses_costs_the_ros_thread_no_more_than_one_a_second(alone: Bridge) -> None:
    publisher = alone.peer.publisher("/amcl_pose", PoseWithCovarianceStamped, 1)
    publisher.publish(stamped(amcl(0.0, 0.0), alone))
    until_at(alone, 0.0)
    ending, sent = Event(), [0]

    def flood() -> None:
        while not ending.wait(0.002):
            sent[0] += 1
            publisher.publish(stamped(amcl(float(sent[0]), 0.0), alone))

    thread = Thread(target=flood)
    with alone.listen() as client:
        client.until("robot")
        thread.start()
        try:
            begin_s = time.monotonic()
            frames = [client.until("robot") for _ in range(4)]
            took_s = time.monotonic() - begin_s
        finally:
            ending.set()
            thread.join()
    assert took_s > 2.5
    assert sent[0] > 100
    first, *_, last = (frame["position"]["x"] for frame in frames)
    assert last - first > 20, "the latest, and none that waited"
    reported = robot(alone)
    assert len(reported["trail"]) <= took_s + 3


def test_a_clock_that_never_starts_dates_nothing_and_shows_no_age() -> None:
    with bridge(*PATIENT, *QUICK, "-p", "use_sim_time:=true") as running:
        running.peer.observe(scan("1", {"co2": 400.0}, (0.0, 0.0), stamp_s=1_000.0))
        running.tag("1")
        message = amcl(3.0, 3.0)
        message.header.stamp.sec = 1_000
        running.peer.publish("/amcl_pose", message, depth=1)
        reported = until_at(running, 3.0)
        assert reported["position"]["observed_at"]["sec"] == 1_000
        assert running.get("/readyz").json()["reason"] == "no_clock"
