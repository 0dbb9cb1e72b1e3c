"""What Home Assistant is told of the house: one device a tag and one for the house. Pure.

https://www.home-assistant.io/integrations/mqtt/#discovery-messages (a message an entity, which
every version since 2021 takes).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

from lupin_bridge.judge.ranges import Sensor
from lupin_bridge.judge.verdict import Verdict
from lupin_bridge.outward.names import Topics, safe

# A class of Home Assistant's with the units that it takes for it; with another unit there is none.
_CLASSES: Final = {
    "temperature": ("temperature", {"°C", "°F", "K"}),
    "dew_point": ("temperature", {"°C", "°F", "K"}),
    "humidity": ("humidity", {"%"}),
    "soil_moisture": ("moisture", {"%"}),
    "co2": ("carbon_dioxide", {"ppm"}),
    "light": ("illuminance", {"lx"}),
    "vpd": ("pressure", {"kPa", "Pa", "hPa"}),
}
# How long Home Assistant shows a reading that nothing follows, s. In steps, or a tag's rhythm would
# have its entities announced anew after each scan.
STEPS_S: Final = (
    *(minutes * 60 for minutes in (10, 15, 20, 30, 45, 60, 90)),
    *(hours * 3600 for hours in (2, 3, 4, 6, 8, 12, 18, 24, 48, 96, 168)),
)
_STATE: Final = "{{ value_json.state }}"
# Its "unknown" is no option, but the absence of all.
_VERDICT: Final = "{{ value_json.verdict if value_json.verdict != 'unknown' else None }}"
_IS_LIVE: Final = "{{ 'online' if value_json.state == 'ON' else 'offline' }}"


@dataclass(frozen=True, slots=True)
class _Place:
    """A tag, or the house (None), and what Home Assistant is told of it as a device."""

    tag_id: str | None
    device: dict[str, Any]


def expire_after_s(holds_ns: int) -> int:
    """The step that is no shorter than readings hold; s."""
    return next((step for step in STEPS_S if step * 1_000_000_000 >= holds_ns), STEPS_S[-1])


def tag_configs(
    topics: Topics, tag_id: str, sensors: Sequence[Sensor], holds_ns: int
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Topic and payload of each entity of a tag; an entity of no sensor is not announced."""
    device = {
        "identifiers": [topics.device(tag_id)],
        "name": f"Tag {tag_id}",
        "manufacturer": "lupin-twin",
        "model": "Tag",
        "via_device": topics.device(None),
    }
    place = _Place(tag_id, device)
    for sensor in sensors:
        what = f"reading_{safe(sensor.name)}"
        found, units = _CLASSES.get(sensor.name, ("", set[str]()))
        own = {
            "name": sensor.label,
            "state_topic": topics.reading(tag_id, sensor.name),
            "state_class": "measurement",
            "value_template": "{{ value_json.value }}",
            # The bridge tells itself when a reading does not hold any more; this is for when it is
            # not there to tell.
            "expire_after": expire_after_s(holds_ns),
            **({"unit_of_measurement": sensor.unit} if sensor.unit else {}),
            **({"device_class": found} if sensor.unit in units else {}),
        }
        yield _config(topics, "sensor", place, what, own)
    yield from _verdict_and_alarm(topics, place)


def house_configs(topics: Topics) -> Iterator[tuple[str, dict[str, Any]]]:
    """The same of the house."""
    device = {
        "identifiers": [topics.device(None)],
        "name": f"Greenhouse {topics.prefix}",
        "manufacturer": "lupin-twin",
        "model": "Greenhouse",
    }
    place = _Place(None, device)
    own = {
        "name": "Twin",
        "state_topic": topics.twin,
        "device_class": "connectivity",
        "value_template": _STATE,
    }
    yield _config(topics, "binary_sensor", place, "twin", own)
    yield from _verdict_and_alarm(topics, place)


def _verdict_and_alarm(topics: Topics, place: _Place) -> Iterator[tuple[str, dict[str, Any]]]:
    own: dict[str, Any] = {
        "name": "Verdict",
        "state_topic": topics.of(place.tag_id, "health"),
        "device_class": "enum",
        "options": [verdict for verdict in Verdict if verdict != Verdict.UNKNOWN],
        "value_template": _VERDICT,
    }
    yield _config(topics, "sensor", place, "verdict", own)
    own = {
        "name": "Alarm",
        "state_topic": topics.of(place.tag_id, "alarms"),
        "device_class": "problem",
        "value_template": _STATE,
    }
    yield _config(topics, "binary_sensor", place, "alarm", own)


def _config(
    topics: Topics, component: str, place: _Place, what: str, own: dict[str, Any]
) -> tuple[str, dict[str, Any]]:
    availability: list[dict[str, str]] = [{"topic": topics.status}]
    if place.tag_id is not None and what in ("verdict", "alarm"):
        # Of a twin that is silent, nobody knows how its tags are.
        availability.append({"topic": topics.twin, "value_template": _IS_LIVE})
    return topics.config(component, place.tag_id, what), {
        "unique_id": f"{topics.device(place.tag_id)}_-_{what}",
        "json_attributes_topic": own["state_topic"],
        "availability": availability,
        "availability_mode": "all",
        "qos": 1,
        "device": place.device,
        "origin": {"name": "lupin-twin"},
        **own,
    }
