"""What every node of the project shares: latched QoS, guarded callbacks, warnings, spinning.

Messages are read raw, so that their lengths are checked before they become objects, and one that
cannot be read is reported with its topic.
"""

from __future__ import annotations

import math
import signal
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from threading import Event, Thread, main_thread
from time import sleep
from typing import Any, Final

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.exceptions import InvalidHandle
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions

from lupin_twin.core import ingest
from lupin_twin.core.diagnostics import MAX_PROBLEMS
from lupin_twin.core.drops import Counts, Drop, DropCounts, Reason, Throttle
from lupin_twin.core.interfaces import SERVICE_DEPTH, Topic
from lupin_twin.core.parameters import ParameterError
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.ros import convert
from lupin_twin.ros.inputs import Input
from lupin_twin.ros.message_limits import MessageShape, TooManyError
from lupin_twin.ros.parameters import naming
from lupin_twin.runtime import process

WARNING_PERIOD_S: Final = 5.0
# How long, s, waiting messages are taken one after the other before other callbacks have a turn.
DRAIN_S: Final = 0.02
# The same before long work; the full queues of a working robot take less.
WORK_DRAIN_S: Final = 1.0
# A message that waited longer than this, s, shows that the thread is too slow. At 200 a second, ten
# of the fifty that may wait do so by then. The thread then counts as behind for `BELIEVED_S`.
BEHIND_S: Final = 0.05
BELIEVED_S: Final = 0.25
# A twin that has died stays in DDS's graph for 20 s (the lease). A twin restarted in its place must
# not count as a second one.
LEFT_OVER_S: Final = 30.0
# The default of ROS, reliable and volatile, except for the depth.
SERVICE_QOS: Final = QoSProfile(depth=SERVICE_DEPTH)
# Without rclpy's default warnings about subscribers that do not match, which log the same warning
# themselves. rclpy's executor handles each of them in Python at each of its wake-ups.
NO_EVENTS: Final = PublisherEventCallbacks(use_default_callbacks=False)


def waker(condition: Any) -> Callable[[], None]:
    """Return a function that wakes a node's thread by a guard condition, if the node still exists.

    Work that was begun for a node may end after the node.
    """

    def wake() -> None:
        with suppress(InvalidHandle):
            condition.trigger()

    return wake


def latched(depth: int) -> QoSProfile:
    """RELIABLE and TRANSIENT_LOCAL: a late subscriber still gets the last `depth` messages.

    Fixed, never inferred from the graph: a profile chosen before the publisher is discovered would
    miss what it has latched.
    """
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )


def qos_of(topic: Topic) -> QoSProfile:
    """The QoS of a topic in the table of interfaces, for publishing and subscribing."""
    if topic.is_latched:
        return latched(topic.depth)
    reliability = ReliabilityPolicy.RELIABLE if topic.is_reliable else ReliabilityPolicy.BEST_EFFORT
    return QoSProfile(depth=topic.depth, reliability=reliability)


def read_message(
    data: bytes, shape: MessageShape, read: Callable[[bytes, Any], Any] = deserialize_message
) -> Any | Drop:
    """Deserialise a message; returns a drop if it is too large or cannot be read.

    Its lengths are checked first: ROS would allocate whatever they claim.
    """
    try:
        shape.check(data)
        return read(data, shape.message_type)
    except TooManyError as error:
        return Drop(Reason.SIZE, str(error))
    except Exception as error:  # noqa: BLE001  # rclpy raises several kinds
        return Drop(Reason.UNREADABLE, str(error), "dropped an unreadable message")


class NodeUtilities:
    """Subscriptions, warnings and counts of one node; belongs to its thread."""

    def __init__(self, node: Node) -> None:
        self._drops = DropCounts()
        # When the current message was published, by its publisher's clock, and how long before its
        # arrival that was, s, by the two clocks.
        self.published_ns = 0
        self.published_ago_s = 0.0
        self.node = node
        self._inputs: list[Input] = []
        # As of the last `check_inputs`.
        self.input_problems: tuple[str, ...] = ()
        # The twins that publish one state, see `check_twins`.
        self.twins = 1
        self._several_since_s = math.inf
        self._drains: list[Callable[[], None]] = []
        self._behind_until_s = -math.inf
        self._throttle = Throttle(WARNING_PERIOD_S)

    def subscribe(
        self,
        parameter: str,
        topic: str,
        shape: MessageShape,
        *,
        depth: int,
        group: Any,
        callback: Callable[[Any], None],
        is_wanted: Callable[[bytes], bool] | None = None,
    ) -> str:
        """Call `callback(message)`, guarded, for each message on a latched topic.

        Publishers that do not latch, or are not reliable, are matched too, as soon as DDS reports
        one that matches no subscription: see `inputs`.

        `is_wanted` is for a topic that is not latched, and that many nodes share. It selects
        messages while they are serialised; unwanted and lost ones are not counted.

        `parameter` is the parameter that gave the name. Returns the topic's name as resolved and
        remapped by ROS, as it appears in its graph and in warnings. A message past the limits of
        `shape` is dropped before a single object is made from it.

        Raises:
            lupin_twin.core.parameters.ParameterError: the name is invalid in ROS.

        """
        source = Input(depth)

        def read(data: bytes, info: dict[str, Any]) -> None:
            if not (is_wanted(data) if is_wanted is not None else source.is_new(info)):
                return
            self._see_wait(info["received_timestamp"])
            self.published_ns = info["source_timestamp"]
            self.published_ago_s = (info["received_timestamp"] - self.published_ns) / 1e9
            number = info["publication_sequence_number"]
            # With depth 1, only the latest message is wanted.
            if depth > 1 and number is not None and is_wanted is None:
                lost = source.gaps.see(number, lambda: int(self.node.count_publishers(name)))
                if lost:
                    what = f"lost {lost} messages"
                    self.drop(Drop(Reason.LOST, "they arrived too fast", what, count=lost), name)
            message = read_message(data, shape)
            if isinstance(message, Drop):
                self.drop(message, name)
            else:
                self.guarded(name, callback)(message)

        def listen(qos: QoSProfile, events: SubscriptionEventCallbacks | None) -> str:
            subscription = self.node.create_subscription(
                shape.message_type,
                topic,
                read,
                qos,
                callback_group=group,
                raw=True,
                event_callbacks=events,
            )
            if depth > 1:
                self._drain_behind(subscription, read, depth)
            return str(subscription.topic_name)

        with naming(parameter, topic):
            if is_wanted is not None:
                name = listen(QoSProfile(depth=depth), None)
            else:
                name = source.topic = self._subscribe_all(source, listen)
                self._inputs.append(source)
        return name

    def _subscribe_all(
        self, source: Input, listen: Callable[[QoSProfile, SubscriptionEventCallbacks], str]
    ) -> str:
        """Subscribe, and once more as soon as DDS reports a publisher that was not matched."""
        level = source.subscriptions

        def on_unmatched(_: object) -> None:
            if source.subscriptions == level + 1 < len(source.profiles):
                self._subscribe_all(source, listen)

        source.subscriptions += 1
        guarded = self.guarded("a publisher that was not matched", on_unmatched)
        return listen(source.profiles[level], SubscriptionEventCallbacks(incompatible_qos=guarded))

    def every(self, group: Any, period_s: float, what: str, callback: Callable[[], None]) -> Any:
        """Create a timer on the steady clock, so that it also runs while a simulation is paused."""
        return self.node.create_timer(
            period_s,
            self.guarded(what, callback),
            callback_group=group,
            clock=Clock(clock_type=ClockType.STEADY_TIME),
        )

    def check_inputs(self) -> tuple[str, ...]:
        """Return what is wrong with the publishers on latched topics; new problems are logged."""
        before, now_s = self.input_problems, time.monotonic()
        domain = self.node.context.get_domain_id()
        self.input_problems = tuple(
            problem
            for each in self._inputs
            for problem in each.check(
                self.node.get_publishers_info_by_topic(each.topic), domain, now_s
            )
        )[:MAX_PROBLEMS]
        for problem in self.input_problems:
            if problem not in before:
                self.warn(("input", problem), problem)
        return self.input_problems

    def _drain_behind(
        self, subscription: Any, read: Callable[[bytes, dict[str, Any]], None], depth: int
    ) -> None:
        """After each message, also take those that wait.

        The executor delivers one message a round, beside whatever else is due. If that takes long,
        more messages arrive than are taken, and the queue overflows.
        """

        def drain(most: float, most_s: float) -> None:
            until_s = time.monotonic() + most_s
            handle, kind = subscription.handle, subscription.msg_type
            taken = 0
            with handle:
                while (more := handle.take_message(kind, True)) is not None:
                    read(*more)
                    taken += 1
                    if taken >= most or time.monotonic() >= until_s:
                        return

        def take(data: bytes, info: dict[str, Any]) -> None:
            read(data, info)
            drain(math.inf, DRAIN_S)

        subscription.callback = take
        self._drains.append(lambda: drain(depth, WORK_DRAIN_S))

    def drain(self) -> None:
        """Take the waiting messages, before work that occupies the thread for long.

        It takes as many as the queues can hold, so that they are empty when the work begins. But a
        flood of huge ones must not silence the twin: it ends after `WORK_DRAIN_S`.
        """
        for drain in self._drains:
            drain()

    @property
    def is_behind(self) -> bool:
        """Whether messages have recently waited for long; work that can wait should wait then."""
        return time.monotonic() < self._behind_until_s

    def _see_wait(self, received_ns: int) -> None:
        # The middleware stamps arrivals with wall time, if at all.
        if received_ns and time.time_ns() - received_ns > BEHIND_S * 1e9:
            self._behind_until_s = time.monotonic() + BELIEVED_S

    def new_map(
        self, msg: Any, topic: str, frame_id: str, before: OccupancyMap | None
    ) -> OccupancyMap | None:
        """Return a valid map that differs from the one before, else None.

        An invalid one is dropped. The caller has to set the revision.
        """
        if dropped := ingest.wrong_frame(msg.header.frame_id, frame_id):
            self.drop(dropped, topic)
            return None
        try:
            new = convert.map_of(msg, 0)
        except ValueError as error:
            self.drop(Drop(Reason.MAP, f"{error}; the previous one stays", "dropped a map"), topic)
            return None
        return None if before is not None and new.shows_the_same_as(before) else new

    def check_twins(self, topic: str, what: str) -> None:
        """Count the publishers of a twin's state; warns if several; `what` is the consequence."""
        publishers, now_s = int(self.node.count_publishers(topic)), time.monotonic()
        self._several_since_s = min(self._several_since_s, now_s) if publishers > 1 else math.inf
        self.twins = publishers if now_s - self._several_since_s >= LEFT_OVER_S else 1
        if self.twins > 1:
            self.warn(
                ("twins", 0),
                f"{self.twins} nodes publish {topic}: {what}; "
                "stop all twins but one, or give them ROS domains of their own",
            )

    def drop(self, drop: Drop, topic: str) -> None:
        """Count and report something that was dropped, lost or late."""
        self._drops.add(drop.reason.value, drop.on(topic), time.monotonic(), drop.count)
        self.warn((drop.reason, (topic, drop.case)), drop.on(topic))

    @property
    def callback_errors(self) -> int:
        """Number of errors in callbacks so far."""
        return self._drops.callback_errors

    def counts(self) -> Counts:
        """Return all drops, losses and errors so far."""
        return self._drops.value(time.monotonic())

    def warn(self, key: tuple[str, object], text: str) -> None:
        """Log a warning, at most one a period for each key, and how many were held back."""
        held_back = self._throttle.allow(key, time.monotonic())
        if held_back is not None:
            more = f" ({held_back} more since the last warning)" if held_back else ""
            self.node.get_logger().warning(text + more)

    def guarded(self, what: str, callback: Callable[..., None]) -> Callable[..., None]:
        """`callback`, whose errors are reported: one bad message must not end the node."""

        def run(*args: Any) -> None:
            try:
                callback(*args)
            except Exception as error:  # noqa: BLE001  # see above
                self.report(what, error)

        return run

    def report(self, what: str, error: Exception) -> None:
        """Count and log an error of a callback, with its trace, throttled."""
        self._drops.callback_errors += 1
        if self._throttle.allow(("error", what), time.monotonic()) is not None:
            trace = "".join(traceback.format_exception(error))
            self.node.get_logger().error(
                f"error number {self.callback_errors}, in {what}:\n{trace}"
            )


# Pause after an error, s: an executor that fails at once must not take a whole core.
PAUSE_S: Final = 0.05


def spin_until_shutdown(executor: Any, on_error: Callable[[str, Exception], None]) -> None:
    """Spin until the executor or its context is shut down.

    An exception that leaves a callback ends rclpy's own `spin`, and with it a thread that nobody
    watches. Here it goes to `on_error(what, exception)`, and spinning continues.
    """
    while True:
        try:
            executor.spin()
        except ExternalShutdownException:
            return
        except Exception as error:  # noqa: BLE001  # whatever it is
            on_error("a callback", error)
            sleep(PAUSE_S)
        else:
            return


def end_spinning(executor: Any) -> None:
    """Ask the spinning to end, once, from any thread; a callback that is running ends first.

    rclpy's `shutdown` destroys what a spin that is about to wait still needs. So it has to run in
    the spinning thread itself.
    """
    executor.create_task(executor.shutdown)


@contextmanager
def running_ros(args: Sequence[str] | None) -> Iterator[None]:
    """Run ROS until the end of the context; the caller has to block signals before.

    Raises:
        ParameterError: ROS rejects the arguments.

    """
    try:
        rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # the parent of all that rclpy raises for bad arguments
        raise ParameterError(f"cannot start ROS: {error}") from error
    process.remove_stale_shared_memory(rclpy.get_default_context().get_domain_id())
    try:
        yield
    finally:
        rclpy.try_shutdown()


@contextmanager
def spinning(node: Any, at_end: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Spin a node in its own thread until the end of the context; that thread calls `at_end`."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)

    def spin() -> None:
        try:
            spin_until_shutdown(executor, node.utilities.report)
        finally:
            at_end()

    thread = Thread(target=spin, name="ros")
    thread.start()
    try:
        yield
    finally:
        end_spinning(executor)
        thread.join()
        node.destroy_node()


def run_until_signal(node: Any) -> int:
    """Spin a node until a stop signal comes; the caller has to call `process.block` before.

    Returns the exit code: 1 if its thread has died.
    """
    ended = Event()

    def end() -> None:
        ended.set()
        signal.pthread_kill(main_thread().ident or 0, signal.SIGTERM)  # it waits, see below

    with spinning(node, end):
        process.wait()
        return 1 if ended.is_set() else 0
