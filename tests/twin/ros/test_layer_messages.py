"""Layers and marks as messages, and as a viewer reads them."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker, MarkerArray

from lupin_twin.ros.layers import COLOURS, MarkerArrays, TagMark, tag_markers

TAGS = st.builds(
    TagMark,
    st.integers(0, 20_000),
    st.text(max_size=12),
    *[st.floats(-1e3, 1e3)] * 3,
    st.sampled_from(list(COLOURS)),
)


def arrays_of(frame_id: str, make: Any = tag_markers) -> Any:
    """Of marks themselves, where a twin has a snapshot."""
    same: Any = list
    return MarkerArrays(same, make, frame_id)


@given(st.lists(TAGS, max_size=6, unique_by=lambda mark: mark.number), st.text("abc", max_size=9))
def test_an_array_starts_with_a_deletion_followed_by_all_markers(
    marks: list[TagMark], frame: str
) -> None:
    arrays = arrays_of(frame)
    first = arrays.build(marks[::2])  # so that some are known already
    plain = MarkerArray(markers=[each for mark in marks for each in tag_markers(mark, frame)])
    expected = deserialize_message(serialize_message(plain), MarkerArray)  # in float32
    built = arrays.build(marks)
    assert (built is None) == (marks == marks[::2]), "nothing is another"
    msg = deserialize_message(built or first, MarkerArray)
    assert msg.markers[0].action == Marker.DELETEALL
    assert msg.markers[1:] == expected.markers


def test_only_changed_marks_are_rebuilt_and_removed_ones_are_dropped() -> None:
    made: list[int] = []

    def make(mark: TagMark, frame_id: str) -> list[Any]:
        made.append(mark.number)
        return tag_markers(mark, frame_id)

    one, two = (TagMark(n, "t", 0.0, 0.0, 0.0, "fresh") for n in (1, 2))
    arrays = arrays_of("map", make)
    arrays.build([one, two])
    arrays.build([one, two._replace(appearance="old")])
    assert made == [1, 2, 2]
    msg = deserialize_message(arrays.build([one]), MarkerArray)
    assert [(m.ns, m.id) for m in msg.markers[1:]] == [("tags", 1), ("names", 1)]
    arrays.build([one, two])
    assert made == [1, 2, 2, 2]
