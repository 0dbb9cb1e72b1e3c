"""A second publisher of the state is told of once it speaks; one that only stands there is not."""

from __future__ import annotations

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup

from lupin_twin.numbering import TwinCount
from lupin_twin.other_twins import OtherTwins
from tests.support.ros import Peer


class Told:
    """The one habit that is used."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def warn(self, key: tuple[str, object], text: str) -> None:
        """Keep what is warned of."""
        self.texts.append(text)


def test_it_listens_only_while_there_are_several(domain: int) -> None:
    from lupin_msgs.msg import TwinState

    told, count = Told(), TwinCount()
    with Peer(domain) as peer:
        group = MutuallyExclusiveCallbackGroup()
        others = OtherTwins(peer.node, told, count, "s", group)  # type: ignore[arg-type]
        publishers = [peer.node.create_publisher(TwinState, "/s", 1) for _ in range(2)]
        peer.until(lambda: peer.node.count_publishers("/s") == 2, "both publishers")
        others.look("/s")
        assert peer.node.count_subscribers("/s") == 1
        assert told.texts == []
        for number in (1, 7, 2):
            count.hear(number)
        others.look("/s")
        assert told.texts[0].startswith("2 nodes publish /s: consumers get a mixture")
        peer.node.destroy_publisher(publishers[0])
        peer.until(lambda: peer.node.count_publishers("/s") == 1, "one publisher")
        others.look("/s")
        assert peer.node.count_subscribers("/s") == 0
