"""Kriging of many tags, each place by those near it, without seams.

Pure, standardised units. Over the tags lies a net of knots; around each, the nearest tags alone are
reckoned with. A place lies between four knots, and its mean and variance are theirs, weighted as by
bilinear interpolation: crossing from one to the next, nothing jumps.

The whole house's level is not known (`level`, its variance): with A the covariance of the
local part and the noise, the variance at a place is, as in ordinary kriging (Cressie, "Statistics
for Spatial Data", 1993, 3.2)::

    local - r' A^-1 r + (1 - 1' A^-1 r)^2 / (1 / level + 1' A^-1 1)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from lupin_twin.estimate.kernel import UNKNOWN_MEAN, Hyper, matern, nearness
from lupin_twin.estimate.nowcast import Nowcasts
from lupin_twin.estimate.readings import IntArray
from lupin_twin.grid import FloatArray
from lupin_twin.idw import Abandoned, never

Float32Array = npt.NDArray[np.float32]

# Tags around each knot that are reckoned with, and how many knots there are to so many tags.
NEAREST: Final = 32
TAGS_A_KNOT: Final = 8
# Tags as near as so many steps of the net are looked at first.
_REACH: Final = 3.0
# Knots at a time: about two megabytes.
_AT_ONCE: Final = 32


class Net:
    """Knots over the tags' bounding box, (columns, rows), `step_m` apart."""

    def __init__(self, xy: FloatArray) -> None:
        self.origin = xy.min(axis=0)
        extent = xy.max(axis=0) - self.origin
        knots = max(len(xy) / TAGS_A_KNOT, 4.0)
        # (width / step + 1) (height / step + 1) = knots, for 1 / step.
        square, linear = float(extent[0] * extent[1]), float(extent.sum())
        root = np.sqrt(linear**2 + 4.0 * square * (knots - 1.0))
        self.step_m = (linear + root) / (2.0 * (knots - 1.0)) or 1.0
        self.shape = np.ceil(extent / self.step_m).astype(int) + 1

    def along(self, axis: int, places: FloatArray) -> tuple[IntArray, FloatArray]:
        """The knot before each place along an axis, and how far on it is, 0 to 1."""
        last = int(self.shape[axis]) - 1
        position = np.clip((places - self.origin[axis]) / self.step_m, 0.0, last)
        before = np.minimum(position.astype(np.int64), max(last - 1, 0))
        return before, position - before

    def place(self, column: IntArray, row: IntArray) -> FloatArray:
        """(k, 2), m, of knots (k,)."""
        result: FloatArray = self.origin + np.column_stack((column, row)) * self.step_m
        return result


@dataclass(frozen=True, slots=True, eq=False)
class _Knot:
    """The tags near a knot (k, 2) and what they say; float32, for no difference here is small."""

    xy: FloatArray
    root: Float32Array
    mean_of: Float32Array
    level_of: Float32Array
    mean: float
    certain: float


class Tiles:
    """What many tags say of one moment, everywhere. Knots are made as they are asked for."""

    def __init__(self, h: Hyper, now: Nowcasts) -> None:
        self._h = h
        self._drift = now.drift
        self._net = Net(now.xy)
        by_y = np.argsort(now.xy[:, 1], kind="stable")
        self._xy, self._value, self._noise = now.xy[by_y], now.value[by_y], now.noise[by_y]

    def on(
        self, x: FloatArray, y: FloatArray, should_stop: Callable[[], bool] = never
    ) -> tuple[Float32Array, Float32Array]:
        """Mean and variance, float32 (len(y), len(x)), at all places of a grid, m, x and y rising.

        Raises:
            Abandoned: `should_stop`, asked every few milliseconds, said so.

        """
        h, length = self._h, self._h.l
        mean = np.zeros((len(y), len(x)), dtype=np.float32)
        variance = np.zeros_like(mean)
        columns, rows = self._supports(0, x), self._supports(1, y)
        wanted = np.array([(column, row) for row in rows for column in columns])
        for first in range(0, len(wanted), _AT_ONCE):
            if should_stop():
                raise Abandoned
            some = wanted[first : first + _AT_ONCE]
            for (column, row), knot in zip(some.tolist(), self._knots(some), strict=True):
                (left, right, weight_x), (low, high, weight_y) = columns[column], rows[row]
                near_x = nearness(x[left:right], knot.xy[:, 0], length).astype(np.float32)
                near_y = nearness(y[low:high], knot.xy[:, 1], length).astype(np.float32)
                near_y *= np.float32(h.local_variance)
                shared = (near_y[:, None, :] * near_x[None, :, :]).reshape(-1, len(knot.xy))
                weight = (weight_y[:, None] * weight_x).astype(np.float32)
                for into, found in zip((mean, variance), self._moments(knot, shared), strict=True):
                    into[low:high, left:right] += weight * found.reshape(weight.shape)
        return mean, variance

    def at(
        self, places: FloatArray, should_stop: Callable[[], bool] = never
    ) -> tuple[FloatArray, FloatArray]:
        """Mean and variance (k,) at places (k, 2), m: the same as on a grid."""
        (column, on_x), (row, on_y) = (self._net.along(axis, places[:, axis]) for axis in (0, 1))
        mean, variance = np.zeros(len(places)), np.zeros(len(places))
        last_column, last_row = self._net.shape - 1
        for right in (0, 1):
            for up in (0, 1):
                weight = (on_x if right else 1.0 - on_x) * (on_y if up else 1.0 - on_y)
                at_column = np.minimum(column + right, last_column)
                at_row = np.minimum(row + up, last_row)
                knots, which = np.unique(
                    np.column_stack((at_column, at_row)), axis=0, return_inverse=True
                )
                for first in range(0, len(knots), _AT_ONCE):
                    if should_stop():
                        raise Abandoned
                    some = knots[first : first + _AT_ONCE]
                    for index, knot in enumerate(self._knots(some), first):
                        here = np.flatnonzero(which.ravel() == index)
                        found = self._moments(knot, self._shared(knot, places[here]))
                        mean[here] += weight[here] * found[0]
                        variance[here] += weight[here] * found[1]
        return mean, variance

    def _supports(self, axis: int, places: FloatArray) -> dict[int, tuple[int, int, FloatArray]]:
        """By knot along an axis: the places (first, last) that it counts for, and their weights."""
        before, on = self._net.along(axis, places)
        result = {}
        for knot in range(int(before[0]), min(int(before[-1]) + 2, int(self._net.shape[axis]))):
            first, last = np.searchsorted(before, (knot - 1, knot + 1))
            weight = np.where(before[first:last] == knot, 1.0 - on[first:last], on[first:last])
            result[knot] = (int(first), int(last), weight)
        return result

    def _shared(self, knot: _Knot, places: FloatArray) -> Float32Array:
        (x, y), (tag_x, tag_y), length = places.T, knot.xy.T, self._h.l
        shared = self._h.local_variance * nearness(x, tag_x, length) * nearness(y, tag_y, length)
        return shared.astype(np.float32)

    def _moments(self, knot: _Knot, shared: Float32Array) -> tuple[Float32Array, Float32Array]:
        rooted = shared @ knot.root.T
        lacks = 1.0 - shared @ knot.level_of
        variance: Float32Array = (lacks * lacks / knot.certain).astype(np.float32)
        variance += np.float32(self._h.local_variance)
        variance -= np.einsum("ij,ij->i", rooted, rooted)
        np.maximum(variance, 0.0, out=variance)
        variance += np.float32(self._drift)
        mean: Float32Array = shared @ knot.mean_of
        mean += np.float32(knot.mean)
        return mean, variance

    def _knots(self, wanted: IntArray) -> list[_Knot]:
        """Of (k, 2): column and row."""
        column, row = wanted.T
        xy = self._xy
        chosen = self._nearest(self._net.place(column, row))
        count = chosen.shape[1]
        x, y = xy[chosen, 0], xy[chosen, 1]
        length = self._h.l
        shared = matern(np.abs(x[:, :, None] - x[:, None, :]), length)
        shared *= matern(np.abs(y[:, :, None] - y[:, None, :]), length)
        shared *= self._h.local_variance
        shared[:, np.arange(count), np.arange(count)] += self._noise[chosen]
        root = np.linalg.inv(np.linalg.cholesky(shared))
        of_value = np.matmul(root, self._value[chosen][:, :, None])
        of_level = root.sum(axis=2, keepdims=True)
        certain = 1.0 / UNKNOWN_MEAN + np.square(of_level).sum(axis=(1, 2))
        mean = (of_level * of_value).sum(axis=(1, 2)) / certain
        turned = root.transpose(0, 2, 1)
        level_of = np.matmul(turned, of_level)[:, :, 0]
        mean_of = np.matmul(turned, of_value)[:, :, 0] - mean[:, None] * level_of
        return [
            _Knot(
                xy[chosen[index]],
                root[index].astype(np.float32),
                mean_of[index].astype(np.float32),
                level_of[index].astype(np.float32),
                float(mean[index]),
                float(certain[index]),
            )
            for index in range(len(wanted))
        ]

    def _nearest(self, places: FloatArray) -> IntArray:
        """(k, `NEAREST`): the tags nearest to places (k, 2), in any order."""
        count = min(NEAREST, len(self._xy))
        reach = _REACH * self._net.step_m
        low, high = np.searchsorted(
            self._xy[:, 1], (places[:, 1].min() - reach, places[:, 1].max() + reach)
        )
        if high - low >= count:
            chosen, farthest = _nearest_of(self._xy[low:high], places, count)
            if farthest <= reach**2:  # beyond the strip there is none nearer
                return chosen + int(low)
        return _nearest_of(self._xy, places, count)[0]


def _nearest_of(xy: FloatArray, places: FloatArray, count: int) -> tuple[IntArray, float]:
    far = (places[:, :1] - xy[:, 0]) ** 2 + (places[:, 1:] - xy[:, 1]) ** 2
    chosen = np.argpartition(far, count - 1, axis=1)[:, :count]
    return chosen, float(np.take_along_axis(far, chosen, axis=1).max())
