"""The floor plan, read from the simulator."""

from __future__ import annotations

import json
from math import cos, dist, hypot, sin
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.greenhouse import CLEARANCE_M, Greenhouse, read_greenhouse


@pytest.fixture(scope="module")
def simulator() -> Any:
    return GreenhouseSimulator()


@pytest.fixture(scope="module")
def greenhouse(simulator: Any) -> Greenhouse:
    return read_greenhouse(simulator)


def built_from(tmp_path: Path, tags: dict[str, Any], tables: dict[str, Any]) -> Greenhouse:
    """A greenhouse of 4 × 4 m with tags and tables of one's own."""
    layout = tmp_path / "tag_locations.json"
    layout.write_text(json.dumps({"tags": tags, "tables": tables}))
    return read_greenhouse(
        SimpleNamespace(
            sim_config={"visualization": {"greenhouse_width_m": 4, "greenhouse_height_m": 4}},
            tag_manager=SimpleNamespace(file_path=layout, get_tags=lambda: tags),
        )
    )


def box(x0: float, y0: float, x1: float, y1: float) -> dict[str, float]:
    return {"x0": x0, "y0": y0, "x1": x1, "y1": y1}


def test_the_tags_are_the_simulators_with_the_sensors_they_carry(
    greenhouse: Greenhouse, simulator: Any
) -> None:
    assert len(greenhouse.tags) == 29
    assert {t.tag_id: (*t.position, list(t.sensors)) for t in greenhouse.tags} == {
        tag_id: (tag["x"], tag["y"], tag["sensors"])
        for tag_id, tag in simulator.tag_manager.get_tags().items()
    }


def test_every_tag_is_on_the_nearest_table_and_faces_away_from_it(greenhouse: Greenhouse) -> None:
    for tag in greenhouse.tags:
        away = {t.name: dist(tag.position, t.rect.nearest(tag.position)) for t in greenhouse.tables}
        assert away[tag.table.name] == min(away.values())
        assert hypot(*tag.facing) == 1.0
        assert tag.edge == pytest.approx(tag.table.rect.nearest(tag.edge))
        just_outside = tuple(e + 0.01 * f for e, f in zip(tag.edge, tag.facing, strict=True))
        assert tag.table.rect.nearest((just_outside[0], just_outside[1])) == pytest.approx(tag.edge)
        assert (cos(tag.yaw), sin(tag.yaw)) == pytest.approx(tag.facing)


def test_the_robot_fits_where_it_stops_and_faces_the_tag(
    greenhouse: Greenhouse,
) -> None:
    for tag in greenhouse.tags:
        assert greenhouse.is_free(tag.stop)
        away = [s - e for s, e in zip(tag.stop, tag.edge, strict=True)]
        assert hypot(*away) == pytest.approx(
            sum(a * f for a, f in zip(away, tag.facing, strict=True))
        )
        assert CLEARANCE_M <= round(hypot(*away), 6) <= 0.4


def test_a_tag_faces_the_side_it_is_nearest_to(tmp_path: Path) -> None:
    tags = {
        "left": {"x": 1.02, "y": 1.5, "sensors": []},
        "top": {"x": 1.5, "y": 2.03, "sensors": []},
    }
    greenhouse = built_from(tmp_path, tags, {"one": box(1.0, 1.0, 2.0, 2.0)})
    assert greenhouse.tag("left").facing == (-1.0, 0.0)
    assert greenhouse.tag("left").stop == pytest.approx((0.6, 1.5))
    assert greenhouse.tag("top").facing == (0.0, 1.0)


def test_in_a_narrow_aisle_the_robot_stops_closer(tmp_path: Path) -> None:
    tags = {"a": {"x": 1.0, "y": 1.5, "sensors": []}}
    tables = {"one": box(1.0, 1.0, 2.0, 2.0), "left of it": box(0.0, 0.0, 0.5, 4.0)}
    assert built_from(tmp_path, tags, tables).tag("a").stop == pytest.approx((0.7, 1.5))


def test_a_tag_that_no_robot_can_face_is_refused_by_name(tmp_path: Path) -> None:
    tags = {"7": {"x": 1.0, "y": 1.0, "sensors": []}}
    with pytest.raises(ValueError, match=r"tag 7 at \(1\.0, 1\.0\): no aisle beside one .* 0\.4 m"):
        built_from(tmp_path, tags, {"one": box(0.1, 0.1, 3.9, 3.9)})
