"""The three formats of a field: decoded again and compared with the grid, cell by cell."""

import io
import json
import math

import numpy as np
import numpy.typing as npt
import orjson
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from PIL import Image

from lupin_bridge import field as field_formats
from lupin_bridge.field import FORMATS, JSON, NPY, PNG, rgb
from lupin_bridge.judge.judging import own_sensors
from lupin_bridge.stream import schema
from lupin_twin.field.grid import FieldGrid

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

GRIDS = st.tuples(st.integers(1, 6), st.integers(1, 6)).flatmap(
    lambda shape: st.lists(
        st.lists(
            st.one_of(
                st.just(math.nan), st.floats(width=32, allow_nan=False, allow_infinity=False)
            ),
            min_size=shape[0],
            max_size=shape[0],
        ),
        min_size=shape[1],
        max_size=shape[1],
    ).map(grid_of)
)


# --- JSON ---------------------------------------------------------------------------------------


@given(GRIDS)
@settings(max_examples=150)
def test_json_carries_every_value_with_null_for_nan(grid: FieldGrid) -> None:
    text = field_formats.write_json(grid)
    response = schema.GetFieldResponse.model_validate_json(text, strict=True)
    assert (response.ok, response.error_message) == (True, "")
    assert (response.width, response.height) == (grid.width, grid.height)
    assert [None if math.isnan(v) else v for v in grid.values.tolist()] == [
        None if v is None else float(np.float32(v)) for v in response.values
    ]
    assert np.float32(response.value_min) == np.float32(grid.value_min)
    assert np.float32(response.value_max) == np.float32(grid.value_max)


def test_json_has_no_number_that_json_does_not_know_and_short_decimals() -> None:
    text = field_formats.write_json(GRID)
    body = json.loads(text, parse_constant=pytest.fail)
    assert body["values"] == [10.0, None, 20.0, 12.5, 15.0, 30.0]
    assert (body["origin_x"], body["origin_y"]) == (-1.25, 2.5)
    assert b'"resolution_used":0.1,' in text
    assert (body["value_min"], body["value_max"], body["sample_count"]) == (10.0, 30.0, 5)


def test_a_large_field_is_written_in_parts_that_are_one_list(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = field_formats.write_json(GRID)
    monkeypatch.setattr(field_formats, "_AT_ONCE", 4)
    assert field_formats.write_json(GRID) == whole
    parts = list(field_formats.numbers(GRID.values))
    assert parts == [b"10.0,null,20.0,12.5", b",", b"15.0,30.0"]


def test_a_refusal_is_get_fields_failure_body() -> None:
    refused = schema.GetFieldResponse.model_validate_json(field_formats.refusal_json('no "x"'))
    assert (refused.ok, refused.error_message) == (False, 'no "x"')
    rest = refused.model_dump(exclude={"ok", "error_message", "values"})
    assert rest == dict.fromkeys(rest, 0)
    assert refused.values == []
    assert list(orjson.loads(field_formats.refusal_json(""))) == list(
        orjson.loads(field_formats.write_json(GRID))
    )


# --- NPY ----------------------------------------------------------------------------------------


@given(GRIDS)
@settings(max_examples=50)
def test_npy_is_the_array_itself(grid: FieldGrid) -> None:
    array = np.load(io.BytesIO(field_formats.write_npy(grid)), allow_pickle=False)
    assert (array.dtype, array.shape) == (np.dtype("<f4"), (grid.height, grid.width))
    assert array.ravel().tobytes() == grid.values.tobytes()


def test_row_0_of_npy_lies_at_the_smallest_y() -> None:
    array = np.load(io.BytesIO(field_formats.write_npy(GRID)))
    np.testing.assert_array_equal(array, np.array(ROWS, dtype=np.float32))


# --- PNG ----------------------------------------------------------------------------------------


@given(GRIDS, st.integers(1, 3))
@example(grid_of([[-3e38, 2e38, 3e38]]), 1)  # the span is past float32
@example(grid_of([[0.0, 1.4e-45, 4.2e-45]]), 1)  # its inverse is
@settings(max_examples=200)
def test_every_pixel_of_a_png_is_the_ramps(grid: FieldGrid, scale: int) -> None:
    picture = decoded(field_formats.write_png(grid, "temperature", SENSORS, scale))
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


def test_the_top_row_of_a_png_lies_at_the_largest_y() -> None:
    alphas = decoded(field_formats.write_png(GRID, "temperature", SENSORS))[:, :, 3]
    bottom = [0, 0, ALPHA_MAX / 2]  # 10 is the minimum, NaN is transparent, 20 is half-way
    top = [ALPHA_MAX / 8, ALPHA_MAX / 4, ALPHA_MAX]
    np.testing.assert_allclose(alphas.astype(float), [top, bottom], atol=0.81)


def test_one_value_everywhere_is_shown_and_no_value_anywhere_is_not() -> None:
    one = decoded(field_formats.write_png(grid_of([[7.0, 7.0]]), "co2", SENSORS))
    assert one[:, :, 3].tolist() == [[ALPHA_MAX, ALPHA_MAX]]
    none = decoded(field_formats.write_png(grid_of([[math.nan, math.nan]]), "co2", SENSORS))
    assert none[:, :, 3].tolist() == [[0, 0]]


def test_a_png_says_what_it_shows() -> None:
    with Image.open(io.BytesIO(field_formats.write_png(GRID, "temperature", SENSORS, 2))) as image:
        image.load()
        assert image.size == (6, 4)
        assert image.text == {  # type: ignore[attr-defined]  # Pillow's PngImageFile
            "Sensor": "temperature",
            "Unit": "°C",
            "Width": "3",
            "Height": "2",
            "Origin-X": "-1.25",
            "Origin-Y": "2.5",
            "Resolution": "0.1",
            "Value-Min": "10.0",
            "Value-Max": "30.0",
            "Sample-Count": "5",
        }


# --- all ----------------------------------------------------------------------------------------


def test_write_goes_by_the_format() -> None:
    assert field_formats.write(GRID, JSON, "co2", SENSORS) == field_formats.write_json(GRID)
    assert field_formats.write(GRID, NPY, "co2", SENSORS) == field_formats.write_npy(GRID)
    picture = field_formats.write_png(GRID, "co2", SENSORS, 3)
    assert field_formats.write(GRID, PNG, "co2", SENSORS, 3) == picture
    assert [known.media_type for known in FORMATS] == [
        "application/json",
        "image/png",
        "application/x-npy",
    ]
