"""Relays ROS topics as raw CDR to listeners in the bridge, on demand; has message definitions too.

    close = await source.relay.listen(topic, on_sample)
    ...
    close()

`topic` is one of `topics_of(source.names)`, or another `Topic` with an absolute name.
`on_sample(sample)` is called on the event loop for each sample, and must not block. A new listener
of a latched topic first gets its newest samples. All listeners of a `Topic` share one subscription.
It ends some seconds after the last of them has closed, so that listeners that come and go make no
work in the ROS thread.

The ROS thread hands over bytes and does nothing else with them. Samples that wait for the loop, and
those cached for later listeners, are bounded: the oldest are dropped. A sample larger than the
topic's limit is dropped, and counted.

`schema_text` gives the definition of a message type with all its parts, for bags and viewers. It
reads the `.msg` files that every message package installs with ROS. The format is the schema
encoding `ros2msg` (https://mcap.dev/spec/registry#ros2msg).
"""

from __future__ import annotations

import asyncio
import logging
import os
import re
import sys
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, Final

from lupin_twin.core import interfaces
from lupin_twin.core.interfaces import Topic

log = logging.getLogger(__name__)


def absolute(name: str) -> str:
    """A ROS name as seen from the root namespace: `a/b` is `/a/b`."""
    return name if name.startswith("/") else f"/{name}"


@dataclass(frozen=True, slots=True)
class TwinNames:
    """A twin's names, absolute and remapped; topics of field layers begin with `field_layers`."""

    state_topic: str
    field_service: str
    observations_topic: str = absolute(interfaces.OBSERVATIONS.name)
    discovered_tags_topic: str = absolute(interfaces.DISCOVERED_TAGS.name)
    map_topic: str = absolute(interfaces.MAP.name)
    diagnostics_topic: str = absolute(interfaces.DIAGNOSTICS.name)
    field_layers: str = absolute(interfaces.LAYERS_BELOW)
    tags_layer: str = absolute(interfaces.TAGS.name)
    planters_layer: str = absolute(interfaces.PLANTERS.name)


def topics_of(names: TwinNames) -> tuple[Topic, ...]:
    """A twin's topics: its state, its inputs and its diagnostics."""
    return (
        replace(interfaces.STATE, name=names.state_topic),
        replace(interfaces.OBSERVATIONS, name=names.observations_topic),
        replace(interfaces.DISCOVERED_TAGS, name=names.discovered_tags_topic),
        replace(interfaces.MAP, name=names.map_topic),
        replace(interfaces.DIAGNOSTICS, name=names.diagnostics_topic),
    )


# How long a topic is still relayed after its last listener has left, s.
LINGER_S: Final = 5.0


class NotRelayedError(RuntimeError):
    """A topic that cannot be listened to; the message says why."""


@dataclass(frozen=True, slots=True)
class Sample:
    """A message as CDR, with its 4-byte header; `stamp_ns` is the ROS time of its receipt."""

    data: bytes
    stamp_ns: int


class Bounded:
    """The newest samples of a topic, within its bounds."""

    def __init__(self, topic: Topic) -> None:
        self._topic = topic
        self.samples: deque[Sample] = deque()
        self._bytes = 0

    def __len__(self) -> int:
        return len(self.samples)

    def put(self, sample: Sample) -> int:
        """Add a sample; returns how many old ones were dropped for it."""
        self.samples.append(sample)
        self._bytes += len(sample.data)
        given_way = 0
        while len(self.samples) > self._topic.depth or self._bytes > self._topic.max_bytes:
            self.take()
            given_way += 1
        return given_way

    def take(self) -> Sample:
        """Remove and return the oldest sample."""
        sample = self.samples.popleft()
        self._bytes -= len(sample.data)
        return sample


@dataclass(frozen=True, slots=True)
class Feed:
    """A client's subscription to a topic, which the client calls `name`."""

    topic: Topic
    name: str | int
    min_interval_s: float = 0.0


class _Relayed:
    """One relayed topic: its samples and its listeners."""

    def __init__(self, topic: Topic) -> None:
        self.topic = topic
        # Samples from the ROS thread that the loop has not taken yet.
        self.incoming: deque[Sample] = deque(maxlen=topic.depth)
        self.latched = Bounded(topic)
        self.opening: asyncio.Task[Callable[[], None]]
        self.listeners: list[Callable[[Sample], None]] = []

    def hand_out(self) -> None:
        """Pass all new samples to all listeners."""
        while self.incoming:
            sample = self.incoming.popleft()
            if self.topic.is_latched:
                self.latched.put(sample)
            for on_sample in list(self.listeners):
                on_sample(sample)


class Relay:
    """All relayed topics. Belongs to the event loop.

    `thread()` returns the `RosThread`; it is first called for the first topic, so the thread may
    start later. `ros` is `ros_source.RelayRos`: the relay's calls to rclpy, made in that thread.
    """

    def __init__(self, thread: Callable[[], Any], ros: Any) -> None:
        self._thread = thread
        self._ros = ros
        self.linger_s = LINGER_S
        # Samples that viewers got unchanged; and those that were too large, or dropped before the
        # loop or a slow client had taken them.
        self.sent = self.skipped = 0
        self.topics: dict[Topic, _Relayed] = {}
        self._ending: set[asyncio.Task[None]] = set()

    async def listen(self, topic: Topic, on_sample: Callable[[Sample], None]) -> Callable[[], None]:
        """Listen to a topic, whoever publishes it; returns a function that ends this, idempotent.

        Raises:
            NotRelayedError: its type is not installed here, or its name is invalid.
            TwinUnavailableError: the ROS thread has ended.

        """
        relayed = self.topics.get(topic)
        if relayed is None:
            relayed = self.topics[topic] = _Relayed(topic)
            self._open(relayed)
        for sample in list(relayed.latched.samples):
            on_sample(sample)
        relayed.listeners.append(on_sample)
        close = partial(self._leave, relayed, on_sample)
        try:
            # Shielded from the first listener's cancellation: others may wait for it by now.
            await asyncio.shield(relayed.opening)
        except BaseException:
            close()
            raise
        return close

    def renew(self) -> None:
        """Subscribe to all topics again, on a new node."""
        for relayed in self.topics.values():
            self._open(relayed)

    async def published(self, is_wanted: Callable[[str, str], bool]) -> Mapping[str, str]:
        """The topics that have a publisher now, with their types; `is_wanted(name, type)` filters.

        Raises:
            TwinUnavailableError: the ROS thread has ended.

        """
        found: Mapping[str, str] = await self._thread().call(
            lambda node: self._ros.published(node, is_wanted)
        )
        return found

    def read(self, topic: Topic, sample: Sample) -> Any:
        """The ROS message of a sample. Call it on a worker: a map takes a while.

        Raises:
            ValueError: not a message of the topic's type, or too large.

        """
        return self._ros.read(topic, sample.data)

    def _open(self, relayed: _Relayed) -> None:
        relayed.opening = asyncio.create_task(self._subscribe(relayed))
        # Retrieve the exception, in case all listeners have left.
        relayed.opening.add_done_callback(lambda it: it.cancelled() or it.exception())

    async def _subscribe(self, relayed: _Relayed) -> Callable[[], None]:
        topic, thread = relayed.topic, self._thread()

        def take(sample: Sample) -> None:
            is_too_large = len(sample.data) > topic.max_bytes
            self.skipped += is_too_large or len(relayed.incoming) == topic.depth
            if not is_too_large:
                relayed.incoming.append(sample)
                thread.to_loop(relayed.hand_out)

        try:
            close: Callable[[], None] = await thread.call(
                lambda node: self._ros.subscribe(node, topic, take)
            )
        except BaseException as error:
            self._forget(relayed)
            if isinstance(error, ValueError):
                raise NotRelayedError(f"{topic.name} cannot be relayed here: {error}") from None
            raise
        return close

    def _forget(self, relayed: _Relayed) -> None:
        if self.topics.get(relayed.topic) is relayed:
            del self.topics[relayed.topic]

    def _leave(self, relayed: _Relayed, on_sample: Callable[[Sample], None]) -> None:
        if on_sample in relayed.listeners:
            relayed.listeners.remove(on_sample)
            if not relayed.listeners:
                ending = asyncio.create_task(self._end(relayed))
                self._ending.add(ending)
                ending.add_done_callback(self._ending.discard)

    async def _end(self, relayed: _Relayed) -> None:
        await asyncio.sleep(self.linger_s)
        if relayed.listeners or self.topics.get(relayed.topic) is not relayed:
            return  # somebody listens again, or it has ended
        self._forget(relayed)
        try:
            close = await relayed.opening
            await self._thread().call(lambda _: close())
        except Exception as error:  # noqa: BLE001  # nobody waits for this task
            # Usually the thread has ended, and its subscriptions with it.
            log.info("%s was not unsubscribed: %r", relayed.topic.name, error)


# --- definitions of message types, for bags and viewers -------------------------------------------

ENCODING: Final = "ros2msg"
_RULE: Final = "=" * 80
_NAME: Final = re.compile(r"([A-Za-z]\w*)/msg/([A-Za-z]\w*)", re.ASCII)
# A field, or a constant: its type without bounds and array, `pkg/Name` or `Name`.
_LINE: Final = re.compile(r"\s*([A-Za-z]\w*(?:/[A-Za-z]\w*){0,2})", re.ASCII)
# https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html#field-types
_PRIMITIVES: Final = frozenset(
    (
        *("bool", "byte", "char", "float32", "float64", "string", "wstring"),
        *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
    )
)


def schema_text(type_name: str, environ: Mapping[str, str] = os.environ) -> str:
    """The definition of `package/msg/Name`, followed by all types that it contains, each once.

    It is searched as ROS does: in the prefixes of AMENT_PREFIX_PATH, then in Python's own, where
    the ROS wheels install it.

    Raises:
        LookupError: no such name, or it or a type that it contains is not installed.

    """
    prefixes = [prefix for prefix in environ.get("AMENT_PREFIX_PATH", "").split(":") if prefix]
    return _schema_text(type_name, (*prefixes, sys.prefix))


@cache
def _schema_text(type_name: str, prefixes: tuple[str, ...]) -> str:
    texts: dict[str, str] = {}
    wanted = [(type_name, "")]
    while wanted:
        name, needed_by = wanted.pop(0)
        if name not in texts:
            texts[name] = _definition(name, needed_by, prefixes)
            wanted += [(part, f", a part of {name},") for part in _parts(texts[name], name)]
    own, *others = texts
    # The encoding calls a part `package/Name`, without the `msg`.
    return "\n".join(
        (
            texts[own],
            *(f"{_RULE}\nMSG: {name.replace('/msg/', '/')}\n{texts[name]}" for name in others),
        )
    )


def _definition(type_name: str, needed_by: str, prefixes: tuple[str, ...]) -> str:
    parts = _NAME.fullmatch(type_name)
    if parts is None:
        raise LookupError(f"{type_name!r} is not a message type, expected package/msg/Name")
    package, name = parts.groups()
    for prefix in prefixes:
        try:
            return Path(prefix, "share", package, "msg", f"{name}.msg").read_text(encoding="utf-8")
        except (FileNotFoundError, NotADirectoryError):
            continue
    raise LookupError(
        f"the message type {type_name}{needed_by} is not installed: there is no "
        f"share/{package}/msg/{name}.msg in {', '.join(prefixes)}"
    )


def _parts(text: str, type_name: str) -> list[str]:
    """The message types of a definition's fields, in their order."""
    package = type_name.partition("/")[0]
    found = []
    for line in text.splitlines():
        field = _LINE.match(line)
        if field is None or field[1] in _PRIMITIVES:
            continue
        words = field[1].split("/")
        found.append(f"{words[0] if len(words) > 1 else package}/msg/{words[-1]}")
    return found
