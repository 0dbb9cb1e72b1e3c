"""Layers and marks as messages, and as a viewer reads them."""

from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker, MarkerArray

from lupin_twin.ros.layers import COLOURS, TagMark, marker_array, tag_markers

TAGS = st.builds(
    TagMark,
    st.integers(0, 20_000),
    st.text(max_size=12),
    *[st.floats(-1e3, 1e3)] * 3,
    st.sampled_from(list(COLOURS)),
)


@given(st.lists(TAGS, max_size=6, unique_by=lambda mark: mark.number), st.text("abc", max_size=9))
def test_an_array_starts_with_a_deletion_followed_by_all_markers(
    marks: list[TagMark], frame: str
) -> None:
    plain = MarkerArray(markers=[each for mark in marks for each in tag_markers(mark, frame)])
    expected = deserialize_message(serialize_message(plain), MarkerArray)  # in float32
    msg = deserialize_message(marker_array(marks, tag_markers, frame), MarkerArray)
    assert msg.markers[0].action == Marker.DELETEALL
    assert msg.markers[1:] == expected.markers
