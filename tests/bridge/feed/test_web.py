"""The source of the role `web`, and a peer in place of its twin."""

import asyncio
import itertools
import math
import os
import re
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from geometry_msgs.msg import Point, Pose, PoseStamped
from lupin_msgs.msg import Observation, SensorReading, TwinState, TwinTagState
from lupin_msgs.srv import GetWrites
from rclpy.parameter import Parameter

from lupin_bridge.feed import web
from lupin_bridge.feed.relay import Sample, topics_of
from lupin_bridge.feed.source import TwinTimeoutError, TwinUnavailableError
from lupin_bridge.feed.web import RETAINED_S, FollowedLog, WebTwin
from lupin_bridge.serving.admission import Limits
from lupin_twin.core import state
from lupin_twin.core.diagnostics import STATE_TOPIC, Condition, Finding, JournalState
from lupin_twin.core.parameters import World
from lupin_twin.core.past import NotRemembered
from lupin_twin.journal.follow import Lot, followed, write
from lupin_twin.ros.convert import diagnostics
from lupin_twin.runtime.workers import Workers
from tests.support.inprocess import started
from tests.support.journal import NOW, recording, scan
from tests.support.journal_answers import old
from tests.support.messages import occupancy_grid
from tests.support.ros import Peer, latched
from tests.support.waiting import until, until_answered, wait_for

SAYS = "32 requests are being answered: ask again later"
NAME = "/twin/get_writes"
LOOK = "the look for a lost twin"


def state_of(value: float) -> TwinState:
    reading = SensorReading(name="co2", value=value)
    return TwinState(tags=[TwinTagState(tag_id="1", readings=[reading])])


async def test_a_new_map_is_a_new_revision_and_no_sign_of_life(domain: int) -> None:
    with Peer(domain) as peer:
        async with started(WebTwin) as (twin, reported):
            peer.publish("/twin/state", state_of(1.0), depth=1)
            await until(lambda: reported and twin.revision() == reported[-1].revision, "a state")
            before = len(reported)
            peer.publish_map(occupancy_grid([[0, 100]]))
            await until(lambda: twin.occupancy_map() is not None, "the map")
            assert twin.revision() != reported[-1].revision
            assert len(reported) == before


async def test_without_a_twin_the_missing_service_is_named(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    with Peer(domain) as peer:
        async with started(WebTwin) as (twin, _):
            await knows_a_journal(twin, peer)
            await until(lambda: f"no twin offers {NAME}: the twin's state" in caplog.text, "why")
            peer.node.destroy_publisher(peer.publisher("/twin/state", TwinState))
            await until(lambda: f"no twin offers {NAME}: is it running" in caplog.text, "why")
    assert all(task.get_name() != LOOK for task in asyncio.all_tasks()), "it goes on searching"


async def knows_a_journal(twin: WebTwin, peer: Peer) -> None:
    """Until it was told of a journal that it cannot read here, and so has to request its rows."""
    values = {STATE_TOPIC: "/twin/state", "state": "recording", "id": "j", "file": "/nowhere"}
    report = diagnostics([Finding("journal", 0, "", values)], "/lupin_twin", 0)

    def is_told() -> bool:
        peer.publish("/diagnostics", report)
        peer.publish("/twin/state", state_of(1.0), depth=1)
        return twin.journal().journal_id == "j"

    await until(is_told, "its journal")


async def test_after_a_silence_a_new_node_recovers_everything(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    scans, samples = list[Observation](), list[Sample]()
    with Peer(domain) as peer:
        peer.node.create_subscription(
            Observation, "/floranova/observations", scans.append, latched(50)
        )
        async with started(WebTwin) as (twin, reported):
            state_topic = topics_of(twin.names)[0]
            await twin.relay.listen(state_topic, samples.append)

            def received() -> float:
                return reported[-1].snapshot.tags[0].readings[0].value if reported else 0.0

            def relayed() -> float:
                message = twin.relay.read(state_topic, samples[-1]) if samples else state_of(0.0)
                return float(message.tags[0].readings[0].value)

            async def place() -> float | None:
                robot = await twin.robot(None)
                return robot.position.x if robot and robot.position else None

            async def is_joined() -> bool:
                try:
                    await twin.relay.published(lambda *_: False)
                except TwinUnavailableError:
                    return False
                return True

            async def goes_both_ways(value: float) -> None:
                pose = PoseStamped(pose=Pose(position=Point(x=value)))
                pose.header.frame_id = "map"
                peer.publish("/amcl_pose", pose, depth=1)
                peer.publish("/twin/state", state_of(value), depth=1)
                await until(lambda: received() == relayed() == value, "the state, raw too")
                await until_answered(place, "the robot", lambda x: x == value)
                scan = state.Observation("1", 1, {"co2": value}, source="program")
                await twin.publish_observation(scan)
                await asyncio.to_thread(
                    peer.until,
                    lambda: scans and scans[-1].tag_reading.readings[0].value == value,
                    "the scan",
                )

            maps = peer.publish("/map", occupancy_grid([[0, 100]]), depth=1)
            await goes_both_ways(1.0)
            await until(twin.occupancy_map, "the map")
            peer.node.destroy_publisher(maps)
            twin.rejoin_after_s = 0.1
            await until(lambda: "joining ROS again" in caplog.text, "its replacement")
            twin.rejoin_after_s = math.inf
            await until_answered(is_joined, "the new node")
            await goes_both_ways(2.0)
            assert twin.occupancy_map() is not None, "and nobody publishes it any more"


async def test_the_last_state_of_a_lost_twin_is_no_news_to_a_new_node(domain: int) -> None:
    samples = list[Sample]()
    with Peer(domain) as peer:
        async with started(WebTwin) as (twin, reported):
            await twin.relay.listen(topics_of(twin.names)[0], samples.append)
            peer.publish("/twin/state", state_of(1.0), depth=1)
            await until(lambda: reported and samples, "the state")
            before = twin.revision()
            await twin.thread.call(
                lambda node: node.set_parameters([Parameter("idw_power", value=3.0)])
            )
            await until(lambda: twin.rules.idw_power == 3.0, "the parameter")
            revision = twin.revision()
            assert revision != before, "what is made by other rules is another answer"
            twin.rejoin_after_s = 0.1
            # In a twin that is stuck, DDS goes on: its latched state reaches new subscribers.
            await until(lambda: len(samples) > 1, "what is latched, again")
            twin.rejoin_after_s = math.inf
            peer.publish_map(occupancy_grid([[0, 100]]))
            await until(twin.occupancy_map, "the map")
            state, _, _ = revision.rpartition("-0-")
            assert state in twin.revision(), "the state is the same"
            assert twin.rules.idw_power == 3.0
            assert twin.update is not None
            assert twin.update.snapshot is reported[-1].snapshot
            peer.publish("/twin/state", state_of(2.0), depth=1)
            await until(
                lambda: reported[-1].snapshot.tags[0].readings[0].value == 2.0, "the next one"
            )
            assert [it.snapshot.tags[0].readings[0].value for it in reported] == [1.0, 2.0]


async def test_a_node_is_replaced_after_ever_longer_silences_of_five_minutes_at_most(
    domain: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    second: Iterator[int]
    plain = asyncio.sleep
    monkeypatch.setattr(asyncio, "sleep", lambda for_s: plain(min(for_s, 0.001)))

    def now_s() -> float:
        """Each look for the twin is a second after the one before."""
        assert twin.update is not None
        return twin.update.made_s + next(second, 1_000)

    def rejoined() -> list[str]:
        return re.findall(r"nothing was received on /twin/state for (\d+) s: joining", caplog.text)

    with Peer(domain) as peer:
        async with started(WebTwin) as (twin, reported):
            for lost in (1, 2):
                second = itertools.repeat(0)
                monkeypatch.setattr(web, "time", SimpleNamespace(monotonic=now_s))
                twin.rejoin_after_s = Limits().rejoin_after_s
                peer.publish("/twin/state", state_of(float(lost)), depth=1)
                await until(lambda: len(reported) == lost, "a sign of life")  # noqa: B023
                second = iter(range(1_000))
                await until(lambda: len(rejoined()) == 6 * lost, "its silence")  # noqa: B023
    expected_s = [30, 60, 120, 240, 480, 780] * 2
    # On a busy machine, another task may have looked at the clock in between.
    assert [int(it) for it in rejoined()] == pytest.approx(expected_s, abs=2)


async def test_refusals_are_the_services_and_no_wait_is_endless(
    domain: int, caplog: pytest.LogCaptureFixture
) -> None:
    def answer(_: Any, response: Any) -> Any:
        response.error_message = SAYS
        return response

    with Peer(domain) as peer:
        peer.node.create_service(GetWrites, NAME, answer)
        async with started(WebTwin, timeout_s=0.5) as (twin, _):
            await knows_a_journal(twin, peer)
            await until(lambda: "within 0.5 s" in caplog.text, "the peer, which does not spin")
            twin.timeout_s = 20.0
            while SAYS not in caplog.text:
                await asyncio.to_thread(peer.spin_briefly)


def copies(folder: Path, *ages_s: float) -> list[Path]:
    """One file of each age, each a copy of its own journal."""
    paths = [folder / f"{number:032}.sqlite" for number in range(len(ages_s))]
    for path, age_s in zip(paths, ages_s, strict=True):
        write(path, Lot(path.stem, (), 0, is_all=True), 1)
        os.utime(path, (time.time() - age_s,) * 2)
    return paths


def left_after_start(folder: Path) -> tuple[str | None, list[Path]]:
    """The file that is read first, and those that are left."""

    async def test() -> str | None:
        async def query(_after: int) -> Lot:
            raise NotRemembered("nobody is there")

        log = FollowedLog(query, Workers("test"))
        await log.start(folder)
        condition = log.condition
        await log.stop()
        return None if condition is None else condition.path

    return asyncio.run(test()), sorted(folder.glob("*.sqlite"))


def test_an_old_copy_is_deleted_at_the_start_unless_it_is_the_latest(tmp_path: Path) -> None:
    latest, recent, old = copies(tmp_path, 60.0, RETAINED_S - 60.0, RETAINED_S + 60.0)
    assert left_after_start(tmp_path) == (str(latest), [latest, recent])
    for path in (latest, recent):
        path.unlink()
    latest, old = copies(tmp_path, RETAINED_S + 60.0, RETAINED_S + 120.0)
    assert left_after_start(tmp_path) == (str(latest), [latest])
    assert not old.exists()


@pytest.mark.parametrize("is_old", [False, True])
def test_rows_that_do_not_come_are_requested_again_and_an_old_copy_is_made_anew(
    tmp_path: Path, *, is_old: bool
) -> None:
    copy, requests = tmp_path / "j.sqlite", list[int]()
    if is_old:
        old("version4/purged", tmp_path)

    async def query(after: int) -> Lot:
        requests.append(after)
        if len(requests) < 2:
            raise TwinTimeoutError("did not answer within 10 s")
        return Lot("j", (), 0, is_all=True)

    async def test() -> None:
        log = FollowedLog(query, Workers("test"))
        log.on_update(Condition(JournalState.RECORDING, journal_id="j"))
        await log.start(tmp_path)
        await until(lambda: log.condition, "a copy")
        await log.stop()

    asyncio.run(test())
    assert requests[:2] == [0, 0]
    assert followed(copy).journal == "j"


def test_a_configured_file_is_read_before_its_twin_is_received(tmp_path: Path) -> None:
    journal = tmp_path / "j.sqlite"
    with recording(journal, world=World("simulated", 1_440.0)) as twin:
        twin.write(scan())
        wait_for(lambda: twin.condition.written == 1, "it")

    async def test() -> None:
        async def query(_after: int) -> Lot:
            raise NotRemembered("nobody is there")

        log = FollowedLog(query, Workers("test"), journal)
        await log.start(tmp_path / "copies")
        await log.wait()
        condition = log.condition
        assert condition is not None
        assert (condition.path, condition.complete_ns) == (str(journal), NOW)
        assert log.world == World("simulated", 1_440.0)
        await log.stop()

    asyncio.run(test())
