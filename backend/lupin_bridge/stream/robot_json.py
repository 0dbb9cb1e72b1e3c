"""What a robot says of itself as JSON. Pure."""

from __future__ import annotations

from typing import Any

import orjson

from lupin_bridge.feed.robot import Position, Robot, RobotLog
from lupin_bridge.stream.frames import text_frame
from lupin_bridge.stream.state_json import stamp


def robot_frame(now: Robot) -> bytes:
    """`robot_schema.RobotFrame` as a WebSocket frame."""
    return text_frame(orjson.dumps({"type": "robot", **_now(now)}))


def robot_body(known: RobotLog) -> bytes:
    """`robot_schema.Robot`."""
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
