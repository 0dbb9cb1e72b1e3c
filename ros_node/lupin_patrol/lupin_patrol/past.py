"""What the patrol would have observed until now: three simulated days, in a journal that is empty.

For a demo without a memory: `python -m lupin_patrol.past JOURNAL`, with the patrol's own options.
Places, plants and climate are those of the patrol with the same seed, and so is the time of day:
where the past ends, now, the patrol begins.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.cli import parse
from lupin_patrol.mission import Mission
from lupin_patrol.perception import SECONDS_PER_DAY
from lupin_twin.core.state import Pin, Write
from lupin_twin.journal.appending import prefill
from lupin_twin.journal.beside import InUse
from lupin_twin.journal.schema import FILE_ERRORS, Foreign

SOURCE: Final = "lupin_patrol (simulated past)"
DAYS: Final = 3
# So far before the patrol's own passes that none of them is alike.
_FIRST_PASS: Final = -1_000_000


def past(options: argparse.Namespace, now_ns: int) -> Iterator[Write]:
    """What a twin would have written, the oldest first; nothing where the day stands still."""
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
    pinned: set[str] = set()
    for event in mission.visits():
        if event.at_s >= 0.0:
            return
        write, at_ns = event.write, now_ns + round(event.at_s / options.speed * 1e9)
        if write.pose is not None and write.tag_id not in pinned:
            pinned.add(write.tag_id)
            yield Pin(write.tag_id, write.pose, at_ns, at_ns)
        yield replace(
            write,
            stamp_ns=at_ns,
            pose=None,
            source=SOURCE,
            own_stamp_ns=at_ns,
            mission=f"past-{event.pass_index - _FIRST_PASS + 1:04d}",
            arrival_ns=at_ns,
        )


def main(arguments: Sequence[str] | None = None) -> None:
    """Fill a journal that is new or empty."""
    path, *options = sys.argv[1:] if arguments is None else arguments
    now_ns = time.time_ns()
    try:
        prefill(Path(path), "lupin-twin demo", list(past(parse(options), now_ns)), now_ns)
    except (InUse, Foreign, OSError, *FILE_ERRORS) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
