"""GetEstimateReport without ROS: what is asked, and what a sensor's estimates are worth.

Pure. Metres in the map frame, times ns of ROS time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from lupin_twin.estimate import Place
from lupin_twin.estimate_rounds import Loaded, TagCheck
from lupin_twin.explored import OccupancyMap
from lupin_twin.fields import FieldRefused, check_sensor_type
from lupin_twin.free_places import floor, free_of
from lupin_twin.grading import Record

DEFAULT_PLACES: Final = 5
MAX_PLACES: Final = 20
# What advice takes, roughly and at worst, s of one core.
ADVICE_S: Final = 0.3


@dataclass(frozen=True, slots=True)
class ReportRequest:
    """A sensor, and how many places for other tags are to be told; None: nobody asks for any.

    Working them out is dear. By the service there is no asking for none.

    Raises:
        FieldRefused: names the field, the value and the limit.

    """

    sensor_type: str
    max_places: int | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be answered."""
        check_sensor_type(self.sensor_type)
        if self.max_places is not None and not 1 <= self.max_places <= MAX_PLACES:
            raise FieldRefused(
                f"max_places is {self.max_places}, the limits are 1 and {MAX_PLACES}"
            )


@dataclass(frozen=True, slots=True)
class Report:
    """What a sensor's estimates are worth as of `at_ns`.

    `fitted_at_ns` is when the model was fitted that serves, None: none yet; `fit_problem` what is
    wrong with fits or with the day's length, empty: nothing. `tags` are the newest readings beside
    what is expected of them, `places` where another tag helps most, the best first.
    """

    at_ns: int
    fitted_at_ns: int | None
    fit_problem: str
    record: Record
    tags: tuple[TagCheck, ...] = ()
    places: tuple[Place, ...] = ()


def advice(loaded: Loaded, occupancy: OccupancyMap | None, count: int) -> tuple[Place, ...]:
    """Where other tags help most, over all the free floor; nowhere, where none is free."""
    tags = loaded.posterior.readings.xy
    over = floor(tags, occupancy)
    places = free_of(tags, over)
    if not len(places):
        return ()
    return tuple(loaded.posterior.advice(places, count, over=over))
