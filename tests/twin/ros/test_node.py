"""The node over real DDS: every test has a twin in its own process."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.support import journal
from tests.support.domains import own_domain
from tests.support.messages import scan
from tests.support.processes import OFTEN, Process, twin_node
from tests.support.ros import Peer, clock_at


class Twin:
    """A twin in a process, and a peer that is connected to it."""

    def __init__(self, process: Process, peer: Peer) -> None:
        self.process, self.peer = process, peer

    def warning(self, *words: str) -> str:
        """Wait for a warning that contains all of the words."""

        def find() -> str | None:
            lines = self.process.output.splitlines()
            return next((x for x in lines if "WARN" in x and all(w in x for w in words)), None)

        return str(self.peer.until(find, f"a warning with {words}"))

    def settled(self, tag_id: str = "marker") -> Any:
        """Send one good observation and wait for it: all earlier messages are handled then."""
        self.peer.observe(scan(tag_id, {"temperature": 1.0}))
        return self.peer.tag(tag_id)

    def tags(self) -> dict[str, Any]:
        return {tag.tag_id: tag for tag in self.peer.states[-1].tags}


def running_twin(*ros_args: str) -> Iterator[Twin]:
    with own_domain() as domain, twin_node(domain, *ros_args) as process, Peer(domain) as peer:
        peer.wait_for_twin()
        yield Twin(process, peer)


def test_a_twin_alone_publishes_an_empty_state_at_once(domain: int) -> None:
    with twin_node(domain, "--ros-args", "-p", "state_publish_rate_hz:=0.01"), Peer(domain) as peer:
        state = peer.state(lambda _: True, "a state")
    assert list(state.tags) == []
    assert state.header.frame_id == "map"
    assert state.header.stamp.sec > 0


def test_fifty_observations_latched_before_the_twin_started_are_all_received(domain: int) -> None:
    with Peer(domain) as producer:
        producer.observe(*(scan(f"t{i}", {"co2": 400.0 + i}, at=(i, 0)) for i in range(50)))
        with twin_node(domain, *OFTEN):
            # First the twin, which may take its time to start on a busy machine, then its tags.
            producer.state(lambda _: True, "a state")
            state = producer.state(lambda s: len(s.tags) >= 50, "all 50 tags")
    assert [tag.tag_id for tag in state.tags] == [f"t{i}" for i in range(50)]
    assert [tag.readings[0].value for tag in state.tags] == [400.0 + i for i in range(50)]


def test_stamps_and_staleness_follow_the_simulated_clock(domain: int) -> None:
    clock = (*OFTEN, "-p", "use_sim_time:=true")
    with twin_node(domain, *clock) as process, Peer(domain) as peer:
        peer.wait_for_twin()
        now_s = 100.0
        # After 3 s without it the clock counts as stopped, and no age is known: on a busy machine a
        # state from in between may arrive, which is skipped.
        peer.node.create_timer(0.1, lambda: peer.publish("/clock", clock_at(now_s), depth=1))

        def ages(accept: Any = lambda _: True) -> dict[str, float]:
            def check(state: Any) -> bool:
                known = not any(math.isnan(tag.stale_seconds) for tag in state.tags)
                return state.header.stamp == clock_at(now_s).clock and known and accept(state)

            state = peer.state(check, f"a state at {now_s} s with ages")
            return {tag.tag_id: tag.stale_seconds for tag in state.tags}

        peer.set_clock(now_s)
        peer.observe(scan("now", {"co2": 1.0}), scan("before", {"co2": 1.0}, stamp_s=60.0))
        assert peer.tag("now").last_observed.sec == 100
        assert ages(lambda state: len(state.tags) == 2) == {"before": 40.0, "now": 0.0}
        now_s = 130.5
        assert ages() == {"before": 70.5, "now": 30.5}
        now_s = 50.0
        assert ages() == {"before": 0.0, "now": 0.0}
        process.wait_for_output("ROS time has gone back")
        # Both age from the jump on, and a new observation is the latest.
        now_s = 60.0
        assert ages() == {"before": 10.0, "now": 10.0}
        peer.observe(scan("now", {"co2": 2.0}, stamp_s=55.0))
        peer.tag("now", lambda tag: tag.readings[0].value == 2.0)
        assert ages() == {"before": 10.0, "now": 5.0}


def test_a_parameter_that_does_not_exist_causes_a_warning_with_its_name(domain: int) -> None:
    with twin_node(domain, "--ros-args", "-p", "idw_pwoer:=3.0") as process:
        line = process.wait_for_output("idw_pwoer")
    assert "WARN" in line
    assert "unknown" in line


def test_a_damaged_journal_is_named_in_the_log(domain: int, tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    journal.append(path, [journal.scan()])
    path.write_bytes(path.read_bytes()[:-4096])
    with twin_node(domain, "--ros-args", "-p", f"journal:={path}") as process:
        line = process.wait_for_output("a damaged journal was quarantined as")
    assert "WARN" in line
