"""Whether the house's day takes longer than was told: by readings of many days.

Pure. A day that is told too short hides itself: it foretells no farther than it sees, and so near
anybody can. But over several of its days the readings go on as its course does not. The same
readings are fitted with longer days, and the one that makes them more probable is believed; how
much more, told in nats, adds up over sensors (Kass and Raftery, "Bayes Factors", Journal of the
American Statistical Association 90, 1995, 773).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from lupin_twin.estimate import fitting
from lupin_twin.estimate.kernel import Hyper, pairs_of
from lupin_twin.estimate.readings import Readings, scale_of
from lupin_twin.idw import never

# Days that are held against the one told, as multiples of it.
LONGER: Final = (4.0, 16.0, 64.0)
# What was read over fewer days tells nothing of how long one is.
LEAST_DAYS: Final = 2.0
# Very strong evidence, by Kass and Raftery: 150 to 1.
STRONG_NATS: Final = 5.0

NOTHING: Final = (0.0,) * len(LONGER)


def gains(
    readings: Readings, day_length_s: float, should_stop: Callable[[], bool] = never
) -> tuple[float, ...]:
    """By how many nats each of `LONGER` days explains the readings better than one does, or none.

    Where nothing is daily, a long day fits better than a short one; but no better than no day.

    Raises:
        lupin_twin.estimate.FitFailed: the readings do not let themselves be fitted.
        lupin_twin.idw.Abandoned: `should_stop`, asked at each step, said so.

    """
    if not np.ptp(readings.time_s) >= LEAST_DAYS * day_length_s:
        return NOTHING
    y = scale_of(readings.value, None).standardised(readings.value)

    def least_surprise(factor: float = 1.0, *, has_days: bool = True) -> float:
        pairs = pairs_of(readings, factor * day_length_s, has_days=has_days)
        objective = fitting.surprise(pairs, y, should_stop)
        return objective(fitting.minimise(objective, np.zeros(len(Hyper._fields))))[0]

    told = min(least_surprise(), least_surprise(has_days=False))
    return tuple(told - least_surprise(factor) for factor in LONGER)


def longer_by(told: Sequence[tuple[float, ...]]) -> float | None:
    """How many times as long a day is, by what each sensor gains; None: nothing says so strongly.

    It is one for all sensors, and what they tell of it adds up; one tells it clearly by itself.
    Where several explain the readings about as well it is the shortest: any smooth course is also a
    part of a longer day's.
    """
    each = np.array([*told, NOTHING])
    total = each.sum(axis=0)
    is_strong = np.minimum(total, each.max(axis=0)) >= STRONG_NATS
    is_as_good = total >= total.max() - STRONG_NATS
    fits = np.flatnonzero(is_strong & is_as_good)
    return LONGER[fits[0]] if len(fits) else None
