"""The contract's types: the names of the ROS messages, and what a live bridge really sends."""

import math
from collections.abc import Iterator
from typing import Any

import pytest
from geometry_msgs.msg import Point, Polygon, Pose, Quaternion
from lupin_msgs.msg import FlowerPoint, SensorReading, TagTimes, TwinState, TwinTagState
from lupin_msgs.srv import GetField
from nav_msgs.msg import MapMetaData, OccupancyGrid
from pydantic import BaseModel, ValidationError
from std_msgs.msg import Header

from lupin_bridge.stream import schema
from tests.support.messages import discovered, look, occupancy_grid, pose, scan
from tests.support.web import Bridge, bridge


def names(message_type: Any) -> list[str]:
    """The fields of a ROS message, in their order."""
    return list(message_type.get_fields_and_field_types())


@pytest.mark.parametrize(
    ("model", "message_type"),
    [
        (schema.TwinState, TwinState),
        (schema.FlowerPoint, FlowerPoint),
        (schema.GetFieldResponse, GetField.Response),
        (schema.MapMetaData, MapMetaData),
        (schema.Header, Header),
        (schema.Pose, Pose),
        (schema.Point, Point),
        (schema.Quaternion, Quaternion),
        (schema.Polygon, Polygon),
    ],
)
def test_a_type_has_its_messages_fields_in_their_order(
    model: type[BaseModel], message_type: Any
) -> None:
    assert list(model.model_fields) == names(message_type)


@pytest.mark.parametrize(
    ("model", "message_type", "times"),
    [
        (
            schema.TwinTagState,
            TwinTagState,
            ["looked_at", "last_try", "last_try_status", "last_try_detail"],
        ),
        (schema.SensorReading, SensorReading, ["observed_at"]),
    ],
)
def test_behind_its_messages_fields_a_type_has_the_times(
    model: type[BaseModel], message_type: Any, times: list[str]
) -> None:
    assert list(model.model_fields) == names(message_type) + times
    told = set(names(TagTimes)) - {"tag_id", "sensors"}
    assert set(times) <= told


def test_the_map_has_all_of_its_message_but_the_cells() -> None:
    assert list(schema.OccupancyGrid.model_fields) == [
        name for name in names(OccupancyGrid) if name != "data"
    ]


def test_a_field_that_the_contract_does_not_name_is_an_error() -> None:
    assert schema.Time.model_validate({"sec": 1, "nanosec": 2}).sec == 1
    with pytest.raises(ValidationError, match="extra"):
        schema.Time.model_validate({"sec": 1, "nanosec": 2, "usec": 3})


def test_every_type_forbids_what_it_does_not_name() -> None:
    models = [m for m in vars(schema).values() if isinstance(m, type) and issubclass(m, BaseModel)]
    assert len(models) > 15
    assert all(model.model_config.get("extra") == "forbid" for model in models[1:])


# --- a live bridge ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def live() -> Iterator[Bridge]:
    """A bridge that has heard of everything that a tag can have."""
    with bridge() as running:
        peer = running.peer
        peer.observe(
            scan("full", {"temperature": 21.5, "co2": math.nan, "light": math.inf}, at=(1, 2)),
            look("full", at=(1, 2), blooms=[(1, 2), (3, 4)], footprint=[(0, 0), (1, 0), (1, 1)]),
            scan("no pose", {"temperature": 1.0}),
        )
        peer.discover(discovered({"discovered": pose(3, 3)}))
        peer.publish_map(occupancy_grid([[0, 100], [-1, 50]]))
        running.tag("full", lambda tag: tag["species"])
        running.tag("discovered")
        running.tag("no pose")
        # The topic is told at 1 Hz, what the bridge shows is younger.
        peer.tag("full", lambda tag: tag.flowers)
        # Frames are paced: the one that new listeners get may be a moment older than the state.
        with running.listen() as listener:
            listener.until(
                "state",
                lambda frame: any(
                    tag["tag_id"] == "full" and tag["flowers"] for tag in frame["state"]["tags"]
                ),
            )
        yield running


def test_live_frames_are_of_the_contracts_types(live: Bridge) -> None:
    with live.listen() as listener:
        status = listener.connection.recv()
        state = listener.connection.recv()
    schema.StatusFrame.model_validate_json(status, strict=True)
    tags = schema.StateFrame.model_validate_json(state, strict=True).state.tags
    full = next(tag for tag in tags if tag.tag_id == "full")
    assert [(r.name, r.value) for r in full.readings] == [
        ("temperature", 21.5),
        ("co2", None),
        ("light", None),
    ]
    assert (len(full.flowers), len(full.box_footprint.points)) == (2, 3)


# What a float32 field of a message has lost is not in the JSON either; ages differ by a moment.
NUMBERS_APART = 1e-6


def as_json(value: Any) -> Any:
    """A ROS message as the contract has it: field by field, NaN and infinity as None."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: as_json(getattr(value, name)) for name in names(value)}
    if isinstance(value, float):
        return pytest.approx(value, abs=NUMBERS_APART) if math.isfinite(value) else None
    return [as_json(item) for item in value] if isinstance(value, list) else value


@pytest.mark.parametrize("tag_id", ["full", "no pose", "discovered"])
def test_a_tag_on_the_web_is_the_tag_on_the_topic(live: Bridge, tag_id: str) -> None:
    message = as_json(live.peer.tag(tag_id))
    web = live.json(f"/api/tags/{tag_id}")
    for name in ("looked_at", "last_try", "last_try_status", "last_try_detail"):
        web.pop(name, None)
    for reading in web["readings"]:
        reading.pop("observed_at", None)
    assert (web.pop("stale_seconds") is None) == (message.pop("stale_seconds") is None)
    assert web == message
