"""All channels together: started, notified and stopped with a bridge."""

import asyncio
import threading
from pathlib import Path
from typing import Any

from lupin_bridge.alarms.board import AlarmBoard, NoteBoard
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.notify.channels import Channels
from lupin_bridge.notify.destinations import Targets
from lupin_bridge.notify.messages import GreenhouseState
from lupin_bridge.settings import Secrets, Settings
from lupin_twin.core.diagnostics import Origin
from tests.support.mosquitto import Broker
from tests.support.receiver import receiver, status
from tests.support.seen import NOW_NS, SENSORS, Alarms, alarm, seen, tag
from tests.support.waiting import PATIENCE_S, until


class Greenhouse:
    """A bridge as the channels need it."""

    ros_time_ns = NOW_NS
    origin: Origin = "simulated"
    criteria = Criteria.of(Settings())
    source: Any = None  # no past is queried

    def __init__(self) -> None:
        board = Alarms()
        board.show([alarm("a")])
        self.alarms: AlarmBoard = board
        self.notes = NoteBoard(self.source, lambda: None)

    def seen(self) -> GreenhouseState:
        return seen(tag("a", temperature=20.0))


async def test_without_a_configured_channel_nothing_is_started() -> None:
    channels = Channels()
    before = len(asyncio.all_tasks())
    channels.start(Greenhouse(), SENSORS)
    assert len(asyncio.all_tasks()) == before
    assert channels.status() == {}
    assert {name: dict(counts) for name, counts in channels.counts()} == {
        f"lupin_outward_{what}": {}
        for what in ("connected", "waiting", "sent", "failed", "dropped")
    }
    await channels.stop()


async def test_a_failing_channel_is_reported_and_the_other_goes_on(tmp_path: Path) -> None:
    broker = Broker(tmp_path)
    with receiver(status(200)) as server:
        hook = f"http://127.0.0.1:{server.port}/hook"
        settings = Settings(mqtt_url=broker.url, webhook_url=hook)
        channels = Channels(Targets.of(settings, Secrets(webhook_secret="s" * 16)))
        channels.start(Greenhouse(), SENSORS)
        # A slow name lookup does not delay the shutdown.
        loop, name_server = asyncio.get_running_loop(), threading.Event()
        looking = loop.run_in_executor(None, name_server.wait, PATIENCE_S)
        await until(lambda: channels.status()["mqtt"], "the broker's absence")
        await until(lambda: dict(channels.counts())["lupin_outward_sent"]["webhook"], "a post")
        assert channels.status() == {
            "mqtt": f"[Errno 111] Connection refused ({broker.url})",
            "webhook": "",
        }
        counts = dict(channels.counts())
        assert counts["lupin_outward_connected"] == {"mqtt": 0, "webhook": 1}
        assert counts["lupin_outward_failed"]["mqtt"] >= 1
        assert counts["lupin_outward_waiting"]["mqtt"] == 1
        await channels.stop()
        await loop.shutdown_default_executor()
        assert not looking.done()
        name_server.set()
        await looking
    assert server.posted[0].json["origin"] == Greenhouse.origin
