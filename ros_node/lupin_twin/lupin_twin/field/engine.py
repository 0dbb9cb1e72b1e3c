"""GetField without ROS: its checks, the clipping to explored ground, the cache; and its quality.

The error of a map is the leave-one-out error (cross-validation as in Davis, "Contouring
algorithms", 1975): each tag's reading is predicted from the other tags' by the field's own rules,
and compared with what was measured. Errors are in the sensor's own unit.

Pure. Metres in the map frame throughout.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple, Self

import numpy as np

from lupin_twin.core.drops import too_long
from lupin_twin.core.parameters import TwinParameters
from lupin_twin.core.state import TagState, samples_of
from lupin_twin.field.explored import OccupancyMap, explored_mask
from lupin_twin.field.grid import FieldGrid, FloatArray, grid_dimensions, reach_of
from lupin_twin.field.idw import (
    Abandoned,
    IndexArray,
    PairwiseIdw,
    compute_idw_field,
    fits,
    gap_squares,
    never,
    sample_columns,
)

MAX_ENTRIES: Final = 64
MAX_BYTES: Final = 64_000_000


# m, where a request names none.
DEFAULT_RESOLUTION_M: Final = 0.1

# What computing takes, roughly and at worst: for each cell, and for each pair of a cell and a
# sample that reaches it.
_CELL_S: Final = 20e-9
_PAIR_S: Final = 15e-9


class FieldRefused(ValueError):
    """A request that gets no field; the message names the field, the value and the limit."""


# The fields of a request, but for the sensor.
NUMBERS: Final = ("resolution", "bbox_min_x", "bbox_min_y", "bbox_max_x", "bbox_max_y")


@dataclass(frozen=True, slots=True)
class FieldRequest:
    """What to reconstruct: a sensor over a box (m, map frame) in cells of `resolution` (m).

    The numbers are rounded to float32, GetField's wire type: a request over HTTP and the same one
    over ROS are the same request then, with the same field. `past_float32` names the first number
    that float32 does not hold, as it was sent; `check_request` refuses it.
    """

    sensor_type: str
    resolution: float
    bbox_min_x: float
    bbox_min_y: float
    bbox_max_x: float
    bbox_max_y: float
    past_float32: str = field(default="", init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        with np.errstate(over="ignore", under="ignore"):
            for name in NUMBERS:
                sent = getattr(self, name)
                rounded = float(np.float32(sent))
                object.__setattr__(self, name, rounded)
                is_lost = name == "resolution" and sent != 0.0 and rounded == 0.0
                if (is_lost or math.isinf(rounded) > math.isinf(sent)) and not self.past_float32:
                    object.__setattr__(self, "past_float32", f"{name} is {sent}")

    @property
    def cells(self) -> dict[str, float]:
        """The box and the resolution, m, as `grid_dimensions` and all that make a grid take it."""
        return {name: getattr(self, name) for name in NUMBERS}


@dataclass(frozen=True, slots=True)
class FieldRules:
    """The node's parameters for fields; distances in metres."""

    idw_power: float
    falloff_radius_m: float
    max_distance_m: float
    max_grid_cells: int

    @classmethod
    def of(cls, parameters: TwinParameters) -> Self:
        """As the parameters have them."""
        return cls(
            idw_power=parameters.idw_power,
            falloff_radius_m=parameters.idw_falloff_radius_m,
            max_distance_m=parameters.idw_max_distance_m,
            max_grid_cells=parameters.max_grid_cells,
        )


class FieldKey(NamedTuple):
    """Everything that a field depends on; `rules` are those by which it is made.

    `observation_count` stands for the store's whole content. `map_revision` is None where no map
    has come.
    """

    request: FieldRequest
    observation_count: int
    map_revision: int | None
    rules: FieldRules


class FieldCache:
    """An LRU of at most `MAX_ENTRIES` fields whose values take at most `MAX_BYTES` together."""

    def __init__(self) -> None:
        self._grids: OrderedDict[FieldKey, FieldGrid] = OrderedDict()

    @property
    def bytes(self) -> int:
        """What the values take."""
        return sum(grid.values.nbytes for grid in self._grids.values())

    def __len__(self) -> int:
        return len(self._grids)

    def get(self, key: FieldKey) -> FieldGrid | None:
        """The cached field of `key`, which becomes the most recently used; None: there is none."""
        grid = self._grids.get(key)
        if grid is not None:
            self._grids.move_to_end(key)
        return grid

    def put(self, key: FieldKey, grid: FieldGrid) -> None:
        """Cache `grid`, dropping the least recently used; not one past the whole bound."""
        if grid.values.nbytes > MAX_BYTES:
            return
        self._grids[key] = grid
        self._grids.move_to_end(key)
        while len(self._grids) > MAX_ENTRIES or self.bytes > MAX_BYTES:
            self._grids.popitem(last=False)


def cost_s(request: FieldRequest, samples: int, rules: FieldRules) -> float:
    """About how long a field of so many samples takes, seconds of one core; for ordering work.

    As if all samples lay within the box: one outside costs less.
    """
    width, height = check_request(request, rules.max_grid_cells)
    reach = 2.0 * max(rules.falloff_radius_m, rules.max_distance_m) / request.resolution
    pairs = samples * min(width, reach) * min(height, reach)
    return width * height * _CELL_S + pairs * _PAIR_S


def check_sensor_type(name: str) -> None:
    """See that a sensor is named.

    Raises:
        FieldRefused: the name is empty, or longer than any that is taken.

    """
    if not name:
        raise FieldRefused("sensor_type is empty, must name a sensor")
    if why := too_long("sensor_type", name):
        raise FieldRefused(why)


def check_request(request: FieldRequest, max_grid_cells: int) -> tuple[int, int]:
    """(width, height) of the grid that `request` asks for; nothing is allocated.

    Raises:
        FieldRefused: the request names no sensor, its numbers make no grid, or a grid of more than
            `max_grid_cells` cells.

    """
    check_sensor_type(request.sensor_type)
    if request.past_float32:
        raise FieldRefused(f"{request.past_float32} m, must fit into float32 (1.4e-45 to 3.4e38)")
    try:
        width, height = grid_dimensions(**request.cells)
    except ValueError as error:
        raise FieldRefused(str(error)) from error
    if width * height > max_grid_cells:
        # As floats: a hostile request has sides of dozens of digits.
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
    """The field of `samples`; with a map, cells that it does not know are NaN.

    Raises:
        FieldRefused: see `check_request`.
        lupin_twin.field.idw.Abandoned: `should_stop`, called now and then, was true.

    """
    mask = None
    if occupancy is not None:
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

    The box of the tags' `positions` (x, y), wider by `max_distance_m` on every side; without a tag
    the same around the origin. Tags that are far off (`far_off`) have no say.
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
    """The field over a default box, where a request names no resolution either.

    Cells are `DEFAULT_RESOLUTION_M` wide, or 2, 4, 8... times as wide where they would be more than
    `max_cells`.
    """
    resolution = DEFAULT_RESOLUTION_M
    while True:
        request = FieldRequest(sensor_type, resolution, *box)
        width, height = grid_dimensions(**request.cells)
        if width * height <= max_cells:
            return request
        resolution *= 2.0


# --- how far off it is, and how much of it is known -----------------------------------------------


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
