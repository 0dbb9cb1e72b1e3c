"""What an estimate is made of: the readings of one sensor, and how they are standardised.

Pure. Times are seconds of ROS time, places metres in the map frame, values the sensor's own unit.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from lupin_twin.grid import FloatArray

IntArray = npt.NDArray[np.int64]

# So many readings of a tag count; more say little that these do not.
MAX_PER_TAG: Final = 32
# Readings as old as a day are the last that count.
MAX_AGE_DAYS: Final = 1.0
# So many readings weigh as much as the ideal range does in saying how far values spread.
_PRIOR_WEIGHT: Final = 4.0
_MAX_WEIGHT: Final = 20.0


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """Finite readings of one sensor, in any order; the arrays are copied and read-only.

    `time_s` and `value` are (n,), `tag` (n,) tells the row of `xy` (T, 2) at which each was taken.
    Two may be of the same tag and time.

    Raises:
        ValueError: shapes that do not fit together, a number that is not finite, a tag out of
            range; names which.

    """

    time_s: FloatArray
    tag: IntArray
    value: FloatArray
    xy: FloatArray

    def __post_init__(self) -> None:
        """Refuse what nothing can be made of."""
        for name, kind in (
            ("time_s", np.float64),
            ("tag", np.int64),
            ("value", np.float64),
            ("xy", np.float64),
        ):
            array = np.array(getattr(self, name), dtype=kind)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        count = self.time_s.shape[0] if self.time_s.ndim == 1 else -1
        for name, array in (("time_s", self.time_s), ("tag", self.tag), ("value", self.value)):
            if array.shape != (count,):
                raise ValueError(f"{name} has shape {array.shape}, must be ({max(count, 0)},)")
            if not np.all(np.isfinite(array)):
                raise ValueError(f"{name} has numbers that are not finite")
        if self.xy.ndim != 2 or self.xy.shape[1] != 2:
            raise ValueError(f"xy has shape {self.xy.shape}, must be (tags, 2)")
        if not np.all(np.isfinite(self.xy)):
            raise ValueError("xy has numbers that are not finite")
        if count and not (self.tag.min() >= 0 and self.tag.max() < len(self.xy)):
            wrong = self.tag.min() if self.tag.min() < 0 else self.tag.max()
            raise ValueError(f"tag is {wrong}, the limits are 0 and {len(self.xy) - 1}")

    def __len__(self) -> int:
        """How many readings there are."""
        return len(self.time_s)

    def recent(
        self, at_s: float, *, day_length_s: float = 86_400.0, per_tag: int = MAX_PER_TAG
    ) -> Readings:
        """Those up to `at_s` that are not older than a day, at most `per_tag` of each tag.

        Of more, the newest quarter counts, and of as many equal parts of the time before as are
        left the newest of each: what the next hours bring, yesterday's readings tell better than
        many of the last hour.
        """
        age_s = at_s - self.time_s
        chosen = np.flatnonzero((age_s >= 0.0) & (age_s <= MAX_AGE_DAYS * day_length_s))
        # By tag, the newest first; of equal stamps the later in order counts as the newer.
        order = chosen[np.lexsort((-chosen, age_s[chosen], self.tag[chosen]))]
        tag = self.tag[order]
        _, starts, counts = np.unique(tag, return_index=True, return_counts=True)
        rank = np.arange(len(tag)) - np.repeat(starts, counts)
        newest = -(-per_tag // 4)
        parts = max(per_tag - newest, 1)
        reach_s = max(float(age_s[chosen].max(initial=0.0)), 1.0)
        part = np.minimum((age_s[order] * (parts / reach_s)).astype(int), parts - 1)
        is_older = rank >= newest
        is_first = np.ones(len(tag), dtype=bool)
        is_first[1:] = (tag[1:] != tag[:-1]) | (part[1:] != part[:-1]) | ~is_older[:-1]
        kept = (np.repeat(counts, counts) <= per_tag) | ~is_older
        if per_tag > newest:
            kept |= is_first
        return self.take(np.sort(order[kept]))

    def take(self, chosen: npt.NDArray[np.int64] | npt.NDArray[np.bool_]) -> Readings:
        """Some of them, at the same places."""
        return Readings(self.time_s[chosen], self.tag[chosen], self.value[chosen], self.xy)

    def of_present(self) -> Readings:
        """The same by tag and time, at the places of tags with readings alone."""
        order = np.lexsort((self.time_s, self.tag))
        present, row = np.unique(self.tag[order], return_inverse=True)
        return Readings(self.time_s[order], row.ravel(), self.value[order], self.xy[present])


@dataclass(frozen=True, slots=True)
class Scale:
    """Standardised is (value - `centre`) / `spread`, both in the sensor's unit; `spread` > 0."""

    centre: float
    spread: float

    def standardised(self, values: FloatArray) -> FloatArray:
        """What the model reckons with."""
        result: FloatArray = (values - self.centre) / self.spread
        return result


def scale_of(values: FloatArray, ideal: tuple[float, float] | None) -> Scale:
    """The median, and a spread between what is thought beforehand and that of the readings.

    Few readings spread by chance, so what is thought counts as much as four of them do: a quarter
    of the ideal range, or without one, a tenth of the median.

    Raises:
        ValueError: no readings, or a range without width.

    """
    if not len(values):
        raise ValueError("there are no readings")
    centre = float(np.median(values))
    if ideal is not None and not ideal[1] > ideal[0]:
        raise ValueError(f"ideal is {ideal[0]} to {ideal[1]}, must have a width")
    thought = abs(centre) / 10.0 if ideal is None else (ideal[1] - ideal[0]) / 4.0
    weight = min(float(len(values)), _MAX_WEIGHT)
    # What is to be squared is taken by its largest: it may be near the end of what floats hold.
    off = values - centre
    largest = max(float(np.abs(off).max()), thought) or 1.0
    variance = float(np.mean((off / largest) ** 2))
    whole = _PRIOR_WEIGHT * (thought / largest) ** 2 + weight * variance
    return Scale(centre, largest * (whole / (_PRIOR_WEIGHT + weight)) ** 0.5 or 1.0)
