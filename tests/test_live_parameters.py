"""One parameter file for a twin and its `web`, for any name and namespace of the twin."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.support.live import attached, field_of, wait_until_ready
from tests.support.messages import occupancy_grid, scan
from tests.support.processes import lupin_twin, twin_node
from tests.support.ros import Peer
from tests.support.waiting import wait_for

REACH_M = 0.75
CHANGED = {
    "observations_topic": "/site/observations",
    "map_topic": "/site/map",
    "state_topic": "/site/state",
    "frame_id": "site",
    "idw_power": 3,
    "idw_max_distance_m": REACH_M,
    "max_grid_cells": 900,
}
SHIPPED = Path("ros_node/lupin_twin/config/twin.yaml")


def test_the_same_file_means_the_same_to_both(domain: int, tmp_path: Path) -> None:
    document = yaml.safe_load(SHIPPED.read_text(encoding="utf-8"))
    [node] = document.values()
    node["ros__parameters"].update(CHANGED)
    path = tmp_path / "twin.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    renaming = ["-r", "__node:=other", "-r", "__ns:=/house1"]
    file = ["--ros-args", "--params-file", str(path)]
    with (
        Peer(domain) as peer,
        twin_node(domain, *file, *renaming),
        lupin_twin(domain, "web", *file, *renaming[2:]) as process,  # the namespace
        attached(process, peer) as web,
    ):
        peer.publish("/site/map", occupancy_grid([[0, 0]], frame_id="site"), depth=1)
        for tag_id, value, x in (("a", 400.0, 0.0), ("b", 500.0, 1.0), ("c", 900.0, 1.5)):
            message = scan(tag_id, {"co2": value}, (x, 0.0), frame_id="site")
            peer.publish("/site/observations", message)
        wait_until_ready(web)
        web.tag("c")
        wait_for(lambda: web.get("/api/map").status_code == 200, "the map")

        requested: dict[str, Any] = {"sensor_type": "co2", "resolution": 0.25}
        # The box is web's, the values are the twin's.
        field = field_of(web, **requested).json()
        assert (field["origin_x"], field["origin_y"]) == (-REACH_M, -REACH_M)
        assert (field["width"], field["height"]) == (12, 6)
        assert field["values"][0] is None

        # One cell, half way between a and b and twice as far from c.
        cell = {
            "resolution": 0.2,
            "bbox_min_x": 0.4,
            "bbox_max_x": 0.6,
            "bbox_min_y": -0.1,
            "bbox_max_y": 0.1,
        }
        [value] = web.get("/api/field", **requested | cell).json()["values"]
        assert value == pytest.approx((400 * 8 + 500 * 8 + 900) / 17, rel=1e-3)

        # a has no other tag in reach; c is predicted from b, and three times as far from a.
        quality = web.get("/api/field/quality", **requested).json()
        assert quality["judged_count"] == 2
        assert quality["worst"]["predicted"] == pytest.approx((400 + 500 * 27) / 28)

        refused = web.get("/api/field", **requested | {"resolution": 0.05})
        assert "the limit is 900" in refused.json()["error_message"]
