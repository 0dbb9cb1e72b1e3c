"""The robot on the map: discreet, with its age, and only at the current moment."""

import math
import re
from collections.abc import Iterator

import pytest
from geometry_msgs.msg import Point, Pose, PoseStamped, PoseWithCovarianceStamped, Quaternion
from nav_msgs.msg import Path
from playwright.sync_api import expect
from sensor_msgs.msg import BatteryState

from tests.browser.hmi import Hmi, OpenPage
from tests.browser.test_accessibility import violations
from tests.support.messages import scan
from tests.support.processes import OFTEN, constants
from tests.support.web import Bridge, bridge


@pytest.fixture
def robot() -> Iterator[Bridge]:
    often = constants(**{"lupin_bridge.stream.pollers:ROBOT_PERIOD_S": 0.1})
    with bridge(*often, *OFTEN) as running:
        for tag_id, at in (("a", (0.0, 0.0)), ("b", (4.0, 0.0)), ("c", (4.0, 3.0))):
            running.peer.observe(scan(tag_id, {"temperature": 21.0}, at))
            running.tag(tag_id)
        yield running


def pose(x: float, y: float, yaw: float) -> Pose:
    turned = Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))
    return Pose(position=Point(x=x, y=y), orientation=turned)


def stamp(live: Bridge, message: object, ago_s: float) -> None:
    header = message.header  # type: ignore[attr-defined]
    header.frame_id = "map"
    now_ns = live.peer.node.get_clock().now().nanoseconds - round(ago_s * 1e9)
    header.stamp.sec, header.stamp.nanosec = divmod(now_ns, 10**9)


def place(live: Bridge, x: float, y: float, yaw: float = 0.0, ago_s: float = 0.0) -> None:
    """Publish the robot's position, and wait until the bridge has it."""
    message = PoseWithCovarianceStamped()
    message.pose.pose = pose(x, y, yaw)
    stamp(live, message, ago_s)
    live.peer.publish("/amcl_pose", message, depth=1)

    def is_there() -> bool:
        position = live.json("/api/robot")["position"]
        return position is not None and (position["x"], position["y"]) == (x, y)

    live.peer.until(is_there, f"the robot at {x}, {y} m")


def charge(live: Bridge, share: float) -> None:
    battery = BatteryState(percentage=share)
    stamp(live, battery, 0.0)
    live.peer.publish("/battery_state", battery, depth=1)


def plan(live: Bridge, *points: tuple[float, float]) -> None:
    way = Path(poses=[PoseStamped(pose=pose(x, y, 0.0)) for x, y in points])
    stamp(live, way, 0.0)
    live.peer.publish("/plan", way, depth=1)


def mark(hmi: Hmi) -> tuple[float, float]:
    box = hmi.test_id("robot-mark").locator(".robot-body").bounding_box()
    around, view = hmi.map.bounding_box(), hmi.view()
    assert box is not None
    assert around is not None
    x, y = box["x"] + box["width"] / 2 - around["x"], box["y"] + box["height"] / 2 - around["y"]
    return (x - view.x) / view.scale, (view.y - y) / view.scale


def test_the_robot_and_its_trail_plan_and_battery_are_shown_in_the_live_view(
    robot: Bridge, open_page: OpenPage
) -> None:
    # Without a robot nothing of it is shown, nor loaded.
    hmi = open_page(robot.url)
    hmi.expect_parts()
    hmi.page.get_by_role("button", name="Layers").click()
    expect(hmi.page.get_by_label("Labels")).to_be_visible()
    expect(hmi.page.get_by_label("Robot", exact=True)).to_have_count(0)
    expect(hmi.test_id("robot")).to_have_count(0)
    assert not [it for it in hmi.requests if "api/robot" in it]
    for x, ago_s in ((2.8, 20.0), (3.0, 10.0)):
        place(robot, x, 1.0, ago_s=ago_s)
    charge(robot, 0.64)
    plan(robot, (3.2, 1.0), (3.2, 3.0))
    place(robot, 3.2, 1.5, math.pi / 2)
    hmi = open_page(robot.url)
    fact = hmi.test_id("robot-fact")
    expect(fact).to_have_text(re.compile(r"Robot: 3\.2 m, 1\.5 m; \d+\ss ago; battery 64\s%"))
    layer = hmi.test_id("robot")
    place(robot, 3.2, 1.6, math.pi / 2)
    expect(layer).to_have_attribute("data-freshness", "live")
    hmi.expect(lambda: mark(hmi) == pytest.approx((3.2, 1.6), abs=0.05), "the mark where it is")
    # Pins' labels are readable over it.
    heights = [
        int(hmi.page.locator(layer).evaluate("it => +getComputedStyle(it).zIndex || 0"))
        for layer in (".robot-now", ".map-view [data-layer=pins]")
    ]
    assert heights[0] < heights[1]
    arrow = hmi.test_id("robot-mark").locator("path")
    assert float(re.findall(r"-?[\d.]+", arrow.get_attribute("transform") or "")[0]) == (
        pytest.approx(-90.0, abs=0.1)
    )
    trail = layer.locator(".robot-trail").last
    expect(trail).to_have_attribute("data-step", "0")
    hmi.page.emulate_media(media="print")
    expect(trail).to_be_hidden()
    hmi.page.emulate_media(media="screen")
    expect(layer.locator(".robot-plan")).to_have_attribute("points", "3.2,1.6 3.2,3")
    assert violations(hmi) == []

    # It can be switched off, also for others who open the link.
    hmi.page.get_by_role("button", name="Layers").click()
    hmi.page.get_by_label("Robot", exact=True).uncheck()
    expect(layer).to_have_count(0)
    expect(fact).to_have_count(0)
    hmi.page.get_by_label("Robot", exact=True).check()
    expect(layer).to_have_count(1)

    # The past view has no robot.
    stamp_s = robot.json("/api/state")["header"]["stamp"]["sec"]
    hmi.go(f"at={stamp_s}")
    expect(hmi.app).to_have_attribute("data-moment", str(stamp_s))
    expect(layer).to_have_count(0)
    expect(fact).to_have_count(0)
