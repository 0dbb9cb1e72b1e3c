"""The ROS node of `lupin-twin web`, which follows a twin elsewhere by its ROS contracts."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from hashlib import blake2b
from typing import Any, Final

from lupin_msgs.srv import GetWrites
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.validate_topic_name import validate_topic_name

from lupin_bridge.feed.source import TwinUpdate
from lupin_twin.core import interfaces
from lupin_twin.core.clock import reported_clock
from lupin_twin.core.diagnostics import SelfReport, self_report
from lupin_twin.core.parameters import TwinParameters
from lupin_twin.core.state import TagState
from lupin_twin.field.engine import FieldRules
from lupin_twin.field.explored import OccupancyMap, digest_of
from lupin_twin.ros import convert, message_limits
from lupin_twin.ros.base_node import SERVICE_QOS, NodeUtilities
from lupin_twin.ros.convert import findings_of
from lupin_twin.ros.parameters import (
    AdjustableNode,
    declare,
    naming,
    naming_own_parameters,
)

NODE_NAME: Final = "lupin_web"


# How long a twin's report of itself, sent once a second, stays valid, s.
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
    "clip_to_explored",
    "max_grid_cells",
)


class WebNode(AdjustableNode):
    """Follows `/twin/state` with its `/twin/times`, and `/map`, and calls the twin's services.

    All nodes of a domain share `/diagnostics`: it takes only the report of the twin that publishes
    this state.

    `post(update)` is called for each state, once its times or the next state are there. Unchanged
    tags are the same objects as in the snapshot before. It is also called when the map or a
    parameter of this node has changed, which is no sign of life of the twin.

    Raises:
        lupin_twin.core.parameters.ParameterError: a parameter out of its range.

    """

    def __init__(
        self,
        post: Callable[[TwinUpdate], None],
        *,
        context: Any = None,
    ) -> None:
        with naming_own_parameters():
            super().__init__(NODE_NAME, context=context)
        self.utilities = NodeUtilities(self)
        self.parameters = declare(self, SHARED_PARAMETERS)
        self.rules = FieldRules.of(self.parameters)
        self.occupancy_map: OccupancyMap | None = None
        self.digest = ""
        self.publishers_digest = ""
        self._changes = 0
        self._post = post
        self.update: TwinUpdate | None = None
        # When the newest state was published.
        self._published_ns = 0
        # The newest message of each, not yet shown; they belong together if their stamps are equal.
        self._state: Any = None
        self._times: Any = None
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
        # Never called from here; roslib clients get its name.
        with naming("field_service_name", p.field_service_name):
            validate_topic_name(p.field_service_name, is_service=True)
        self.rows = self.create_client(
            GetWrites, interfaces.GET_WRITES.name, qos_profile=SERVICE_QOS, callback_group=group
        )

    # --- for the source, on this node's thread ------------------------------------------------

    def take_over(self, before: WebNode) -> None:
        """Take over the state of the node that this one replaces."""
        self.occupancy_map, self.update = before.occupancy_map, before.update
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

        The twin's own revision and parameters are not on the wire, but a twin restarted with other
        parameters is another publisher. Changes of this node's own parameters are counted too.
        """
        map_revision = 0 if self.occupancy_map is None else self.occupancy_map.revision
        known = f"{self.publishers_digest}-{self.digest}-{map_revision:x}"
        return f"{known}-{self._changes}" if self._changes else known

    @property
    def self_report(self) -> SelfReport:
        """The recent report of the followed twin; an empty one if it is too old."""
        is_recent = time.monotonic() - self._reported_s < REPORT_HOLDS_S
        return self._report if is_recent else SelfReport()

    def why_no_rows(self) -> str:
        """Why the log's rows cannot be requested, for a person; empty: a twin offers them."""
        if self.rows.service_is_ready():
            return ""
        if self.count_publishers(self._topics["state_topic"]):
            guess = "the twin's state is received, so try again; is the service renamed there?"
        else:
            guess = "is it running?"
        return f"no twin offers {self.rows.service_name}: {guess}"

    # --- callbacks ----------------------------------------------------------------------------

    def _take_state(self, msg: Any) -> None:
        # DDS goes on in a stuck twin: a new node gets its latched state again, which is no sign of
        # life. 0: the middleware reports no times.
        if 0 < self.utilities.published_ns == self._published_ns:
            return
        self._published_ns = self.utilities.published_ns
        # Without its times a state is shown too: when things were observed is then not known.
        if self._state is not None:
            self._show(self._state, None)
        self._state = msg
        if self.count_publishers(self._topics["times"]):
            self._show_pair()
        else:
            self._state = None
            self._show(msg, None)

    def _take_times(self, msg: Any) -> None:
        self._times = msg
        self._show_pair()

    def _show_pair(self) -> None:
        """Show the state with its times, once both are here: two topics keep no order."""
        state, times = self._state, self._times
        if state is not None and times is not None and state.header.stamp == times.header.stamp:
            self._state = self._times = None
            self._show(state, times)

    def _show(self, msg: Any, times: Any) -> None:
        topic = self._topics["state_topic"]
        # The same in all replicas: DDS gives a publisher one id for all who see it.
        ids = sorted(bytes(it.endpoint_gid) for it in self.get_publishers_info_by_topic(topic))
        self.publishers_digest = blake2b(b"".join(ids), digest_size=6).hexdigest()
        self.utilities.check_twins(topic, "what is shown is a mixture")
        before = None if self.update is None else self.update.snapshot
        report = self.self_report
        snapshot = convert.snapshot_of(msg, before, times)
        clock = reported_clock(
            report.clock,
            snapshot.stamp_ns,
            ages_are_known=not any(math.isnan(tag.stale_seconds) for tag in msg.tags),
        )
        self.digest = _digest_of(snapshot.tags)
        self.update = TwinUpdate(
            replace(snapshot, clock=clock),
            self.revision,
            self.utilities.twins,
            self.occupancy_map,
            report.counts,
            self.utilities.counts(),
            journal=report.journal,
            rules=self.rules,
            origin=report.origin,
            input_problems=report.input_problems,
        )
        self._post(self.update)

    def _renew(self) -> None:
        if self.update is not None:
            self.update = replace(
                self.update,
                revision=self.revision,
                occupancy_map=self.occupancy_map,
                rules=self.rules,
            )
            self._post(self.update)

    def _take_map(self, msg: Any) -> None:
        topic, frame_id = self._topics["map_topic"], self.parameters.frame_id
        new = self.utilities.new_map(msg, topic, frame_id, self.occupancy_map)
        if new is not None:
            self.occupancy_map = replace(new, revision=digest_of(new))
            self._renew()

    def _take_diagnostics(self, msg: Any) -> None:
        # Reported with the next state, like the map: without a state there is no twin to show.
        said = list(findings_of(msg, self._topics["state_topic"]))
        if said:
            self._report = self_report(said)
            self._reported_s = time.monotonic()

    def adjust(self, now: TwinParameters) -> None:
        """See `AdjustableNode`. The twin's parameters are not on the wire: set them here too."""
        self.rules = FieldRules.of(now)
        self._changes += 1
        self._renew()


def _digest_of(tags: Sequence[TagState]) -> str:
    """A digest of poses and readings, and of which readings share a scan: only those give a VPD."""
    digest = blake2b(digest_size=12)
    for tag in tags:
        times = [reading.observed_at_ns for reading in tag.readings]
        readings = [(it.name, it.value, times.index(it.observed_at_ns)) for it in tag.readings]
        text = repr((tag.tag_id, tag.pose, readings))
        digest.update(text.encode("utf-8", "surrogatepass"))
    return digest.hexdigest()
