"""The node over real DDS while somebody strains it: the state keeps its beat, nothing is lost."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import pytest
from lupin_msgs.msg import DiscoveredTag, DiscoveredTags
from rclpy.serialization import serialize_message

from tests.support.domains import own_domain
from tests.support.messages import scan
from tests.support.proc_stat import peak_mb, reset_peak, resident_mb
from tests.support.processes import Process, twin_node
from tests.support.ros import Peer

BEAT_S = 0.1


class Strained:
    """A twin at ten states a second, and a peer that measures the pauses between them."""

    def __init__(self, process: Process, peer: Peer) -> None:
        self.process, self.peer = process, peer

    def longest_pause_s(self, done: Callable[[], object], what: str) -> float:
        """The longest time without a state until `done` gives something true."""
        last_s, longest_s, seen = time.monotonic(), 0.0, len(self.peer.states)

        def look() -> object:
            nonlocal last_s, longest_s, seen
            if len(self.peer.states) > seen:
                now_s = time.monotonic()
                longest_s, last_s, seen = (
                    max(longest_s, now_s - last_s),
                    now_s,
                    len(self.peer.states),
                )
            return done()

        self.peer.until(look, what)
        return max(longest_s, time.monotonic() - last_s)


@pytest.fixture
def strained() -> Iterator[Strained]:
    with (
        own_domain() as domain,
        twin_node(domain, "--ros-args", "-p", f"state_publish_rate_hz:={1 / BEAT_S}") as process,
        Peer(domain) as peer,
    ):
        peer.wait_for_twin()
        peer.listen()
        peer.until(lambda: peer.states, "a state")
        yield Strained(process, peer)


def test_a_length_that_lies_delays_no_state_and_takes_no_memory(strained: Strained) -> None:
    peer, pid = strained.peer, strained.process.pid
    topic = "/perception/discovered_tags"
    whole = serialize_message(DiscoveredTags(tags=[DiscoveredTag()]))
    at = whole.index(b"\x01\x00\x00\x00", 20)  # behind the header: how many tags
    lie = whole[:at] + (3_000_000).to_bytes(4, "little") + whole[at + 4 :] + bytes(3_000_000)
    before_mb = resident_mb(pid)
    reset_peak(pid)
    peer.publisher(topic, DiscoveredTags).publish(lie)
    pause_s = strained.longest_pause_s(
        lambda: "tags: 3000000, the limit is 20000" in strained.process.output,
        "the lie to be told of",
    )
    peer.observe(scan("after", {"co2": 1.0}))
    peer.tag("after")
    assert peak_mb(pid) - before_mb < 40.0
    assert pause_s < 1.0, "a tick of the default rate"
