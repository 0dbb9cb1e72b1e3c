"""What a twin still knows after it was killed, started again, or started twice."""

import random
import time
from pathlib import Path

from tests.support.journal import is_whole, select
from tests.support.killing import kill_and_look
from tests.support.messages import discovered, look, pose, scan
from tests.support.processes import OFTEN, twin_node
from tests.support.ros import Peer

ROUNDS = 3


def test_a_killed_twin_knows_all_that_was_shown_100_ms_before(domain: int, tmp_path: Path) -> None:
    chance, number, journal = random.Random(7), 0, tmp_path / "j.sqlite"
    for _ in range(ROUNDS):
        number = kill_and_look(domain, journal, chance, number)
    assert number > 100
    assert is_whole(journal)
    twice = (
        "SELECT 1 FROM scan WHERE is_copy = 0 GROUP BY series, stamp_ns, source HAVING count(*) > 1"
    )
    assert select(journal, twice) == []


def test_latched_observations_heard_again_are_not_written_twice(
    domain: int, tmp_path: Path
) -> None:
    journal = tmp_path / "j.sqlite"
    ros_args = (*OFTEN, "-p", f"journal:={journal}")
    with Peer(domain) as robot:
        for _ in range(3):
            begun_s = time.time()
            with twin_node(domain, *ros_args) as twin:
                robot.observe(
                    scan("1", {"t": 21.5}, at=(1.0, 2.0), stamp_s=1_700_000_000.0),
                    look("1", bug_count=1, anomaly=True, stamp_s=1_700_000_001.0),
                )
                robot.discover(discovered({"2": pose(3.0, 4.0)}))
                # The last states of the twin before it may come late.
                robot.state(
                    lambda state, begun_s=begun_s: (  # type: ignore[misc]
                        state.header.stamp.sec + state.header.stamp.nanosec / 1e9 > begun_s
                        and {tag.tag_id: tag.bug_count for tag in state.tags} == {"1": 1, "2": 0}
                    ),
                    "a state of this twin with both tags",
                )
                tag = robot.tag("1")
                twin.stop()  # it writes what is waiting
        assert tag.readings[0].value == 21.5
    rows = {
        table: select(journal, f"SELECT count(*) FROM {table}")
        for table in ("scan", "look", "place")
    }
    assert rows == {"scan": [(1,)], "look": [(1,)], "place": [(2,)]}
