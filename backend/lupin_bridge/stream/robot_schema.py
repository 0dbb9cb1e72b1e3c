"""The web contract of the robot's layer: what `/api/robot` and the frames of a robot carry."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from lupin_bridge.stream.schema import Contract, Time


class RobotPoint(Contract):
    """A place of the robot's, m in the map frame, and when it was there."""

    x: float
    y: float
    observed_at: Time = Field(description="ROS time; sec and nanosec 0: not known")


class RobotPosition(RobotPoint):
    """Where the robot was last."""

    heading: float | None = Field(
        description="where it faces, rad from x towards y; null: not reported"
    )


class RobotPlan(Contract):
    """The way that the robot means to take."""

    points: list[list[float]] = Field(
        description="of each x and y, m in the map frame; at most 60, the last is where it ends"
    )
    observed_at: Time


class RobotBattery(Contract):
    """How full the robot's battery was."""

    percent: float = Field(description="0 to 100")
    observed_at: Time


class RobotNow(Contract):
    """What the robot says of itself; null: nothing that still holds."""

    position: RobotPosition | None
    plan: RobotPlan | None
    battery: RobotBattery | None


class RobotFrame(RobotNow):
    """WebSocket frame: once the robot has published something; on change, at most once a second."""

    type: Literal["robot"]


class Robot(RobotNow):
    """`/api/robot`: the same, and where the robot has been."""

    trail: list[RobotPoint] = Field(
        description="the last hour as this process received it, oldest first; at most 720 points"
    )
