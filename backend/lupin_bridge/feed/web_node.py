"""The ROS side of `lupin-twin web`: a consumer of a twin elsewhere, over its ROS contracts."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from hashlib import blake2b
from typing import Any, Final

from lupin_msgs.srv import GetEstimateReport, GetWrites
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.validate_topic_name import validate_topic_name

from lupin_bridge.feed.source import TwinUnavailableError
from lupin_twin.core import interfaces
from lupin_twin.core.clock import StampWatch
from lupin_twin.core.diagnostics import SelfReport, self_report
from lupin_twin.core.parameters import TwinParameters
from lupin_twin.core.past import PastRefused, error_of
from lupin_twin.core.state import Snapshot, TagState
from lupin_twin.field.engine import FieldRefused, FieldRules
from lupin_twin.field.explored import OccupancyMap, digest_of
from lupin_twin.ros import convert, message_limits
from lupin_twin.ros.base_node import SERVICE_QOS, NodeUtilities
from lupin_twin.ros.convert import findings_of
from lupin_twin.ros.inputs import TwinCount
from lupin_twin.ros.parameters import (
    AdjustableNode,
    declare,
    naming,
    naming_own_parameters,
)

NODE_NAME: Final = "lupin_web"


# How long a state waits for the times that a twin publishes right behind it. Without them it is
# shown all the same, and when what was observed is not known.
TIMES_PATIENCE_S: Final = 0.5

# What a twin said of itself, once a second, stands for so long, s.
REPORT_HOLDS_S: Final = 5.0

# The twin's parameters that a consumer has to know too. They are not on the wire: where the twin's
# are not the defaults, give both the same parameter file.
SHARED_PARAMETERS: Final = (
    "state_topic",
    "field_service_name",
    "observations_topic",
    "discovered_tags_topic",
    "map_topic",
    "frame_id",
    "buffer_len",
    "idw_power",
    "idw_falloff_radius_m",
    "idw_max_distance_m",
    "max_grid_cells",
)


class WebNode(AdjustableNode):
    """Follows `/twin/state` with its `/twin/times`, and `/map`, and asks the twin's services.

    Of `/diagnostics`, which all nodes of a domain share, it takes what the twin says of itself that
    publishes this state, and nothing else.

    `on_state(snapshot)` is called for each state, once its times are there. Its tags are the very
    same values as in the one before where nothing has changed. `on_map()` is called for each map
    that is another.

    Raises:
        lupin_twin.core.parameters.ParameterError: a parameter out of its range.

    """

    def __init__(
        self,
        on_state: Callable[[Snapshot], None],
        on_map: Callable[[], None] = lambda: None,
        *,
        context: Any = None,
    ) -> None:
        with naming_own_parameters():
            super().__init__(NODE_NAME, context=context)
        self.utilities = NodeUtilities(self)
        self.parameters = declare(self, SHARED_PARAMETERS)
        self.rules = FieldRules.of(self.parameters)
        self.twins = TwinCount()
        self.occupancy_map: OccupancyMap | None = None
        self.digest = ""
        self.publishers_digest = ""
        self._changes = 0
        self._on_state = on_state
        self._on_map = on_map
        self._newest: Snapshot | None = None
        # When the newest state was published.
        self._published_ns = 0
        # What came last of each: they belong together where their stamps are the same.
        self._state: Any = None
        self._times: Any = None
        self._stamp_watch = StampWatch()
        self._report = SelfReport()
        self._reported_s = -math.inf
        self._topics: dict[str, str] = {}
        group = MutuallyExclusiveCallbackGroup()
        p = self.parameters
        for parameter, topic, shape, callback in (
            ("state_topic", p.state_topic, message_limits.STATE, self._take_state),
            ("times", interfaces.TIMES.name, message_limits.TIMES, self._take_times),
            ("map_topic", p.map_topic, message_limits.MAP, self._take_map),
        ):
            self._topics[parameter] = self.utilities.subscribe(
                parameter,
                topic,
                shape,
                depth=1,
                group=group,
                callback=callback,
            )
        self.utilities.subscribe(
            "diagnostics",
            interfaces.DIAGNOSTICS.name,
            message_limits.DIAGNOSTICS,
            depth=50,
            group=group,
            callback=self._take_diagnostics,
            is_wanted=lambda data: self._topics["state_topic"].encode() in data,
        )
        # Nobody calls it from here; roslib's clients are told its name.
        with naming("field_service_name", p.field_service_name):
            validate_topic_name(p.field_service_name, is_service=True)
        self.clients_of_twin: dict[Any, Any] = {
            kind: self.create_client(kind, name, qos_profile=SERVICE_QOS, callback_group=group)
            for kind, name in (
                (GetWrites, interfaces.GET_WRITES.name),
                (GetEstimateReport, interfaces.GET_ESTIMATE_REPORT.name),
            )
        }
        self._patience = self.utilities.every(
            group, TIMES_PATIENCE_S, "the wait for times", self._show_without_times
        )
        self._patience.cancel()

    # --- for the source, on this node's thread ------------------------------------------------

    def take_over(self, before: WebNode) -> None:
        """Know what a node knew that this one takes the place of."""
        self.occupancy_map = before.occupancy_map
        self.digest, self.publishers_digest = before.digest, before.publishers_digest
        self._published_ns = before._published_ns
        differ = [
            name
            for name in SHARED_PARAMETERS
            if getattr(before.parameters, name) != getattr(self.parameters, name)
        ]
        self.set_parameters([before.get_parameter(name) for name in differ])
        self._changes = before._changes

    @property
    def revision(self) -> str:
        """Digests of who publishes the state, of poses and readings, and of the map.

        The twin's count is not on the wire, nor are its parameters: but one that was started with
        others is another publisher. Of this node's own they are part, once they are changed.
        """
        map_revision = 0 if self.occupancy_map is None else self.occupancy_map.revision
        known = f"{self.publishers_digest}-{self.digest}-{map_revision:x}"
        return f"{known}-{self._changes}" if self._changes else known

    @property
    def self_report(self) -> SelfReport:
        """What the twin that is followed said of itself lately."""
        is_recent = time.monotonic() - self._reported_s < REPORT_HOLDS_S
        return self._report if is_recent else SelfReport()

    def why_not(self, service: Any) -> str:
        """What is to be said where no twin offers it; empty: one does."""
        if self.clients_of_twin[service].service_is_ready():
            return ""
        if self.count_publishers(self._topics["state_topic"]):
            guess = "its state is received, so try again; or does it have another name there?"
        else:
            guess = "is it running?"
        return f"no twin offers {self.clients_of_twin[service].service_name}: {guess}"

    # --- callbacks ----------------------------------------------------------------------------

    def _take_state(self, msg: Any) -> None:
        # DDS goes on in a twin that is stuck, and what it latched comes again to a new node: that
        # is no sign of life. 0: the middleware says no times.
        if 0 < self.utilities.published_ns == self._published_ns:
            return
        self._published_ns = self.utilities.published_ns
        self._state = msg
        if self._show_pair():
            return
        if not self.count_publishers(self._topics["times"]):
            self._show_without_times()
        elif self._patience.is_canceled():
            self._patience.reset()

    def _take_times(self, msg: Any) -> None:
        self._times = msg
        self._show_pair()

    def _show_pair(self) -> bool:
        """Show the state with its times, once both are here: two topics keep no order."""
        state, times = self._state, self._times
        if state is None or times is None or state.header.stamp != times.header.stamp:
            return False
        self._state = self._times = None
        self._show(state, times)
        return True

    def _show_without_times(self) -> None:
        # They may still come.
        if self._state is not None:
            self._show(self._state, None)

    def _show(self, msg: Any, times: Any) -> None:
        self._patience.cancel()
        topic = self._topics["state_topic"]
        # The same in all replicas: DDS gives a publisher one id for all who see it.
        ids = sorted(bytes(it.endpoint_gid) for it in self.get_publishers_info_by_topic(topic))
        self.publishers_digest = blake2b(b"".join(ids), digest_size=6).hexdigest()
        self.utilities.check_twins(self.twins, topic, "what is shown is a mixture")
        before = self._newest
        snapshot = convert.snapshot_of(msg, before, times)
        now_s = time.monotonic()
        clock = self._stamp_watch.update(
            snapshot.stamp_ns,
            now_s,
            ages_are_known=not any(math.isnan(tag.stale_seconds) for tag in msg.tags),
            reported=self.self_report.clock,
        )
        snapshot = replace(snapshot, clock=clock)
        self._newest = snapshot
        self.digest = _digest_of(snapshot.tags)
        self._on_state(snapshot)

    def _take_map(self, msg: Any) -> None:
        # Kept, and told with the next state: a map is no sign of life of the twin.
        topic, frame_id = self._topics["map_topic"], self.parameters.frame_id
        new = self.utilities.new_map(msg, topic, frame_id, self.occupancy_map)
        if new is not None:
            self.occupancy_map = replace(new, revision=digest_of(new))
            self._on_map()

    def _take_diagnostics(self, msg: Any) -> None:
        # Told with the next state, like the map: a twin that publishes none is none to show.
        said = list(findings_of(msg, self._topics["state_topic"]))
        if said:
            self._report = self_report(said)
            self._reported_s = time.monotonic()

    def adjust(self, now: TwinParameters) -> None:
        """See `AdjustableNode`. A twin's own are not on the wire: they are set here as there."""
        self.rules = FieldRules.of(now)
        self._changes += 1
        self._on_map()


def _digest_of(tags: Sequence[TagState]) -> str:
    """Of poses and readings, and of which readings are of one scan: only those derive a VPD."""
    digest = blake2b(digest_size=12)
    for tag in tags:
        times = [reading.observed_at_ns for reading in tag.readings]
        readings = [(it.name, it.value, times.index(it.observed_at_ns)) for it in tag.readings]
        text = repr((tag.tag_id, tag.pose, readings))
        digest.update(text.encode("utf-8", "surrogatepass"))
    return digest.hexdigest()


def check_ok(response: Any) -> None:
    """Raise what a service's refusal says."""
    if response.ok:
        return
    error = error_of(response.error_message)
    if isinstance(error, PastRefused):
        raise FieldRefused(str(error))
    raise TwinUnavailableError(str(error))
