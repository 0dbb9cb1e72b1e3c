"""The formats of a field, of an estimate and of the map, decoded and compared with the cells."""

import io
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import count
from typing import Literal

import httpx
import numpy as np
import numpy.typing as npt
import pytest
from geometry_msgs.msg import Point, Pose
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from lupin_bridge import field as formats
from lupin_bridge.field import PNG, EstimateQuery, FieldFormat, rgb
from lupin_bridge.judge.judging import own_sensors
from lupin_bridge.judge.quantities import Ranges, Span
from lupin_bridge.routes.status import map_json, map_png
from lupin_bridge.stream import schema
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.field.grid import FieldGrid
from tests.support.estimates import an_estimate
from tests.support.messages import occupancy_grid, scan
from tests.support.web import Bridge, bridge

SENSORS = own_sensors()
TEMPERATURE_RGB = rgb(8, 72, 50)
ALPHA_MAX = 153  # 60 % of 255


def grid_of(rows: list[list[float]], origin: tuple[float, float] = (0.0, 0.0)) -> FieldGrid:
    """A grid from its rows, the first at the smallest y."""
    values = np.array(rows, dtype=np.float32)
    known = values[np.isfinite(values)]
    return FieldGrid(
        width=values.shape[1],
        height=values.shape[0],
        origin_x=origin[0],
        origin_y=origin[1],
        resolution=float(np.float32(0.1)),
        values=values.ravel(),
        value_min=float(known.min()) if known.size else 0.0,
        value_max=float(known.max()) if known.size else 0.0,
        sample_count=int(known.size),
    )


def decoded(png: bytes) -> npt.NDArray[np.uint8]:
    """A picture as RGBA (height, width, 4), its first row on top."""
    with Image.open(io.BytesIO(png)) as image:
        return np.asarray(image.convert("RGBA"))


ROWS = [[10.0, math.nan, 20.0], [12.5, 15.0, 30.0]]
GRID = grid_of(ROWS, origin=(-1.25, 2.5))


@pytest.mark.parametrize(
    ("hue", "saturation", "lightness", "red_green_blue"),
    [  # worked examples of CSS Color 4, section 7
        (0, 100, 50, (255, 0, 0)),
        (120, 100, 25, (0, 128, 0)),
        (240, 100, 50, (0, 0, 255)),
        (30, 50, 50, (191, 128, 64)),
        (200, 0, 40, (102, 102, 102)),
    ],
)
def test_a_colour_is_the_one_that_a_browser_shows(
    hue: float, saturation: float, lightness: float, red_green_blue: tuple[int, int, int]
) -> None:
    assert rgb(hue, saturation, lightness) == red_green_blue


def test_json_has_null_for_what_is_not_finite_and_a_large_field_is_written_in_parts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    text = formats.write_json(GRID)
    body = json.loads(text, parse_constant=pytest.fail)
    assert body["values"] == [10.0, None, 20.0, 12.5, 15.0, 30.0]
    assert (body["origin_x"], body["origin_y"]) == (-1.25, 2.5)
    assert b'"resolution_used":0.1,' in text
    assert (body["value_min"], body["value_max"], body["sample_count"]) == (10.0, 30.0, 5)
    whole = formats.write_json(GRID)
    monkeypatch.setattr(formats, "AT_ONCE", 4)
    assert formats.write_json(GRID) == whole
    parts = list(formats.numbers(GRID.values))
    assert parts == [b"10.0,null,20.0,12.5", b",", b"15.0,30.0"]


@pytest.mark.parametrize("scale", [1, 3])
@pytest.mark.parametrize(
    "rows",
    [
        ROWS,
        [[7.0, 7.0]],  # one value everywhere
        [[math.nan, math.nan]],
        [[-3e38, 2e38, 3e38]],  # the span exceeds float32
        [[0.0, 1.4e-45, 4.2e-45]],  # its inverse does
    ],
)
def test_every_pixel_of_a_png_is_the_ramps(rows: list[list[float]], scale: int) -> None:
    grid = grid_of(rows)
    picture = decoded(formats.write_png(grid, "temperature", SENSORS, scale))
    assert picture.shape == (grid.height * scale, grid.width * scale, 4)
    span = grid.value_max - grid.value_min
    for row in range(grid.height):
        for column in range(grid.width):
            value = float(grid.values[row * grid.width + column])
            top = (grid.height - 1 - row) * scale
            cell = picture[top : top + scale, column * scale : (column + 1) * scale]
            red, green, blue, alpha = cell[0, 0].tolist()
            assert (cell == cell[0, 0]).all()
            if math.isnan(value):
                assert alpha == 0
                continue
            assert (red, green, blue) == TEMPERATURE_RGB
            exact = ALPHA_MAX * ((value - grid.value_min) / span if span else 1.0)
            # 255 steps over 153 levels: at most half a step and half a level off.
            assert abs(alpha - exact) <= 0.81


# The first five of six are known: standard deviations 0, 0.5, .. below 2.25.
ESTIMATE = an_estimate(width=3, height=2)


def written(field_format: FieldFormat, layer: Literal["mean", "sd"] = "mean") -> bytes:
    return formats.write_estimate(
        ESTIMATE, field_format, EstimateQuery("co2", layer=layer), SENSORS
    )


@pytest.mark.parametrize(("layer", "highest"), [("mean", 24.0), ("sd", 2.0)])
def test_a_picture_is_transparent_where_nothing_is_known(
    layer: Literal["mean", "sd"], highest: float
) -> None:
    field = formats.estimate_picture(ESTIMATE, layer)
    assert field.value_max == highest
    assert np.isnan(field.values).tolist() == [False] * 5 + [True]
    alpha = np.asarray(Image.open(io.BytesIO(written(PNG, layer))).convert("RGBA"))[..., 3]
    # Its top row has the greatest y.
    assert alpha[0, 2] == alpha[1, 0] == 0
    assert alpha[1, 1] < alpha[1, 2] < alpha[0, 0] < alpha[0, 1]
    nothing = formats.estimate_picture(an_estimate(2, 2, sd_known=0.0), layer)
    assert (nothing.value_min, nothing.value_max) == (0.0, 0.0)
    assert np.isnan(nothing.values).all()


def test_an_estimate_is_known_where_it_is_certain_to_a_part_of_the_narrowest_ideal_range() -> None:
    sensor = replace(
        SENSORS.named("ph"), ideal=Span(20.0, 60.0), night=Ranges(ideal=Span(20.0, 26.0))
    )
    found = formats.within_ideal(ESTIMATE, sensor).grid
    assert found.sd_known == 1.0
    assert found.known.ravel().tolist() == [True, True, False, False, False, False]
    for other in (replace(sensor, night=None), SENSORS.named("ph")):
        assert formats.within_ideal(ESTIMATE, other) is ESTIMATE


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


SHAPES = st.tuples(st.integers(1, 5), st.integers(1, 5)).flatmap(
    lambda shape: st.lists(
        st.lists(st.integers(-128, 127), min_size=shape[0], max_size=shape[0]),
        min_size=shape[1],
        max_size=shape[1],
    )
)


@given(SHAPES)
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
