"""ROS topics as they are on the wire, for whoever in the bridge asks for one: raw CDR, on demand.

    listening = await source.relay.listen(topic, on_sample)
    ...
    listening.close()

`topic` is one of `names.topics_of(source.names())`, or a `Topic` of one's own. `on_sample(sample)`
is called on the event loop for each sample, and must not wait. Of a latched topic the newest ones
come first, before `listen` returns if they are here, or soon after. One `Topic` is one
subscription, however many listen; it ends some seconds after the last of them has closed, so that
who comes and goes makes no work in the ROS thread. While nobody listens there is none.

The ROS thread hands over bytes and does nothing else with them. Of what the loop has not taken yet,
as of what is kept for who listens later, the oldest give way to the newest within the topic's
bounds. A sample that is larger than these is left out, and counted.
"""

from __future__ import annotations

import asyncio
import logging
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any, Final, Protocol

from lupin_bridge.feed.topics import Topic

log = logging.getLogger(__name__)

# How long, s, a topic that nobody listens to any more is still relayed.
LINGER_S: Final = 5.0
# More at once nobody needs, and each has its buffers.
MAX_TOPICS: Final = 100


class NotRelayedError(RuntimeError):
    """A topic that cannot be listened to; the message says why."""


@dataclass(frozen=True, slots=True)
class Sample:
    """A message as CDR, with the four bytes that say how; `stamp_ns` is ROS time as it came."""

    data: bytes
    stamp_ns: int


@dataclass(frozen=True, slots=True)
class RosTime:
    """A moment; `is_simulated`: by `/clock`, and 0 while that has told none."""

    now_ns: int
    is_simulated: bool


class RosSide(Protocol):
    """What is needed of the ROS thread; `RosThread` is it."""

    async def call(self, work: Callable[[Any], Any]) -> Any:
        """Run `work(node)` there, and return its result."""

    def to_loop(self, callback: Callable[..., None], *args: Any) -> None:
        """From there, have a callback run on the event loop."""


class Ros(Protocol):
    """What ROS does for the relay, in its thread; `relay_ros.RelayRos` is it."""

    def subscribe(
        self, node: Any, topic: Topic, take: Callable[[Sample], None]
    ) -> Callable[[], None]:
        """Have `take` called for each sample, until what is returned is called.

        Raises:
            LookupError: the topic's type is not installed.
            ValueError: ROS takes no such topic.

        """

    def published(self, node: Any, is_wanted: Callable[[str, str], bool]) -> Mapping[str, str]:
        """Topics that somebody publishes as a type that is wanted, and that type."""

    def time(self, node: Any) -> RosTime:
        """What ROS has for now."""

    def read(self, topic: Topic, data: bytes) -> Any:
        """The message that the bytes hold; in any thread.

        Raises:
            ValueError: none of this type, or one that is too large.

        """


class Bounded:
    """The newest samples of a topic, within its bounds."""

    def __init__(self, topic: Topic) -> None:
        self._topic = topic
        self._samples: deque[Sample] = deque()
        self._bytes = 0

    def __len__(self) -> int:
        return len(self._samples)

    def put(self, sample: Sample) -> int:
        """Take a sample; returns how many others gave way to it."""
        self._samples.append(sample)
        self._bytes += len(sample.data)
        given_way = 0
        while len(self._samples) > self._topic.depth or self._bytes > self._topic.max_bytes:
            self.take()
            given_way += 1
        return given_way

    def take(self) -> Sample:
        """Take the oldest out."""
        sample = self._samples.popleft()
        self._bytes -= len(sample.data)
        return sample

    def take_all(self) -> list[Sample]:
        """Take them out."""
        taken = list(self._samples)
        self._samples.clear()
        self._bytes = 0
        return taken

    def all(self) -> list[Sample]:
        """Look at them, oldest first."""
        return list(self._samples)


class Listening:
    """Somebody's ear on a topic, until it is closed."""

    def __init__(self, on_sample: Callable[[Sample], None], leave: Callable[[], None]) -> None:
        self._on_sample: Callable[[Sample], None] | None = on_sample
        self._leave = leave

    @property
    def is_open(self) -> bool:
        """Whether it hears."""
        return self._on_sample is not None

    def close(self) -> None:
        """Hear no more; harmless if it is closed already."""
        if self._on_sample is not None:
            self._on_sample = None
            self._leave()

    def hear(self, sample: Sample) -> None:
        """Pass a sample on; an error is the listener's, and the others' ears are spared it."""
        if self._on_sample is not None:
            try:
                self._on_sample(sample)
            except Exception:  # whatever it is: the other listeners hear it all the same
                log.exception("a listener met an error")


class _Relayed:
    """One topic: what has come of it, and who listens."""

    def __init__(self, topic: Topic) -> None:
        self.topic = topic
        self.opening: asyncio.Task[Callable[[], None]]
        self.listeners: list[Listening] = []
        self.users = 0
        self.ending: asyncio.TimerHandle | None = None
        self.skipped = 0
        self._lock = threading.Lock()
        self._incoming = Bounded(topic)
        self._latched = Bounded(topic)

    def put(self, sample: Sample) -> bool:
        """Take a sample from the ROS thread; whether there is one to hand out."""
        with self._lock:
            if len(sample.data) > self.topic.max_bytes:
                self.skipped += 1
                return False
            self.skipped += self._incoming.put(sample)
            return True

    def hand_out(self) -> None:
        """Give all that has come to all who listen."""
        with self._lock:
            samples = self._incoming.take_all()
        self.listeners = [listening for listening in self.listeners if listening.is_open]
        for sample in samples:
            if self.topic.latched:
                self._latched.put(sample)
            for listening in list(self.listeners):
                listening.hear(sample)

    def add(self, listening: Listening) -> None:
        """Have somebody listen, from what is kept on."""
        for sample in self._latched.all():
            listening.hear(sample)
        self.listeners.append(listening)


class Relay:
    """All topics that are listened to. Belongs to the event loop.

    `thread()` is asked for with the first topic: it need not run before.
    """

    def __init__(self, thread: Callable[[], RosSide], ros: Ros, linger_s: float = LINGER_S) -> None:
        self._thread = thread
        self._ros = ros
        self.linger_s = linger_s
        self._topics: dict[Topic, _Relayed] = {}
        self._lock = threading.Lock()
        self._is_waking = False
        self._skipped = 0
        self._closing: set[asyncio.Task[None]] = set()

    def __len__(self) -> int:
        """How many topics are relayed."""
        return len(self._topics)

    @property
    def skipped(self) -> int:
        """Samples that were too large, or gave way before the loop had taken them."""
        return self._skipped + sum(relayed.skipped for relayed in self._topics.values())

    async def listen(self, topic: Topic, on_sample: Callable[[Sample], None]) -> Listening:
        """Listen to a topic; whether anybody publishes it is another matter.

        Raises:
            NotRelayedError: its type is not installed here, ROS takes no such name, or too many
                others are listened to.
            TwinUnavailableError: the ROS thread has ended.

        """
        relayed = self._topics.get(topic) or self._open(topic)
        with self._in_use(relayed):
            # Not ended with who asked first: others may wait for it by now.
            await asyncio.shield(relayed.opening)
            relayed.users += 1
            listening = Listening(on_sample, lambda: self._let_go(relayed))
            relayed.add(listening)
            return listening

    async def published(self, is_wanted: Callable[[str, str], bool]) -> Mapping[str, str]:
        """Topics that somebody publishes now, and their types; `is_wanted(name, type)` takes them.

        Raises:
            TwinUnavailableError: the ROS thread has ended.

        """
        found: Mapping[str, str] = await self._thread().call(
            lambda node: self._ros.published(node, is_wanted)
        )
        return found

    async def time(self) -> RosTime:
        """ROS time now.

        Raises:
            TwinUnavailableError: the ROS thread has ended.

        """
        now: RosTime = await self._thread().call(self._ros.time)
        return now

    def read(self, topic: Topic, sample: Sample) -> Any:
        """The ROS message of a sample; for a worker's thread, a map takes its time.

        Raises:
            ValueError: none of the topic's type, or one that is too large.

        """
        return self._ros.read(topic, sample.data)

    # --- how long a topic is relayed --------------------------------------------------------------

    def _open(self, topic: Topic) -> _Relayed:
        if len(self._topics) >= MAX_TOPICS:
            unused = next((relayed for relayed in self._topics.values() if not relayed.users), None)
            if unused is None:
                raise NotRelayedError(
                    f"{MAX_TOPICS} topics are listened to, the limit: no room for {topic.name}"
                )
            self._end(unused)
        relayed = self._topics[topic] = _Relayed(topic)
        relayed.opening = asyncio.create_task(self._subscribe(relayed), name=f"open {topic.name}")
        relayed.opening.add_done_callback(lambda task: task.cancelled() or task.exception())
        return relayed

    async def _subscribe(self, relayed: _Relayed) -> Callable[[], None]:
        topic, thread = relayed.topic, self._thread()

        def take(sample: Sample) -> None:
            if relayed.put(sample):
                self._wake(thread)

        with ExitStack() as otherwise:
            otherwise.callback(self._forget, relayed)
            try:
                close: Callable[[], None] = await thread.call(
                    lambda node: self._ros.subscribe(node, topic, take)
                )
            except (LookupError, ValueError) as error:
                raise NotRelayedError(f"{topic.name} cannot be relayed here: {error}") from None
            otherwise.pop_all()
        return close

    @contextmanager
    def _in_use(self, relayed: _Relayed) -> Iterator[None]:
        relayed.users += 1
        if relayed.ending is not None:
            relayed.ending.cancel()
            relayed.ending = None
        try:
            yield
        finally:
            self._let_go(relayed)

    def _let_go(self, relayed: _Relayed) -> None:
        relayed.users -= 1
        if not relayed.users and self._topics.get(relayed.topic) is relayed:
            loop = asyncio.get_running_loop()
            relayed.ending = loop.call_later(self.linger_s, self._end, relayed)

    def _end(self, relayed: _Relayed) -> None:
        if relayed.ending is not None:
            relayed.ending.cancel()
        self._forget(relayed)
        task = asyncio.create_task(self._unsubscribe(relayed), name=f"close {relayed.topic.name}")
        self._closing.add(task)
        task.add_done_callback(self._closing.discard)

    async def _unsubscribe(self, relayed: _Relayed) -> None:
        try:
            close = await relayed.opening
            await self._thread().call(lambda _: close())
        except Exception as error:  # noqa: BLE001  # nobody waits for this task
            # As a rule the thread has ended, and all with it.
            log.info("%s was not unsubscribed: %r", relayed.topic.name, error)

    def _forget(self, relayed: _Relayed) -> None:
        if self._topics.get(relayed.topic) is relayed:
            del self._topics[relayed.topic]
            self._skipped += relayed.skipped

    # --- from the ROS thread --------------------------------------------------------------------

    def _wake(self, thread: RosSide) -> None:
        # One wake-up for as many samples as come before the loop gets round to it.
        with self._lock:
            if self._is_waking:
                return
            self._is_waking = True
        thread.to_loop(self._drain)

    def _drain(self) -> None:
        # First the flag, then the samples: one that comes in between wakes the loop once more.
        with self._lock:
            self._is_waking = False
        for relayed in list(self._topics.values()):
            relayed.hand_out()
