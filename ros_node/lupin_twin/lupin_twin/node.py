"""The rclpy node `lupin_twin`: parameters, QoS, callbacks, and nothing that can be tested without.

Everything here runs on one thread, in one callback group: the store and the cache need no lock.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray
from lupin_msgs.msg import TwinState, TwinTimes
from lupin_msgs.srv import GetField
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rosgraph_msgs.msg import Clock as ClockMessage

from lupin_twin import convert, convert_field, ingest, interfaces, shapes
from lupin_twin.clock_watch import CLOCK_SAYS, ClockWatch
from lupin_twin.convert import diagnostics
from lupin_twin.diagnostics import Health, Origin, findings, origin_of
from lupin_twin.drops import Drop, Reason
from lupin_twin.estimate_service import EstimateRules, EstimateService, Known
from lupin_twin.explored import OccupancyMap
from lupin_twin.field_desk import FieldDesk
from lupin_twin.fields import FieldCache, FieldEngine, FieldJob, FieldRefused, FieldRules
from lupin_twin.grid import FieldGrid
from lupin_twin.habits import SERVICE_QOS, Habits, qos_of, waker
from lupin_twin.history import History, TagHistory, kind_of
from lupin_twin.journal.runs import Clock as RunClock
from lupin_twin.lateness import LATCHED_AFTER_S, Lateness
from lupin_twin.layer_service import LAYER_LOOK_S, LayerService, Shown
from lupin_twin.memory import Memory, journal_path, open_journal
from lupin_twin.numbering import TwinCount
from lupin_twin.other_twins import OtherTwins
from lupin_twin.parameters import ParameterError, TwinParameters, World
from lupin_twin.past_desk import PastDesk
from lupin_twin.past_service import JournalPast, PastService
from lupin_twin.responses import TRY_EVERY_S, Later, Resending, allow_later
from lupin_twin.ros_parameters import AdjustableNode, declare, naming, naming_own_parameters
from lupin_twin.state import ClockState, Look, Scan, Snapshot, TwinStore
from lupin_twin.workers import Workers

NODE_NAME: Final = "lupin_twin"
# How often it is looked at whether ROS time runs, s, however rarely the state is published.
CLOCK_LOOK_S: Final = 0.5
DIAGNOSTICS_PERIOD_S: Final = 1.0
# How often it is looked at whether a sensor's model is to be fitted anew, s.
FIT_LOOK_S: Final = 1.0


class TwinNode(AdjustableNode):
    """Fuses observations and discovered tags into `/twin/state` and `/twin/get_field`.

    Raises:
        ParameterError: a parameter out of its range; nothing was subscribed to.

    """

    def __init__(
        self,
        *,
        context: Any = None,
        cli_args: Sequence[str] | None = None,
        world: World = World(),
    ) -> None:
        with naming_own_parameters():
            super().__init__(NODE_NAME, context=context, cli_args=cli_args)
        self.habits = Habits(self)
        self.report = self.habits.report
        self.parameters = declare(self)
        self._world = world
        self.store = TwinStore()
        self.history = History(self.parameters.buffer_len)
        self.memory = self._memory()
        self.lateness = Lateness()
        self.fields = FieldEngine(FieldRules.of(self.parameters), FieldCache())
        self.occupancy_map: OccupancyMap | None = None
        self.twins = TwinCount()
        self._clock_watch = ClockWatch()
        self._observed_s: float | None = None
        self._clock_subscription: Any = None
        self._clock_told: ClockState = "running"
        self._map_revision = 0
        self._rules_revision = 0
        self._topics: dict[str, str] = {}
        self._listeners: list[Callable[[Snapshot], None]] = []
        self._states = convert.StateMessages()
        self._times = convert.TimesMessages()
        self._group = MutuallyExclusiveCallbackGroup()
        self._workers = Workers("field")
        computed = self.create_guard_condition(
            self.habits.guarded("get_field", self._on_computed), self._group
        )
        self._desk = FieldDesk(self.fields, self._workers, waker(computed))
        found = self.create_guard_condition(
            self.habits.guarded("the past", self._on_found), self._group
        )
        self._past_desk = PastDesk(self._workers, waker(found), lambda: self.habits.is_behind)
        self.estimates = EstimateService(
            self.habits,
            Known(self.store, self.history, self.memory.recall, lambda: self.occupancy_map),
            EstimateRules(world.day_length_s, self.parameters.max_grid_cells),
            self.now_ns,
            waker(found),
        )
        self.layers = LayerService(
            self.habits,
            Shown(
                self.store,
                self.fields,
                self.estimates,
                lambda: self.occupancy_map,
                self.snapshot,
                self.now_ns,
                world.day_length_s,
            ),
            waker(found),
        )
        self._connect()
        self._say_start()
        self._publish_state()

    # --- for the bridge, on this node's thread ----------------------------------------------

    @property
    def callback_errors(self) -> int:
        """Errors met by callbacks so far."""
        return self.habits.callback_errors

    @property
    def revision(self) -> tuple[int, int, int]:
        """(observation_count, map revision, rules revision): changes exactly when a field could."""
        return self.store.observation_count, self._map_revision, self._rules_revision

    def add_listener(self, listener: Callable[[Snapshot], None], heartbeat_s: float) -> None:
        """Call `listener(snapshot)` on this thread now, after each change, and as a heartbeat.

        The heartbeat goes by the steady clock and does not depend on `state_publish_rate_hz`: who
        listens can tell a quiet greenhouse from a dead twin, however rarely the topic is published.
        """
        self._listeners.append(listener)
        listener(self.snapshot())
        self._every(heartbeat_s, "heartbeat", lambda: listener(self.snapshot()))

    def snapshot(self) -> Snapshot:
        """Every tag, now by ROS time, and whether that runs."""
        snapshot = self.store.snapshot(self.now_ns(), self.parameters.frame_id)
        return replace(snapshot, clock=self._clock_state)

    def history_of(self, tag_id: str) -> TagHistory | None:
        """The last scans and tries of a tag; None: no such tag."""
        return self.history.of(tag_id) if self.store.knows(tag_id) else None

    # --- set-up -----------------------------------------------------------------------------

    def _memory(self) -> Memory:
        p = self.parameters
        try:
            path = journal_path(
                p.journal, os.environ, self.context.get_domain_id(), self.get_namespace()
            )
        except RuntimeError as error:
            raise ParameterError(
                f"parameter journal is empty, and there is no home to keep one in: {error}"
            ) from error
        journal = open_journal(
            path, self.get_fully_qualified_name(), p.journal_days, p.journal_max_mb
        )
        return Memory(self.store, self.history, journal, p.buffer_len)

    def _connect(self) -> None:
        p, group = self.parameters, self._group
        resending = Resending(self.habits.warn, self.habits.drain)
        for topic, shape, callback in (
            (interfaces.OBSERVATIONS, shapes.OBSERVATION, self._on_observation),
            (interfaces.DISCOVERED_TAGS, shapes.DISCOVERED_TAGS, self._on_discovered_tags),
            (interfaces.MAP, shapes.MAP, self._on_map),
        ):
            name = getattr(p, topic.parameter)
            self._topics[topic.parameter] = self.habits.subscribe(
                topic.parameter, name, shape, depth=topic.depth, group=group, callback=callback
            )
        state, times, own = interfaces.STATE, interfaces.TIMES, interfaces.DIAGNOSTICS
        with naming("state_topic", p.state_topic):
            self._state_publisher = self.create_publisher(TwinState, p.state_topic, qos_of(state))
        self._times_publisher = self.create_publisher(TwinTimes, times.name, qos_of(times))
        kind, name, answer = GetField, p.field_service_name, self._on_get_field
        with naming("field_service_name", name):
            self.create_service(kind, name, answer, qos_profile=SERVICE_QOS, callback_group=group)
        past = JournalPast(self.memory.recall, self.store, p.frame_id)
        PastService(self.habits, self._past_desk, past, self.store, self.now_ns).offer(self, group)
        self.estimates.offer(self, group)
        self.layers.offer(self, p.layers, p.frame_id)
        for service in self.services:  # those of its parameters too
            allow_later(resending.watch(service))
        self._others = OtherTwins(self, self.habits, self.twins, p.state_topic, group)
        self._diagnostics = self.create_publisher(DiagnosticArray, own.name, qos_of(own))
        self._every(DIAGNOSTICS_PERIOD_S, "diagnostics timer", self._publish_diagnostics)
        self._every(CLOCK_LOOK_S, "clock timer", self._look_at_clock)
        self._every(FIT_LOOK_S, "estimate timer", self.estimates.go_on)
        self._every(LAYER_LOOK_S, "layers timer", self.layers.look)
        self._every(TRY_EVERY_S, "answers timer", resending.go_on)
        self._state_timer = self._publish_at(p.state_publish_rate_hz)
        self.adjust_by(self._adjust)

    def _say_start(self) -> None:
        # Who waits for a twin that hears nothing looks for a name or a domain that is another.
        self.get_logger().info(
            f"{self.get_fully_qualified_name()} in ROS domain {self.context.get_domain_id()} "
            f"subscribes to {', '.join(self._topics.values())} and publishes "
            f"{self._state_publisher.topic_name}; poses are in frame "
            f"{self.parameters.frame_id!r}"
        )

    def _publish_at(self, rate_hz: float) -> Any:
        return self._every(1.0 / rate_hz, "state timer", self._publish_state)

    def _adjust(self, now: TwinParameters) -> None:
        if self._state_timer.timer_period_ns != int(1e9 / now.state_publish_rate_hz):
            self.destroy_timer(self._state_timer)
            self._state_timer = self._publish_at(now.state_publish_rate_hz)
        if (rules := FieldRules.of(now)) != self.fields.rules:
            self.fields.rules = rules
            self._rules_revision += 1
            self.tell_listeners()

    def _every(self, period_s: float, what: str, callback: Callable[[], None]) -> Any:
        # The steady clock: a paused simulation is no reason to look dead. Stamps and ages in the
        # state follow ROS time all the same.
        return self.create_timer(
            period_s,
            self.habits.guarded(what, callback),
            callback_group=self._group,
            clock=Clock(clock_type=ClockType.STEADY_TIME),
        )

    # --- callbacks --------------------------------------------------------------------------

    def _on_observation(self, msg: Any) -> None:
        topic = self._topics["observations_topic"]
        write = ingest.observation(convert.heard(msg), self.parameters.frame_id, self.now_ns())
        if isinstance(write, Drop):
            self.habits.drop(write, topic)
            return
        is_news = self.history.news(write) is not None
        if self._apply(write, topic, msg.mission_id):
            self._observed_s = time.monotonic()
            if is_news:
                self._look_at_stamp(write, topic)
            self.tell_listeners()

    def _look_at_stamp(self, write: Scan | Look, topic: str) -> None:
        late = self.lateness.see(
            write.source,
            kind_of(write),
            write.stamp_ns,
            was_latched=self.habits.published_ago_s > LATCHED_AFTER_S,
            now_s=time.monotonic(),
        )
        if late is not None:
            self.habits.late(late, topic)

    def _on_discovered_tags(self, msg: Any) -> None:
        topic = self._topics["discovered_tags_topic"]
        before = self.store.observation_count
        for write in ingest.discoveries(
            convert.heard_tags(msg), self.parameters.frame_id, self.store.is_pinned
        ):
            self._apply(write, topic)
        if self.store.observation_count != before:
            self.tell_listeners()

    def _on_map(self, msg: Any) -> None:
        topic = self._topics["map_topic"]
        if dropped := ingest.wrong_frame(msg.header.frame_id, self.parameters.frame_id):
            self.habits.drop(dropped, topic)
            return
        try:
            new = convert.map_of(msg, self._map_revision + 1)
        except ValueError as error:
            self.habits.drop(Drop(Reason.MAP, f"{error}; the last one stays", "a map"), topic)
            return
        if self.occupancy_map is not None and new.shows_the_same_as(self.occupancy_map):
            return
        self.occupancy_map = new
        self._map_revision += 1
        self.tell_listeners()

    def _on_get_field(self, request: Any, response: Any) -> Any:
        try:
            answer = self.fields.lookup(
                convert_field.request_of(request), self.store, self.occupancy_map
            )
            if not isinstance(answer, FieldJob):
                return convert_field.fill_response(response, answer)
            # Longer than a tick, perhaps: not on this thread, where messages wait.
            later = Later()
            self._desk.ask(
                answer, lambda field: later.answer(self._field_response(response, field))
            )
        except Exception as error:  # noqa: BLE001  # the caller must not wait for ever
            return self._field_response(response, error)
        return later

    def _on_computed(self) -> None:
        self._desk.deliver()

    def _on_found(self) -> None:
        self.habits.drain()
        self._past_desk.deliver()
        self.estimates.deliver()
        self.layers.deliver()

    def _field_response(self, response: Any, field: FieldGrid | Exception) -> Any:
        if not isinstance(field, Exception):
            return convert_field.fill_response(response, field)
        refusal = convert_field.refusal()
        if isinstance(field, FieldRefused):
            refusal.error_message = str(field)
        else:
            self.report("get_field", field)
            refusal.error_message = f"the twin failed to compute the field: {field}"
        return refusal

    def destroy_node(self) -> None:
        """End the workers and the journal too; what they compute is for nobody then."""
        self._workers.close()
        self.estimates.close()
        self.layers.close()
        self.memory.close()
        super().destroy_node()

    def _publish_diagnostics(self) -> None:
        now_s = time.monotonic()
        health = Health(
            journal=self.memory.condition,
            clock=self._clock_state,
            counts=self.habits.counts(),
            inputs={topic: int(self.count_publishers(topic)) for topic in self._topics.values()},
            observed_ago_s=None if self._observed_s is None else now_s - self._observed_s,
            late=self.lateness.counts,
            twins=self.twins.value,
            state_topic=self._state_publisher.topic_name,
            fields_computing=self._desk.computing,
            fields_computed=self._desk.computed,
            slowest_field_s=self._desk.slowest_s,
            estimates=self.estimates.state(),
            layers=self.layers.state(),
            origin=self.origin,
            input_problems=self.habits.look_at_inputs(),
        )
        self._diagnostics.publish(
            diagnostics(findings(health), self.get_fully_qualified_name(), self.now_ns())
        )

    def _publish_state(self) -> None:
        # Of a large house each of the two keeps this thread for tenths of a second.
        self.habits.drain()
        snapshot = self.snapshot()
        self._state_publisher.publish(self._states.build(snapshot))
        self.habits.drain()
        self._times_publisher.publish(self._times.build(snapshot))
        self._others.look(self._state_publisher.topic_name)

    @property
    def _clock_state(self) -> ClockState:
        return "doubted" if self.memory.is_clock_doubted else self._clock_watch.state

    @property
    def origin(self) -> Origin:
        """Where what is observed comes from."""
        return origin_of(self._world.origin, is_simulated=self.get_clock().ros_time_is_active)

    # --- small parts ------------------------------------------------------------------------

    def _apply(self, write: ingest.Write | Drop, topic: str, mission: str = "") -> bool:
        near, dropped = ingest.near(write, self.parameters.max_pose_m)
        refused = None if near is None else self.memory.apply(near, time.time_ns(), mission)
        for drop in filter(None, (dropped, refused)):
            self.habits.drop(drop, topic)
        if near is None or refused is not None:
            return False
        self.estimates.hear(near)
        return True

    def tell_listeners(self) -> None:
        """Give all of them the state as it is."""
        if self._listeners:
            snapshot = self.snapshot()
            for listener in self._listeners:
                listener(snapshot)

    def _look_at_clock(self) -> None:
        self._past_desk.go_on()
        before = self._clock_watch.state
        self.now_ns()
        if self._clock_watch.state != before:
            self.tell_listeners()

    def _watch_clock(self, now_ns: int, *, is_simulated: bool) -> None:
        watch = self._clock_watch
        state = watch.look(now_ns, time.monotonic(), is_simulated=is_simulated)
        if state != self._clock_told:
            self._clock_told = state
            # Two lines: rclpy lets one line log at one level only.
            if state in ("none", "stopped"):
                self.get_logger().warning(CLOCK_SAYS[state])
            else:
                self.get_logger().info(CLOCK_SAYS[state])
        # Only while it stands: a simulator that runs may tell the time a thousand times a second.
        if watch.wants_to_listen and self._clock_subscription is None:
            self._clock_subscription = self.create_subscription(
                ClockMessage,
                interfaces.CLOCK.name,
                lambda _: watch.hear(time.monotonic()),
                qos_of(interfaces.CLOCK),
                callback_group=self._group,
                raw=True,
            )
        elif not watch.wants_to_listen and self._clock_subscription is not None:
            self.destroy_subscription(self._clock_subscription)
            self._clock_subscription = None

    def now_ns(self) -> int:
        """ROS time; what follows from a clock that has gone back is done."""
        clock = self.get_clock()
        now_ns = int(clock.now().nanoseconds)
        self._watch_clock(now_ns, is_simulated=bool(clock.ros_time_is_active))
        self._follow(now_ns, is_simulated=bool(clock.ros_time_is_active))
        return now_ns

    def _follow(self, now_ns: int, *, is_simulated: bool) -> None:
        now = RunClock(now_ns, time.time_ns(), is_simulated)
        if told := self.memory.follow(now):
            self.get_logger().info(told)
            self.estimates.restore()
        if self.memory.hold_to(now):
            self.lateness.hold_to(now_ns)
            self.estimates.hold_to(now_ns)
            self.habits.warn(
                ("clock", 0),
                "ROS time has gone back: all observations from later than now age from here on",
            )
        condition = self.memory.condition
        if not condition.is_well:
            self.habits.warn(("journal", condition.state), f"journal: {condition.detail}")
