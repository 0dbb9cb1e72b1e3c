"""How things go on after the last reading: what a later moment has in common with the readings.

Pure. A Matern 3/2 in time is a process with two states (Hartikainen and Sarkka, "Kalman filtering
and smoothing solutions to temporal Gaussian process regression models", 2010), a cosine has two
more, a constant one. So what any later moment has in common with a reading is a sum of five
products, of something of the reading and something of the moment::

    M(a + d; l) = exp(-v) [ (1 + u) exp(-u) + v exp(-u) ]       u, v = sqrt3 a / l, sqrt3 d / l
    cos w(a + d) = cos wa cos wd - sin wa sin wd

a is the reading's age at the newest reading, d how much later the moment is; both >= 0, h of a day
of 24.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from lupin_twin.estimate.kernel import HOURS, UNKNOWN_MEAN, Hyper, scaled
from lupin_twin.grid import FloatArray

STATES: Final = 5
_TURN: Final = 2.0 * np.pi / HOURS


def of_readings(h: Hyper, ages_h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n, 5) each, of readings so old: for the whole house's course, and for their own place's."""
    return _states(ages_h, h.lg), _states(ages_h, h.lh)


def _states(ages_h: FloatArray, length: float) -> FloatArray:
    u = scaled(ages_h, length)
    fades = np.exp(-u)
    turn = ages_h * _TURN
    return np.column_stack((np.ones_like(u), (1.0 + u) * fades, fades, np.cos(turn), np.sin(turn)))


def of_moments(h: Hyper, later_h: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(k, 5) each, of moments so much later: the same, times which it makes a covariance."""
    return (
        _shares(later_h, UNKNOWN_MEAN, h.sg**2, h.lg, h.sp**2),
        _shares(later_h, h.sa**2, h.sh**2, h.lh, h.sq**2),
    )


def _shares(
    later_h: FloatArray, always: float, now: float, length: float, daily: float
) -> FloatArray:
    v = scaled(later_h, length)
    fades = now * np.exp(-v)
    turn = later_h * _TURN
    return np.column_stack(
        (
            np.full_like(v, always),
            fades,
            fades * v,
            daily * np.cos(turn),
            -daily * np.sin(turn),
        )
    )
