"""`python -m lupin_bridge.bags.player`: plays a recording to the one twin of `demo --from`.

A process of its own, so that the data crosses DDS. ROS time is the recording's: its `/clock`, else
the time at which its messages were recorded.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Event
from typing import Final

from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock

from lupin_bridge.bags.recording import INPUTS, Recorded, Recording, RecordingError
from lupin_bridge.console import say
from lupin_twin.adapt.messages import message_type
from lupin_twin.core.interfaces import CLOCK, STATE
from lupin_twin.core.parameters import ParameterError
from lupin_twin.ros.base_node import qos_of, running_ros
from lupin_twin.ros.convert import nanoseconds, time_msg
from lupin_twin.ros.inputs import name_of
from lupin_twin.runtime import process

NODE_NAME: Final = "lupin_player"
_BEAT_S: Final = 0.02
# Messages per beat, which makes 100 a second. A twin's queue holds 50, so none is lost while its
# thread is busy for half a second. DDS acknowledges what waits there, taken or not.
_MAX_A_BEAT: Final = 2
# How far messages follow behind the clock, s: before the twin knows that time, their stamps would
# be in the future.
_LAG_S: Final = 0.1
# Longest step of time: after the machine stood still, the recording goes on where it was.
_MAX_STEP_S: Final = 0.25
# Longest wait for the twin: discovery by DDS takes up to 3 s, and longer on a busy machine.
_TWIN_S: Final = 30.0
_POLL_S: Final = 1.0


def main(argv: Sequence[str] | None = None) -> int:
    """Play until a signal comes; at the end of the recording, time stands still."""
    own, ros_args = process.split_ros_args(sys.argv[1:] if argv is None else argv)
    options = parser().parse_args(own)
    process.end_with_parent()
    process.block()
    stop = process.stop_flag()
    try:
        with Recording(options.recording) as recording, running_ros(ros_args):
            node = PlayerNode(recording.inputs)
            try:
                _play(recording, node, options.speed, stop)
            finally:
                node.destroy_node()
    except (RecordingError, ParameterError) as error:
        say(str(error))
        return 1
    return 0


def parser() -> argparse.ArgumentParser:
    """The options; `lupin-twin demo` has checked them."""
    made = argparse.ArgumentParser(prog=f"python -m {__spec__.name}", allow_abbrev=False)
    made.add_argument("recording", metavar="FILE.mcap", type=Path)
    made.add_argument("--speed", type=float, default=1.0)
    return made


class PlayerNode(Node):  # type: ignore[misc]  # rclpy is not typed
    """Publishes the recorded topics and `/clock`, and knows whether they have subscribers."""

    def __init__(self, inputs: Mapping[str, str]) -> None:
        super().__init__(NODE_NAME)
        self._clock = self.create_publisher(Clock, CLOCK.name, 1)
        self._publishers_by_topic = {
            topic: self.create_publisher(message_type(kind), topic, qos_of(INPUTS[kind]))
            for topic, kind in inputs.items()
        }

    def publish_time(self, now_ns: int) -> None:
        """Publish `/clock`."""
        self._clock.publish(Clock(clock=time_msg(now_ns)))

    def publish(self, message: Recorded) -> None:
        """Publish a serialised message as it is."""
        self._publishers_by_topic[message.topic].publish(message.data)

    @property
    def has_subscribers(self) -> bool:
        """Whether somebody subscribes to each topic."""
        return all(p.get_subscription_count() for p in self._publishers_by_topic.values())

    def check_alone(self) -> None:
        """Refuse a second twin in this ROS domain: its journal would keep what is played.

        Raises:
            RecordingError: several twins run; the message says what to do.

        """
        twins = [
            name_of(info)
            for topic, types in self.get_topic_names_and_types()
            if STATE.type_name in types
            for info in self.get_publishers_info_by_topic(topic)
        ]
        if len(twins) > 1:
            raise RecordingError(
                f"several twins run in ROS domain {self.context.get_domain_id()} "
                f"({', '.join(sorted(twins))}), and a journal would record the playback: choose "
                "another ROS_DOMAIN_ID for this demo"
            )


class Player:
    """Decides what is due at each moment. Time is an argument of `beat`; `node` publishes."""

    def __init__(self, recording: Recording, node: PlayerNode, speed: float) -> None:
        self._recording = recording
        self._node = node
        self._speed = speed
        self._lag_ns = round(_LAG_S * speed * 1e9)
        self._end_ns = recording.end_ns + self._lag_ns
        self.published = 0
        self._position_ns = recording.start_ns
        self._time_ns = None if recording.has_clock else recording.start_ns
        topics = [*recording.inputs, *([CLOCK.name] if recording.has_clock else [])]
        self._rest = recording.messages(topics)
        self._next = next(self._rest, None)
        self._last_s: float | None = None

    @property
    def is_over(self) -> bool:
        """Whether all of it was published."""
        return self._next is None and self._position_ns >= self._end_ns

    def beat(self, now_s: float) -> None:
        """Publish the time and what is due.

        Raises:
            RecordingError: the recording is damaged here.

        """
        left = _MAX_A_BEAT
        step_s = 0.0 if self._last_s is None else min(now_s - self._last_s, _MAX_STEP_S)
        self._last_s = now_s
        self._position_ns = min(self._position_ns + round(step_s * self._speed * 1e9), self._end_ns)
        if not self._recording.has_clock:
            self._time_ns = min(self._position_ns, self._recording.end_ns)
        while (message := self._next) is not None:
            is_clock = message.topic == CLOCK.name
            if message.log_ns > self._position_ns - (0 if is_clock else self._lag_ns):
                break
            if is_clock:
                self._time_ns = _clock_ns(message) or self._time_ns
            elif left:
                left -= 1
                self._node.publish(message)
                self.published += 1
            else:
                # Time waits for messages that are due: the twin must be able to take them.
                self._position_ns = message.log_ns + self._lag_ns
                break
            self._next = next(self._rest, None)
        self._publish_time()

    def _publish_time(self) -> None:
        if self._time_ns is not None:
            self._node.publish_time(self._time_ns)


def _clock_ns(message: Recorded) -> int:
    return nanoseconds(deserialize_message(message.data, Clock).clock)


def _play(recording: Recording, node: PlayerNode, speed: float, stop: Event) -> None:
    until_s = time.monotonic() + _TWIN_S
    while not node.has_subscribers and not stop.is_set():
        if time.monotonic() > until_s:
            raise RecordingError(f"no twin has subscribed within {_TWIN_S:g} s")
        stop.wait(_BEAT_S)
    say(f"playing {recording.path}")
    player = Player(recording, node, speed)
    is_announced = False
    looked_s = -math.inf
    while not stop.is_set():
        now_s = time.monotonic()
        if now_s - looked_s > _POLL_S:
            looked_s = now_s
            node.check_alone()
        player.beat(now_s)
        if player.is_over and not is_announced:
            is_announced = True
            say(f"the end: {player.published:,} messages were published")
        stop.wait(_BEAT_S)


if __name__ == "__main__":
    sys.exit(main())
