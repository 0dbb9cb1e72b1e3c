"""Fields and estimates: their query parameters, and their output as JSON, PNG or NPY. Pure.

Write them on a worker: large ones take a while.
"""

from __future__ import annotations

import colorsys
import io
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, Literal
from urllib.parse import quote

import numpy as np
import numpy.typing as npt
import orjson
from annotated_types import Gt, Interval

from lupin_bridge.judge.quantities import Sensor, Sensors
from lupin_bridge.query_string import AT, Name, needed, parameter, safe_name
from lupin_twin.estimate.engine import Estimate
from lupin_twin.estimate.posterior import EstimateGrid
from lupin_twin.field.engine import (
    DEFAULT_RESOLUTION_M,
    FieldRefused,
    FieldRequest,
    default_request,
)
from lupin_twin.field.grid import FieldGrid


@dataclass(frozen=True, slots=True)
class FieldFormat:
    """One way to write a field: its route's suffix and its media type."""

    name: str
    media_type: str


JSON: Final = FieldFormat("json", "application/json")
PNG: Final = FieldFormat("png", "image/png")
NPY: Final = FieldFormat("npy", "application/x-npy")
FORMATS: Final = (JSON, PNG, NPY)


BOX_NAMES: Final = ("bbox_min_x", "bbox_min_y", "bbox_max_x", "bbox_max_y")
_BOX: Final = "m, map frame; default box: all pinned tags except those far off, and their reach"

Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class FieldQuery:
    """Query parameters of a field; `resolution` and box None: the server chooses."""

    sensor_type: Name = needed("name of a sensor, as in a reading")
    resolution: Annotated[float, Gt(0)] | None = parameter(
        f"side of a square cell, m; default: {DEFAULT_RESOLUTION_M}, which without a box is "
        "doubled until the field is small enough"
    )
    bbox_min_x: float | None = parameter(_BOX)
    bbox_min_y: float | None = parameter(_BOX)
    bbox_max_x: float | None = parameter(_BOX)
    bbox_max_y: float | None = parameter(_BOX)
    scale: Annotated[int, Interval(ge=1, le=1000)] = parameter(
        "PNG only: pixels per cell, along each side", 1
    )
    at: str | None = parameter(AT)

    @property
    def box(self) -> Box | None:
        """The box; None: not given.

        Raises:
            FieldRefused: only part of the box is given.

        """
        box = self.bbox_min_x, self.bbox_min_y, self.bbox_max_x, self.bbox_max_y
        missing = [name for name, value in zip(BOX_NAMES, box, strict=True) if value is None]
        if missing and len(missing) < len(box):
            raise FieldRefused(f"the box is incomplete: {', '.join(missing)} is missing")
        return None if missing else box  # type: ignore[return-value]  # all of it is there

    def request(self, default_box: Box, max_cells: int) -> FieldRequest:
        """The request for GetField; with neither box nor resolution, of at most `max_cells` cells.

        Raises:
            FieldRefused: see `box`.

        """
        box = self.box
        if box is None and self.resolution is None:
            return default_request(self.sensor_type, default_box, max_cells)
        resolution = DEFAULT_RESOLUTION_M if self.resolution is None else self.resolution
        return FieldRequest(self.sensor_type, resolution, *(box or default_box))


@dataclass(frozen=True, slots=True)
class EstimateQuery(FieldQuery):
    """Query parameters of an estimate: it has two numbers per cell, and a PNG shows one of them."""

    layer: Literal["mean", "sd"] = parameter(
        "PNG only: the number to draw; transparent where the estimate is not known", "mean"
    )


def check_scale(query: FieldQuery, field_format: FieldFormat, cells: int, max_cells: int) -> None:
    """Refuse a scale for other formats than PNG, and a PNG of more than `max_cells` pixels.

    Raises:
        FieldRefused: either of the two.

    """
    if query.scale == 1:
        return
    if field_format != PNG:
        raise FieldRefused(f"scale is {query.scale}, but only a PNG can be scaled")
    pixels = cells * query.scale**2
    if pixels > max_cells:
        raise FieldRefused(
            f"scale {query.scale} makes a picture of {pixels} pixels, the limit is {max_cells}"
        )


def negotiate(accept: str) -> FieldFormat:
    """The format of the first media type in an Accept header that has one; JSON if none has."""
    for name in listed(accept):
        for candidate in FORMATS:
            main_type = candidate.media_type.partition("/")[0]
            if name in {candidate.media_type, f"{main_type}/*", "*/*"}:
                return candidate
    return JSON


def listed(header: str) -> list[str]:
    """The items of an Accept header, in lower case and in its order, without their weights.

    Programs list what they prefer first, so weights would change nothing.
    """
    return [part.partition(";")[0].strip() for part in header.lower().split(",")]


def headers(metadata: Mapping[str, str], file_name: str, kind: str = "Field") -> dict[str, str]:
    """A field's metadata as `X-Field-…` headers, and a file name to save it under.

    Characters other than ASCII, and spaces at either end of a value, are percent-encoded.
    """
    result = {f"X-{kind}-{name}": _header_value(value) for name, value in metadata.items()}
    result["Content-Disposition"] = f'inline; filename="{safe_name(file_name)}"'
    return result


def _header_value(text: str) -> str:
    value = quote(text, safe=_SAFE)
    return _OUTER_SPACES.sub(lambda spaces: "%20" * len(spaces[0]), value)


_OUTER_SPACES: Final = re.compile(r"^ +| +$")
_SAFE: Final = " !#$&'()*+,-./:;<=>?@[]^_`{|}~"


# --- as bytes -------------------------------------------------------------------------------------


def rgb(hue: float, saturation: float, lightness: float) -> tuple[int, int, int]:
    """HSL (degrees, percent, percent) to RGB, 0 to 255 per channel (CSS Color 4, section 7)."""
    channels = colorsys.hls_to_rgb(hue / 360, lightness / 100, saturation / 100)
    red, green, blue = (round(channel * 255) for channel in channels)
    return red, green, blue


# Palette index 0 is "not known"; the ramp has the other 255.
_RAMP_STEPS: Final = 255
# Numbers per call of orjson, about a millisecond: no other thread of this process runs meanwhile.
AT_ONCE: Final = 16_384


def extent(grid: FieldGrid | EstimateGrid, sensor: Sensor) -> dict[str, str]:
    """The sensor of the cells, and the grid's size, origin and resolution."""
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
    """What the cells of a PNG or NPY do not show: sensor, unit, extent, range of values."""
    return {
        **extent(grid, sensor),
        "Value-Min": str(np.float32(grid.value_min)),
        "Value-Max": str(np.float32(grid.value_max)),
        "Sample-Count": str(grid.sample_count),
    }


def write(
    grid: FieldGrid, field_format: FieldFormat, sensor_type: str, sensors: Sensors, scale: int = 1
) -> bytes:
    """The field in a format. `scale` (PNG only) is the side of a cell in pixels.

    NPY is NumPy's own format, float32 (height, width), row 0 at `bbox_min_y`, NaN as it is.
    """
    if field_format == PNG:
        return write_png(grid, sensor_type, sensors, scale)
    return _npy(_rows(grid)) if field_format == NPY else write_json(grid)


def write_json(grid: FieldGrid) -> bytes:
    """The field as JSON of `schema.GetFieldResponse`."""
    return _json(
        grid,
        {"values": grid.values},
        value_min=np.float32(grid.value_min),
        value_max=np.float32(grid.value_max),
        sample_count=grid.sample_count,
    )


def _json(
    grid: FieldGrid | EstimateGrid, arrays: Mapping[str, npt.NDArray[np.float32]], **rest: Any
) -> bytes:
    """A service's response, its arrays flat and row-major, NaN as null."""
    # float32, as in the services: orjson then writes the shortest decimal of each, such as 0.1.
    fields = {
        "width": grid.width,
        "height": grid.height,
        "origin_x": np.float32(grid.origin_x),
        "origin_y": np.float32(grid.origin_y),
        "resolution_used": np.float32(grid.resolution),
        **rest,
    }
    parts = [b'{"ok":true,"error_message":""']
    for name, cells in arrays.items():
        parts += (b',"%b":[' % name.encode(), *numbers(cells), b"]")
    parts += (b",", orjson.dumps(fields, option=orjson.OPT_SERIALIZE_NUMPY)[1:])
    # Joined once: copying thirty megabytes takes a while.
    return b"".join(parts)


def numbers(cells: npt.NDArray[np.float32]) -> Iterator[bytes]:
    """Yield an array's numbers as JSON in parts, row-major, without the brackets; NaN is null."""
    flat = np.ascontiguousarray(cells).ravel()
    for start in range(0, flat.size, AT_ONCE):
        part = flat[start : start + AT_ONCE]
        if start:
            yield b","
        yield orjson.dumps(part, option=orjson.OPT_SERIALIZE_NUMPY)[1:-1]


_ZEROED: Final[Mapping[Any, Any]] = {int: 0, float: 0.0}


def refusal_json(service: Any, reason: str) -> bytes:
    """The failure response of a service (a type of `schema`): the reason; all else is zero."""
    fields = service.model_fields.items()
    zeroed = {name: _ZEROED.get(field.annotation, []) for name, field in fields}
    return orjson.dumps({**zeroed, "ok": False, "error_message": reason})


def _npy(array: npt.NDArray[np.float32]) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, array, allow_pickle=False)
    return buffer.getvalue()


def write_png(grid: FieldGrid, sensor_type: str, sensors: Sensors, scale: int = 1) -> bytes:
    """A PNG with cells of `scale` by `scale` pixels, top row at `bbox_max_y`; NaN is transparent.

    It has one hue; alpha rises from 0 at `value_min` to `max_alpha` at `value_max`. A palette with
    transparency holds this exactly, in a fifth of RGBA's time (PNG, third edition, 11.3.2).
    """
    # The process that reads the past makes no pictures, and does not load Pillow.
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
        # In float64: the span of two float32 values, or its inverse, may overflow float32.
        steps = np.subtract(values, grid.value_min, dtype=np.float64)
        steps *= (_RAMP_STEPS - 1) / span
        np.rint(steps, out=steps)
    else:
        # A single value is both minimum and maximum: draw it as the maximum.
        steps = np.full(values.shape, _RAMP_STEPS - 1.0)
    steps += 1
    return np.where(np.isfinite(values), steps, 0).astype(np.uint8)


def estimate_metadata(estimate: Estimate, sensor: Sensor) -> dict[str, str]:
    """What the cells of a PNG or NPY do not show: extent, unit, the sd below which one is known."""
    grid = estimate.grid
    return {
        **extent(grid, sensor),
        "Sd-Known": str(np.float32(grid.sd_known)),
        "Sample-Count": str(estimate.sample_count),
        "Reading-Count": str(estimate.reading_count),
    }


# A cell is known if the ideal range is wider than this many sds: its 90 % interval is about half.
_SDS_OF_IDEAL: Final = 6.0


def within_ideal(estimate: Estimate, sensor: Sensor) -> Estimate:
    """The estimate, known only where its 90 % interval is at most about half the ideal range."""
    spans = [sensor.by(is_day=is_day).ideal for is_day in (True, False)]
    limit = min((it.width for it in spans if it is not None), default=math.inf) / _SDS_OF_IDEAL
    grid = estimate.grid
    if not limit < grid.sd_known:
        return estimate
    return replace(estimate, grid=replace(grid, sd_known=limit, known=grid.sd < limit))


def write_estimate(
    estimate: Estimate, field_format: FieldFormat, query: EstimateQuery, sensors: Sensors
) -> bytes:
    """The estimate in a format; NPY and JSON (`followers.GetEstimateResponse`) have both numbers.

    NPY is float32 (2, height, width): mean and sd, row 0 at `bbox_min_y`.
    """
    if field_format == PNG:
        picture = estimate_picture(estimate, query.layer)
        return write_png(picture, query.sensor_type, sensors, query.scale)
    grid = estimate.grid
    if field_format == NPY:
        return _npy(np.stack((grid.mean, grid.sd)))
    return _json(
        grid,
        {"mean": grid.mean, "sd": grid.sd},
        sd_known=np.float32(grid.sd_known),
        sample_count=estimate.sample_count,
        reading_count=estimate.reading_count,
    )


def estimate_picture(estimate: Estimate, layer: str) -> FieldGrid:
    """A layer of the estimate (mean or sd) as a field, NaN where the estimate is not known."""
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
