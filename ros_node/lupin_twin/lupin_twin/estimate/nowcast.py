"""Many tags: what the whole house has done, and each tag by itself, brought to one moment.

Pure, standardised units. Two steps stand for all readings at once, with tags taken to be
independent of each other in the first:

1. The whole house's course at `_TIMES` times, and its level, from all readings: a tag's own local
   part and noise are the errors (Rasmussen and Williams, 2006, 8.3.4, with interpolation for the
   times between).
2. Each tag's readings, brought to the moment by what the house has done since, say of its place a
   mean m and a variance v. A reading now with the noise 1 / (1/v - 1/P), P being the variance
   before any reading, says the same: it stands for them.

What is not known of the house's course is common to all tags, and no number of them lessens it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from lupin_twin.estimate.kernel import JITTER, UNKNOWN_MEAN, Hyper, daily, matern
from lupin_twin.estimate.readings import IntArray, Readings
from lupin_twin.estimate.triangle import root_of_inverse
from lupin_twin.grid import FloatArray
from lupin_twin.idw import Abandoned, never

# Times at which the house's course is reckoned with, from the oldest reading until the moment.
_TIMES: Final = 64
# However new all readings are: nothing can be divided by the least of floats.
_LEAST_H: Final = 1.0
# Readings at a time: two megabytes.
_AT_ONCE: Final = 2_048


@dataclass(frozen=True, slots=True, eq=False)
class Nowcasts:
    """One reading of each tag, (T,), that stands for all of its own: `value` and its `noise`.

    `drift` is the variance of what the whole house has done since they were read, common to all.
    """

    xy: FloatArray
    value: FloatArray
    noise: FloatArray
    drift: float


def nowcasts(
    h: Hyper,
    readings: Readings,
    y: FloatArray,
    ages_h: FloatArray,
    should_stop: Callable[[], bool] = never,
) -> Nowcasts:
    """Of the tags with readings, standardised `y`, `ages_h` (n,) before the moment.

    Ages are h of a day of 24, none below 0.

    Raises:
        Abandoned: `should_stop`, asked every few milliseconds, said so.

    """
    times_h = np.linspace(0.0, max(float(ages_h.max()), _LEAST_H), _TIMES)
    present, parts = _alike(readings.tag)
    course, unsure = _course(
        h, times_h, [(ages_h[rows], y[rows]) for _, rows in parts], should_stop
    )
    now = _interpolation(np.zeros(1), times_h)[0]
    before = UNKNOWN_MEAN + h.local_variance
    mean, variance = np.empty(len(present)), np.empty(len(present))
    lacks = np.empty((len(present), _TIMES + 1))
    for some, rows in parts:
        if should_stop():
            raise Abandoned
        at = _interpolation(ages_h[rows], times_h)
        between = UNKNOWN_MEAN + _local(h, ages_h[rows])
        shared = UNKNOWN_MEAN + h.sa**2 + h.sh**2 * matern(ages_h[rows], h.lh)
        shared += h.sq**2 * daily(ages_h[rows])
        weights = np.linalg.solve(between, shared[:, :, None])[:, :, 0]
        brought = y[rows] - (at - now) @ course
        mean[some] = np.einsum("kn,kn->k", weights, brought)
        variance[some] = before - np.einsum("kn,kn->k", weights, shared)
        lacks[some] = now - np.einsum("kn,knm->km", weights, at)
    drift = float(np.square(unsure @ lacks.mean(axis=0)).sum())
    variance += np.maximum(np.square(lacks @ unsure.T).sum(axis=1) - drift, 0.0)
    # Between what floats can tell from 0, and from nothing known.
    variance = np.clip(variance, 1e-9 * before, (1.0 - 1e-9) * before)
    left = 1.0 - variance / before
    return Nowcasts(readings.xy[present], mean / left, variance / left, drift)


def _alike(tag: IntArray) -> tuple[IntArray, list[tuple[IntArray, IntArray]]]:
    """The tags with readings; and of some of them at a time, which they are, and their readings.

    Those have equally many readings, (k, n).
    """
    order = np.argsort(tag, kind="stable")
    present, starts, counts = np.unique(tag[order], return_index=True, return_counts=True)
    parts = []
    for count in np.unique(counts).tolist():
        alike = np.flatnonzero(counts == count)
        at_once = max(_AT_ONCE // count, 1)
        for first in range(0, len(alike), at_once):
            some = alike[first : first + at_once]
            parts.append((some, order[starts[some, None] + np.arange(count)]))
    return present, parts


def _course(
    h: Hyper,
    times_h: FloatArray,
    parts: list[tuple[FloatArray, FloatArray]],
    should_stop: Callable[[], bool],
) -> tuple[FloatArray, FloatArray]:
    """The house's course at times and its level, (times + 1,), and a root of their covariance.

    The root W is such that the variance of a sum by weights a is the square of W a.
    """
    apart_h = np.abs(times_h[:, None] - times_h)
    prior = np.zeros((_TIMES + 1, _TIMES + 1))
    prior[:-1, :-1] = h.sg**2 * matern(apart_h, h.lg) + h.sp**2 * daily(apart_h)
    prior[np.diag_indices(_TIMES)] += JITTER * (h.sg**2 + h.sp**2)
    prior[-1, -1] = UNKNOWN_MEAN
    root = root_of_inverse(prior)
    precision, told = root.T @ root, np.zeros(_TIMES + 1)
    for ages_h, y in parts:
        if should_stop():
            raise Abandoned
        lower = np.linalg.inv(np.linalg.cholesky(_local(h, ages_h)))
        at = np.matmul(lower, _interpolation(ages_h, times_h)).reshape(-1, _TIMES + 1)
        precision += at.T @ at
        told += at.T @ np.matmul(lower, y[:, :, None]).ravel()
    root = root_of_inverse(precision)
    return root.T @ (root @ told), root


def _interpolation(ages_h: FloatArray, times_h: FloatArray) -> FloatArray:
    """(.., times + 1): each age's shares of the two times about it, and 1 for the level."""
    position = ages_h / times_h[1]
    before = np.clip(position.astype(np.int64), 0, len(times_h) - 2)
    result = np.zeros((*ages_h.shape, len(times_h) + 1))
    np.put_along_axis(result, before[..., None], (1.0 + before - position)[..., None], -1)
    np.put_along_axis(result, before[..., None] + 1, (position - before)[..., None], -1)
    result[..., -1] = 1.0
    return result


def _local(h: Hyper, ages_h: FloatArray) -> FloatArray:
    """(k, n, n): the covariance of a tag's readings, but for what the whole house does."""
    apart_h = np.abs(ages_h[:, :, None] - ages_h[:, None, :])
    result = h.sa**2 + h.sh**2 * matern(apart_h, h.lh) + h.sq**2 * daily(apart_h)
    own = np.arange(ages_h.shape[1])
    result[:, own, own] += h.tau**2 + JITTER
    return result
