"""The ROS thread, and the only crossing between it and the event loop.

The loop sends calls to the thread. The thread sends back their results, and the newest event
(`post`). Both directions wake the other side at once. Nothing here knows what the node does.
"""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, Final, Generic, TypeVar

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.settings import SettingError
from lupin_twin.ros.base_node import end_spinning, spin_until_shutdown
from lupin_twin.runtime.process import remove_stale_shared_memory

# Keeps rcl from writing its own lines to standard error, which a log collector reads. Its log file
# and `/rosout` stay as they are.
QUIET: Final = ("--ros-args", "--disable-stdout-logs")


@cache
def forward() -> None:
    """From now on, pass all that rclpy's loggers log, after ROS has filtered it, to `logging`."""
    write = rclpy_implementation.rclpy_logging_rcutils_log

    def write_and_hand_on(severity: Any, name: str, message: str, *place: Any) -> None:
        write(severity, name, message, *place)
        function, file, line = place
        # ROS uses Python's numbers for severities, and has already filtered by them.
        record = logging.LogRecord(
            name, int(severity), file, line, "%s", (message,), None, function
        )
        logging.root.handle(record)

    rclpy_implementation.rclpy_logging_rcutils_log = write_and_hand_on


log = logging.getLogger(__name__)

# A stop waits this long for the ROS thread. A callback that computes a huge field takes longer
# and cannot be interrupted: the thread is left behind, and the process ends without it.
STOP_TIMEOUT_S = 0.9
# Pause between the return of a heartbeat and the next one.
BEAT_PERIOD_S = 1.0
_NOT_RUNNING: Final = "the ROS thread is not running"


# A node with `utilities` (`NodeUtilities`) and `parameters` (`TwinParameters`).
NodeT = TypeVar("NodeT", bound=Node)
EventT = TypeVar("EventT")
ResultT = TypeVar("ResultT")


class RosThread(Generic[NodeT, EventT]):
    """Runs one node in one thread of its own.

    `make_node(context, post)` is called in the thread; the node calls `post(event)` with what the
    loop should know. On the loop, `on_event(event)` gets the newest event (older ones are skipped),
    and `on_death()` is called once if the thread ends without having been stopped.
    """

    def __init__(
        self,
        make_node: Callable[[Context, Callable[[EventT], None]], NodeT],
        *,
        ros_args: Sequence[str],
        on_event: Callable[[EventT], None],
        on_death: Callable[[], None],
    ) -> None:
        self._make_node = make_node
        self._ros_args = list(ros_args)
        self._on_event = on_event
        self._on_death = on_death
        self._loop: asyncio.AbstractEventLoop
        self._started: asyncio.Future[None]
        self._thread = threading.Thread(target=self._run, name="ros", daemon=True)
        self._context = Context()
        self._executor: SingleThreadedExecutor | None = None
        self._node: NodeT | None = None
        self._newest: EventT | None = None
        # Calls whose answer has not come yet.
        self.calls_waiting = 0
        # Failed when the thread ends: nothing else would end them.
        self._unanswered: set[asyncio.Future[Any]] = set()
        # Errors met by the node's callbacks, as of the last heartbeat.
        self.callback_errors = 0
        self._beating: asyncio.Task[None] | None = None
        # When the heartbeat that has not come back yet was sent, by the loop's clock.
        self._beat_sent_s: float | None = None
        self._is_waking = False
        self._is_stopping = False
        self._is_joining = False

    # --- on the event loop ------------------------------------------------------------------

    async def start(self) -> None:
        """Start the thread; returns when the node is there.

        Raises:
            SettingError: ROS does not understand its arguments; the message is rcl's own.
            Exception: whatever `make_node` raised, such as a `ParameterError`.

        """
        self._loop = asyncio.get_running_loop()
        self._started = self._loop.create_future()
        self._thread.start()
        await self._started
        self._beating = asyncio.create_task(self._beat(), name="heartbeat")

    async def stop(self) -> None:
        """Stop the node and join the thread; calls under way raise TwinUnavailableError."""
        was_stopping, self._is_stopping = self._is_stopping, True
        if self._beating is not None:
            self._beating.cancel()
        if not was_stopping and self._executor is not None and self._thread.is_alive():
            end_spinning(self._executor)
        self._is_joining = True
        try:
            # A running callback ends first, which must not block the loop.
            await asyncio.to_thread(self._thread.join, STOP_TIMEOUT_S)
        finally:
            self._is_joining = False
        if self._thread.is_alive():
            log.warning("the ROS thread did not end within %s s: left running", STOP_TIMEOUT_S)
        self._refuse_unanswered()

    @property
    def is_alive(self) -> bool:
        """Whether the thread runs; one that is being stopped has not died."""
        return self._is_joining or self._thread.is_alive()

    @property
    def stuck_s(self) -> float:
        """For how long a heartbeat has been unanswered, s; 0: none is under way."""
        return 0.0 if self._beat_sent_s is None else self._loop.time() - self._beat_sent_s

    async def call(self, work: Callable[[NodeT], ResultT]) -> ResultT:
        """Run `work(node)` in the ROS thread, between two callbacks, and return its result.

        If the caller is cancelled first, `work` does not run.

        Raises:
            TwinUnavailableError: the thread has ended.
            Exception: whatever `work` raised.

        """
        if self._executor is None or not self._thread.is_alive() or self._is_stopping:
            raise TwinUnavailableError(_NOT_RUNNING)
        result: asyncio.Future[ResultT] = self._loop.create_future()

        def run() -> None:
            if result.cancelled():
                return
            try:
                value = work(self.require_node())
            except Exception as error:  # noqa: BLE001  # handed to the caller
                self.to_loop(_settle, result, None, error)
            else:
                self.to_loop(_settle, result, value, None)

        self._executor.create_task(run)
        self.calls_waiting += 1
        try:
            return await self._answer(result)
        finally:
            self.calls_waiting -= 1

    async def _answer(self, result: asyncio.Future[ResultT]) -> ResultT:
        if self._is_stopping:  # stopped since the call
            raise TwinUnavailableError(_NOT_RUNNING)
        self._unanswered.add(result)
        try:
            return await result
        finally:
            self._unanswered.discard(result)

    async def ask(
        self, start: Callable[[NodeT], Any], give_up: Callable[[NodeT, Any], None]
    ) -> Any:
        """Run `start(node)`, which returns an rclpy Future, and wait for that future's result.

        Awaiting an rclpy Future itself would busy-wait; its done callback wakes the loop instead.
        If the caller is cancelled (a time-out), `give_up(node, future)` runs in the ROS thread.

        Raises:
            TwinUnavailableError: the thread has ended.
            Exception: whatever `start` or the future raised.

        """
        result: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        # `begin` and `end` run in the ROS thread, not necessarily in the order of submission.
        future: Any = None

        def begin(node: NodeT) -> None:
            nonlocal future
            future = start(node)
            future.add_done_callback(
                lambda done: self.to_loop(
                    _settle, result, None if done.exception() else done.result(), done.exception()
                )
            )

        def end() -> None:
            if future is not None:
                give_up(self.require_node(), future)

        try:
            await self.call(begin)
            return await self._answer(result)
        except asyncio.CancelledError:
            result.cancel()
            if self._executor is not None and not self._is_stopping:
                self._executor.create_task(end)
            raise

    def _refuse_unanswered(self) -> None:
        for result in self._unanswered:
            _settle(result, None, TwinUnavailableError(_NOT_RUNNING))

    async def _beat(self) -> None:
        while self._executor is not None:
            back: asyncio.Future[int] = self._loop.create_future()
            self._beat_sent_s = self._loop.time()
            self._executor.create_task(self._bring_back, back)
            self.callback_errors = await back
            self._beat_sent_s = None
            await asyncio.sleep(BEAT_PERIOD_S)

    def require_node(self) -> NodeT:
        """The node; call this in the ROS thread only."""
        if self._node is None:
            raise TwinUnavailableError("the ROS thread has no node")
        return self._node

    # --- in the ROS thread ------------------------------------------------------------------

    def _run(self) -> None:
        error: BaseException | None = None
        try:
            self._init_ros()
            self._node = self._make_node(self._context, self._post)
            if self._newest is not None:
                self._post(self._newest)
            executor = SingleThreadedExecutor(context=self._context)
            executor.add_node(self._node)
            self._executor = executor
            self.to_loop(_settle, self._started, None, None)
            spin_until_shutdown(executor, self._report)
        except BaseException as caught:  # noqa: BLE001  # no thread ends unnoticed
            error = caught
        finally:
            self._end(error)

    def _bring_back(self, beat: asyncio.Future[int]) -> None:
        self.to_loop(_settle, beat, self.require_node().utilities.callback_errors, None)

    def _report(self, what: str, error: Exception) -> None:
        self.require_node().utilities.report(what, error)

    def _init_ros(self) -> None:
        forward()
        try:
            rclpy.init(
                args=[*self._ros_args, *QUIET],
                context=self._context,
                # The web server owns the signals.
                signal_handler_options=SignalHandlerOptions.NO,
            )
        except Exception as error:  # rclpy raises several kinds
            raise SettingError(" ".join(str(error).split())) from error
        remove_stale_shared_memory(self._context.get_domain_id())

    def _end(self, error: BaseException | None) -> None:
        if self._node is not None:
            self._node.destroy_node()
        if self._context.ok():
            rclpy.try_shutdown(context=self._context)
        if self._executor is None:
            failure = error if isinstance(error, Exception) else TwinUnavailableError(repr(error))
            self.to_loop(_settle, self._started, None, failure)
        elif not self._is_stopping:
            log.critical("the ROS thread has ended", exc_info=error)
            self.to_loop(self._refuse_unanswered)
            self.to_loop(self._on_death)

    def to_loop(self, callback: Callable[..., None], *args: Any) -> None:
        """Run a callback on the event loop, which wakes at once; call this in the ROS thread."""
        try:
            self._loop.call_soon_threadsafe(callback, *args)
        except RuntimeError:
            # The loop is closed: nobody is left to notify.
            log.debug("event loop closed, dropped %r", callback)

    def _post(self, event: EventT) -> None:
        self._newest = event
        # One wake-up covers all events until the loop runs; there is none before the node exists.
        if self._node is not None and not self._is_waking:
            self._is_waking = True
            self.to_loop(self._drain)

    # --- on the event loop again --------------------------------------------------------------

    def _drain(self) -> None:
        # Flag first, then value: an event posted in between wakes the loop once more.
        self._is_waking = False
        event = self._newest
        if event is not None:
            self._on_event(event)


def _settle(future: asyncio.Future[Any], value: Any, error: BaseException | None) -> None:
    if future.done():  # the caller has gone
        return
    if error is None:
        future.set_result(value)
    else:
        future.set_exception(error)
