"""What a twin still knows after it was killed at random moments under 200 observations a second.

The suite kills it three times, `make soak` fifty times.
"""

import os
import random
import signal
import time
from pathlib import Path
from typing import Any

from tests.support.journal import is_whole, select
from tests.support.messages import scan
from tests.support.proc_stat import waited_s
from tests.support.processes import OFTEN, twin_node
from tests.support.ros import Peer

KILLS = int(os.environ.get("KILLS", "3"))
# Forbidden in a journal.
TWICE = "SELECT 1 FROM scan WHERE is_copy = 0 GROUP BY series, stamp_ns, source HAVING count(*) > 1"
TAGS = 30
RATE = 200
# What a client has received so long before is durable.
SAFE_S = 0.1


def counts(state: Any) -> dict[str, float]:
    """The count at each tag of a state."""
    return {tag.tag_id: tag.readings[0].value for tag in state.tags if tag.readings}


def test_a_killed_twin_knows_everything_shown_100_ms_before(domain: int, tmp_path: Path) -> None:
    chance, number, journal = random.Random(KILLS), 0, tmp_path / "j.sqlite"
    ros_args = (*OFTEN, "-p", f"journal:={journal}")
    for _ in range(KILLS):
        first = number
        shown: list[tuple[float, float, dict[str, float]]] = []
        with twin_node(domain, *ros_args) as twin, Peer(domain, "robot") as robot:
            robot.listen()
            robot.wait_for_twin()
            begun = time.monotonic()
            end = begun + chance.uniform(0.3, 1.5)
            while (now := time.monotonic()) < end:
                while number - first < (now - begun) * RATE:
                    number += 1
                    robot.observe(
                        scan(
                            str(number % TAGS),
                            {"count": number},
                            at=(number % TAGS, 1.0),
                            stamp_s=time.time(),
                        )
                    )
                robot.spin_briefly()
                if robot.states:
                    latest = counts(robot.states[-1])
                    shown.append((time.monotonic(), waited_s(twin.pid), latest))
            killed, waited = time.monotonic(), waited_s(twin.pid)
            twin.send(signal.SIGKILL)
        # Nothing runs that could publish it again.
        safe: dict[str, float] = {}
        for at, waited_by_then, state in shown:
            # Time in which its threads waited for a core is not its own.
            if killed - at - (waited - waited_by_then) >= SAFE_S:
                safe = state
        with twin_node(domain, *ros_args), Peer(domain, "client") as client:
            client.listen()
            known = counts(client.state(lambda state: True, "the first state"))
        lost = {
            tag: (value, known.get(tag)) for tag, value in safe.items() if known.get(tag, 0) < value
        }
        assert not lost, f"shown and not known any more: {lost}"
        assert is_whole(journal)
    assert number > 30 * KILLS
    assert select(journal, TWICE) == []
