"""GetField without ROS: request checks, clipping to explored ground, the cache, and the quality.

The quality of a field is its leave-one-out error (cross-validation as in Davis, "Contouring
algorithms", 1975). Each tag's reading is predicted from the other tags' by the field's own rules,
and compared with what was measured. Errors are in the sensor's own unit.

Pure. Metres in the map frame throughout.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from lupin_twin.core.drops import too_long
from lupin_twin.core.parameters import TwinParameters
from lupin_twin.core.state import TagState, samples_of
from lupin_twin.field.explored import OccupancyMap, explored_mask
from lupin_twin.field.grid import FieldGrid, FloatArray, grid_dimensions, reach_of
from lupin_twin.field.idw import (
    Abandoned,
    PairwiseIdw,
    compute_idw_field,
    never,
    sample_columns,
)

MAX_ENTRIES: Final = 64


# m, if a request gives none.
DEFAULT_RESOLUTION_M: Final = 0.1

# Rough worst-case cost of a field: for each cell, and for each pair of a cell and a sample that
# reaches it.
_CELL_S: Final = 20e-9
_PAIR_S: Final = 15e-9


class FieldRefused(ValueError):
    """A request is refused; the message names its field, the value and the limit."""


# The fields of a request, except for the sensor.
NUMBERS: Final = ("resolution", "bbox_min_x", "bbox_min_y", "bbox_max_x", "bbox_max_y")


@dataclass(frozen=True, slots=True)
class FieldRequest:
    """Request for a sensor's field over a box (m, map frame) in cells of `resolution` (m).

    The numbers are rounded to float32, GetField's wire type. So the same request over HTTP and over
    ROS compares equal, and has the same field.

    Raises:
        FieldRefused: float32 cannot hold a number.

    """

    sensor_type: str
    resolution: float
    bbox_min_x: float
    bbox_min_y: float
    bbox_max_x: float
    bbox_max_y: float

    def __post_init__(self) -> None:
        with np.errstate(over="ignore", under="ignore"):
            for name in NUMBERS:
                sent = getattr(self, name)
                rounded = float(np.float32(sent))
                object.__setattr__(self, name, rounded)
                is_lost = name == "resolution" and sent != 0.0 and rounded == 0.0
                if is_lost or math.isinf(rounded) > math.isinf(sent):
                    raise FieldRefused(
                        f"{name} is {sent} m, must fit into float32 (1.4e-45 to 3.4e38)"
                    )

    @property
    def cells(self) -> dict[str, float]:
        """The box and the resolution, m, as keyword arguments of `grid_dimensions` and the like."""
        return {name: getattr(self, name) for name in NUMBERS}


@dataclass(frozen=True, slots=True)
class FieldRules:
    """The node's parameters for fields; distances in metres."""

    idw_power: float
    falloff_radius_m: float
    max_distance_m: float
    max_grid_cells: int
    clip_to_explored: bool

    @classmethod
    def of(cls, parameters: TwinParameters) -> Self:
        """Take the rules from the node's parameters."""
        return cls(
            idw_power=parameters.idw_power,
            falloff_radius_m=parameters.idw_falloff_radius_m,
            max_distance_m=parameters.idw_max_distance_m,
            max_grid_cells=parameters.max_grid_cells,
            clip_to_explored=parameters.clip_to_explored,
        )


class FieldCache:
    """An LRU of at most `MAX_ENTRIES` fields whose values take at most `max_bytes` together.

    A key has everything that a field depends on.
    """

    def __init__(self, max_bytes: float) -> None:
        self._max_bytes = max_bytes
        self._grids: OrderedDict[Hashable, FieldGrid] = OrderedDict()

    @property
    def bytes(self) -> int:
        """Memory that the values take."""
        return sum(grid.values.nbytes for grid in self._grids.values())

    def __len__(self) -> int:
        return len(self._grids)

    def get(self, key: Hashable) -> FieldGrid | None:
        """The cached field of `key`, which becomes the most recently used; None: there is none."""
        grid = self._grids.get(key)
        if grid is not None:
            self._grids.move_to_end(key)
        return grid

    def put(self, key: Hashable, grid: FieldGrid) -> None:
        """Cache `grid`, unless it exceeds the limit alone; drops the least recently used ones."""
        if grid.values.nbytes > self._max_bytes:
            return
        self._grids[key] = grid
        self._grids.move_to_end(key)
        while len(self._grids) > MAX_ENTRIES or self.bytes > self._max_bytes:
            self._grids.popitem(last=False)


def cost_s(request: FieldRequest, samples: int, rules: FieldRules) -> float:
    """Approximate cost of a field, seconds of one core; used to order work.

    It assumes that all samples lie within the box; those outside cost less.
    """
    width, height = check_request(request, rules.max_grid_cells)
    reach = 2.0 * max(rules.falloff_radius_m, rules.max_distance_m) / request.resolution
    pairs = samples * min(width, reach) * min(height, reach)
    return width * height * _CELL_S + pairs * _PAIR_S


def check_sensor_type(name: str) -> None:
    """Check the name of a sensor.

    Raises:
        FieldRefused: the name is empty or too long.

    """
    if not name:
        raise FieldRefused("sensor_type is empty, must name a sensor")
    if why := too_long("sensor_type", name):
        raise FieldRefused(why)


def check_request(request: FieldRequest, max_grid_cells: int) -> tuple[int, int]:
    """Return (width, height) of the requested grid; nothing is allocated.

    Raises:
        FieldRefused: the sensor's name or a number is invalid, or the grid has more than
            `max_grid_cells` cells.

    """
    check_sensor_type(request.sensor_type)
    try:
        width, height = grid_dimensions(**request.cells)
    except ValueError as error:
        raise FieldRefused(str(error)) from error
    if width * height > max_grid_cells:
        # As floats: in a hostile request, a side has dozens of digits.
        raise FieldRefused(
            f"resolution {request.resolution:g} m makes {float(width):.10g} x {float(height):.10g} "
            f"cells, the limit is {max_grid_cells} in all (max_grid_cells)"
        )
    return width, height


def compute_field(
    request: FieldRequest,
    samples: Sequence[tuple[float, float, float]],
    occupancy: OccupancyMap | None,
    rules: FieldRules,
    should_stop: Callable[[], bool] = never,
) -> FieldGrid:
    """Compute the field of `samples`; if the rules say so, cells unknown on the map are NaN.

    Raises:
        FieldRefused: see `check_request`.
        lupin_twin.field.idw.Abandoned: `should_stop`, called now and then, was true.

    """
    mask = None
    if occupancy is not None and rules.clip_to_explored:
        width, height = check_request(request, rules.max_grid_cells)
        mask = explored_mask(
            occupancy,
            width=width,
            height=height,
            origin_x=request.bbox_min_x,
            origin_y=request.bbox_min_y,
            resolution=request.resolution,
        )
    return compute_idw_field(
        samples,
        **request.cells,
        falloff_radius_m=rules.falloff_radius_m,
        max_distance_m=rules.max_distance_m,
        power=rules.idw_power,
        explored_mask=mask,
        should_stop=should_stop,
    )


def default_box(
    positions: Iterable[tuple[float, float]], max_distance_m: float
) -> tuple[float, float, float, float]:
    """(min_x, min_y, max_x, max_y) for a request without a box: all that can be painted.

    The bounding box of the tags' `positions` (x, y), widened by `max_distance_m` on every side;
    without tags, the same around the origin. Tags that are far off (`reach_of`) are ignored.
    """
    positions = list(positions)
    reach = reach_of(positions)
    positions = [(x, y) for x, y in positions if reach.holds(x, y)]
    xs, ys = zip(*positions, strict=True) if positions else ((0.0,), (0.0,))
    return (
        min(xs) - max_distance_m,
        min(ys) - max_distance_m,
        max(xs) + max_distance_m,
        max(ys) + max_distance_m,
    )


def default_request(
    sensor_type: str, box: tuple[float, float, float, float], max_cells: int
) -> FieldRequest:
    """The request for a field over a default box, when no resolution is given either.

    Cells are `DEFAULT_RESOLUTION_M` wide, or 2, 4, 8... times as wide, so that there are at most
    `max_cells`.
    """
    resolution = DEFAULT_RESOLUTION_M
    while True:
        request = FieldRequest(sensor_type, resolution, *box)
        width, height = grid_dimensions(**request.cells)
        if width * height <= max_cells:
            return request
        resolution *= 2.0


# --- quality: the error of a field, and how much of it is known -----------------------------------

# Samples that are predicted at once, from those that reach them in x; and a margin for rounding.
_AT_ONCE: Final = 32
_MORE: Final = 1.01


@dataclass(frozen=True, slots=True)
class TagError:
    """One tag's reading, and its prediction from the others; `error` is `predicted - measured`."""

    tag_id: str
    measured: float
    predicted: float
    error: float


@dataclass(frozen=True, slots=True)
class FieldQuality:
    """The leave-one-out error of a sensor's current readings.

    `judged` tags have another one within `max_distance_m`; `unjudged` have none, so they cannot be
    predicted. `rmse` and `worst` are None if no tag is judged; of equally bad tags, the worst is
    the first.
    """

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
    """The quality of a sensor's field that these rules make from the `tags` of a snapshot.

    Only tags with a pose and a finite reading take part, as in the field. The cost grows with the
    pairs of tags in reach of each other. `should_stop()` is called every millisecond or so.

    Raises:
        ValueError: a rule is out of its range; the message names it, its value and the limit.
        Abandoned: `should_stop` was true.

    """
    named = [(tag.tag_id, sample) for tag in tags for sample in samples_of((tag,), sensor_type)]
    samples = [sample for _, sample in named]
    x, y, measured = sample_columns(samples)
    idw = PairwiseIdw(falloff_radius_m=falloff_radius_m, max_distance_m=max_distance_m, power=power)
    predicted = _predictions(x, y, measured, idw, should_stop)
    judged = np.flatnonzero(~np.isnan(predicted))
    if judged.size == 0:
        return FieldQuality(judged=0, unjudged=len(samples), rmse=None, worst=None)
    errors = predicted[judged] - measured[judged]
    worst = int(np.abs(errors).argmax())
    index = int(judged[worst])
    return FieldQuality(
        judged=judged.size,
        unjudged=len(samples) - judged.size,
        rmse=math.hypot(*errors.tolist()) / math.sqrt(judged.size),
        worst=TagError(
            tag_id=named[index][0],
            measured=float(measured[index]),
            predicted=float(predicted[index]),
            error=float(errors[worst]),
        ),
    )


def painted_share(grid: FieldGrid) -> float:
    """The share of the grid's cells that have a value, 0 to 1."""
    return float(np.count_nonzero(~np.isnan(grid.values)) / grid.values.size)


def _predictions(
    x: FloatArray,
    y: FloatArray,
    value: FloatArray,
    idw: PairwiseIdw,
    should_stop: Callable[[], bool],
) -> FloatArray:
    """Predict each sample's value from the others; NaN if none is within `max_distance_m`."""
    predicted = np.empty(value.size)
    order = np.argsort(x, kind="stable")
    along, reach_m = x[order], _MORE * math.sqrt(idw.reach_square)
    with np.errstate(all="ignore"):
        for first in range(0, value.size, _AT_ONCE):
            if should_stop():
                raise Abandoned
            part = order[first : first + _AT_ONCE]
            ends = np.searchsorted(along, (x[part[0]] - reach_m, x[part[-1]] + reach_m))
            # In recorded order: of equally near samples, the first one counts.
            near = np.sort(order[slice(*ends)])
            square = idw.squares(near.size, part.size)
            np.square(x[near][:, None] - x[part], out=square)
            square += np.square(y[near][:, None] - y[part])
            # A sample must not predict itself.
            square[np.searchsorted(near, part), np.arange(part.size)] = np.inf
            predicted[part] = idw.evaluate(square, value[near])
    return predicted
