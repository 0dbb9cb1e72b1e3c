"""What an honest map also shows: how far off it is, and how much of it is known.

The error is the leave-one-out error (cross-validation as in Davis, "Contouring algorithms", 1975):
each tag's reading is predicted from the other tags' by the field's own rules, and compared with
what was measured.

Pure: numpy, the store's types and the field's rules. Metres in the map frame; errors are in the
sensor's own unit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from lupin_twin.core.state import TagState, samples_of
from lupin_twin.field.grid import FieldGrid, FloatArray
from lupin_twin.field.idw import (
    Abandoned,
    IndexArray,
    PairwiseIdw,
    fits,
    gap_squares,
    never,
    sample_columns,
)


@dataclass(frozen=True, slots=True)
class TagError:
    """One tag's reading against what the others say; `error` is `predicted - measured`."""

    tag_id: str
    measured: float
    predicted: float
    error: float


@dataclass(frozen=True, slots=True)
class FieldQuality:
    """The leave-one-out error of a sensor's current readings.

    `judged` tags have another one in reach of the gate; `unjudged` have none, so nothing can be
    said about them. `rmse` and `worst` are None where no tag is judged; of equally bad tags the
    worst is the first.
    """

    sensor_type: str
    judged: int
    unjudged: int
    rmse: float | None
    worst: TagError | None


def leave_one_out(
    tags: Iterable[TagState],
    sensor_type: str,
    *,
    falloff_radius_m: float,
    max_distance_m: float,
    power: float,
    should_stop: Callable[[], bool] = never,
) -> FieldQuality:
    """The quality of the field of `sensor_type` made of `tags` (a snapshot's) by these rules.

    Only tags with a pose and a finite reading take part, as in the field. The cost follows the
    pairs of tags in reach of each other. `should_stop()` is called every millisecond or so.

    Raises:
        ValueError: a rule out of its range, named with its value and the limit.
        Abandoned: `should_stop` was true.

    """
    tag_ids: list[str] = []
    samples: list[tuple[float, float, float]] = []
    for tag in tags:
        for sample in samples_of((tag,), sensor_type):
            tag_ids.append(tag.tag_id)
            samples.append(sample)
    x, y, measured = sample_columns(samples)
    idw = PairwiseIdw(falloff_radius_m=falloff_radius_m, max_distance_m=max_distance_m, power=power)
    predicted = _predictions(x, y, measured, idw, should_stop)
    judged = np.flatnonzero(~np.isnan(predicted))
    if judged.size == 0:
        return FieldQuality(sensor_type, judged=0, unjudged=len(samples), rmse=None, worst=None)
    errors = predicted[judged] - measured[judged]
    worst = int(np.abs(errors).argmax())
    index = int(judged[worst])
    return FieldQuality(
        sensor_type=sensor_type,
        judged=judged.size,
        unjudged=len(samples) - judged.size,
        rmse=math.hypot(*errors.tolist()) / math.sqrt(judged.size),
        worst=TagError(
            tag_id=tag_ids[index],
            measured=float(measured[index]),
            predicted=float(predicted[index]),
            error=float(errors[worst]),
        ),
    )


def painted_share(grid: FieldGrid) -> float:
    """The share of the grid's cells, 0 to 1, of which something is known."""
    return float(np.count_nonzero(~np.isnan(grid.values)) / grid.values.size)


def _predictions(
    x: FloatArray,
    y: FloatArray,
    value: FloatArray,
    idw: PairwiseIdw,
    should_stop: Callable[[], bool],
) -> FloatArray:
    """Each sample's value from the others, NaN where none is in reach of the gate.

    The samples are halved along the longer side of their box, again and again, until those of a
    part and those that reach it make few enough pairs.
    """
    predicted = np.full(value.size, np.nan)
    everyone = np.arange(value.size)
    parts = [(everyone, everyone)] if value.size else []
    with np.errstate(all="ignore"):
        while parts:
            if should_stop():
                raise Abandoned
            part, near = parts.pop()
            gap = gap_squares(x[near], x[part]) + gap_squares(y[near], y[part])
            near = near[gap <= idw.reach_square]
            if fits(near.size, part.size):
                predicted[part] = _predict_part(part, near, (x, y, value), idw)
                continue
            along = x[part] if np.ptp(x[part]) > np.ptp(y[part]) else y[part]
            order = part[np.argsort(along, kind="stable")]
            parts.append((order[: part.size // 2], near))
            parts.append((order[part.size // 2 :], near))
    return predicted


def _predict_part(
    part: IndexArray,
    near: IndexArray,
    samples: tuple[FloatArray, FloatArray, FloatArray],
    idw: PairwiseIdw,
) -> FloatArray:
    x, y, value = samples
    square = idw.squares(near.size, part.size)
    gap = x[near][:, None] - x[part]
    np.square(gap, out=square)
    np.subtract(y[near][:, None], y[part], out=gap)
    np.square(gap, out=gap)
    np.add(square, gap, out=square)
    # A sample has no say about itself. `near` is in recorded order and holds all of `part`.
    square[np.searchsorted(near, part), np.arange(part.size)] = np.inf
    return idw.evaluate(square, value[near])
