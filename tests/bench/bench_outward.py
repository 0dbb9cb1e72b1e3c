"""What telling a broker of ten thousand tags costs the loop: a real mosquitto, and a ticker beside.

A frame waits for the loop as the ticker does: its delay is what a frame's would be.
"""

from __future__ import annotations

import asyncio
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path

from lupin_bridge.judge.judging import Judge
from lupin_bridge.judge.options import own_sensors
from lupin_bridge.notify.destinations import Targets
from lupin_bridge.notify.messages import GreenhouseState
from lupin_bridge.notify.mirror import Mirror
from lupin_bridge.notify.mqtt import Mqtt
from lupin_bridge.settings import Secrets, Settings
from lupin_twin.core.state import Reading, Snapshot, TagState
from tests.support.mosquitto import Broker
from tests.support.seen import by_light
from tests.support.waiting import until

TAGS = 10_000
VALUES = {
    "temperature": 22.0,
    "humidity": 62.0,
    "co2": 600.0,
    "light": 900.0,
    "soil_moisture": 40.0,
}
S = 1_000_000_000
NOW_NS = 1_795_270_500 * S
SCANS_PER_S = 15
TICK_S = 0.01
LISTEN_S = 10.0


@dataclass
class House:
    """Ten thousand tags, of whom some are scanned."""

    judge: Judge = field(default_factory=lambda: Judge(own_sensors(), by_light, recent_s=3_600.0))
    now_ns: int = NOW_NS
    scanned: Iterator[int] = field(default_factory=count)

    def __post_init__(self) -> None:
        self.tags = [self.tag(number, 22.0) for number in range(TAGS)]

    def tag(self, number: int, temperature: float) -> TagState:
        values = {**VALUES, "temperature": temperature}
        readings = tuple(Reading(name, value, self.now_ns) for name, value in values.items())
        return TagState(str(number), readings=readings, last_observed_ns=self.now_ns)

    def scan(self, tags: int) -> None:
        self.now_ns += S
        for number in (next(self.scanned) for _ in range(tags)):
            self.tags[number % TAGS] = self.tag(number % TAGS, 21.0 + number / TAGS % 1)

    def look(self) -> GreenhouseState:
        snapshot = Snapshot(self.now_ns, "map", tuple(self.tags))
        judged = self.judge.see(snapshot)
        seen = GreenhouseState(snapshot, judged, now_ns=self.now_ns, is_live=True)
        return replace(seen, holds_ns=self.judge.holds_ns())


class Ticker:
    """How late the loop was for something else, s."""

    def __init__(self) -> None:
        self.delays_s: list[float] = []

    async def run(self) -> None:
        while True:
            due_s = time.perf_counter() + TICK_S
            await asyncio.sleep(TICK_S)  # how late it is over is what is measured
            self.delays_s.append(time.perf_counter() - due_s)

    def told(self) -> str:
        delays, self.delays_s = sorted(self.delays_s), []
        shares = [delays[int(share * (len(delays) - 1))] * 1e3 for share in (0.5, 0.99, 1.0)]
        return "".join(f"{share:>9.1f}" for share in shares)


async def measured(broker: Broker) -> None:
    target = Targets.of(Settings(mqtt_url=broker.url), Secrets()).mqtt
    assert target is not None
    house, ticker = House(), Ticker()
    for _ in range(TAGS // 500 + 2):
        house.look()
    mirror = Mirror(target.topics, own_sensors())
    channel = Mqtt(target, mirror)
    beside = asyncio.create_task(ticker.run())

    async def period(what: str, scans_per_s: int) -> None:
        sent, cpu_s, begun_s = channel.condition.sent, time.process_time(), time.perf_counter()
        while (passed_s := time.perf_counter() - begun_s) < LISTEN_S:
            house.scan(scans_per_s)
            await asyncio.sleep(1.0)  # a load at a rate
        cpu_ms = (time.process_time() - cpu_s) / passed_s * 1e3
        rate = (channel.condition.sent - sent) / passed_s
        waiting = channel.condition.waiting
        print(f"{what:<32}{rate:>12.0f}{cpu_ms:>10.1f}{ticker.told()}{waiting:>9}")

    print(f"\n{TAGS:,} tags{'':<21}{'messages/s':>12}{'CPU ms/s':>10}", end="")
    print(f"{'delay':>9}{'99 %':>9}{'most':>9}{'waiting':>9}")
    await period("nobody is told", 0)
    channel.start(house.look)
    await period("told for the first time", 0)
    # The rest takes minutes: as if it had been told.
    for _ in mirror.messages():
        pass
    await until(lambda: channel.condition.waiting == 0, "what was being told")
    ticker.told()
    await period("nothing new", 0)
    await period(f"{SCANS_PER_S} scans a second", SCANS_PER_S)
    beside.cancel()
    await channel.stop()


def main() -> None:
    """Print all of it."""
    with tempfile.TemporaryDirectory() as folder:
        broker = Broker(Path(folder))
        with broker.running():
            asyncio.run(measured(broker))


if __name__ == "__main__":
    main()
