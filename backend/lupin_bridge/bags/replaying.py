"""A replay from its start to its end: file, player and node put together."""

from __future__ import annotations

import math
import sys
import time
from argparse import Namespace
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Final

import rclpy
from rclpy.signals import SignalHandlerOptions

from lupin_bridge.bags.choosing import INPUTS, inputs_of, state_of
from lupin_bridge.bags.keys import keys
from lupin_bridge.bags.live_twins import LiveTwins
from lupin_bridge.bags.offered_qos import Offered, offered
from lupin_bridge.bags.player import Player, Playing, due_in_s
from lupin_bridge.bags.recording import Topic
from lupin_bridge.bags.recordings import Recordings
from lupin_bridge.bags.replay_node import (
    DELIVERY_S,
    DISCOVERY_S,
    LOOK_S,
    NODE_NAME,
    SAYS_WITHIN_S,
    NotPublishable,
    ReplayNode,
)
from lupin_bridge.telling import say
from lupin_twin.half_made import remove_half_made
from lupin_twin.parameters import ParameterError

_TELL_EVERY_S: Final = 0.5
# How long it is waited for at the end for what twins say of it, s: they do so once a second.
LAST_SAID_S: Final = 2.5
# What a publisher keeps for who comes late, unless another depth was recorded (`INPUTS`).
_LATE: Final = "the newest 50 observations"


class Refused(Exception):
    """A replay that must not begin, or go on; the message says why and what to do."""


def replay(options: Namespace, ros_args: Sequence[str], stop_asked: Callable[[], bool]) -> None:
    """Replay until the end, or until a stop is asked for; `options` are those of the command.

    Raises:
        RecordingError: the file cannot be played.
        Refused: it would be written into a journal, or ROS does not start.

    """
    with Recordings(options.files) as recording:
        topics = inputs_of(recording.topics, recording.name)
        names: dict[str, str] = {}
        if options.state_as is not None:
            topics.append(state_of(recording.topics, recording.name))
            names[topics[-1].name] = options.state_as
        start_s = options.start or 0.0
        recording.check_start(start_s)
        wanted = {topic.name: (topic.type_name, _qos(topic)) for topic in topics}
        playing = Playing(
            {name: qos.depth for name, (_, qos) in wanted.items()},
            speed=options.speed,
            start_s=start_s,
            loops=options.loop,
            is_paused=options.pause,
            skip_s=options.skip_gaps,
        )
        twins = LiveTwins(options.own_journal or "")
        with _node(wanted, twins, names, ros_args) as node:
            play(recording, node, playing, options, stop_asked)


def play(
    recording: Recordings,
    node: ReplayNode,
    playing: Playing,
    options: Namespace,
    stop_asked: Callable[[], bool],
) -> None:
    """Look whom it would feed, and then play.

    Raises:
        RecordingError: the file is broken from some place on.
        Refused: it would be written into a journal.

    """
    count = f"{recording.file_count} files, " if recording.file_count > 1 else ""
    say(f"{recording.name}, {count}{recording.duration_s:.1f} s: looking who would hear it")
    if not _has_looked(node, options, stop_asked):
        return
    say(
        f"replaying from second {playing.start_s:g}{', paused' if playing.is_paused else ''}, "
        f"to {_whom(node, options)}"
    )
    player = Player(recording, node, playing)
    progress = Progress(recording.duration_s, playing.speed, is_seen=not options.own_journal)
    started_s = time.monotonic()
    ended_s: float | None = None
    is_told = False
    rivals = Rivals(node)
    with keys(sys.stdin) as wishes, progress:
        while not stop_asked():
            for _ in range(wishes.wishes()):
                player.toggle()
            player.beat(time.monotonic())
            progress.tell(player, rivals.news(time.monotonic()))
            if player.is_over and not options.loop and ended_s is None:
                if not options.hold:
                    node.deliver(DELIVERY_S)
                node.twins.ask_again()
                ended_s = time.monotonic()
            if ended_s is not None and (
                node.twins.has_said or time.monotonic() - ended_s > LAST_SAID_S
            ):
                progress.end()
                if not is_told:
                    say(f"the end: {player.published:,} messages were published")
                    _tell_lost(node.twins)
                if not options.hold:
                    return
                is_told = True
            node.listen(due_in_s(started_s, time.monotonic()))
            _refuse(node, options, is_patient=True)
    if not is_told:
        _tell_lost(node.twins)


def _has_looked(node: ReplayNode, options: Namespace, stop_asked: Callable[[], bool]) -> bool:
    """Wait until the twins that are there have said whether they keep a journal."""
    started_s = time.monotonic()
    # With a twin of its own the one is waited for.
    while (passed_s := time.monotonic() - started_s) < SAYS_WITHIN_S:
        node.listen(0.05)
        if stop_asked():
            return False
        _refuse(node, options, is_patient=True)
        if node.twin_names and not node.awaits and node.has_listeners:
            break
        if not node.twin_names and passed_s > DISCOVERY_S and not options.own_journal:
            break
    _refuse(node, options, is_patient=False)
    for name in node.without_sim_time():
        say(
            f"{name} does not follow /clock: start it with --ros-args -p use_sim_time:=true, or "
            "its ages count from now"
        )
    return True


def _whom(node: ReplayNode, options: Namespace) -> str:
    if node.twin_names:
        return ", ".join(sorted(node.twin_names))
    if options.into_live:
        return "nobody so far"
    # DDS hands them over before the twin can say that it does, which would end the replay.
    return f"nobody so far; a twin that is started now and keeps a journal would keep {_LATE}"


def _tell_lost(twins: LiveTwins) -> None:
    for name, lost in sorted(twins.lost.items()):
        say(
            f"{name} says that {lost:,} messages came too fast for it and are lost: what it shows "
            "is not all that was recorded; replay it slower (--speed), or on a machine less busy"
        )


def _refuse(node: ReplayNode, options: Namespace, *, is_patient: bool) -> None:
    refusal = None if options.into_live else node.refusal(is_patient=is_patient)
    if refusal is not None:
        raise Refused(refusal)


def _qos(topic: Topic) -> Offered:
    otherwise = INPUTS.get(topic.type_name, Offered())
    qos = offered(topic.offered_qos, otherwise)
    if topic.type_name in INPUTS and not (qos.is_reliable and qos.is_latched):
        say(
            f"{topic.name} was offered as volatile or best effort, and is so again: no twin hears "
            "it, for a twin asks for reliable and transient local"
        )
    return qos


@contextmanager
def _node(
    wanted: dict[str, tuple[str, Offered]],
    twins: LiveTwins,
    names: dict[str, str],
    ros_args: Sequence[str],
) -> Iterator[ReplayNode]:
    try:
        rclpy.init(args=[*ros_args], signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # rclpy raises several kinds
        raise Refused(f"cannot start ROS: {error}") from error
    try:
        remove_half_made(rclpy.get_default_context().get_domain_id())
        try:
            node = ReplayNode(wanted, twins, names)
        except NotPublishable as error:
            option = "--state-as " if error.name in names.values() else ""
            raise Refused(f"{option}{error}") from error
        except (ParameterError, RuntimeError) as error:  # the second is rcl's
            raise Refused(str(error)) from error
        try:
            yield node
        finally:
            node.destroy_node()
    finally:
        rclpy.try_shutdown()


class Rivals:
    """Who else tells the time in this domain: looked for from time to time, each told of once."""

    def __init__(self, node: ReplayNode) -> None:
        self._node = node
        self._looked_s = -math.inf
        self._there: Counter[str] = Counter()

    def news(self, now_s: float) -> Iterator[str]:
        """What is to be said of those that were not there before."""
        if now_s - self._looked_s < LOOK_S:
            return
        self._looked_s = now_s
        before, self._there = self._there, Counter(self._node.rivals())
        for name in self._there - before:
            who = "another replay" if name.endswith(f"/{NODE_NAME}") else name
            yield (
                f"{who} publishes /clock in this ROS domain too: time leaps between the two, and "
                "twins hear a mixture; end one of them, or give it a ROS_DOMAIN_ID of its own"
            )


class Progress:
    """How far it is, on the standard error: one line that is written over, if a person looks.

    Where nothing comes for long it is said to everybody.
    """

    def __init__(self, duration_s: float, speed: float, *, is_seen: bool) -> None:
        self._end = f" of {duration_s:.1f} s, {speed:g} times as fast, "
        self._speed = speed
        self._is_seen = is_seen and sys.stderr.isatty()
        self._told_s = 0.0

    def tell(self, player: Player, news: Iterable[str] = ()) -> None:
        """Say where the player is, twice a second, and at once what it waits for, and news."""
        for text in (*(gap.told(self._speed) for gap in player.take_gaps()), *news):
            if self._is_seen:
                _write("\r\x1b[K")
            say(text)
        if self._is_seen and time.monotonic() - self._told_s >= _TELL_EVERY_S:
            self._told_s = time.monotonic()
            paused = ", paused" if player.is_paused else ""
            _write(
                f"\r\x1b[K{player.position_s:.1f}{self._end}{player.published:,} messages{paused}"
            )

    def end(self) -> None:
        """Leave the line as it is."""
        if self._is_seen:
            self._is_seen = False
            _write("\n")

    def __enter__(self) -> None:
        pass

    def __exit__(self, *_: object) -> None:
        self.end()


def _write(text: str) -> None:
    # Who reads it may be gone, or the disk full: what is replayed is for others.
    with suppress(OSError):
        sys.stderr.write(text)
        sys.stderr.flush()
