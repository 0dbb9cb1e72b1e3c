"""A bridge whose broker and receiver hang: frames flow, and it ends."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from functools import partial
from pathlib import Path

from lupin_bridge.alarms.board import Page, change_between, page_of
from lupin_bridge.notify.channels import Channels
from lupin_bridge.notify.destinations import Targets
from lupin_bridge.settings import Secrets, Settings
from tests.bridge.test_bridge import Stage, state
from tests.support.mosquitto import Broker
from tests.support.receiver import Receiver, receiver, silence
from tests.support.seen import alarm
from tests.support.waiting import until

STATES = 20


def has_frames(stage: Stage, number: int) -> bool:
    return len(stage.ear.states) == number


def test_neither_a_hanging_broker_nor_a_hanging_receiver_delays_a_frame(tmp_path: Path) -> None:
    """Nothing is taken by either from beginning to end, and every state becomes a frame."""
    broker = Broker(tmp_path)

    async def run(server: Receiver) -> None:
        settings = Settings(mqtt_url=broker.url, webhook_url=f"http://127.0.0.1:{server.port}")
        stage = Stage(frames_per_s=100.0)
        stage.bridge.outward = Channels(Targets.of(settings, Secrets(webhook_secret="s" * 16)))
        async with stage:
            # The alarms are the test's alone: of what it hears, the feed makes none, and takes this
            # one back.
            await stage.bridge._alarm_feed.stop()
            page = page_of((alarm("a"),))
            change = change_between(Page(), page)
            stage.bridge.alarms.put(page, change, "heard", 1)
            # The post waits until it is known where observations come from.
            stage.script.tell(replace(state(1), origin="robot"))
            await until(lambda: len(server.posted) == 1, "the post that hangs")
            for number in range(2, STATES + 1):
                stage.script.tell(state(number))
                await until(partial(has_frames, stage, number), f"frame {number}")
            channels = stage.bridge.outward
            assert [it.is_failing for it in channels.status()] == [False, False]
            counts = {name: dict(values) for name, values in channels.counts()}
            assert counts["lupin_outward_sent"] == {"mqtt": 0, "webhook": 0}
            assert counts["lupin_outward_connected"]["mqtt"] == 0
            assert counts["lupin_outward_waiting"] == {"mqtt": 1, "webhook": 1}

    with broker.running() as process, receiver(silence) as server:
        process.freeze()
        asyncio.run(run(server))


def test_a_channel_that_fails_is_told_to_clients(tmp_path: Path) -> None:
    async def run() -> None:
        stage = Stage()
        settings = Settings(mqtt_url=Broker(tmp_path).url)
        stage.bridge.outward = Channels(Targets.of(settings, Secrets()))
        async with stage:
            await until(
                lambda: any(
                    channel["is_failing"]
                    for frame in stage.ear.heard
                    if frame["type"] == "status"
                    for channel in frame["outward"]
                ),
                "the status",
            )
            assert stage.bridge.status.outward[0].channel == "mqtt"

    asyncio.run(run())
