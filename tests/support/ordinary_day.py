"""The simulator's ordinary days, as the judge receives them.

The demo's past has its own pace: a day takes 24 minutes, a round of the patrol 48 s.
Here the times are those of the greenhouse, in which a day takes 24 hours and a round 48 minutes.
"""

from dataclasses import replace
from typing import Final

from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.mission import DAYS, past
from lupin_twin.core.past import PastWrite
from lupin_twin.core.state import Pin
from tests.support.journal import past_write

S: Final = 1_000_000_000
DAY_NS: Final = 86_400 * S
_DAY_SPEED: Final = 60.0


def ordinary_days() -> list[PastWrite]:
    """Scans and inspections of three days, from 0 ns on, as a journal returns them."""
    rows = past(GreenhouseSimulator(), 0, _DAY_SPEED, 1.0, 0)
    reported = (row for row in rows if not isinstance(row, Pin))
    return [
        past_write(
            number, 1, replace(row, stamp_ns=DAYS * DAY_NS + round(row.stamp_ns * _DAY_SPEED))
        )
        for number, row in enumerate(reported, start=1)
    ]
