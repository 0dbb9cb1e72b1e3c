"""Layers and markers over real DDS, of a twin in a namespace, in its own process."""

import json
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticArray
from lupin_msgs.msg import Observation
from lupin_msgs.srv import GetEstimate, GetField
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

from lupin_twin.core.parameters import TwinParameters
from lupin_twin.field.engine import DEFAULT_RESOLUTION_M
from tests.support.domains import own_domain
from tests.support.journal import SECOND, append
from tests.support.journal import scan as row
from tests.support.messages import inspection, scan
from tests.support.proc_stat import cpu_s
from tests.support.processes import Process, twin_node
from tests.support.ros import Peer, latched

LAYERS = "layers:=[temperature, co2, humidity, light, soil_moisture]"
SENSORS = Path("backend/lupin_bridge/sensors.json")
RVIZ = Path("ros_node/lupin_twin/rviz/twin.rviz")
# What each display of RViz reads.
READS = {
    "rviz_default_plugins/Map": "nav_msgs/msg/OccupancyGrid",
    "rviz_default_plugins/PointCloud2": "sensor_msgs/msg/PointCloud2",
    "rviz_default_plugins/MarkerArray": "visualization_msgs/msg/MarkerArray",
}
CO2, SOIL = "/gh1/twin/field/co2", "/gh1/twin/field/soil_moisture"
TEMPERATURE = "/gh1/twin/field/temperature"
TAGS, PLANTERS = "/gh1/twin/tags", "/gh1/twin/planters"
KINDS = dict.fromkeys((CO2, SOIL, TEMPERATURE), PointCloud2) | dict.fromkeys(
    (TAGS, PLANTERS), MarkerArray
)
BOX = ((0.0, 0.0), (1.0, 0.0), (1.0, 0.5))


class Viewer(Peer):
    """A peer that subscribes to what is drawn, and stores all of it."""

    def __init__(self, domain: int, name: str) -> None:
        super().__init__(domain, name)
        self.came: dict[str, list[Any]] = {topic: [] for topic in KINDS}
        self.subscriptions: dict[str, Any] = {}
        self.said: dict[str, str] = {}

    def watch(self, topic: str) -> None:
        self.subscriptions[topic] = self.node.create_subscription(
            KINDS[topic], topic, self.came[topic].append, latched(1)
        )

    def unwatch(self, topic: str) -> None:
        self.node.destroy_subscription(self.subscriptions.pop(topic))

    def latest(self, topic: str, accept: Any = lambda _: True) -> Any:
        came = self.came[topic]
        return self.until(
            lambda: came[-1] if came and accept(came[-1]) else None, f"a message on {topic}"
        )

    def receive_diagnostics(self) -> None:
        def receive(msg: Any) -> None:
            for status in msg.status:
                if status.name == "/gh1/lupin_twin: layers":
                    self.said = {each.key: each.value for each in status.values}
                    self.said["message"] = status.message

        self.node.create_subscription(DiagnosticArray, "/diagnostics", receive, 10)

    def reports(self, topic: str, count: int) -> None:
        """Wait until the twin's diagnostics contain it; any unexpected change is found here too."""
        self.until(lambda: self.said.get(topic) == str(count), f"{count} on {topic}")


@pytest.fixture(scope="module")
def greenhouse() -> Iterator[tuple[int, Process, Viewer]]:
    args = ("--ros-args", "-r", "__ns:=/gh1", "-p", LAYERS)
    with (
        own_domain() as domain,
        twin_node(domain, *args) as process,
        Viewer(domain, "robot") as robot,
    ):
        yield domain, process, robot


def observe(robot: Peer, *messages: Any) -> None:
    for message in messages:
        robot.publish("/gh1/floranova/observations", message)


def cells(msg: Any) -> npt.NDArray[np.float32]:
    """(n, 5): x, y, z, value, error."""
    assert [field.name for field in msg.fields] == ["x", "y", "z", "value", "error"]
    return np.frombuffer(bytes(msg.data), dtype=np.float32).reshape(msg.width, 5)


def box_of(low: tuple[float, float], high: tuple[float, float]) -> dict[str, Any]:
    """The default box and cells: the tags', 1.5 m wider, in cells of 0.1 m."""
    return {
        "resolution": 0.1,
        "bbox_min_x": low[0] - 1.5,
        "bbox_min_y": low[1] - 1.5,
        "bbox_max_x": high[0] + 1.5,
        "bbox_max_y": high[1] + 1.5,
    }


def test_a_layer_is_the_field_and_is_computed_only_for_subscribers(
    greenhouse: tuple[int, Process, Viewer],
) -> None:
    domain, _, robot = greenhouse
    robot.receive_diagnostics()
    for x in (0, 4):
        observe(robot, scan(f"t{x}", {"co2": 400.0 + x, "soil_moisture": 30.0}, (x, 0)))
    box = box_of((0.0, 0.0), (4.0, 0.0))
    query: dict[str, Any] = {"sensor_type": "co2", **box}
    field = robot.until(
        lambda: (f := robot.call(GetField, "/gh1/twin/get_field", **query)).sample_count == 2 and f,
        "both tags",
    )
    # Something is known, without subscribers: nothing was computed.
    robot.reports(CO2, 0)
    robot.reports(TAGS, 0)
    assert robot.said["message"] == "0 of 7 topics have subscribers"

    with Viewer(domain, "viewer") as viewer:
        viewer.watch(CO2)
        msg = viewer.latest(CO2)
        values = np.array(field.values).reshape(field.height, field.width)
        rows, columns = np.nonzero(~np.isnan(values))
        assert 0 < rows.size < values.size
        found = cells(msg)
        np.testing.assert_array_equal(found[:, 3], values[rows, columns].astype(np.float32))
        np.testing.assert_allclose(found[:, 0], -1.5 + (columns + 0.5) * 0.1, atol=1e-6)
        np.testing.assert_allclose(found[:, 1], -1.5 + (rows + 0.5) * 0.1, atol=1e-6)
        # Two readings make no model yet: the error is unknown.
        assert (found[:, 2] == 0.0).all()
        assert (found[:, 4] == -1.0).all()
        assert (msg.header.frame_id, msg.is_dense) == ("map", True)
        assert msg.header.stamp.sec > 0

        with Viewer(domain, "late") as late:
            late.watch(CO2)
            assert late.latest(CO2).header.stamp == msg.header.stamp  # from the latch
        robot.reports(CO2, 1)
        robot.reports(SOIL, 0)

        observe(robot, scan("t0", {"co2": 900.0}))
        changed = viewer.latest(CO2, lambda m: cells(m)[:, 3].max() == 900.0)
        assert cells(changed).shape == found.shape
        viewer.watch(SOIL)
        assert (cells(viewer.latest(SOIL))[:, 3] == 30.0).all()
        viewer.unwatch(CO2)
        robot.until(
            lambda: robot.said["message"] == "1 of 7 topics have subscribers", "one who looks"
        )
        observe(robot, scan("t0", {"co2": 700.0}))
        viewer.latest(SOIL)  # the same tags at another revision
        viewer.came[CO2].clear()
        viewer.watch(CO2)
        viewer.latest(CO2, lambda m: cells(m)[:, 3].max() == 700.0)
    robot.reports(CO2, 3)


def test_the_error_is_that_of_the_value_by_the_estimate(
    greenhouse: tuple[int, Process, Viewer],
) -> None:
    domain, _, robot = greenhouse
    now_s = robot.node.get_clock().now().nanoseconds / 1e9
    places = [(x, 8.0) for x in range(5)]
    observe(
        robot,
        *(
            scan(f"e{x}", {"temperature": 20.0 + x + ago_s / 60}, (x, y), stamp_s=now_s - ago_s)
            for x, y in places
            for ago_s in (1200.0, 600.0, 1.0)
        ),
    )
    query: dict[str, Any] = {"sensor_type": "temperature", **box_of((0.0, 0.0), (4.0, 8.0))}
    with Viewer(domain, "viewer") as viewer:
        viewer.watch(TEMPERATURE)

        def is_as_foretold() -> bool:
            clouds = viewer.came[TEMPERATURE]
            if not clouds or not len(found := cells(clouds[-1])) or found[0, 4] < 0.0:
                return False
            estimate = viewer.call(GetEstimate, "/gh1/twin/get_estimate", **query)
            field = viewer.call(GetField, "/gh1/twin/get_field", **query)
            values = np.array(field.values)
            known = ~np.isnan(values)
            off = values[known] - np.array(estimate.mean)[known]
            expected = np.hypot(np.array(estimate.sd)[known], off)
            return expected.shape == found[:, 4].shape and np.allclose(
                found[:, 4], expected, rtol=1e-4
            )

        viewer.until(is_as_foretold, "errors as those of the estimate")


def test_estimates_take_a_tenth_of_a_core_however_much_is_received(
    domain: int, tmp_path: Path
) -> None:
    """Without a pause, that was a whole core: each scan is a reason for new estimates."""
    chance, now_ns, sensors = Random(1), time.time_ns(), ("co2", "temperature")

    def readings() -> Any:
        return {name: chance.gauss(20.0) for name in sensors}

    rows = [
        row(f"t{tag}", now_ns - ago * 1_200 * SECOND, **readings())
        for ago in range(30, 0, -1)
        for tag in range(30)
    ]
    append(tmp_path / "journal.sqlite", rows)
    args = ("--ros-args", "-p", LAYERS, "-p", f"journal:={tmp_path / 'journal.sqlite'}")
    with twin_node(domain, *args) as twin, Peer(domain) as peer:
        peer.observe(*(scan(f"t{tag}", readings(), (tag % 6, tag // 6)) for tag in range(30)))
        came: dict[str, list[Any]] = {name: [] for name in sensors}
        for name in sensors:
            topic = f"/twin/field/{name}"
            peer.node.create_subscription(PointCloud2, topic, came[name].append, latched(1))

        def both() -> bool:
            """Whether both have come with an error; meanwhile, there is one more scan."""
            peer.observe(scan("t0", readings()))
            found = [it[-1] for it in came.values() if it and it[-1].width]
            return len(found) == 2 and all(cells(it)[0, 4] >= 0.0 for it in found)

        def next_s() -> float:
            for each in came.values():
                each.clear()
            peer.until(both, "both layers")
            return time.monotonic()

        next_s()
        began_s, before_s = next_s(), cpu_s(twin.pid)
        took_s = next_s() - began_s
        assert (cpu_s(twin.pid) - before_s) / took_s < 0.4  # all its work; a busy machine adds


def test_tags_and_planters_are_marked_by_their_state(
    greenhouse: tuple[int, Process, Viewer],
) -> None:
    domain, _, robot = greenhouse
    observe(
        robot,
        scan("m1", {"light": 1.0}, (1.0, 3.0)),
        scan("m2", {"light": 1.0}, (2.0, 3.0)),
        inspection("m1", footprint=BOX),
        inspection("m2", footprint=BOX),
        scan("m2", status=Observation.STATUS_SCAN_FAILED),
    )
    with Viewer(domain, "viewer") as viewer:
        viewer.watch(TAGS)
        viewer.watch(PLANTERS)
        msg = viewer.latest(TAGS, lambda m: any(x.text == "m2 (failed)" for x in m.markers))
        assert msg.markers[0].action == Marker.DELETEALL
        names = {marker.text: marker for marker in msg.markers if marker.text}
        balls = {m.id: m for m in msg.markers if m.type == Marker.SPHERE and m.ns == "tags"}
        fresh, failed = balls[names["m1"].id], balls[names["m2 (failed)"].id]
        assert (fresh.pose.position.x, fresh.pose.position.y) == (1.0, 3.0)
        assert fresh.color.g > fresh.color.r
        assert failed.color.r > failed.color.g
        outlines = viewer.latest(PLANTERS, lambda m: len(m.markers) > 1).markers[1:]
        assert [(o.ns, o.id, len(o.points)) for o in outlines] == [("planters", fresh.id, 4)]
        # Its type stays, and so does its name.
        observe(robot, scan("m2", {"light": 2.0}))
        msg = viewer.latest(TAGS, lambda m: any(x.text == "m2" for x in m.markers))
        assert next(x.id for x in msg.markers if x.text == "m2") == failed.id


def test_rviz_shows_what_the_twin_publishes(greenhouse: tuple[int, Process, Viewer]) -> None:
    _, _, robot = greenhouse
    manager = yaml.safe_load(RVIZ.read_text(encoding="utf-8"))["Visualization Manager"]
    shown = {each["Name"]: each for each in manager["Displays"] if "Topic" in each}
    # Relative, so that a namespace moves them; latched, or the last one would not arrive.
    reads = {f"/gh1/{each['Topic']['Value']}": [READS[each["Class"]]] for each in shown.values()}
    robot.until(
        lambda: reads.items() <= dict(robot.node.get_topic_names_and_types()).items(),
        f"topics {reads}",
    )
    for each in shown.values():
        topic = each["Topic"]
        assert (topic["Durability Policy"], topic["Reliability Policy"], topic["Depth"]) == (
            "Transient Local",
            "Reliable",
            1,
        )
    known = json.loads(SENSORS.read_text(encoding="utf-8"))["sensors"]
    layers = {name: each for name, each in shown.items() if "PointCloud2" in each["Class"]}
    assert list(layers) == [name for name, reported in known.items() if "derived" not in reported]
    # A displayed layer costs the twin something.
    assert [name for name, each in layers.items() if each["Enabled"]] == ["temperature"]
    assert {each["Channel Name"] for each in layers.values()} == {"value"}
    assert {each["Size (m)"] for each in layers.values()} == {DEFAULT_RESOLUTION_M}
    namespaces = {space for each in shown.values() for space in each.get("Namespaces", ())}
    assert namespaces == {"tags", "names", "planters"}
    assert manager["Global Options"]["Fixed Frame"] == TwinParameters().frame_id


def test_a_tag_far_off_widens_no_layer_and_has_its_marker(
    greenhouse: tuple[int, Process, Viewer],
) -> None:
    domain, _, robot = greenhouse
    at = {"a": (0.0, 0.0), "b": (1.0, 0.0), "c": (1.0, 0.5), "far": (900.0, 0.0)}
    observe(robot, *(scan(tag_id, {"co2": 1.0}, place) for tag_id, place in at.items()))
    with Viewer(domain, "viewer") as viewer:
        viewer.watch(CO2)
        viewer.watch(TAGS)
        viewer.latest(TAGS, lambda m: any(x.text == "far" for x in m.markers))
        layer = cells(viewer.latest(CO2, lambda m: m.width > 0))
        assert layer[:, 0].max() < 100.0
