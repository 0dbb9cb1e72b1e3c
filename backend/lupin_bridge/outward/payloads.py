"""What is published of a house: readings, verdicts, alarms, each as a JSON object. Pure.

Nothing here changes while nothing happens: a payload that is as before is not sent again. So ages
are not in it, but the moments that they count from.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from lupin_bridge.alarms.board import Board
from lupin_bridge.judge.alarm import Alarm
from lupin_bridge.judge.judging import NOTHING_JUDGED, Judged
from lupin_bridge.judge.ranges import Sensor
from lupin_bridge.judge.verdict import Health
from lupin_bridge.past.moments import iso
from lupin_bridge.stream.health_json import alarm_json, reason_json
from lupin_bridge.stream.state_json import moment
from lupin_twin.diagnostics import Origin
from lupin_twin.state import Reading, Snapshot


@dataclass(frozen=True, slots=True)
class Seen:
    """The house as the bridge knows it at one moment.

    `now_ns` is ROS time, None where it is not known; `holds_ns` is for how long each tag's readings
    hold. `twin` is why the twin is live or not (`stream.status.Reason`), `message` says so.
    `origin` is where what was observed comes from.
    """

    snapshot: Snapshot | None = None
    judged: Judged = NOTHING_JUDGED
    board: Board = field(default_factory=Board)
    holds_ns: Mapping[str, int] = field(default_factory=dict)
    now_ns: int | None = None
    is_live: bool = False
    twin: str = ""
    message: str = ""
    origin: Origin = "unknown"


def holds(reading: Reading, holds_ns: int, now_ns: int | None) -> bool:
    """Whether a reading still says something about now."""
    return (
        now_ns is not None
        and reading.observed_at_ns is not None
        and now_ns - reading.observed_at_ns <= holds_ns
    )


def reading_payload(
    reading: Reading, sensor: Sensor, holds_ns: int, now_ns: int | None
) -> dict[str, Any]:
    """One reading with its own time; `value` is null where it failed or does not hold any more."""
    is_known = holds(reading, holds_ns, now_ns) and math.isfinite(reading.value)
    observed_ns = reading.observed_at_ns
    return {
        "value": reading.value if is_known else None,
        "unit": sensor.unit,
        "observed_at": None if observed_ns is None else iso(observed_ns),
        "stamp": moment(observed_ns),
        "sensor": reading.name,
    }


def health_payload(health: Health) -> dict[str, Any]:
    """A verdict and its reasons, as `/api/health` has them."""
    return {
        "verdict": health.verdict,
        "reasons": [reason_json(reason) for reason in health.reasons],
    }


def house_payload(judged: Judged) -> dict[str, Any]:
    """The same of the house, and whether it is day."""
    day = {"is_day": judged.day.is_day, "source": judged.day.source}
    return {**health_payload(judged.house), "day": day}


def twin_payload(seen: Seen) -> dict[str, Any]:
    """Whether the twin is live, and why not."""
    state = "ON" if seen.is_live else "OFF"
    return {"state": state, "reason": seen.twin, "message": seen.message}


def alarms_payload(count: int, worst: Iterable[Alarm], *, is_known: bool) -> dict[str, Any]:
    """How many are active, and the worst of them; `state` is null before that is known."""
    return {
        "state": ("ON" if count else "OFF") if is_known else None,
        "count": count,
        "alarms": [alarm_json(alarm) for alarm in worst],
    }
