"""Layers and marks as messages: what a viewer reads of them again."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import PointCloud2, PointField
from visualization_msgs.msg import Marker, MarkerArray

from lupin_twin.ros.layers import (
    COLOURS,
    MarkerArrays,
    TagMark,
    cloud,
    tag_markers,
)


@pytest.mark.parametrize("count", [0, 1, 1_000])
def test_a_cloud_is_its_points_bit_by_bit(count: int) -> None:
    points = np.random.default_rng(1).normal(size=(count, 5)).astype(np.float32)
    msg = deserialize_message(cloud(points, 5_000_000_007, "map"), PointCloud2)
    assert (msg.header.frame_id, msg.header.stamp.sec, msg.header.stamp.nanosec) == ("map", 5, 7)
    assert [(f.name, f.offset, f.datatype, f.count) for f in msg.fields] == [
        (name, 4 * index, PointField.FLOAT32, 1)
        for index, name in enumerate(("x", "y", "z", "value", "error"))
    ]
    assert (msg.width, msg.height, msg.point_step, msg.row_step) == (count, 1, 20, 20 * count)
    assert (msg.is_dense, msg.is_bigendian) == (True, False)
    assert bytes(msg.data) == points.tobytes()


TAGS = st.builds(
    TagMark,
    st.integers(0, 20_000),
    st.text(max_size=12),
    *[st.floats(-1e3, 1e3)] * 3,
    st.sampled_from(list(COLOURS)),
)


@given(st.lists(TAGS, max_size=6, unique_by=lambda mark: mark.number), st.text("abc", max_size=9))
def test_an_array_of_parts_is_the_array_that_ros_makes(marks: list[TagMark], frame: str) -> None:
    arrays = MarkerArrays(tag_markers, frame)
    arrays.build(marks[::2])  # so that some parts are kept
    plain = MarkerArray(markers=[each for mark in marks for each in tag_markers(mark, frame)])
    expected = deserialize_message(serialize_message(plain), MarkerArray)  # in float32
    msg = deserialize_message(arrays.build(marks), MarkerArray)
    assert msg.markers[0].action == Marker.DELETEALL
    assert msg.markers[1:] == expected.markers


def test_only_marks_that_changed_are_made_anew_and_those_that_are_gone_are_forgotten() -> None:
    made: list[int] = []

    def make(mark: TagMark, frame_id: str) -> list[Any]:
        made.append(mark.number)
        return tag_markers(mark, frame_id)

    one, two = (TagMark(n, "t", 0.0, 0.0, 0.0, "fresh") for n in (1, 2))
    arrays = MarkerArrays(make, "map")
    arrays.build([one, two])
    arrays.build([one, two._replace(appearance="old")])
    assert made == [1, 2, 2]
    msg = deserialize_message(arrays.build([one]), MarkerArray)
    assert [(m.ns, m.id) for m in msg.markers[1:]] == [("tags", 1), ("names", 1)]
    arrays.forget()
    arrays.build([one])
    assert made == [1, 2, 2, 1]


def test_a_tag_is_a_ball_of_its_colour_and_its_name_above() -> None:
    ball, name = tag_markers(TagMark(3, "T3", 1.0, 2.0, 0.5, "failed"), "map")
    assert (ball.type, ball.id, ball.pose.position.x, ball.pose.position.z) == (
        Marker.SPHERE, 3, 1.0, 0.5,
    )  # fmt: skip
    assert (ball.color.r, ball.color.g, ball.color.b) == COLOURS["failed"]
    assert (name.type, name.text, name.id) == (Marker.TEXT_VIEW_FACING, "T3 (failed)", 3)
    assert name.pose.position.z > ball.pose.position.z
    # At whatever time it is looked at, and until it is deleted.
    assert ball.header.stamp.sec == ball.lifetime.sec == 0
