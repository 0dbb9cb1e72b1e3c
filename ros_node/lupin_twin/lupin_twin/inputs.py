"""A latched topic as one node hears it: publishers of any QoS, each message once, what is wrong."""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from lupin_twin.numbering import Gaps

# What rclpy calls a node whose name DDS has not told (rmw_dds_common, graph_cache.cpp).
_NO_NAME: Final = "_NODE_NAME_UNKNOWN_"
# What was latched comes as a publisher is found; what is lost on the way comes again within 3 s.
SETTLED_S: Final = 5.0
SHARED_MEMORY: Final = Path("/dev/shm")  # noqa: S108  # where Fast DDS has its ports
# rmw_fastrtps makes its own transports for LOCALHOST (8.4.3, participant.cpp).
_HINT: Final = (
    "shared memory does not cross users. Run both as one user, or set "
    "FASTDDS_BUILTIN_TRANSPORTS=UDPv4, without ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST"
)


def _profiles(depth: int) -> tuple[QoSProfile, ...]:
    """How a latched topic is heard, the best first; each hears more publishers than the one before.

    The first is the contract's: RELIABLE and TRANSIENT_LOCAL. DDS matches it with no publisher of
    ROS's default, which is VOLATILE, nor the second with one that is BEST_EFFORT.
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


class Input:
    """Follows what comes on a topic, and who publishes it; belongs to its node's thread."""

    def __init__(self, depth: int) -> None:
        self.topic = ""
        self.gaps = Gaps()
        self.profiles = _profiles(depth)
        # How many of these it is heard by.
        self.subscriptions = 0
        self._has_heard = False
        # What was heard last: of so many messages none is in two subscriptions' queues.
        self._last: deque[tuple[int, int]] = deque(maxlen=4 * depth)
        self._publishers: frozenset[bytes] = frozenset()
        self._since_s = -math.inf

    def is_new(self, info: dict[str, Any]) -> bool:
        """Whether a message is heard for the first time; a second subscription hears it again."""
        self._has_heard = True
        if self.subscriptions <= 1:
            return True
        # A message has these two from its publisher, the same in every subscription.
        key = info["source_timestamp"], info["publication_sequence_number"]
        if key in self._last:
            return False
        self._last.append(key)
        return True

    def look(self, publishers: Sequence[Any], domain: int, now_s: float) -> Iterator[str]:
        """Look at who publishes, as rclpy's TopicEndpointInfo; what is wrong, with the remedy."""
        before, self._publishers = self._publishers, frozenset(_id(one) for one in publishers)
        if before != self._publishers:
            self._since_s = now_s
            self.gaps.unsettle()
        unlike = [one for one in publishers if _faults(one)]
        has_settled = now_s - self._since_s >= SETTLED_S
        if has_settled and not unlike:
            self.gaps.settle(len(publishers))
        for one in unlike:
            why, remedies = zip(*_faults(one), strict=True)
            yield (
                f"{_name(one)} publishes {self.topic} with another QoS than the contract's: "
                f"{', '.join(why)}; use {' and '.join(remedies)}"
            )
        if publishers and has_settled and not self._has_heard:
            others = other_users(domain)
            if others:
                yield (
                    f"nothing has come yet from the publisher of {self.topic}, and another user "
                    f"({', '.join(others)}) has processes in this ROS domain: {_HINT}"
                )


def other_users(domain: int, folder: Path = SHARED_MEMORY, own: int | None = None) -> list[str]:
    """Users other than `own` (None: this process's) whose processes take part in a ROS domain.

    By who owns the ports that Fast DDS has in shared memory: nobody else can write to them.
    """
    found = set()
    for port in _ports_of(domain):
        try:
            owner = (folder / f"fastrtps_port{port}").stat().st_uid
        except OSError:
            continue
        if owner != (os.geteuid() if own is None else own):
            found.add(owner)
    return [f"uid {uid}" for uid in sorted(found)]


def _ports_of(domain: int) -> Iterable[int]:
    """Those that RTPS 2.3, section 9.6.2.3, gives a domain."""
    return range(7400 + 250 * domain, 7400 + 250 * (domain + 1))


def _faults(publisher: Any) -> list[tuple[str, str]]:
    offered = publisher.qos_profile
    faults = []
    if offered.durability == DurabilityPolicy.VOLATILE:
        said = "VOLATILE, so a twin that starts later misses what was said before"
        faults.append((said, "TRANSIENT_LOCAL"))
    if offered.reliability == ReliabilityPolicy.BEST_EFFORT:
        faults.append(("BEST_EFFORT, so what is lost on the way is not sent again", "RELIABLE"))
    return faults


def _id(publisher: Any) -> bytes:
    return bytes(publisher.endpoint_gid)


def _name(publisher: Any) -> str:
    if publisher.node_name == _NO_NAME:
        return "somebody"
    return f"{publisher.node_namespace.rstrip('/')}/{publisher.node_name}"
