"""Which tag has changed: its last readings, held against what everything else foretells for them.

Pure. Readings are left out together (Rasmussen and Williams, 2006, 5.12): with A the inverse of all
readings' covariance and a = A y, those of a block are off by A_bb^-1 a_b, with the covariance
A_bb^-1. An offset that they have in common is estimated from that by least squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from lupin_twin.estimate.kernel import Hyper, Pairs
from lupin_twin.estimate.readings import IntArray, Readings, Scale
from lupin_twin.estimate.triangle import root_of_inverse
from lupin_twin.grid import FloatArray

# A tag's last readings that are held against all the others.
CHANGE_READINGS: Final = 4
# So far off they are by chance about once a day of a house with ten tags.
CHANGE_Z: Final = 4.0


@dataclass(frozen=True, slots=True)
class Change:
    """How far a tag's last readings are off what all the others foretell.

    `z` is in sds, `offset` in the sensor's unit.
    """

    z: float
    offset: float

    @property
    def has_changed(self) -> bool:
        """Whether that is more than chance brings."""
        return abs(self.z) > CHANGE_Z


class Expected(NamedTuple):
    """What was foretold for a tag's newest reading, in the sensor's unit."""

    mean: float
    sd: float


@dataclass(frozen=True, slots=True)
class Off:
    """How far the readings of a block are off, standardised.

    The newest is off by `newest`, with `variance` (its noise included); the last ones together by
    `offset`, which is `z` sds, most clearly from number `onset` of the block on.
    """

    newest: float
    variance: float
    z: float
    offset: float
    onset: int


class Jury:
    """Readings under one set of parameters, for any of them to be left out."""

    def __init__(self, h: Hyper, pairs: Pairs, y: FloatArray) -> None:
        root = root_of_inverse(pairs.covariance(h))
        self._root = root
        self._alpha = root.T @ (root @ y)

    def off(self, block: IntArray) -> Off:
        """Of the readings of a block, the oldest first, the last ones judged."""
        columns = self._root[:, block]
        precision, alpha = columns.T @ columns, self._alpha[block]
        covariance = np.linalg.inv(precision)
        best, onset = 0.0, 0
        z = offset = 0.0
        for start in range(len(block) - 1, max(len(block) - CHANGE_READINGS, 0) - 1, -1):
            # Those before are left out too, but not judged: what the last ones lose by that.
            lost = np.linalg.solve(precision[:start, :start], precision[:start, start:]).T
            weight = float((precision[start:, start:] - lost @ precision[:start, start:]).sum())
            z = float((alpha[start:] - lost @ alpha[:start]).sum()) / weight**0.5
            offset = z / weight**0.5
            if abs(z) >= best:
                best, onset = abs(z), start
        newest = float(covariance[-1] @ alpha)
        return Off(newest, float(covariance[-1, -1]), z, offset, onset)


def last_of(readings: Readings, tag: int, since_s: float | None = None) -> IntArray:
    """The readings of a tag that are left out to judge it, the oldest first.

    Its last four, or all since it has changed.
    """
    own = np.flatnonzero(readings.tag == tag)
    own = own[np.argsort(readings.time_s[own], kind="stable")]
    if since_s is None:
        return own[-CHANGE_READINGS:]
    return own[readings.time_s[own] >= since_s]


def changes(jury: Jury, readings: Readings, scale: Scale) -> tuple[Change | None, ...]:
    """For each tag, how far its last readings are off; None for a tag without any."""
    result: list[Change | None] = []
    for tag in range(len(readings.xy)):
        block = last_of(readings, tag)
        off = jury.off(block) if len(block) else None
        result.append(None if off is None else Change(off.z, off.offset * scale.spread))
    return tuple(result)


def expected(juries: Sequence[Jury], readings: Readings, block: IntArray, scale: Scale) -> Expected:
    """What is foretold for the newest reading of a block when the block is left out.

    The mean and the sd of a reading, noise included, over all sets of parameters.
    """
    offs = [jury.off(block) for jury in juries]
    newest = np.array([off.newest for off in offs])
    sd = float(np.sqrt(np.mean([off.variance for off in offs]) + newest.var()))
    mean = float(readings.value[block[-1]] - newest.mean() * scale.spread)
    return Expected(mean, sd * scale.spread)
