"""The ROS side of `lupin-twin web`: a consumer of a twin elsewhere, over its two ROS contracts."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from hashlib import blake2b
from typing import Any, Final

from lupin_msgs.srv import GetField
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node

from lupin_twin import convert, ingest, shapes
from lupin_twin.drops import Drop, Reason
from lupin_twin.explored import OccupancyMap
from lupin_twin.fields import FieldRequest
from lupin_twin.habits import Habits
from lupin_twin.node import field_rules
from lupin_twin.ros_parameters import declare, naming, naming_use_sim_time
from lupin_twin.state import Observation, Snapshot, TagState
from lupin_twin.twin_count import TwinCount

NODE_NAME: Final = "lupin_web"
# DDS finds a twin's publisher and its service each on its own, one at times a little later.
NEW_TWIN_S: Final = 2.0

# The twin's parameters that a consumer has to know too. They are not on the wire: where the twin's
# are not the defaults, give both the same parameter file.
SHARED_PARAMETERS: Final = (
    "state_topic",
    "field_service_name",
    "map_topic",
    "frame_id",
    "buffer_len",
    "idw_power",
    "idw_falloff_radius_m",
    "idw_max_distance_m",
    "clip_to_explored",
    "max_grid_cells",
)


def _digest_of_map(occupancy: OccupancyMap) -> int:
    """A map's revision: the same in all replicas, and for each copy of a map that has not changed.

    SLAM publishes it anew every few seconds, with another stamp each time.
    """
    digest = blake2b(repr(occupancy.place).encode("utf-8", "surrogatepass"), digest_size=6)
    digest.update(occupancy.cells.data)
    return int.from_bytes(digest.digest())


class WebNode(Node):  # type: ignore[misc]  # rclpy is not typed
    """Follows `/twin/state` and `/map`, and asks `/twin/get_field`.

    `on_state(snapshot)` is called for each state. Its tags are the very same values as in the one
    before where nothing has changed.

    Raises:
        lupin_twin.parameters.ParameterError: a parameter out of its range.

    """

    def __init__(self, on_state: Callable[[Snapshot], None], *, context: Any = None) -> None:
        with naming_use_sim_time():
            super().__init__(NODE_NAME, context=context)
        self.habits = Habits(self)
        self.report = self.habits.report
        self.parameters = declare(self, SHARED_PARAMETERS)
        self.rules = field_rules(self.parameters)
        self.twins = TwinCount()
        self.occupancy_map: OccupancyMap | None = None
        self.digest = ""
        self.publishers_digest = ""
        self._publishers_since_s = -math.inf
        self._on_state = on_state
        self._newest: Snapshot | None = None
        self._history: dict[str, deque[Observation]] = {}
        self._digests: dict[str, tuple[TagState, bytes]] = {}
        self._topics: dict[str, str] = {}
        group = MutuallyExclusiveCallbackGroup()
        p = self.parameters
        for parameter, shape, callback in (
            ("state_topic", shapes.STATE, self._take_state),
            ("map_topic", shapes.MAP, self._take_map),
        ):
            self._topics[parameter] = self.habits.subscribe(
                parameter, getattr(p, parameter), shape, depth=1, group=group, callback=callback
            )
        with naming("field_service_name", p.field_service_name):
            self.field_client = self.create_client(
                GetField, p.field_service_name, callback_group=group
            )

    # --- for the source, on this node's thread ------------------------------------------------

    @property
    def callback_errors(self) -> int:
        """Errors met by callbacks so far."""
        return self.habits.callback_errors

    @property
    def revision(self) -> str:
        """Digests of who publishes the state, of poses and readings, and of the map.

        The twin's count is not on the wire, nor are its parameters: but one that was started with
        others is another publisher.
        """
        map_revision = 0 if self.occupancy_map is None else self.occupancy_map.revision
        return f"{self.publishers_digest}-{self.digest}-{map_revision:x}"

    @property
    def has_new_twin(self) -> bool:
        """Whether a twin has come so lately that its service may not have been found yet."""
        return time.monotonic() - self._publishers_since_s < NEW_TWIN_S

    def request_field(self, request: FieldRequest) -> Any:
        """Ask the twin; returns the rclpy Future of its response."""
        return self.field_client.call_async(convert.field_request_message(request))

    def forget_request(self, future: Any) -> None:
        """Drop a request that nobody waits for any more, or it would be kept for ever."""
        self.field_client.remove_pending_request(future)

    def history(self, tag_id: str) -> tuple[Observation, ...] | None:
        """The last `buffer_len` readings of a tag that were seen from here; None: no such tag."""
        if self._newest is None or all(tag.tag_id != tag_id for tag in self._newest.tags):
            return None
        return tuple(self._history.get(tag_id, ()))

    # --- callbacks ----------------------------------------------------------------------------

    def _take_state(self, msg: Any) -> None:
        before = self._newest
        snapshot = convert.snapshot_of(msg, before)
        known = set() if before is None else set(map(id, before.tags))
        for tag in snapshot.tags:
            if id(tag) not in known:
                self._remember(tag)
        self._newest = snapshot
        self.digest = self._digest_of(snapshot.tags)
        if len(self._digests) > len(snapshot.tags):
            self._forget_all_but(snapshot.tags)
        topic = self._topics["state_topic"]
        publishers_digest = self._digest_of_publishers(topic)
        if publishers_digest != self.publishers_digest:
            self.publishers_digest = publishers_digest
            self._publishers_since_s = time.monotonic()
        if self.twins.see(int(self.count_publishers(topic)), time.monotonic()):
            self.habits.warn(
                ("twins", 0),
                f"{self.twins.value} nodes publish {topic}: what is shown is a mixture; "
                "stop all twins but one, or give them ROS domains of their own",
            )
        self._on_state(snapshot)

    def _take_map(self, msg: Any) -> None:
        # Kept, and told with the next state: a map is no sign of life of the twin.
        topic = self._topics["map_topic"]
        if dropped := ingest.wrong_frame(msg.header.frame_id, self.parameters.frame_id):
            self.habits.drop(dropped, topic)
            return
        try:
            new = convert.map_of(msg, 0)
        except ValueError as error:
            self.habits.drop(Drop(Reason.MAP, f"{error}; the last one stays", "a map"), topic)
            return
        if self.occupancy_map is None or not new.shows_the_same_as(self.occupancy_map):
            self.occupancy_map = replace(new, revision=_digest_of_map(new))

    # --- small parts --------------------------------------------------------------------------

    def _remember(self, tag: TagState) -> None:
        if not tag.readings or tag.last_observed_ns is None:
            return
        history = self._history.setdefault(tag.tag_id, deque(maxlen=self.parameters.buffer_len))
        at_ns = tag.last_observed_ns
        if history and history[-1].stamp_ns > at_ns:
            # The twin has followed a clock that went back, see `TwinStore.hold_to`.
            held = [replace(scan, stamp_ns=min(scan.stamp_ns, at_ns)) for scan in history]
            history.clear()
            history.extend(held)
            is_new = held[-1].readings != tag.readings
        else:
            is_new = not history or history[-1].stamp_ns != at_ns
        if is_new:
            history.append(Observation(tag.tag_id, at_ns, tag.readings))

    def _forget_all_but(self, tags: Sequence[TagState]) -> None:
        ids = {tag.tag_id for tag in tags}
        for kept in (self._history, self._digests):
            for tag_id in [tag_id for tag_id in kept if tag_id not in ids]:
                del kept[tag_id]

    def _digest_of_publishers(self, topic: str) -> str:
        """The same in all replicas: DDS gives a publisher one id for all who see it."""
        ids = sorted(bytes(info.endpoint_gid) for info in self.get_publishers_info_by_topic(topic))
        return blake2b(b"".join(ids), digest_size=6).hexdigest()

    def _digest_of(self, tags: Sequence[TagState]) -> str:
        total = blake2b(digest_size=12)
        for tag in tags:
            kept = self._digests.get(tag.tag_id)
            if kept is None or kept[0] is not tag:
                text = repr((tag.tag_id, tag.pose, tag.readings))
                digest = blake2b(text.encode("utf-8", "surrogatepass"), digest_size=12).digest()
                kept = (tag, digest)
                self._digests[tag.tag_id] = kept
            total.update(kept[1])
        return total.hexdigest()
