"""The greenhouse's floor plan: walls, planter tables, tags and the aisles they face.

Read from the simulator's own configuration. Metres, map frame: the origin is the corner of the
house inside the walls, x along the short side, y along the long one.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from math import atan2, dist
from pathlib import Path
from typing import Any

from lupin_patrol.geometry import TOUCH_M, Point, Rect

# Half the width of the robot (0.3 m) and a hand's breadth: its centre keeps this far from tables
# and walls. The narrowest aisle of the default greenhouse is 0.45 m.
CLEARANCE_M = 0.2
# Where the robot's centre stands to read a tag, measured from the table's edge: as far as the
# aisle allows, because the camera then sees all of the planter.
STAND_OFFS_M = (0.4, 0.35, 0.3, 0.25, 0.2)

# Heights above the floor: of the soil in the planters, and of the tags on the tables' edges.
TABLE_HEIGHT_M = 0.35
TAG_HEIGHT_M = 0.3


@dataclass(frozen=True, slots=True)
class Table:
    """A planter: a table that is one box of plants."""

    name: str
    rect: Rect


@dataclass(frozen=True, slots=True)
class Tag:
    """An AprilTag with its climate sensors.

    `edge` is the point of its table's outline nearest to it, `facing` the unit vector from there
    into the aisle, `stop` where the robot's centre stands to read it.
    """

    tag_id: str
    position: Point
    sensors: tuple[str, ...]
    table: Table
    edge: Point
    facing: Point
    stop: Point

    @property
    def yaw(self) -> float:
        """Direction of `facing`, rad from x towards y."""
        return atan2(self.facing[1], self.facing[0])


@dataclass(frozen=True, slots=True)
class House:
    """Everything that stands still."""

    interior: Rect
    tables: tuple[Table, ...]
    tags: tuple[Tag, ...]

    def is_free(self, point: Point) -> bool:
        """Whether the robot's centre may be there."""
        return _is_free(point, self.interior, self.tables)

    def tag(self, tag_id: str) -> Tag:
        """Return the tag of that id."""
        return next(tag for tag in self.tags if tag.tag_id == tag_id)


def read_house(simulator: Any) -> House:
    """Read the layout of a `greenhouse_sim.simulator.GreenhouseSimulator`.

    Raises ValueError when a tag has no aisle that the robot fits into.
    """
    size = simulator.sim_config["visualization"]
    interior = Rect(0.0, 0.0, float(size["greenhouse_width_m"]), float(size["greenhouse_height_m"]))
    # The simulator's tag manager drops the tables when it loads this file.
    layout = json.loads(Path(simulator.tag_manager.file_path).read_text(encoding="utf-8"))
    tables = tuple(
        Table(name, Rect(float(box["x0"]), float(box["y0"]), float(box["x1"]), float(box["y1"])))
        for name, box in layout["tables"].items()
    )
    tags = tuple(
        _place_tag(tag_id, (float(tag["x"]), float(tag["y"])), tag["sensors"], interior, tables)
        for tag_id, tag in simulator.tag_manager.get_tags().items()
    )
    return House(interior, tables, tags)


def _place_tag(
    tag_id: str,
    position: Point,
    sensors: list[str],
    interior: Rect,
    tables: tuple[Table, ...],
) -> Tag:
    """Put a tag on the side of its table that it is nearest to; at a corner, the roomier one."""
    table = min(tables, key=lambda candidate: dist(position, candidate.rect.nearest(position)))
    sides = []
    for order, (edge, facing) in enumerate(_sides(table.rect, position)):
        for stand_off_m in STAND_OFFS_M:
            stop = (edge[0] + facing[0] * stand_off_m, edge[1] + facing[1] * stand_off_m)
            if _is_free(stop, interior, tables):
                away_m = round(dist(position, edge), 3)
                sides.append((away_m, -stand_off_m, order, edge, facing, stop))
                break
    if not sides:
        raise ValueError(
            f"tag {tag_id} at {position}: no aisle beside {table.name} is as wide as"
            f" {2 * CLEARANCE_M} m"
        )
    *_, edge, facing, stop = min(sides)
    return Tag(tag_id, position, tuple(sensors), table, edge, facing, stop)


def _sides(rect: Rect, position: Point) -> list[tuple[Point, Point]]:
    """For each side of a table: its point nearest to the tag, and its outward normal."""
    x, y = rect.nearest(position)
    return [
        ((rect.x0, y), (-1.0, 0.0)),
        ((rect.x1, y), (1.0, 0.0)),
        ((x, rect.y0), (0.0, -1.0)),
        ((x, rect.y1), (0.0, 1.0)),
    ]


def _is_free(point: Point, interior: Rect, tables: tuple[Table, ...]) -> bool:
    floor = interior.grown(TOUCH_M - CLEARANCE_M)
    return floor.nearest(point) == point and not any(
        table.rect.grown(CLEARANCE_M).contains(point) for table in tables
    )
