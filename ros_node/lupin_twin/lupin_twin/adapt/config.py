"""The configuration of `adapt`: topics, message fields, and tag positions. Pure.

Every error names the key as in the file, its value, and what is expected.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

from lupin_twin.adapt.mqtt import Broker, broker_of
from lupin_twin.adapt.table import (
    AS_IT_IS,
    ConfigError,
    Table,
    Value,
    check_text,
    is_number,
    value_of,
    wrong,
)
from lupin_twin.core.drops import MAX_SENSORS_PER_TAG, MAX_TAGS
from lupin_twin.core.parameters import FARTHEST_M
from lupin_twin.core.state import Pose

MAX_FILE_BYTES: Final = 4_000_000
_TYPE: Final = re.compile(r"[a-z][a-z0-9_]*/msg/[A-Za-z][A-Za-z0-9]*")
_FIELD: Final = re.compile(r"[a-z]\w*(\[\d{1,9}\])?(\.[a-z]\w*(\[\d{1,9}\])?)*")


# Message type → sensor (empty: the topic names it), and where its number is. The factor converts
# to our unit: ratio to %, Pa to hPa.
STANDARD: Final[Mapping[str, tuple[str, Value]]] = {
    "sensor_msgs/msg/Temperature": ("temperature", Value("temperature")),
    "sensor_msgs/msg/RelativeHumidity": ("humidity", Value("relative_humidity", 100.0)),
    "sensor_msgs/msg/Illuminance": ("light", Value("illuminance")),
    "sensor_msgs/msg/FluidPressure": ("pressure", Value("fluid_pressure", 0.01)),
    "std_msgs/msg/Float32": ("", Value("data")),
    "std_msgs/msg/Float64": ("", Value("data")),
}
# Name that apriltag_ros gives to a tag's frame, unless its parameter `tag.frames` sets another.
TAG_FRAME: Final = "{family}:{id}"
# Message type → function that returns its pose. All of them have a header.
POSES: Final[Mapping[str, Callable[[Any], Any]]] = {
    "geometry_msgs/msg/PoseWithCovarianceStamped": attrgetter("pose.pose"),
    "geometry_msgs/msg/PoseStamped": attrgetter("pose"),
    "nav_msgs/msg/Odometry": attrgetter("pose.pose"),
}


@dataclass(frozen=True, slots=True)
class Robot:
    """Source of the robot's pose: a topic, or the TF frame `tf`.

    A pose is valid for `max_age_s`: localisation may publish nothing while the robot stands still.
    """

    topic: str = ""
    type_name: str = ""
    max_age_s: float = 30.0
    tf: str = ""


@dataclass(frozen=True, slots=True)
class Detections:
    """The topic of apriltag_ros, whose tags are TF frames; `name` is the pattern of a tag's id."""

    topic: str
    name: str = TAG_FRAME

    def tag_id(self, family: str, number: int) -> str:
        """The tag's id in the twin."""
        return self.name.replace("{family}", family).replace("{id}", str(number))


@dataclass(frozen=True, slots=True)
class Sensor:
    """One number in one topic's messages. `tag`: where the sensor is fixed; empty: on the robot."""

    name: str
    topic: str
    type_name: str
    value: Value
    tag: str = ""


@dataclass(frozen=True, slots=True)
class Config:
    """The whole configuration. Lengths are metres in `frame_id`, times are seconds.

    `frames`: tag id → TF frame, for tags without a fixed position.
    `reach_m`: the robot scans a tag within this distance. `window_s`: readings of one tag are
    averaged over this time, or until the robot leaves. `cell_m`: where no tag is in reach, a grid
    cell of this size serves as a tag; 0: readings between tags are not used.
    """

    sensors: tuple[Sensor, ...]
    robot: Robot | None = None
    tags: Mapping[str, Pose] = field(default_factory=dict)
    frames: Mapping[str, str] = field(default_factory=dict)
    detections: Detections | None = None
    frame_id: str = "map"
    reach_m: float = 0.8
    window_s: float = 10.0
    cell_m: float = 0.0
    broker: Broker | None = None


def read_config(path: Path) -> Config:
    """Read the configuration from a YAML file; `tags` may name a second file in its folder.

    Raises:
        ConfigError: it cannot be read, or is invalid.

    """
    try:
        return config_of(read_yaml(path), path.parent)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None


def config_of(content: Any, folder: Path = Path()) -> Config:
    """Make the configuration from a file's parsed content; see `read_config`."""
    table = Table("", content)
    robot = _robot(Table("robot", table.take("robot"))) if table.has("robot") else None
    tags = dict(_tags(table.take("tags", {}), folder))
    sensors = tuple(_sensors(Table("sensors", table.take("sensors", {}))))
    config = Config(
        sensors,
        robot,
        {name: at for name, at in tags.items() if isinstance(at, Pose)},
        {name: at for name, at in tags.items() if isinstance(at, str)},
        _detections(Table("detections", table.take("detections")))
        if table.has("detections")
        else None,
        frame_id=table.text("frame_id", "map"),
        reach_m=table.number("reach_m", 0.8, 0.01, 100.0),
        window_s=table.number("window_s", 10.0, 0.1, 3600.0),
        cell_m=table.number("cell_m", 0.0, 0.0, 100.0),
        broker=broker_of(Table("mqtt", table.take("mqtt")), folder) if table.has("mqtt") else None,
    )
    table.end()
    if not sensors and config.broker is None:
        raise ConfigError("sensors and mqtt are both missing, expected at least one")
    for sensor in sensors:
        if sensor.tag and sensor.tag not in tags:
            raise ConfigError(
                f"sensors.{sensor.name}.tag is {sensor.tag!r}, which is not one of tags"
            )
    if robot is None and not all(sensor.tag for sensor in sensors):
        moving = next(sensor.name for sensor in sensors if not sensor.tag)
        raise ConfigError(
            f"sensors.{moving} has no tag, so it is the robot's, but robot is not given"
        )
    if robot is None and config.detections is not None:
        raise ConfigError("detections: robot is not given, so no tag would be within its reach")
    if robot is not None and not tags and not config.cell_m and config.detections is None:
        raise ConfigError(
            "tags: none is given, no detections, and cell_m is 0: no reading would have a place"
        )
    return config


def _robot(table: Table) -> Robot:
    has_tf = table.has("tf")
    robot = Robot(
        topic="" if has_tf else table.text("topic"),
        type_name="" if has_tf else table.one_of("type", POSES),
        max_age_s=table.number("max_age_s", 30.0, 0.1, 86_400.0),
        tf=table.text("tf") if has_tf else "",
    )
    table.end()
    return robot


def _detections(table: Table) -> Detections:
    detections = Detections(table.text("topic"), table.text("name", TAG_FRAME))
    table.end()
    if "{id}" not in detections.name:
        raise wrong("detections.name", detections.name, "{id} in it, and {family}")
    return detections


def _tags(content: Any, folder: Path) -> Iterator[tuple[str, Pose | str]]:
    if isinstance(content, str):
        try:
            content = read_yaml(folder / content)
        except ConfigError as error:
            raise ConfigError(f"tags: {content}: {error}") from None
    table = Table("tags", content)
    if len(table.content) > MAX_TAGS:
        raise ConfigError(f"tags: {len(table.content)}, the limit is {MAX_TAGS}")
    for key in tuple(table.content):
        # An unquoted 12 is a number in YAML, but a valid tag name all the same.
        name = str(key) if isinstance(key, int) and not isinstance(key, bool) else key
        check_text("tags", name)
        at = table.take(key)
        if isinstance(at, str):
            yield name, check_text(f"tags.{name}", at)
            continue
        yield name, place_of(f"tags.{name}", at, ", or a frame of TF")


def place_of(what: str, at: Any, otherwise: str = "") -> Pose:
    """Return a position, m. `otherwise` ends the error message: what else is allowed there.

    Raises:
        ConfigError: it is not a position.

    """
    if (
        not isinstance(at, list)
        or len(at) not in (2, 3)
        or not all(is_number(each) and abs(each) <= FARTHEST_M for each in at)
    ):
        limits = f"[x, y] or [x, y, z] in m up to {FARTHEST_M:.0f}"
        raise wrong(what, at, f"{limits}{otherwise}")
    return Pose.at(*at)


def _sensors(table: Table) -> Iterator[Sensor]:
    if len(table.content) > MAX_SENSORS_PER_TAG:
        raise ConfigError(f"sensors: {len(table.content)}, the limit is {MAX_SENSORS_PER_TAG}")
    for name in tuple(table.content):
        check_text("sensors", name)
        given = table.take(name)
        several = isinstance(given, list)
        for number, each in enumerate(given if several else [given]):
            called = f"sensors.{name}[{number}]" if several else f"sensors.{name}"
            yield _sensor(name, Table(called, each))


def _sensor(name: str, table: Table) -> Sensor:
    type_name = table.text("type")
    if not _TYPE.fullmatch(type_name):
        raise wrong(f"{table.name}.type", type_name, "such as sensor_msgs/msg/Temperature")
    _, known = STANDARD.get(type_name, ("", AS_IT_IS))
    field = table.text("field", known.path or None)
    if not _FIELD.fullmatch(field):
        raise wrong(f"{table.name}.field", field, "a path such as data or axes[2].value")
    # The factor belongs to the standard field; another field of the message has its own unit.
    factor = known.factor if field == known.path else 1.0
    sensor = Sensor(
        name,
        topic=table.text("topic"),
        type_name=type_name,
        value=value_of(table, field, factor),
        tag=str(table.take("tag", "")),
    )
    table.end()
    return sensor


def read_yaml(path: Path) -> Any:
    """Return the content of a YAML file; errors do not name it.

    Raises:
        ConfigError: it cannot be read, is too large, or is not YAML.

    """
    import yaml  # noqa: PLC0415  # commands that read no YAML start without it

    class Loader(yaml.SafeLoader):
        """Refuses aliases: a few lines of them can expand to more than any memory holds."""

        def compose_node(self, parent: Any, index: Any) -> Any:
            if self.check_event(yaml.AliasEvent):
                alias = self.peek_event()  # type: ignore[no-untyped-call]  # PyYAML is not
                raise yaml.composer.ComposerError(
                    None, None, f"the alias *{alias.anchor} is not taken", alias.start_mark
                )
            return super().compose_node(parent, index)

    try:
        with path.open("rb") as file:
            content = file.read(MAX_FILE_BYTES + 1)
    except OSError as error:
        raise ConfigError(str(error.strerror)) from None
    if len(content) > MAX_FILE_BYTES:
        raise ConfigError(f"it has more than {MAX_FILE_BYTES} bytes, the limit")
    try:
        return yaml.load(content, Loader)  # noqa: S506  # it is a SafeLoader
    # PyYAML passes on Python's errors about encoding, numbers of thousands of digits, and [[[[[...
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ConfigError(f"not YAML: {' '.join(str(error).split())[:200]}") from None
