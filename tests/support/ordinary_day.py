"""The simulator's ordinary days, as the judge hears them.

The demo's past is made for whoever watches: a day takes 24 minutes, a round of the patrol 48 s.
Here its times are those of the house, in which a day takes 24 hours: a round takes 48 minutes.
"""

from __future__ import annotations

from typing import Any, Final

from lupin_patrol.cli import parse
from lupin_patrol.past import DAYS, past
from lupin_twin.core.writes import PastWrite

S: Final = 1_000_000_000
DAY_NS: Final = 86_400 * S
RUN: Final = 1
_SCAN, _INSPECTION = 0, 1


def ordinary_days(seed: int = 0) -> list[PastWrite]:
    """Scans and looks of three days, from 0 ns on, as a journal tells them."""
    options = parse([f"--seed={seed}"])
    return [
        _write(number, event, DAYS * DAY_NS + round(event["at_s"] * options.day_speed * S))
        for number, event in enumerate(past(options), start=1)
    ]


def _write(number: int, event: dict[str, Any], at_ns: int) -> PastWrite:
    tag_id = event["tag_id"]
    if "species" in event:
        seen = (True, event["species"], event["anomaly"], event["bug_count"])
        return PastWrite(number, RUN, tag_id, at_ns, _INSPECTION, 0, (), (), *seen)
    names = tuple(name for name, _ in event["readings"])
    values = tuple(value for _, value in event["readings"])
    return PastWrite(number, RUN, tag_id, at_ns, _SCAN, event["status"], names, values)
