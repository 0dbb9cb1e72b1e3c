"""MQTT input of `adapt`: topic patterns, payload parsing, and the client.

paho's thread queues the messages, and the node's thread takes them.
"""

from __future__ import annotations

import json
import re
import secrets
import ssl
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC
from functools import lru_cache
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

from lupin_twin.adapt.table import (
    AS_IT_IS,
    ConfigError,
    Table,
    Value,
    seconds_of,
    shown,
    value_of,
    values_of,
    wrong,
)
from lupin_twin.core.drops import Rejected, check_texts

PORTS: Final = {"mqtt": 1883, "mqtts": 8883}
MAX_TOPICS: Final = 100
# Limit of a broker's packets. Without it, one message of another client may take 256 MB here.
MAX_PACKET_BYTES: Final = 65_536
# A moment in 2001. A device whose clock was never set starts in 1970.
_EARLIEST_S: Final = 1e9
_PLACEHOLDER: Final = re.compile(r"\{(tag|sensor)\}|(\+)")


# Zigbee2MQTT's keys: https://www.zigbee2mqtt.io/guide/usage/exposes.html
_ZIGBEE: Final = {
    "temperature": Value("temperature"),
    "humidity": Value("humidity", low=0.0, high=100.0),
    "soil_moisture": Value("soil_moisture", low=0.0, high=100.0),
    "light": Value("illuminance", low=0.0),
    "co2": Value("co2", low=0.0),
}
# Suffix of an entity in Home Assistant's statestream → sensor:
# https://www.home-assistant.io/integrations/mqtt_statestream/
_HOME_ASSISTANT: Final = {
    "temperature": "temperature",
    "humidity": "humidity",
    "illuminance": "light",
    "carbon_dioxide": "co2",
    "co2": "co2",
    "soil_moisture": "soil_moisture",
    "moisture": "soil_moisture",
}
# Home Assistant's payloads for a sensor that is offline, or has not reported yet.
_AWAY, _UNKNOWN = b"unavailable", b"unknown"
PRESETS: Final = ("zigbee2mqtt", "homeassistant")


@dataclass(frozen=True, slots=True)
class Pattern:
    """One configured topic pattern, and how to read its payloads.

    `values` are by sensor; if empty, the payload is one number, of `sensor` or of the topic's.
    `names` maps the topic's name of a sensor to ours. `time` is the path of the measurement time.
    With `is_availability`, the payload tells whether the tag's sensor is online.
    """

    topic: str
    tag: str = ""
    sensor: str = ""
    values: Mapping[str, Value] = field(default_factory=dict)
    plain: Value = AS_IT_IS
    names: Mapping[str, str] = field(default_factory=dict)
    time: str = ""
    is_availability: bool = False

    @property
    def filter(self) -> str:
        """The topic filter to subscribe to: a level with a placeholder becomes `+`."""
        levels = self.topic.split("/")
        return "/".join("+" if _PLACEHOLDER.search(level) else level for level in levels)

    def match(self, topic: str) -> tuple[str, str] | None:
        """Tag and sensor of a topic, each empty if unknown; None if the topic does not match."""
        found = _regex(self.topic, tuple(self.names)).fullmatch(topic)
        if found is None:
            return None
        named = found.groupdict()
        sensor = named.get("sensor", self.sensor)
        return named.get("tag", self.tag), self.names.get(sensor, sensor)


@dataclass(frozen=True, slots=True)
class Broker:
    """A broker's address, our credentials, and the topic patterns to subscribe to."""

    host: str
    port: int
    patterns: tuple[Pattern, ...]
    user: str = ""
    password: str = ""
    is_tls: bool = False
    ca: str = ""


@dataclass(frozen=True, slots=True)
class Measured:
    """Content of one message: readings of a tag, or that its sensor is offline.

    `stamp_s` is seconds since the epoch; None if the payload has no time.
    """

    tag: str
    readings: tuple[tuple[str, float], ...] = ()
    stamp_s: float | None = None
    is_away: bool = False


def measured(pattern: Pattern, tag: str, sensor: str, payload: bytes) -> Measured:
    """Parse a payload.

    Raises:
        Rejected: a number is missing or out of range, or a name is too long.

    """
    check_texts("tag", tag)
    check_texts("sensor", sensor)
    if pattern.is_availability:
        return Measured(tag, is_away=b"offline" in payload.lower())
    if pattern.names and payload in (_AWAY, _UNKNOWN):
        return Measured(tag, is_away=payload == _AWAY)
    if not pattern.values:
        return Measured(tag, ((sensor, pattern.plain.reading(payload, "the payload")),))
    try:
        content = json.loads(payload)
    except (ValueError, RecursionError):
        raise Rejected(f"it is not JSON: {shown(payload[:40])}") from None
    readings = []
    for name, value in pattern.values.items():
        found = _at(content, value.path)
        if found is not None:  # a device may lack some sensors
            readings.append((name, value.reading(found, value.path)))
    if not readings:
        paths = ", ".join(value.path for value in pattern.values.values())
        raise Rejected(f"it has none of {paths}")
    stamp = _at(content, pattern.time) if pattern.time else None
    return Measured(tag, tuple(readings), None if stamp is None else _seconds(stamp))


def broker_of(table: Table, folder: Path) -> Broker:
    """Read the broker from the configuration's table `mqtt`.

    Raises:
        ConfigError: a key is invalid.

    """
    text = table.text("url")
    try:
        url = urlsplit(text)
        port = url.port
    except ValueError:
        url, port = urlsplit(""), 0
    if url.scheme not in PORTS or not url.hostname or port == 0 or url.path.strip("/"):
        raise wrong("mqtt.url", text, "such as mqtt://broker.lan:1883")
    if "@" in url.netloc:
        raise ConfigError("mqtt.url has a user in it: use mqtt.user and mqtt.password_file")
    listed = table.take("topics")
    if not isinstance(listed, list) or not 0 < len(listed) <= MAX_TOPICS:
        raise wrong("mqtt.topics", listed, f"a list of 1 to {MAX_TOPICS}")
    patterns: list[Pattern] = []
    for number, each in enumerate(listed):
        patterns.extend(_patterns(Table(f"mqtt.topics[{number}]", each)))
    broker = Broker(
        url.hostname,
        port or PORTS[url.scheme],
        tuple(patterns),
        user=str(table.take("user", "")),
        password=_password(table, folder),
        is_tls=url.scheme == "mqtts",
        ca=str(table.take("ca", "")),
    )
    table.end()
    return broker


def _password(table: Table, folder: Path) -> str:
    file = table.take("password_file", "")
    if not file:
        return ""
    try:
        with (folder / str(file)).open(encoding="utf-8") as opened:
            return opened.read(MAX_PACKET_BYTES).strip()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is not text"
        raise ConfigError(f"mqtt.password_file {file}: {reason}") from None


def _patterns(table: Table) -> Iterator[Pattern]:
    topic = table.text("topic")
    if "#" in topic or topic.startswith("/") or "$" in topic:
        raise wrong(f"{table.name}.topic", topic, "levels with {tag}, {sensor} or +")
    preset = table.one_of("preset", PRESETS) if table.has("preset") else ""
    tag = str(table.take("tag", ""))
    there = table.text("availability", "")
    for each in (topic, there or topic):
        if each.count("{tag}") > 1 or each.count("{sensor}") > 1:
            raise ConfigError(f"{table.name}: {shown(each)} has one of them twice")
        if bool(tag) == ("{tag}" in each):
            raise ConfigError(
                f"{table.name}: expected {{tag}} in {shown(each)}, or the key tag; one of them"
            )
    sensor = table.text("sensor", "")
    values = values_of(Table(f"{table.name}.values", table.take("values", {})), "path")
    if preset == "zigbee2mqtt":
        values = {**_ZIGBEE, **values}
        yield Pattern(f"{topic}/availability", tag, is_availability=True)
    names = _HOME_ASSISTANT if preset == "homeassistant" else {}
    if not values and bool(sensor) == ("{sensor}" in topic):
        raise ConfigError(
            f"{table.name}: a payload that is a number needs {{sensor}} in its topic, or sensor; "
            "JSON needs values, or a preset"
        )
    if there:
        yield Pattern(there, tag, is_availability=True)
    default = "last_seen" if preset == "zigbee2mqtt" else ""
    time = table.text("time", default)
    yield Pattern(topic, tag, sensor, values, value_of(table), names, time)
    table.end()


@lru_cache(maxsize=2 * MAX_TOPICS)
def _regex(topic: str, sensors: tuple[str, ...]) -> re.Pattern[str]:
    """Compile a topic's pattern; `sensors` limits the names that {sensor} matches, if not empty."""
    # A tag matches as little as possible, so that the sensor is `soil_moisture`, not `moisture`.
    known = "|".join(map(re.escape, sensors))
    parts, at = [], 0
    for found in _PLACEHOLDER.finditer(topic):
        parts.append(re.escape(topic[at : found.start()]))
        name = found[1]
        any_level = known if known and name == "sensor" else "[^/]+?"
        parts.append(f"(?P<{name}>{any_level})" if name else "[^/]+")
        at = found.end()
    return re.compile("".join(parts) + re.escape(topic[at:]))


def _at(content: Any, path: str) -> Any:
    for key in path.split("."):
        if isinstance(content, list) and key.isdecimal() and int(key) < len(content):
            content = content[int(key)]
        elif isinstance(content, dict):
            content = content.get(key)
        else:
            return None
    return content


def _seconds(stamp: Any) -> float:
    try:
        seconds = seconds_of(stamp, UTC)
    except Rejected as error:
        raise Rejected(f"its time is {shown(stamp)}: {error}") from None
    if seconds < _EARLIEST_S:
        raise Rejected(f"its time is {shown(stamp)}, before 2001: was its clock ever set?")
    return seconds


# Messages queued for the node's thread; beyond that, the oldest is lost and counted. At their
# largest, they take 65 MB.
MAX_WAITING: Final = 1_000
RETRY_S: Final = (1, 60)


class MqttClient:
    """Subscribes to a broker's topics, and reconnects by itself.

    `wake` is called from paho's thread when a message is queued.

    Raises:
        ConfigError: the library is not installed, or a certificate cannot be read.

    """

    def __init__(self, broker: Broker, wake: Callable[[], None]) -> None:
        try:
            from paho.mqtt.client import Client  # noqa: PLC0415  # needed only with a broker
            from paho.mqtt.enums import CallbackAPIVersion, MQTTProtocolVersion  # noqa: PLC0415
            from paho.mqtt.packettypes import PacketTypes  # noqa: PLC0415
            from paho.mqtt.properties import Properties  # noqa: PLC0415
        except ImportError:
            raise ConfigError(
                "mqtt: the package paho-mqtt is not installed here: "
                "pip install 'paho-mqtt>=2', or on a robot a virtual environment with it"
            ) from None
        self._broker = broker
        self._wake = wake
        self._waiting: deque[Any] = deque(maxlen=MAX_WAITING)
        self.lost = 0
        self.problem = f"not connected to {broker.host}:{broker.port} yet"
        self._client: Any = Client(
            CallbackAPIVersion.VERSION2,
            client_id=f"lupin-adapt-{secrets.token_hex(6)}",
            protocol=MQTTProtocolVersion.MQTTv5,
        )
        # The broker does not send larger packets (MQTT 5, 3.1.2.11.4).
        self._limits = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]
        self._limits.MaximumPacketSize = MAX_PACKET_BYTES
        if broker.user:
            self._client.username_pw_set(broker.user, broker.password or None)
        if broker.is_tls:
            try:
                self._client.tls_set_context(ssl.create_default_context(cafile=broker.ca or None))
            except (ssl.SSLError, OSError) as error:
                raise ConfigError(f"mqtt.ca {broker.ca}: {error.strerror or error}") from None
        self._client.reconnect_delay_set(*RETRY_S)
        self._client.on_connect = self._on_connect
        self._client.on_disconnect = self._on_disconnect
        self._client.on_connect_fail = self._on_connect_fail
        self._client.on_message = self._on_message

    def start(self) -> None:
        """Start a thread that connects."""
        self._client.connect_async(self._broker.host, self._broker.port, properties=self._limits)
        self._client.loop_start()

    def stop(self) -> None:
        """End the connection and the thread."""
        self._client.disconnect()
        self._client.loop_stop()

    def take(self) -> list[Any]:
        """Return paho's messages received since the last call, in order."""
        return [self._waiting.popleft() for _ in range(len(self._waiting))]

    def _on_connect(
        self, client: Any, _data: Any, _flags: Any, code: Any, _properties: Any
    ) -> None:
        if code.is_failure:
            self.problem = f"{self._broker.host}:{self._broker.port} refuses the connection: {code}"
            return
        self.problem = ""
        client.subscribe([(pattern.filter, 1) for pattern in self._broker.patterns])

    def _on_connect_fail(self, _client: Any, _data: Any) -> None:
        self.problem = f"nothing answers at {self._broker.host}:{self._broker.port}"

    def _on_disconnect(
        self, _client: Any, _data: Any, _flags: Any, code: Any, _properties: Any
    ) -> None:
        self.problem = f"the connection to {self._broker.host} has ended: {code}"

    def _on_message(self, _client: Any, _data: Any, message: Any) -> None:
        if len(self._waiting) == MAX_WAITING:
            self.lost += 1
        self._waiting.append(message)
        self._wake()
