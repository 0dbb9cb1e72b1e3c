"""What the robot says of itself: asked once a second, written as JSON, sent to the listeners."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import orjson

from lupin_bridge.feed.robot import Position, Robot, RobotLog
from lupin_bridge.feed.shared_work import Periodic
from lupin_bridge.feed.source import TwinSource, TwinUnavailableError
from lupin_bridge.stream.frames import text_frame
from lupin_bridge.stream.hub import Hub
from lupin_bridge.stream.state_json import stamp


def robot_frame(now: Robot) -> bytes:
    """`routes_schema.RobotFrame` as a WebSocket frame."""
    return text_frame(orjson.dumps({"type": "robot", **_now(now)}))


def robot_body(known: RobotLog) -> bytes:
    """`routes_schema.Robot`."""
    return orjson.dumps({**_now(known.now), "trail": [_point(it) for it in known.trail]})


def _now(now: Robot) -> dict[str, Any]:
    position, plan, battery = now.position, now.plan, now.battery
    return {
        "position": position
        and {
            **_point(position),
            "heading": None if position.heading is None else round(position.heading, 3),
        },
        "plan": plan
        and {
            "points": [(round(x, 2), round(y, 2)) for x, y in plan.points],
            "observed_at": stamp(plan.at_ns),
        },
        "battery": battery
        and {"percent": round(battery.percent, 1), "observed_at": stamp(battery.at_ns)},
    }


def _point(at: Position) -> dict[str, Any]:
    return {"x": round(at.x, 2), "y": round(at.y, 2), "observed_at": stamp(at.at_ns)}


# How often the newest message of each topic is taken: no frame comes more often.
PERIOD_S: Final = 1.0


class RobotFollower(Periodic):
    """Keeps what is known of the robot; a frame goes out when anything is another.

    `now_ns()` is the twin's time, None: not known; `clock` tells seconds and never jumps. Belongs
    to the event loop.
    """

    def __init__(
        self,
        source: TwinSource,
        hub: Hub,
        now_ns: Callable[[], int | None],
        clock: Callable[[], float],
    ) -> None:
        super().__init__(self._look, PERIOD_S, "what the robot says of itself")
        self.log = RobotLog()
        self._source = source
        self._hub = hub
        self._now_ns = now_ns
        self._clock = clock

    async def _look(self) -> None:
        now_ns = self._now_ns()
        try:
            heard = await self._source.robot(now_ns)
        except TwinUnavailableError:  # its thread has ended, which others tell
            return
        if heard is not None and self.log.take(heard, now_ns):
            self._hub.publish_robot(robot_frame(self.log.now), self._clock())
