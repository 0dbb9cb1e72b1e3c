"""Fields and estimates as JSON, PNG or NPY. Pure; on a worker, for large ones take a while."""

from __future__ import annotations

import colorsys
import io
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import orjson

from lupin_bridge.judge.quantities import Sensor, Sensors
from lupin_twin.core.state import TagState
from lupin_twin.estimate.engine import Estimate
from lupin_twin.estimate.posterior import EstimateGrid
from lupin_twin.field.engine import FieldRules, leave_one_out, painted_share
from lupin_twin.field.grid import FieldGrid, far_off_tags
from lupin_twin.field.idw import never


def rgb(hue: float, saturation: float, lightness: float) -> tuple[int, int, int]:
    """A colour of degrees, percent, percent as 0 to 255 a channel (CSS Color 4, section 7)."""
    channels = colorsys.hls_to_rgb(hue / 360, lightness / 100, saturation / 100)
    red, green, blue = (round(channel * 255) for channel in channels)
    return red, green, blue


# Palette index 0 is "not known"; the ramp has the other 255.
_RAMP_STEPS: Final = 255
# Numbers that are written at once: for this millisecond, no other thread of this process runs.
_AT_ONCE: Final = 16_384


@dataclass(frozen=True, slots=True)
class FieldFormat:
    """One way to write a field: its route's suffix and its media type."""

    name: str
    media_type: str


JSON: Final = FieldFormat("json", "application/json")
PNG: Final = FieldFormat("png", "image/png")
NPY: Final = FieldFormat("npy", "application/x-npy")
FORMATS: Final = (JSON, PNG, NPY)


def extent(grid: FieldGrid | EstimateGrid, sensor: Sensor) -> dict[str, str]:
    """Of which sensor the cells are, how many, and where they lie."""
    return {
        "Sensor": sensor.name,
        "Unit": sensor.unit,
        "Width": str(grid.width),
        "Height": str(grid.height),
        "Origin-X": str(np.float32(grid.origin_x)),
        "Origin-Y": str(np.float32(grid.origin_y)),
        "Resolution": str(np.float32(grid.resolution)),
    }


def metadata(grid: FieldGrid, sensor: Sensor) -> dict[str, str]:
    """What a picture or a bare array cannot say of itself: extent, range, unit, sensor."""
    return {
        **extent(grid, sensor),
        "Value-Min": str(np.float32(grid.value_min)),
        "Value-Max": str(np.float32(grid.value_max)),
        "Sample-Count": str(grid.sample_count),
    }


def far_off(tags: Sequence[str]) -> dict[str, str]:
    """How many tags a default box leaves out; in headers alone, for no picture is made of it."""
    return {"Far-Off-Count": str(len(tags))}


def write(
    grid: FieldGrid, field_format: FieldFormat, sensor_type: str, sensors: Sensors, scale: int = 1
) -> bytes:
    """The field in a format. `scale` (PNG only) is the side of a cell in pixels."""
    if field_format == PNG:
        return write_png(grid, sensor_type, sensors, scale)
    return write_npy(grid) if field_format == NPY else write_json(grid)


def write_json(grid: FieldGrid) -> bytes:
    """`schema.GetFieldResponse`: `values` flat and row-major, NaN as null."""
    rest = orjson.dumps(
        {
            **_place(grid),
            "value_min": np.float32(grid.value_min),
            "value_max": np.float32(grid.value_max),
            "sample_count": grid.sample_count,
        },
        option=orjson.OPT_SERIALIZE_NUMPY,
    )
    # Put together once: to copy thirty megabytes takes a while too.
    return b"".join(
        (b'{"ok":true,"error_message":"","values":[', *numbers(grid.values), b"],", rest[1:])
    )


def _place(grid: FieldGrid | EstimateGrid) -> dict[str, Any]:
    """As in the services' float32, and so the shortest decimals that are the same one: 0.1."""
    return {
        "width": grid.width,
        "height": grid.height,
        "origin_x": np.float32(grid.origin_x),
        "origin_y": np.float32(grid.origin_y),
        "resolution_used": np.float32(grid.resolution),
    }


def numbers(cells: npt.NDArray[np.float32]) -> Iterator[bytes]:
    """The numbers of an array as JSON, row-major, without the brackets, in parts; NaN as null."""
    flat = np.ascontiguousarray(cells).ravel()
    for start in range(0, flat.size, _AT_ONCE):
        part = flat[start : start + _AT_ONCE]
        if start:
            yield b","
        yield orjson.dumps(part, option=orjson.OPT_SERIALIZE_NUMPY)[1:-1]


def write_quality(
    grid: FieldGrid,
    tags: Sequence[TagState],
    sensor: Sensor,
    rules: FieldRules,
    should_stop: Callable[[], bool] = never,
) -> bytes:
    """`schema.FieldQuality` of a field and of the tags that it was made from.

    Raises:
        lupin_twin.field.idw.Abandoned: `should_stop`, called now and then, returned true.

    """
    quality = leave_one_out(
        tags,
        sensor.name,
        falloff_radius_m=rules.falloff_radius_m,
        max_distance_m=rules.max_distance_m,
        power=rules.idw_power,
        should_stop=should_stop,
    )
    return orjson.dumps(
        {
            "sensor_type": sensor.name,
            "unit": sensor.unit,
            "sample_count": quality.judged + quality.unjudged,
            "judged_count": quality.judged,
            "rmse": quality.rmse,
            "worst": quality.worst,
            "painted_share": painted_share(grid),
            "far_off_tags": far_off_tags(tags),
        }
    )


def refusal_json(reason: str) -> bytes:
    """GetField's failure body: the reason, and every other field zeroed."""
    return _refusal(reason, ("values",), ("value_min", "value_max"), ("sample_count",))


def _refusal(
    reason: str, cells: Iterable[str], numbers: Iterable[str], counts: Iterable[str]
) -> bytes:
    return orjson.dumps(
        {
            "ok": False,
            "error_message": reason,
            **{name: [] for name in cells},
            **dict.fromkeys(("width", "height"), 0),
            **dict.fromkeys(("origin_x", "origin_y", "resolution_used", *numbers), 0.0),
            **dict.fromkeys(counts, 0),
        }
    )


def write_npy(grid: FieldGrid) -> bytes:
    """NumPy's own format, float32 (height, width), row 0 at `bbox_min_y`, NaN as it is."""
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, _rows(grid), allow_pickle=False)
    return buffer.getvalue()


def write_png(grid: FieldGrid, sensor_type: str, sensors: Sensors, scale: int = 1) -> bytes:
    """A picture of `scale` pixels a cell, its top row at `bbox_max_y`; NaN is transparent.

    One hue, alpha rising from 0 at `value_min` to `max_alpha` at `value_max`: a palette and its
    transparency lose nothing of that, and take a fifth of RGBA's time (PNG, third edition, 11.3.2).
    """
    # What only looks back, in a process of its own, makes no pictures, and need not hold Pillow.
    from PIL import Image  # noqa: PLC0415
    from PIL.PngImagePlugin import PngInfo  # noqa: PLC0415

    indices = np.flipud(_palette_indices(grid))
    if scale > 1:
        indices = indices.repeat(scale, axis=0).repeat(scale, axis=1)
    image = Image.fromarray(np.ascontiguousarray(indices), mode="P")
    sensor = sensors.named(sensor_type)
    colour = rgb(sensor.hue, sensors.saturation, sensor.lightness)
    image.putpalette(list(colour) * (_RAMP_STEPS + 1))
    alphas = np.rint(np.linspace(0.0, sensors.max_alpha * 255, _RAMP_STEPS)).astype(np.uint8)
    text = PngInfo()
    for name, value in metadata(grid, sensor).items():
        text.add_itxt(name, value)
    buffer = io.BytesIO()
    image.save(
        buffer,
        format="PNG",
        transparency=b"\x00" + alphas.tobytes(),
        pnginfo=text,
        compress_level=1,  # a third of the time of the default for a tenth more bytes
    )
    return buffer.getvalue()


def _rows(grid: FieldGrid) -> npt.NDArray[np.float32]:
    return grid.values.reshape(grid.height, grid.width)


def _palette_indices(grid: FieldGrid) -> npt.NDArray[np.uint8]:
    """0 where the value is not finite, else 1 (value_min) to 255 (value_max)."""
    values = _rows(grid)
    span = grid.value_max - grid.value_min
    if span > 0.0:
        # In float64: the span of two float32, or the inverse of it, may be past float32.
        steps = np.subtract(values, grid.value_min, dtype=np.float64)
        steps *= (_RAMP_STEPS - 1) / span
        np.rint(steps, out=steps)
    else:
        # One value everywhere is the maximum as much as the minimum: show it.
        steps = np.full(values.shape, _RAMP_STEPS - 1.0)
    steps += 1
    return np.where(np.isfinite(values), steps, 0).astype(np.uint8)


def estimate_metadata(estimate: Estimate, sensor: Sensor) -> dict[str, str]:
    """What a picture or a bare array cannot say of itself: extent, unit, the limit of known."""
    grid = estimate.grid
    return {
        **extent(grid, sensor),
        "Sd-Known": str(np.float32(grid.sd_known)),
        "Sample-Count": str(estimate.sample_count),
        "Reading-Count": str(estimate.reading_count),
    }


# The ideal range is so many sds wide where a place is known: an interval of 9 in 10 is half of it.
_SDS_OF_IDEAL: Final = 6.0


def within_ideal(estimate: Estimate, sensor: Sensor) -> Estimate:
    """The estimate, known only where its interval for 9 of 10 is about half of the ideal range."""
    spans = [ranges.ideal for ranges in (sensor.day, sensor.night) if ranges.ideal is not None]
    limit = min((span.high - span.low for span in spans), default=math.inf) / _SDS_OF_IDEAL
    grid = estimate.grid
    if not limit < grid.sd_known:
        return estimate
    return replace(estimate, grid=replace(grid, sd_known=limit, known=grid.sd < limit))


def write_estimate(
    estimate: Estimate,
    field_format: FieldFormat,
    sensor_type: str,
    sensors: Sensors,
    *,
    layer: str,
    scale: int = 1,
) -> bytes:
    """The estimate in a format; `layer` and `scale`, the side of a cell in pixels, are a PNG's."""
    if field_format == PNG:
        return write_png(estimate_picture(estimate, layer), sensor_type, sensors, scale)
    return write_estimate_npy(estimate) if field_format == NPY else write_estimate_json(estimate)


def write_estimate_json(estimate: Estimate) -> bytes:
    """`followers.GetEstimateResponse`: `mean` and `sd` flat and row-major."""
    grid = estimate.grid
    rest = orjson.dumps(
        {
            **_place(grid),
            "sd_known": np.float32(grid.sd_known),
            "sample_count": estimate.sample_count,
            "reading_count": estimate.reading_count,
        },
        option=orjson.OPT_SERIALIZE_NUMPY,
    )
    # Put together once: to copy twenty megabytes takes a while too.
    return b"".join(
        (
            b'{"ok":true,"error_message":"","mean":[',
            *numbers(grid.mean),
            b'],"sd":[',
            *numbers(grid.sd),
            b"],",
            rest[1:],
        )
    )


def estimate_refusal_json(reason: str) -> bytes:
    """GetEstimate's failure body: the reason, and every other field zeroed."""
    return _refusal(reason, ("mean", "sd"), ("sd_known",), ("sample_count", "reading_count"))


def write_estimate_npy(estimate: Estimate) -> bytes:
    """NumPy's own format, float32 (2, height, width): mean and sd, row 0 at `bbox_min_y`."""
    buffer = io.BytesIO()
    both = np.stack((estimate.grid.mean, estimate.grid.sd))
    np.lib.format.write_array(buffer, both, allow_pickle=False)
    return buffer.getvalue()


def estimate_picture(estimate: Estimate, layer: str) -> FieldGrid:
    """One of the two numbers as a field, NaN where the estimate is not known."""
    grid = estimate.grid
    cells = grid.mean if layer == "mean" else grid.sd
    values = np.where(grid.known, cells, np.float32(np.nan)).ravel()
    known = cells[grid.known]
    return FieldGrid(
        width=grid.width,
        height=grid.height,
        origin_x=grid.origin_x,
        origin_y=grid.origin_y,
        resolution=grid.resolution,
        values=values,
        value_min=float(known.min()) if known.size else 0.0,
        value_max=float(known.max()) if known.size else 0.0,
        sample_count=estimate.sample_count,
    )
