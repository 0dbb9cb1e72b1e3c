"""The robot on the map; and the page after a lost robot has pinned a tag far off."""

import json
import math
import re
from collections.abc import Iterator
from typing import Any, Final

import pytest
from geometry_msgs.msg import Point, Pose, PoseStamped, PoseWithCovarianceStamped, Quaternion
from nav_msgs.msg import Path
from playwright.sync_api import WebSocketRoute, expect
from sensor_msgs.msg import BatteryState

from tests.browser.hmi import Hmi, OpenPage, View
from tests.browser.test_accessibility import violations
from tests.support.domains import own_domain
from tests.support.messages import inspection, scan
from tests.support.processes import OFTEN, constants
from tests.support.web import Bridge, bridge


@pytest.fixture
def robot() -> Iterator[Bridge]:
    often = constants(**{"lupin_bridge.bridge:ROBOT_PERIOD_S": 0.1})
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
    expect(fact).to_have_text(re.compile(r"Robot: x 3\.2 m, y 1\.5 m; \d+\ss ago; battery 64\s%"))
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
    trail = layer.locator(".robot-trail")
    expect(trail).to_have_attribute("d", "M2.8 1L3 1L3.2 1.5L3.2 1.6")
    hmi.page.emulate_media(media="print")
    expect(trail).to_be_hidden()
    hmi.page.emulate_media(media="screen")
    expect(layer.locator(".robot-plan")).to_have_attribute("points", "3.2,1 3.2,3")
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


AT_HOME: Final = {"1": (0.0, 0.0), "2": (4.0, 0.0), "3": (0.0, 3.0), "4": (4.0, 3.0)}
# How far around the tags the heat map goes, m.
REACH: Final = 1.5
PLANTER: Final = [(4990.0, 0.0), (5000.0, 0.0), (5000.0, 2.0), (4990.0, 2.0)]


@pytest.fixture(scope="module")
def site() -> Iterator[Bridge]:
    """Four tags at home, one at x = 5,000 m, and a planter that was seen there."""
    any_pose = ("--ros-args", "-p", "max_pose_m:=1000000.0")
    with own_domain() as domain, bridge(*any_pose, domain=domain) as running:
        for tag_id, at in AT_HOME.items():
            running.peer.observe(scan(tag_id, {"temperature": 20.0 + at[0]}, at=at))
        running.peer.observe(
            scan("lost", {"temperature": 30.0}, at=(5000.0, 1.0)),
            inspection("1", "lupin", blooms=[(4995.0, 1.0)], footprint=PLANTER),
        )
        running.tag("1", lambda tag: tag["species"])
        yield running


def is_home_in(hmi: Hmi, view: View) -> bool:
    """Whether everything at home is visible."""
    box = hmi.map.bounding_box()
    assert box is not None
    left, bottom = view.pixel(-REACH, -REACH)
    right, top = view.pixel(4 + REACH, 3 + REACH)
    return left >= 0 and top >= 0 and right <= box["width"] and bottom <= box["height"]


def test_the_page_opens_on_the_tags_at_home_and_lists_the_one_far_off(
    site: Bridge, open_page: OpenPage
) -> None:
    hmi = open_page(site.url)
    hmi.expect(lambda: set(hmi.rows()) == {*AT_HOME, "lost"}, "every tag")
    chip = hmi.row("lost").locator(".chip")
    expect(chip).to_have_text("Too far away, not on the map")
    expect(chip).to_have_attribute("title", re.compile("x 5000.00 m"))
    expect(hmi.page.locator("tbody .chip")).to_have_count(1)
    hmi.expect_samples()
    hmi.expect_phase("live")
    hmi.expect(lambda: is_home_in(hmi, hmi.view()), "the tags at home")
    assert hmi.view().scale > 50, "no wider than the tags at home"
    # A card of such a tag has everything but a position on the map.
    hmi.row("lost").get_by_role("button").click()
    expect(hmi.card("lost")).to_contain_text("far from all other tags")
    assert hmi.view().scale > 50


def test_nothing_covers_the_label_of_a_stopped_robot(site: Bridge, open_page: OpenPage) -> None:
    hmi = open_page(site.url, go=False, viewport={"width": 1100, "height": 800})
    no_value = {"sensor": "", "value": None, "limit": None, "since": None}
    stopped = {"kind": "stopped", "verdict": "unknown", **no_value}
    # Another open action: a line of its own, which has no room.
    pest = {"kind": "pest", "verdict": "stressed", **no_value}

    def meet(socket: WebSocketRoute) -> None:
        def on_message(message: str | bytes) -> None:
            frame: dict[str, Any] = json.loads(message)
            if "health" in frame:
                frame["health"]["house"]["reasons"] = [stopped]
                frame["health"]["tags"]["4"] = {"verdict": "stressed", "reasons": [pest]}
            socket.send(json.dumps(frame))

        socket.connect_to_server().on_message(on_message)

    hmi.page.route_web_socket(re.compile("/ws/state"), meet)
    hmi.go(query="?lang=nl")
    todo = hmi.page.get_by_test_id("greenhouse-health")
    expect(todo.locator(".do-more")).to_be_visible()
    order = todo.locator(".do-now p strong")
    expect(order).to_have_text("Bij de robot gaan kijken")
    # The space before it may stand by itself at the end of a line.
    is_hit = """at => [...at.getClientRects()].filter(it => it.width > 9).every(
      it => at.contains(document.elementFromPoint(it.right - 5, it.y + it.height / 2)))"""
    hmi.expect(lambda: bool(order.evaluate(is_hit)), "all of the order in sight")
