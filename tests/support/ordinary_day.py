"""The simulator's ordinary days, as the judge receives them.

The demo's past has its own pace: a day takes 24 minutes, a round of the patrol 48 s.
Here the times are those of the greenhouse, in which a day takes 24 hours and a round 48 minutes.
"""

from typing import Final

from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.mission import DAYS, past
from lupin_twin.core.past import PastWrite
from lupin_twin.core.state import NO_FLOWER, Inspection, Pin, Scan

S: Final = 1_000_000_000
DAY_NS: Final = 86_400 * S
RUN: Final = 1
_SCAN, _INSPECTION = 0, 1
_DAY_SPEED: Final = 60.0


def ordinary_days() -> list[PastWrite]:
    """Scans and inspections of three days, from 0 ns on, as a journal returns them."""
    rows = past(GreenhouseSimulator(), 0, _DAY_SPEED, 1.0, 0)
    reported = (row for row in rows if not isinstance(row, Pin))
    return [
        _write(number, row, DAYS * DAY_NS + round(row.stamp_ns * _DAY_SPEED))
        for number, row in enumerate(reported, start=1)
    ]


def _write(number: int, row: Scan | Inspection, at_ns: int) -> PastWrite:
    if isinstance(row, Inspection):
        flower = row.flower or NO_FLOWER
        seen = (True, flower.species, flower.anomaly, flower.bug_count)
        return PastWrite(number, RUN, row.tag_id, at_ns, _INSPECTION, 0, (), (), *seen)
    names = tuple(reading.name for reading in row.readings)
    values = tuple(reading.value for reading in row.readings)
    return PastWrite(number, RUN, row.tag_id, at_ns, _SCAN, row.status, names, values)
