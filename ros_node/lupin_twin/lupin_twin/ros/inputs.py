"""Latched input topics of a node: matches publishers of any QoS, and detects losses and problems.

Fast DDS does not report when a queue overflows: its event for lost messages stays silent. But each
writer numbers its messages. A message does not name its writer, so its number is matched to the
writer whose last number it continues.
"""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from lupin_twin.runtime.process import FOLDER, ports

# What rclpy calls a node whose name DDS does not know (rmw_dds_common, graph_cache.cpp).
_NO_NAME: Final = "_NODE_NAME_UNKNOWN_"
# Latched messages arrive when a publisher is discovered; lost ones are sent again within 3 s.
SETTLED_S: Final = 5.0
# rmw_fastrtps makes its own transports for LOCALHOST (8.4.3, participant.cpp).
_HINT: Final = (
    "shared memory does not cross users. Run both as one user, or set "
    "FASTDDS_BUILTIN_TRANSPORTS=UDPv4, without ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"
)


def _profiles(depth: int) -> tuple[QoSProfile, ...]:
    """QoS profiles for subscribing to a latched topic, best first; each matches more publishers.

    The first is the contract's: RELIABLE and TRANSIENT_LOCAL. DDS does not match it with a
    publisher of ROS's default, which is VOLATILE, nor the second with one that is BEST_EFFORT.
    """
    reliable, best_effort = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT
    latched, volatile = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE
    return tuple(
        QoSProfile(depth=depth, reliability=reliability, durability=durability)
        for reliability, durability in (
            (reliable, latched),
            (reliable, volatile),
            (best_effort, volatile),
        )
    )


# Writers followed at once; with more, the one that was silent longest is forgotten.
MAX_WRITERS: Final = 16


class Gaps:
    """Detects messages lost on one topic by the numbers of its writers."""

    def __init__(self) -> None:
        self._next: list[int] = []  # the next number of each writer, the last active one at the end

    def see(self, number: int, writers: Callable[[], int]) -> int:
        """Note a message's number; returns how many are known to be lost before it.

        `writers` counts the current writers; it is called only if the number is not expected. A
        number that may be the first of a new writer counts as that.
        """
        if number in self._next:
            self._next.remove(number)
            self._next.append(number + 1)
            return 0
        lost = 0
        before = [expected for expected in self._next if expected < number]
        if before and len(self._next) >= writers():
            nearest = max(before)
            lost = number - nearest
            self._next.remove(nearest)
        self._next.append(number + 1)
        del self._next[:-MAX_WRITERS]
        return lost

    def settle(self, writers: int) -> None:
        """Note that there are `writers`, and that those without a message have published none."""
        self._next[:0] = [1] * (writers - len(self._next))

    def unsettle(self) -> None:
        """Note that the writers have changed: a new one may begin with any number."""
        self._next = [expected for expected in self._next if expected != 1]


class Input:
    """Follows the messages and publishers of a topic; belongs to its node's thread."""

    def __init__(self, depth: int) -> None:
        self.topic = ""
        self.gaps = Gaps()
        self.profiles = _profiles(depth)
        # How many of the profiles are subscribed with.
        self.subscriptions = 0
        self._has_received = False
        # The last messages; more than the queues of all subscriptions can hold.
        self._last: deque[tuple[int, int]] = deque(maxlen=4 * depth)
        self._publishers: frozenset[bytes] = frozenset()
        self._since_s = -math.inf

    def is_new(self, info: dict[str, Any]) -> bool:
        """Whether a message was not received yet; a second subscription receives it again."""
        self._has_received = True
        if self.subscriptions <= 1:
            return True
        # A message has these two from its publisher, the same in every subscription.
        key = info["source_timestamp"], info["publication_sequence_number"]
        if key in self._last:
            return False
        self._last.append(key)
        return True

    def check(self, publishers: Sequence[Any], domain: int, now_s: float) -> Iterator[str]:
        """Yield what is wrong with the publishers (rclpy's TopicEndpointInfo), with the remedy."""
        ids = frozenset(bytes(one.endpoint_gid) for one in publishers)
        if ids != self._publishers:
            self._publishers = ids
            self._since_s = now_s
            self.gaps.unsettle()
        unlike = [one for one in publishers if _faults(one)]
        has_settled = now_s - self._since_s >= SETTLED_S
        if has_settled and not unlike:
            self.gaps.settle(len(publishers))
        for one in unlike:
            why, remedies = zip(*_faults(one), strict=True)
            yield (
                f"{name_of(one)} publishes {self.topic} with another QoS than the contract's: "
                f"{', '.join(why)}; use {' and '.join(remedies)}"
            )
        if publishers and has_settled and not self._has_received:
            others = other_users(domain)
            if others:
                yield (
                    f"nothing has come yet from the publisher of {self.topic}, and another user "
                    f"({', '.join(others)}) has processes in this ROS domain: {_HINT}"
                )


def other_users(domain: int, folder: Path = FOLDER, own: int | None = None) -> list[str]:
    """Users other than `own` (None: this process's) whose processes take part in a ROS domain.

    They are found as the owners of Fast DDS's ports in shared memory, which only they can write.
    """
    found = set()
    for port in ports(domain):
        try:
            owner = (folder / f"fastrtps_port{port}").stat().st_uid
        except OSError:
            continue
        if owner != (os.geteuid() if own is None else own):
            found.add(owner)
    return [f"uid {uid}" for uid in sorted(found)]


def _faults(publisher: Any) -> list[tuple[str, str]]:
    offered = publisher.qos_profile
    faults = []
    if offered.durability == DurabilityPolicy.VOLATILE:
        why = "VOLATILE, so a twin that starts later misses what was published before"
        faults.append((why, "TRANSIENT_LOCAL"))
    if offered.reliability == ReliabilityPolicy.BEST_EFFORT:
        faults.append(("BEST_EFFORT, so what is lost on the way is not sent again", "RELIABLE"))
    return faults


def name_of(publisher: Any) -> str:
    """The name of a publisher's node, for a person to read."""
    if publisher.node_name == _NO_NAME:
        return "somebody"
    return f"{publisher.node_namespace.rstrip('/')}/{publisher.node_name}"
