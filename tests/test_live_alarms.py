"""Alarms over DDS: raised, cleared, the same after a kill, and in a `web` beside it."""

import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from lupin_bridge.stream import schema
from tests.support.domains import own_domain
from tests.support.live import attached
from tests.support.messages import look, scan
from tests.support.processes import OFTEN, lupin_twin
from tests.support.ros import Peer
from tests.support.waiting import wait_for
from tests.support.web import Bridge

MINUTE = 60.0


def alarms(live: Bridge, **query: Any) -> list[dict[str, Any]]:
    body = live.json("/api/alarms", **query)
    schema.Alarms.model_validate(body)
    found: list[dict[str, Any]] = body["alarms"]
    return found if body["source"] == "journal" else []


def kinds(live: Bridge, **query: Any) -> set[tuple[str, str, bool]]:
    return {
        (alarm["tag_id"], alarm["reason"]["kind"], alarm["cleared_at"] is None)
        for alarm in alarms(live, **query)
    }


def test_observations_raise_and_clear_alarms_and_every_replica_and_restart_has_them(
    tmp_path: Path,
) -> None:
    journal = ("--ros-args", *OFTEN[1:], "-p", f"journal:={tmp_path / 'j.sqlite'}")
    begun = time.time() - 20 * MINUTE
    with own_domain() as domain, Peer(domain) as peer, ExitStack() as stack:

        def start(role: str, *options: str) -> tuple[Any, Bridge]:
            process = stack.enter_context(lupin_twin(domain, role, *options))
            return process, stack.enter_context(attached(process, peer))

        def at(minute: float, temperature: float) -> Any:
            return scan("a", {"temperature": temperature}, stamp_s=begun + minute * MINUTE)

        process, live = start("serve", *journal)
        peer.wait_for_twin()
        with live.listen() as listener:
            peer.observe(*(at(minute, 6.0) for minute in (0, 1)))
            wait_for(lambda: ("a", "range", True) in kinds(live), "the alarm of a cold tag")

            def is_told(frame: Any) -> bool:
                return any(one["tag_id"] == "a" for one in frame["alarms"])

            frame = listener.until("alarms", is_told)
            schema.AlarmsFrame.model_validate(frame)
            [cold] = [one for one in frame["alarms"] if one["tag_id"] == "a"]
            assert (cold["worst"], cold["reason"]["limit"]) in {(6.0, 10.0), (6.0, 8.0)}
        peer.observe(
            at(2, 20.0),
            at(3, 20.0),
            look("b", anomaly=True, bug_count=3, stamp_s=begun + 3.5 * MINUTE),
        )
        expected = {("a", "range", False), ("b", "pest", True)}
        wait_for(lambda: expected <= kinds(live), "one cleared, and a pest")
        assert alarms(live, active=1) == [one for one in alarms(live) if one["cleared_at"] is None]
        before = {one["id"]: one for one in alarms(live) if one["tag_id"]}
        _, replica = start("web")
        wait_for(lambda: expected <= kinds(replica), "the same in a replica")
        assert {one["id"]: one for one in alarms(replica) if one["tag_id"]} == before
        process.kill()
        _, again = start("serve", *journal)
        peer.wait_for_twin()
        wait_for(lambda: expected <= kinds(again), "the same after a kill")
        assert {one["id"]: one for one in alarms(again) if one["tag_id"]} == before
        # What comes late puts right what it belongs to: it was warm between the two.
        peer.observe(at(0.5, 20.0), at(0.6, 20.0))
        wait_for(lambda: ("a", "range", False) not in kinds(again), "an alarm taken back")
        wait_for(lambda: ("a", "range", False) not in kinds(replica), "and in the replica")
