"""The map: none before the first message, then its place and its picture, pixel by pixel."""

import math
from collections.abc import Iterator, Sequence
from itertools import count

import httpx
import numpy as np
import pytest
from geometry_msgs.msg import Point, Pose
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_bridge.routes.status import map_json, map_png
from lupin_bridge.stream import schema
from lupin_twin.field.explored import OccupancyMap
from tests.bridge.field.test_formats import decoded
from tests.support.messages import occupancy_grid, scan
from tests.support.web import Bridge, bridge

CELLS = [[0, 100, -1], [-1, 50, 0]]
NOWHERE_YET = count()


@pytest.fixture(scope="module")
def mapped() -> Iterator[Bridge]:
    with bridge() as running:
        yield running


def put_map(running: Bridge, rows: list[list[int]], origin: Pose | None = None) -> str:
    """Publish a map and wait until it is served; returns its ETag.

    Without an origin, the map gets one never used before: a repeated map is no news.
    """
    before = running.get("/api/map").headers.get("etag")
    origin = origin or Pose(position=Point(x=float(next(NOWHERE_YET))))
    running.peer.publish_map(occupancy_grid(rows, 0.05, origin))

    def check() -> str | None:
        tag = running.get("/api/map").headers.get("etag")
        return tag if tag != before else None

    return str(running.peer.until(check, "the new map"))


def test_a_map_is_fetched_again_only_when_it_has_changed(mapped: Bridge) -> None:
    old = put_map(mapped, [[0]])
    for path in ("/api/map", "/api/map.png"):
        first = mapped.get(path)
        assert first.headers["cache-control"] == "no-cache"
        again = mapped.get(path, {"If-None-Match": first.headers["etag"]})
        assert (again.status_code, again.content) == (304, b"")
        assert again.headers["etag"] == first.headers["etag"]
    assert mapped.get("/api/map").headers["etag"] != mapped.get("/api/map.png").headers["etag"]
    assert put_map(mapped, CELLS) != old
    assert mapped.get("/api/map", {"If-None-Match": old}).status_code == 200


def test_a_websocket_client_learns_of_a_new_map_by_the_revision(mapped: Bridge) -> None:
    with mapped.listen() as listener:
        # From the maps so far: a frame under way may be from before another test's map.
        mapped.peer.observe(scan("by now"))
        before = listener.until_tag("by now")["revision"]
        mapped.peer.publish_map(occupancy_grid([[100, -1]]))
        listener.until("state", lambda frame: frame["revision"] != before)


def test_a_restarted_bridge_has_no_map_at_first_and_matches_no_earlier_etag(domain: int) -> None:
    paths = ("/api/map", "/api/field.json?sensor_type=temperature")
    first: dict[str, httpx.Response] = {}
    for _ in range(2):
        with bridge(domain=domain) as running:
            for path in ("/api/map", "/api/map.png"):
                answer = running.get(path)
                message = schema.ErrorMessage.model_validate_json(answer.content)
                assert answer.status_code == 404
                assert message.detail == "no map has been received yet on the twin's map_topic"
            put_map(running, CELLS, Pose())
            running.peer.observe(scan("1", {"temperature": 20.0}, at=(0.1, 0.1)))
            running.tag("1")
            first = first or {path: running.get(path) for path in paths}
            has = {path: {"If-None-Match": first[path].headers["etag"]} for path in paths}
            again = {path: running.get(path, has[path]) for path in paths}
    for path in paths:
        assert again[path].content == first[path].content, "the same thing"
        assert again[path].status_code == 200, "under another tag"


FREE, OCCUPIED = 236, 70


def map_of(rows: Sequence[Sequence[int]], yaw: float = 0.0) -> OccupancyMap:
    """A map from its rows, the first at the origin."""
    return OccupancyMap(
        frame_id="map",
        stamp_ns=12_000_000_034,
        width=len(rows[0]) if rows else 0,
        height=len(rows),
        resolution=0.05,
        origin_x=-4.0,
        origin_y=1.5,
        origin_yaw=yaw,
        cells=np.array([cell for row in rows for cell in row], dtype=np.int8),
        revision=1,
    )


ROWS = st.tuples(st.integers(1, 5), st.integers(1, 5)).flatmap(
    lambda shape: st.lists(
        st.lists(st.integers(-128, 127), min_size=shape[0], max_size=shape[0]),
        min_size=shape[1],
        max_size=shape[1],
    )
)


@given(ROWS)
@settings(max_examples=100)
def test_every_pixel_is_the_grey_of_its_cell(rows: list[list[int]]) -> None:
    picture = decoded(map_png(map_of(rows)))
    assert picture.shape == (len(rows), len(rows[0]), 4)
    for row, cells in enumerate(rows):
        for column, occupancy in enumerate(cells):
            red, green, blue, alpha = picture[len(rows) - 1 - row, column].tolist()
            if not 0 <= occupancy <= 100:
                assert alpha == 0
                continue
            exact = FREE + (OCCUPIED - FREE) * occupancy / 100
            assert (red == green == blue, alpha) == (True, 255)
            assert abs(red - exact) <= 0.5


@pytest.mark.parametrize("rows", [[], [[]], [[], []]])
def test_a_map_without_a_cell_is_one_transparent_pixel(rows: list[list[int]]) -> None:
    assert decoded(map_png(map_of(rows))).tolist() == [[[0, 0, 0, 0]]]


@pytest.mark.parametrize("yaw", [0.0, 0.5, -math.pi / 2, math.pi])
def test_json_has_the_position_of_the_map(yaw: float) -> None:
    text = map_json(map_of([[0, 0, -1], [0, 100, 0]], yaw))
    grid = schema.OccupancyGrid.model_validate_json(text, strict=True)
    assert grid.header == schema.Header(stamp=schema.Time(sec=12, nanosec=34), frame_id="map")
    assert (grid.info.width, grid.info.height, grid.info.resolution) == (3, 2, 0.05)
    origin = grid.info.origin
    assert (origin.position.x, origin.position.y, origin.position.z) == (-4.0, 1.5, 0.0)
    turn = origin.orientation
    assert None not in (turn.z, turn.w)
    assert (turn.x, turn.y) == (0.0, 0.0)
    assert 2 * math.atan2(turn.z or 0.0, turn.w or 0.0) == pytest.approx(yaw)
