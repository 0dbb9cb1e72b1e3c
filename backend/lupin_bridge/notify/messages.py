"""MQTT topics, payloads, and Home Assistant's discovery; and what all channels share. Pure.

A level of a topic has only letters, digits, `-` and `_`. `/`, `+` and `#` are special to a broker,
and Home Assistant's discovery takes no other characters. A payload has moments instead of ages, so
it does not change while nothing happens, and is not sent again. Discovery has one device for each
tag and one for the greenhouse, and a message for each entity:
https://www.home-assistant.io/integrations/mqtt/#discovery-messages
"""

from __future__ import annotations

import hashlib
import math
import random
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Final, Protocol

from lupin_bridge.alarms.board import AlarmBoard, Board, NoteBoard
from lupin_bridge.feed.source import TwinSource
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.judging import NOTHING_JUDGED, Criteria, Judged
from lupin_bridge.judge.quantities import Sensor
from lupin_bridge.judge.verdict import Health, Verdict
from lupin_bridge.query_string import iso
from lupin_bridge.stream.frames import NEVER_SEEN, Status
from lupin_bridge.stream.state_json import alarm_json, by_cause, moment, reason_json
from lupin_twin.core.diagnostics import Origin
from lupin_twin.core.state import Reading, TagState

MAX_PLAIN: Final = 64
_PREFIX_OF_LONG: Final = 24
_UNSAFE: Final = re.compile(rb"[^A-Za-z0-9-]")


@lru_cache(maxsize=50_000)
def safe(name: str) -> str:
    """The name as a level of a topic, different for each name.

    Each byte of UTF-8 that is no letter, digit or `-` becomes `_` and two hexadecimal digits. A
    name that gets too long is cut off, and ends with `__`, which no other name contains, and a
    digest of all of it.
    """
    raw = name.encode("utf-8", "surrogatepass")
    plain = _UNSAFE.sub(lambda found: b"_%02X" % found[0][0], raw).decode("ascii")
    if 0 < len(plain) <= MAX_PLAIN:
        return plain
    digest = hashlib.blake2b(raw, digest_size=16).hexdigest()
    # Do not cut an escape in half: the beginning is for people to read.
    return f"{re.sub(r'_.?$', '', plain[:_PREFIX_OF_LONG])}__{digest}"


@dataclass(frozen=True, slots=True)
class Topics:
    """The topics below one prefix; `discovery` is Home Assistant's prefix, empty: no discovery."""

    prefix: str
    discovery: str

    @property
    def status(self) -> str:
        """`online` while the bridge is connected; its last will says `offline`."""
        return f"{self.prefix}/status"

    @property
    def birth(self) -> str:
        """Where Home Assistant says that it has started."""
        return f"{self.discovery}/status"

    @property
    def twin(self) -> str:
        """Whether the twin is live."""
        return f"{self.prefix}/house/twin"

    def of(self, tag_id: str | None, what: str) -> str:
        """The topic of something of a tag, or of the greenhouse (None), such as `health`."""
        return f"{self.prefix}/{'house' if tag_id is None else f'tags/{safe(tag_id)}'}/{what}"

    def reading(self, tag_id: str, sensor: str) -> str:
        """One sensor of one tag."""
        return self.of(tag_id, f"readings/{safe(sensor)}")

    def device(self, tag_id: str | None) -> str:
        """Home Assistant's id for a tag, or for the greenhouse (None)."""
        return f"{safe(self.prefix)}_{'house' if tag_id is None else f'tag_{safe(tag_id)}'}"

    def config(self, component: str, tag_id: str | None, what: str) -> str:
        """Where an entity is announced; `what` is a valid level of a topic."""
        place = "house" if tag_id is None else f"tag_{safe(tag_id)}"
        return f"{self.discovery}/{component}/{safe(self.prefix)}/{place}_-_{what}/config"


@dataclass(frozen=True, slots=True)
class GreenhouseState:
    """The greenhouse as the bridge knows it at one moment.

    `now_ns` is ROS time; None: not known. `holds_ns` is how long each tag's readings are valid.
    """

    status: Status = NEVER_SEEN
    judged: Judged = NOTHING_JUDGED
    board: Board = field(default_factory=Board)
    holds_ns: Mapping[str, int] = field(default_factory=dict)
    now_ns: int | None = None

    @property
    def tags(self) -> tuple[TagState, ...]:
        """All tags; none until a twin is received."""
        return self.status.update.snapshot.tags

    @property
    def knows_alarms(self) -> bool:
        """Whether the past has been read, so that all alarms are known."""
        return self.board.source != "starting"

    @property
    def origin(self) -> Origin:
        """Where observations come from, as the twin reports."""
        return self.status.update.origin


class Source(Protocol):
    """What the channels need of the bridge."""

    alarms: AlarmBoard
    notes: NoteBoard
    source: TwinSource
    criteria: Criteria

    def seen(self) -> GreenhouseState:
        """The current state."""

    @property
    def ros_time_ns(self) -> int | None:
        """ROS time now; None: it is not known."""

    @property
    def origin(self) -> Origin:
        """Where observations come from."""


def holds(reading: Reading, holds_ns: int, now_ns: int | None) -> bool:
    """Whether a reading is still valid."""
    return (
        now_ns is not None
        and reading.observed_at_ns is not None
        and now_ns - reading.observed_at_ns <= holds_ns
    )


def reading_payload(
    reading: Reading, sensor: Sensor, holds_ns: int, now_ns: int | None
) -> dict[str, Any]:
    """One reading with its own time; `value` is null if it failed or is no longer valid."""
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


def greenhouse_payload(judged: Judged) -> dict[str, Any]:
    """The greenhouse's verdict and its reasons, and whether it is day."""
    day = {"is_day": judged.day.is_day, "source": judged.day.source}
    return {**health_payload(judged.house), "day": day}


def twin_payload(status: Status) -> dict[str, Any]:
    """Whether the twin is live, and why not."""
    state = "ON" if status.is_live else "OFF"
    return {"state": state, "reason": status.reason, "message": status.message}


def alarms_payload(count: int, worst: Iterable[Alarm], *, is_known: bool) -> dict[str, Any]:
    """How many alarms are active, and the worst, each with `also`: others of its cause at its tag.

    `state` is null until that is known.
    """
    return {
        "state": ("ON" if count else "OFF") if is_known else None,
        "count": count,
        "alarms": by_cause(map(alarm_json, worst)),
    }


# Home Assistant's device class of a sensor, and the units that it allows; otherwise there is none.
_CLASSES: Final = {
    "temperature": ("temperature", {"°C", "°F", "K"}),
    "dew_point": ("temperature", {"°C", "°F", "K"}),
    "humidity": ("humidity", {"%"}),
    "soil_moisture": ("moisture", {"%"}),
    "co2": ("carbon_dioxide", {"ppm"}),
    "light": ("illuminance", {"lx"}),
    "vpd": ("pressure", {"kPa", "Pa", "hPa"}),
}
# How long Home Assistant shows a reading that is not followed by another, s. In steps, or changes
# of a tag's scan interval would announce its entities anew after each scan.
STEPS_S: Final = (
    *(minutes * 60 for minutes in (10, 15, 20, 30, 45, 60, 90)),
    *(hours * 3600 for hours in (2, 3, 4, 6, 8, 12, 18, 24, 48, 96, 168)),
)
_STATE: Final = "{{ value_json.state }}"
# Home Assistant's "unknown" is not an option, but the absence of a value.
_VERDICT: Final = "{{ value_json.verdict if value_json.verdict != 'unknown' else None }}"
_IS_LIVE: Final = "{{ 'online' if value_json.state == 'ON' else 'offline' }}"


def expire_after_s(holds_ns: int) -> int:
    """The least step that covers how long readings are valid, s."""
    return next((step for step in STEPS_S if step * 1_000_000_000 >= holds_ns), STEPS_S[-1])


def tag_configs(
    topics: Topics, tag_id: str, sensors: Sequence[Sensor], holds_ns: int
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Topic and payload of each entity of a tag; an entity of no sensor is not announced."""
    for sensor in sensors:
        what = f"reading_{safe(sensor.name)}"
        found, units = _CLASSES.get(sensor.name, ("", set[str]()))
        own = {
            "name": sensor.label,
            "state_topic": topics.reading(tag_id, sensor.name),
            "state_class": "measurement",
            "value_template": "{{ value_json.value }}",
            # The bridge publishes when a reading is no longer valid; this is for when it is not
            # connected.
            "expire_after": expire_after_s(holds_ns),
            **({"unit_of_measurement": sensor.unit} if sensor.unit else {}),
            **({"device_class": found} if sensor.unit in units else {}),
        }
        yield _config(topics, "sensor", tag_id, what, own)
    yield from _verdict_and_alarm(topics, tag_id)


def greenhouse_configs(topics: Topics) -> Iterator[tuple[str, dict[str, Any]]]:
    """Topic and payload of each entity of the greenhouse."""
    own = {
        "name": "Twin",
        "state_topic": topics.twin,
        "device_class": "connectivity",
        "value_template": _STATE,
    }
    yield _config(topics, "binary_sensor", None, "twin", own)
    yield from _verdict_and_alarm(topics, None)


def _device(topics: Topics, tag_id: str | None) -> dict[str, Any]:
    """Home Assistant's device of a tag, or of the greenhouse (None)."""
    device = {"identifiers": [topics.device(tag_id)], "manufacturer": "lupin-twin"}
    if tag_id is None:
        return {**device, "name": f"Greenhouse {topics.prefix}", "model": "Greenhouse"}
    return {**device, "name": f"Tag {tag_id}", "model": "Tag", "via_device": topics.device(None)}


def _verdict_and_alarm(topics: Topics, tag_id: str | None) -> Iterator[tuple[str, dict[str, Any]]]:
    own: dict[str, Any] = {
        "name": "Verdict",
        "state_topic": topics.of(tag_id, "health"),
        "device_class": "enum",
        "options": [verdict for verdict in Verdict if verdict != Verdict.UNKNOWN],
        "value_template": _VERDICT,
    }
    yield _config(topics, "sensor", tag_id, "verdict", own)
    own = {
        "name": "Alarm",
        "state_topic": topics.of(tag_id, "alarms"),
        "device_class": "problem",
        "value_template": _STATE,
    }
    yield _config(topics, "binary_sensor", tag_id, "alarm", own)


def _config(
    topics: Topics, component: str, tag_id: str | None, what: str, own: dict[str, Any]
) -> tuple[str, dict[str, Any]]:
    availability: list[dict[str, str]] = [{"topic": topics.status}]
    if tag_id is not None and what in ("verdict", "alarm"):
        # While the twin is silent, the state of its tags is not known.
        availability.append({"topic": topics.twin, "value_template": _IS_LIVE})
    return topics.config(component, tag_id, what), {
        "unique_id": f"{topics.device(tag_id)}_-_{what}",
        "json_attributes_topic": own["state_topic"],
        "availability": availability,
        "availability_mode": "all",
        "qos": 1,
        "device": _device(topics, tag_id),
        "origin": {"name": "lupin-twin"},
        **own,
    }


# --- a channel's condition, and its backoff -------------------------------------------------------

# Longest reason of a failure on the page and in the log, however long a library's text is.
MAX_DETAIL: Final = 200


@dataclass(slots=True)
class Condition:
    """A channel's counts since the start, and what is wrong (`detail`; empty: nothing).

    `sent` counts what the other side has taken, `failed` attempts that it has not, `dropped` what
    was given up or replaced by something newer. `is_connected`: the last attempt succeeded; webhook
    and push also begin so.
    """

    is_connected: bool = False
    detail: str = ""
    sent: int = 0
    failed: int = 0
    waiting: int = 0
    dropped: int = 0

    def taken(self, number: int = 1) -> None:
        """Count messages that the other side has taken."""
        self.is_connected, self.detail = True, ""
        self.sent += number

    def failing(self, why: str) -> None:
        """Count a failed attempt."""
        self.is_connected = False
        self.detail = " ".join(why.split())[:MAX_DETAIL] or "it failed without a reason"
        self.failed += 1


class Backoff:
    """Exponential backoff from `first_s` to `most_s`; up to half of each wait is random.

    The randomness keeps those that lost the same broker from coming back at the same moment.
    """

    def __init__(self, first_s: float, most_s: float) -> None:
        self._first_s, self.most_s = first_s, most_s
        self._failures = 0

    def wait_s(self) -> float:
        """How long to wait after one more failure."""
        # The exponent is bounded, or days of failures would make a number that no float holds.
        whole_s = min(self.most_s, self._first_s * 2.0 ** min(self._failures, 32))
        self._failures += 1
        return whole_s * random.uniform(0.5, 1.0)  # noqa: S311

    def succeeded(self) -> None:
        """Begin again with `first_s` at the next failure."""
        self._failures = 0
