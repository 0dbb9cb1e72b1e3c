"""From readings to a model, and from a model to an estimate as of a moment. Pure, immutable."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from lupin_twin.estimate import fitting
from lupin_twin.estimate.kernel import HOURS, Hyper, pairs_of
from lupin_twin.estimate.member import members_of
from lupin_twin.estimate.posterior import Posterior
from lupin_twin.estimate.readings import Readings, Scale, scale_of
from lupin_twin.estimate.tiled import TiledPosterior
from lupin_twin.idw import never

# Beyond this share of how far places differ, one knows no more of a place than of any other.
_KNOWN_SHARE: Final = 0.6
# All readings hang together: what they cost grows with the third power of their number.
MAX_EXACT: Final = 64


@dataclass(frozen=True, slots=True)
class Model:
    """How readings of one sensor hang together: parameters, as many as were drawn, and the scale.

    `most_probable` serves where one answer is wanted, `drawn` where one has to say how sure.
    `limit` is the sd (the sensor's unit) beyond which nothing is called known.
    """

    scale: Scale
    limit: float
    day_length_s: float
    most_probable: Hyper
    drawn: tuple[Hyper, ...]

    @property
    def sd_known(self) -> float:
        """Where the estimate's sd (the sensor's unit) is below this, it is known."""
        local = float(np.mean([h.local_variance for h in self.drawn]))
        return min(_KNOWN_SHARE * math.sqrt(local) * self.scale.spread, self.limit)

    def posterior(
        self, readings: Readings, at_s: float, should_stop: Callable[[], bool] = never
    ) -> Posterior | TiledPosterior:
        """What the readings say of the moment `at_s` (ROS time, s), everywhere.

        Of more than 64 tags with readings, by what is near each place (`tiled`).

        Raises:
            ValueError: there are no readings, or some are later than `at_s`.
            numpy.linalg.LinAlgError: their covariance is singular, as far as floats can tell.
            lupin_twin.idw.Abandoned: `should_stop`, asked every few milliseconds, said so; also
                later, when more is asked of what is returned.

        """
        if not len(readings):
            raise ValueError("there are no readings")
        later_h = (at_s - readings.time_s.max()) * (HOURS / self.day_length_s)
        if not later_h >= 0.0:
            raise ValueError(f"at_s is {at_s}, the newest reading is of {readings.time_s.max()}")
        if len(np.unique(readings.tag)) > MAX_EXACT:
            return TiledPosterior(
                self.scale,
                self.sd_known,
                self.day_length_s,
                self.most_probable,
                readings,
                at_s,
                should_stop,
            )
        pairs = pairs_of(readings, self.day_length_s)
        y = self.scale.standardised(readings.value)
        return Posterior(
            self.scale,
            self.sd_known,
            self.day_length_s,
            self.most_probable,
            readings,
            members_of(self.drawn, pairs, y, later_h, should_stop),
        )


def fit(
    readings: Readings,
    *,
    ideal: tuple[float, float] | None = None,
    day_length_s: float = 86_400.0,
    should_stop: Callable[[], bool] = never,
) -> Model:
    """The model that the readings, and what is known beforehand, make most probable.

    `ideal` is the sensor's ideal range in its unit, if there is one; `day_length_s` how long a day
    takes, s of ROS time.

    Raises:
        ValueError: no readings, a day that is not longer than 0.
        FitFailed: the readings do not let themselves be fitted.
        lupin_twin.idw.Abandoned: `should_stop`, asked at each step, said so.

    """
    if not day_length_s > 0.0:
        raise ValueError(f"day_length_s is {day_length_s}, must be greater than 0")
    scale = scale_of(readings.value, ideal)
    pairs = pairs_of(readings, day_length_s)
    objective = fitting.surprise(pairs, scale.standardised(readings.value), should_stop)
    best = fitting.minimise(objective, np.zeros(len(Hyper._fields)))
    drawn = fitting.draws(objective, best)
    limit = scale.spread if ideal is None else (ideal[1] - ideal[0]) / 4.0
    return Model(
        scale,
        limit,
        day_length_s,
        fitting.hyper_of(best),
        tuple(fitting.hyper_of(one) for one in drawn),
    )
