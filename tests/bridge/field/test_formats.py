"""The formats of a field and of an estimate, decoded and compared with the grid."""

import io
import json
import math
from dataclasses import replace
from typing import Literal

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from lupin_bridge import field as formats
from lupin_bridge.field import PNG, EstimateQuery, FieldFormat, rgb
from lupin_bridge.judge.judging import own_sensors
from lupin_bridge.judge.quantities import Ranges, Span
from lupin_twin.field.grid import FieldGrid
from tests.support.estimates import an_estimate

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
    monkeypatch.setattr(formats, "_AT_ONCE", 4)
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
    wide, narrow = (Ranges(ideal=Span(20.0, high)) for high in (60.0, 26.0))
    sensor = replace(SENSORS.named("ph"), day=wide, night=narrow)
    found = formats.within_ideal(ESTIMATE, sensor).grid
    assert found.sd_known == 1.0
    assert found.known.ravel().tolist() == [True, True, False, False, False, False]
    for other in (replace(sensor, night=wide), SENSORS.named("ph")):
        assert formats.within_ideal(ESTIMATE, other) is ESTIMATE
