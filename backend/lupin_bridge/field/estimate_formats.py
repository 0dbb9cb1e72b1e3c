"""An estimate as JSON, PNG or NPY. Pure; a large one takes tenths of a second: on a worker."""

from __future__ import annotations

import io
import math
from dataclasses import replace
from typing import Any

import numpy as np
import orjson

from lupin_bridge.field import formats
from lupin_bridge.field.formats import NPY, PNG, FieldFormat
from lupin_bridge.judge.ranges import Sensor, Sensors
from lupin_twin.estimate import SDS_OF_IDEAL
from lupin_twin.estimates import Estimate
from lupin_twin.grid import FieldGrid


def metadata(estimate: Estimate, sensor: Sensor) -> dict[str, str]:
    """What a picture or a bare array cannot say of itself: extent, unit, what counts as known."""
    grid = estimate.grid
    return {
        **formats.extent(grid, sensor),
        "Sd-Known": str(np.float32(grid.sd_known)),
        "Sample-Count": str(estimate.sample_count),
        "Reading-Count": str(estimate.reading_count),
    }


def within_ideal(estimate: Estimate, sensor: Sensor) -> Estimate:
    """The estimate, known only where its interval for 9 of 10 is about half of the ideal range."""
    spans = [ranges.ideal for ranges in (sensor.day, sensor.night) if ranges.ideal is not None]
    limit = min((span.high - span.low for span in spans), default=math.inf) / SDS_OF_IDEAL
    grid = estimate.grid
    if not limit < grid.sd_known:
        return estimate
    return replace(estimate, grid=replace(grid, sd_known=limit, known=grid.sd < limit))


def write(
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
        return formats.write_png(picture(estimate, layer), sensor_type, sensors, scale)
    return write_npy(estimate) if field_format == NPY else write_json(estimate)


def write_json(estimate: Estimate) -> bytes:
    """`estimate_schema.GetEstimateResponse`: `mean` and `sd` flat and row-major."""
    grid = estimate.grid
    rest = orjson.dumps(
        {
            "width": grid.width,
            "height": grid.height,
            "origin_x": np.float32(grid.origin_x),
            "origin_y": np.float32(grid.origin_y),
            "resolution_used": np.float32(grid.resolution),
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
            *formats.numbers(grid.mean),
            b'],"sd":[',
            *formats.numbers(grid.sd),
            b"],",
            rest[1:],
        )
    )


def refusal_json(reason: str) -> bytes:
    """GetEstimate's failure body: the reason, and every other field zeroed."""
    empty: dict[str, Any] = {
        "ok": False,
        "error_message": reason,
        "mean": [],
        "sd": [],
        "width": 0,
        "height": 0,
        "origin_x": 0.0,
        "origin_y": 0.0,
        "resolution_used": 0.0,
        "sd_known": 0.0,
        "sample_count": 0,
        "reading_count": 0,
    }
    return orjson.dumps(empty)


def write_npy(estimate: Estimate) -> bytes:
    """NumPy's own format, float32 (2, height, width): mean and sd, row 0 at `bbox_min_y`."""
    buffer = io.BytesIO()
    both = np.stack((estimate.grid.mean, estimate.grid.sd))
    np.lib.format.write_array(buffer, both, allow_pickle=False)
    return buffer.getvalue()


def picture(estimate: Estimate, layer: str) -> FieldGrid:
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
