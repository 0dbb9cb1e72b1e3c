"""A small greenhouse with one of everything, for tests that change nothing in it."""

from typing import Any

from lupin_msgs.msg import Observation

from tests.support.messages import discovered, inspection, occupancy_grid, pose, scan
from tests.support.waiting import wait_for
from tests.support.web import Bridge

# In the order of the table: the worst first, equals by number, then by name.
TAGS = ("10", "3", "failed", "seen", "1", "2", "9")


def observations() -> list[Any]:
    """The robot's observations: tag 9 has no pose, tag 10 a pest, and one scan failed."""
    box = [(0.5, 0.8), (3.5, 0.8), (3.5, 1.2), (0.5, 1.2)]
    return [
        scan("10", {"temperature": 31.0, "humidity": 40.0}, at=(1, 3)),
        scan("9", {"temperature": 22.0, "light": 900.0}),
        scan("1", {"temperature": 20.0, "humidity": 60.0, "soil_moisture": 45.0}, at=(1, 1)),
        scan("2", {"temperature": 23.0, "co2": 600.0}, at=(3, 1)),
        scan("3", {"humidity": 70.0, "co2": float("nan")}, at=(3, 3)),
        scan("failed", status=Observation.STATUS_SCAN_FAILED, at=(2, 2)),
        inspection("1", "lupin", blooms=[(0.8, 1.0), (1.2, 1.0)], flower_count=2, footprint=box),
        inspection("2", "tomato", blooms=[(2.9, 1.0)], flower_count=1, footprint=box),
        inspection("10", "lupin", anomaly=True, bug_count=3),
    ]


def furnish(bridge: Bridge) -> None:
    bridge.peer.publish_map(occupancy_grid([[100] * 6, *([[100, 0, 0, 0, 0, 100]] * 4), [100] * 6]))
    bridge.peer.discover(discovered({"seen": pose(4, 2)}))
    bridge.peer.observe(*observations())
    bridge.tag("10", lambda tag: tag["anomaly"])
    bridge.tag("seen")
    wait_for(lambda: bridge.get("/api/map").status_code == 200, "the map")
