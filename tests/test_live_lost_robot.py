"""A robot that is lost pins a tag kilometres away: the site stays usable, and says which tag."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.support.messages import scan
from tests.support.web import Bridge, bridge

AT = {"1": (1.0, 1.0), "2": (3.0, 1.0), "3": (3.0, 3.0)}
# A twin that knows such a pose already, from before there was a limit.
ALL_POSES = ("--ros-args", "-p", "max_pose_m:=1000000.0")
LOST = "lost"


def at_home(running: Bridge) -> None:
    for tag_id, at in AT.items():
        running.peer.observe(scan(tag_id, {"temperature": 20.0}, at=at))
        running.tag(tag_id)


@pytest.fixture(scope="module")
def far() -> Iterator[Bridge]:
    """A greenhouse of three tags, and one that a lost robot has pinned at x = 5,000 m."""
    with bridge(*ALL_POSES) as running:
        at_home(running)
        running.peer.observe(scan(LOST, {"temperature": 40.0}, at=(5000.0, 1.0)))
        running.tag(LOST)
        yield running


@pytest.mark.parametrize("is_past", [False, True])
@pytest.mark.parametrize("sensor", ["temperature", "vpd"])
def test_the_default_field_is_that_of_the_tags_at_home(
    far: Bridge, sensor: str, is_past: bool
) -> None:
    query: dict[str, Any] = {"sensor_type": sensor}
    if is_past:
        stamp = far.json("/api/state")["header"]["stamp"]
        query["at"] = f"{stamp['sec']}.{stamp['nanosec']:09d}"
    answer = far.get("/api/field", **query)
    assert answer.status_code == 200, answer.text
    body = answer.json()
    assert (body["origin_x"], body["origin_y"]) == (-0.5, -0.5)
    assert (body["width"], body["height"]) == (50, 50)
    assert answer.headers["x-field-far-off-count"] == "1"


def test_quality_says_which_tags_are_left_out(far: Bridge) -> None:
    quality = far.json("/api/field/quality", sensor_type="temperature")
    assert quality["far_off_tags"] == [LOST]
    assert quality["sample_count"] == 4


def test_a_box_of_one_s_own_shows_the_tag_that_is_far_off(far: Bridge) -> None:
    box: dict[str, Any] = {"bbox_min_x": 4999, "bbox_min_y": 0, "bbox_max_x": 5001, "bbox_max_y": 2}
    body = far.json("/api/field", sensor_type="temperature", resolution=0.5, **box)
    assert set(body["values"]) == {40.0}
