"""Whether estimates are right: the share of scans that lay where they were predicted.

Each scan is compared with a prediction from what was known before it: earlier readings of other
tags, and a model of the day before. The scan's own tag and the tags beside it are left out, so the
share shows how good estimates between tags are.

Pure. Metres in the map frame, times ns of ROS time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from lupin_twin.core.state import NANOSECONDS_PER_SECOND
from lupin_twin.estimate.engine import TagPast, all_readings, within
from lupin_twin.estimate.kernel import Pairs, Readings
from lupin_twin.estimate.model import Model, fit, of_neighbours
from lupin_twin.estimate.solution import INFLATION, gap_of
from lupin_twin.field.idw import Abandoned, never

# Half of the predicted interval, in sds: 9 of 10 readings should lie inside.
HALF_WIDTH_SDS: Final = 1.645
DAYS_A_WEEK: Final = 7
# What is counted ends with a whole hour, so that it has to be counted only once an hour.
_HOURS_A_DAY: Final = 24
# With fewer readings, there is little to learn, and nothing is graded.
LEAST_READINGS: Final = 10
# Lowest share that is accepted where 0.9 is expected; that of a wrong model soon falls below.
LEAST_SHARE: Final = 0.8
# Scans of one hour are correlated: fewer than this prove nothing.
LEAST_SCANS: Final = 40
# The cost of a day, a tenth of a second, does not grow with the greenhouse. At most so many scans
# of each tag count, of so many tags; each is predicted from at least four other tags.
_PER_TAG: Final = 8
_TAGS: Final = 10
_LEAST_OTHERS: Final = 4


@dataclass(frozen=True, slots=True)
class Tally:
    """Scans that were predicted, and how many of them lay in the interval."""

    scans: int = 0
    inside: int = 0

    @property
    def share(self) -> float | None:
        """Share of the scans inside; None if none was predicted."""
        return self.inside / self.scans if self.scans else None


@dataclass(frozen=True, slots=True)
class Record:
    """How often a sensor's estimates were right; `since_ns` is the first scan that was graded."""

    since_ns: int | None
    day: Tally
    week: Tally

    @property
    def is_trusted(self) -> bool | None:
        """Whether enough scans of the day and the week lay inside; None if there are too few."""
        enough = [one for one in (self.day, self.week) if one.scans >= LEAST_SCANS]
        return all(one.inside >= LEAST_SHARE * one.scans for one in enough) if enough else None


NOT_GRADED: Final = Record(None, Tally(), Tally())


def record_of(
    tags: Sequence[TagPast],
    at_ns: int,
    day_length_s: float,
    should_stop: Callable[[], bool] = never,
) -> Record:
    """Grade the scans of the week up to the last whole hour, day by day.

    Raises:
        lupin_twin.field.idw.Abandoned: `should_stop`, called before each day, was true.

    """
    day_ns = int(day_length_s * NANOSECONDS_PER_SECOND)
    end_ns = at_ns - at_ns % (day_ns // _HOURS_A_DAY)
    days = []
    for until_ns in range(end_ns, end_ns - DAYS_A_WEEK * day_ns, -day_ns):
        if should_stop():
            raise Abandoned
        those = within(tags, until_ns - 2 * day_ns, until_ns)
        days.append(_of_day(those, until_ns, day_length_s))
    week = [one for day in days for one in day]
    return Record(min((at_ns for at_ns, _ in week), default=None), _tally(days[0]), _tally(week))


def _tally(graded: Sequence[tuple[int, bool]]) -> Tally:
    return Tally(len(graded), sum(is_inside for _, is_inside in graded))


def _of_day(tags: Sequence[TagPast], until_ns: int, day_length_s: float) -> list[tuple[int, bool]]:
    """The time of each graded scan of a day, and whether it lay inside.

    `tags` have the readings of this day and of the one before.
    """
    if not tags:
        return []
    every = of_neighbours(all_readings(tags, until_ns))
    before, new = (
        every.recent(at_s, day_length_s=day_length_s, per_tag=_PER_TAG)
        for at_s in (-day_length_s, 0.0)
    )
    new = new.take(new.time_s > -day_length_s)
    columns = (np.r_[getattr(before, it), getattr(new, it)] for it in ("time_s", "tag", "value"))
    graded = _graded(day_length_s, *(it.tobytes() for it in (*columns, every.xy)))
    return [(until_ns + round(at_s * NANOSECONDS_PER_SECOND), inside) for at_s, inside in graded]


# The same days are requested again and again: the weeks of up to 32 sensors.
@lru_cache(maxsize=32 * DAYS_A_WEEK)
def _graded(
    day_length_s: float, time_s: bytes, tag: bytes, value: bytes, xy: bytes
) -> tuple[tuple[float, bool], ...]:
    """The scans of a day, from the raw arrays of `Readings`; times are s from the day's end.

    The model is fitted to the day before or, on the first day, to this one.
    """
    both = Readings(
        np.frombuffer(time_s),
        np.frombuffer(tag, np.int64),
        np.frombuffer(value),
        np.frombuffer(xy).reshape(-1, 2),
    )
    if len(both) < LEAST_READINGS:
        return ()
    before = both.take(both.time_s <= -day_length_s)
    try:
        known = before if len(before) >= LEAST_READINGS else both
        model = fit(known, day_length_s=day_length_s)
        return tuple(
            (at_s, off <= HALF_WIDTH_SDS * sd)
            for at_s, off, sd in predicted(model, both, -day_length_s)
        )
    except np.linalg.LinAlgError:
        return ()


def predicted(
    model: Model, readings: Readings, after_s: float
) -> Iterator[tuple[float, float, float]]:
    """Yield each scan's time, s, how far it was off, and the sd of that; in the sensor's unit.

    Of up to ten tags, each scan after a moment is predicted from readings before the scan. The tag
    and those nearer to it than the typical distance from the floor to a tag are left out.

    Raises:
        numpy.linalg.LinAlgError: the readings' covariance is numerically singular.

    """
    of = readings.of_present()
    of = of.take(np.argsort(of.time_s, kind="stable"))
    covariance = Pairs(of, model.day_length_s).covariance(model.hyper)
    y, noise, spread = model.scale.standardised(of.value), model.hyper.noise, model.scale.spread
    gap = gap_of(of.xy)
    tags = np.unique(of.tag[of.time_s > after_s])
    for tag in tags[np.linspace(0, len(tags) - 1, min(_TAGS, len(tags))).astype(int)]:
        near = np.hypot(*(of.xy - of.xy[tag]).T) < gap
        near[tag] = True
        if np.count_nonzero(~near) < _LEAST_OTHERS:
            continue
        others = np.flatnonzero(~near[of.tag])
        rows = np.flatnonzero((of.tag == tag) & (of.time_s > after_s))
        # In order of time, the first rows of a factor are those of the first readings alone.
        root = np.linalg.cholesky(covariance[np.ix_(others, others)])
        is_known = of.time_s[others, None] < of.time_s[rows]
        of_rows = is_known * covariance[np.ix_(others, rows)]
        solved = np.linalg.solve(root, np.column_stack((of_rows, y[others])))
        shares = is_known * solved[:, :-1]
        off = y[rows] - shares.T @ solved[:, -1]
        true = np.maximum(covariance[rows, rows] - noise - np.square(shares).sum(axis=0), 0.0)
        sd = np.sqrt(INFLATION**2 * true + noise) * spread
        yield from zip(
            of.time_s[rows].tolist(), (np.abs(off) * spread).tolist(), sd.tolist(), strict=True
        )
