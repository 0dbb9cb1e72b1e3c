"""What the patrol would have observed until now: three simulated days, a line of JSON each event.

For a demo whose memory is empty (`python -m lupin_patrol.past`, with the patrol's own options).
Places, plants and climate are those of the patrol with the same seed, and so is the time of day:
where the past ends, at second 0, the patrol begins. Times are seconds before that, as they
pass for whoever watches; a pose is x, y, z and a quaternion, as in geometry_msgs/Pose.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, astuple
from typing import Any

from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.cli import parse
from lupin_patrol.mission import Mission, TagScanned
from lupin_patrol.plants import SECONDS_PER_DAY

DAYS = 3
# So far before the patrol's own passes that none of them is alike.
_FIRST_PASS = -1_000_000


def past(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """The events, the oldest first; none where the day stands still."""
    if options.day_speed <= 0.0:
        return
    begin_s = -DAYS * SECONDS_PER_DAY / options.day_speed
    mission = Mission(
        GreenhouseSimulator(),
        options.seed,
        options.day_speed,
        begin_s=begin_s,
        first_pass=_FIRST_PASS,
    )
    for event in mission.visits():
        if event.at_s >= 0.0:
            return
        common = {
            "tag_id": event.tag_id,
            "at_s": event.at_s / options.speed,
            "pass": event.pass_index - _FIRST_PASS + 1,
            "pose": event.pose and astuple(event.pose),
        }
        if isinstance(event, TagScanned):
            detail, readings = event.status_detail, event.readings
            yield common | {"status": event.status, "detail": detail, "readings": readings}
        else:
            blooms = [astuple(bloom) for bloom in event.flower.blooms]
            yield common | asdict(event.flower) | {"blooms": blooms}


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the past to the standard output."""
    for event in past(parse(sys.argv[1:] if arguments is None else arguments)):
        sys.stdout.write(json.dumps(event) + "\n")


if __name__ == "__main__":
    main()
