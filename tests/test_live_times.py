"""What was observed when: the same from a twin's bridge and from one that follows its topics."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from lupin_msgs.msg import Observation, TwinState, TwinTagState

from tests.support.domains import own_domain
from tests.support.live import attached, wait_until_ready
from tests.support.messages import discovered, look, pose, scan
from tests.support.processes import OFTEN, lupin_twin
from tests.support.ros import Peer
from tests.support.waiting import wait_for
from tests.support.web import Bridge, filled, without_ages


@contextmanager
def house() -> Iterator[tuple[Bridge, Bridge]]:
    """`serve`, and a `web` that follows it, both of one robot."""
    with ExitStack() as stack:
        domain = stack.enter_context(own_domain())
        peer = stack.enter_context(Peer(domain))
        roles = []
        for command in (("serve", "--port", "0", *OFTEN), ("web", "--port", "0")):
            process = stack.enter_context(lupin_twin(domain, *command))
            running = stack.enter_context(attached(process, peer))
            wait_until_ready(running)
            roles.append(running)
        peer.wait_for_twin()
        yield roles[0], roles[1]


def failed(tag_id: str, stamp_s: float, detail: str) -> Any:
    msg = scan(tag_id, status=Observation.STATUS_SCAN_FAILED, stamp_s=stamp_s)
    msg.status_detail = detail
    return msg


STEPS = [
    scan("a", {"co2": 400.0, "light": 1.0}, (0, 0), stamp_s=10.0),
    look("a", "lupin", stamp_s=3610.0),
    scan("a", {"light": 2.0}, stamp_s=7210.0),
    failed("a", 7300.0, "not decoded"),
    scan("b", {"co2": 7.0}, stamp_s=7400.0),
    failed("c", 7500.0, "unreachable"),
    scan("a", {"co2": 401.0}, stamp_s=5000.0),  # late: newer than its co2, older than its light
    scan("a", {"co2": 402.0, "light": 3.0}, stamp_s=7600.0),
]


def sensors_of(live: Bridge, tag_id: str) -> dict[str, list[tuple[int, float]]]:
    return {
        sensor["name"]: [(each["stamp"]["sec"], each["value"]) for each in sensor["values"]]
        for sensor in live.json(f"/api/tags/{tag_id}/history")["sensors"]
    }


def agree(served: Bridge, followed: Bridge) -> bool:
    return without_ages(served.json("/api/state")) == without_ages(followed.json("/api/state"))


def test_both_roles_tell_the_same_states_and_the_same_histories() -> None:
    with house() as (served, followed):
        served.peer.discover(discovered({"d": pose(1, 1)}))
        for number, step in enumerate(STEPS):
            served.peer.observe(step)
            stamp_s = step.header.stamp.sec

            def is_told(stamp_s: int = stamp_s) -> bool:
                tags = [filled(tag) for tag in served.json("/api/state")["tags"]]
                times = [tag["last_try"] for tag in tags]
                times += [r["observed_at"] for tag in tags for r in tag["readings"]]
                return any(time is not None and time["sec"] == stamp_s for time in times)

            wait_for(is_told, f"step {number} at the twin")
            wait_for(lambda: agree(served, followed), f"step {number} at both")
        for tag_id in "abcd":

            def are_same(path: str = f"/api/tags/{tag_id}/history") -> bool:
                return served.get(path).content == followed.get(path).content

            # The newest try is of no kind before the log has it.
            wait_for(are_same, f"the history of {tag_id} at both")
        tries = followed.json("/api/tags/a/history")["tries"]
        assert [(each["stamp"]["sec"], each["status"], each["kind"]) for each in tries] == [
            (10, 0, 0), (3610, 0, 1), (5000, 0, 0), (7210, 0, 0), (7300, 2, 0), (7600, 0, 0),
        ]  # fmt: skip
        assert sensors_of(followed, "a") == {
            "co2": [(10, 400.0), (5000, 401.0), (7600, 402.0)],
            "light": [(10, 1.0), (7210, 2.0), (7600, 3.0)],
        }


def test_a_twin_that_tells_no_times_has_no_history_and_no_times_of_readings(domain: int) -> None:
    """One of another build, which publishes its state alone."""
    message = TwinState(tags=[TwinTagState(tag_id="1")])
    message.header.frame_id = "map"
    message.header.stamp.sec = 100
    with (
        Peer(domain) as peer,
        lupin_twin(domain, "web", "--port", "0") as process,
        attached(process, peer) as live,
    ):
        peer.publish("/twin/state", message, depth=1)
        wait_for(lambda: live.get("/api/tags/1").status_code == 200, "the state")
        answer = live.get("/api/tags/1/history")
        assert (answer.status_code, "journal is not known" in answer.text) == (503, True)
        tag = live.json("/api/tags/1")
        assert (tag["last_try"], tag["last_try_status"]) == (None, None)
        assert "looked_at" not in tag
