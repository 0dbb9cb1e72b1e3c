"""All channels together, and the daily report: each day once, and no missed day is hidden."""

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, time, timedelta, tzinfo
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

import orjson
import pytest

from lupin_bridge.judge.judging import Criteria
from lupin_bridge.notify import channels, mqtt, webhook
from lupin_bridge.notify.channels import MOST_DAYS, Channels, DailyReport, DailyTarget
from lupin_bridge.notify.destinations import Targets
from lupin_bridge.notify.messages import GreenhouseState
from lupin_bridge.notify.mqtt import Mirror, Mqtt
from lupin_bridge.notify.webhook import MAX_REFUSALS, Webhook
from lupin_bridge.past.plans import Answered
from lupin_bridge.serving.admission import Answer
from lupin_bridge.settings import Secrets, SettingError, Settings
from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.past import NotRemembered, PastRefused
from tests.support.mosquitto import Broker, Subscriber
from tests.support.processes import free_port
from tests.support.receiver import Answer as Reply
from tests.support.receiver import Receiver, receiver, status
from tests.support.seen import NOW_NS, SENSORS, Alarms, alarm, seen, tag
from tests.support.waiting import PATIENCE_S, until


def with_an_alarm() -> Any:
    """A simulated greenhouse with an alarm, and no past that is queried."""
    found = Greenhouse(NOW_NS, origin="simulated")
    found.alarms.show([alarm("a")])
    return found


async def test_without_a_configured_channel_nothing_is_started() -> None:
    channels = Channels()
    before = len(asyncio.all_tasks())
    channels.start(with_an_alarm(), SENSORS)
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
        channels.start(with_an_alarm(), SENSORS)
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
    assert server.posted[0].json["origin"] == "simulated"


SIX = time(6)
SECRETS = Secrets(webhook_secret="s" * 16)


def ns(text: str) -> int:
    return int(datetime.fromisoformat(text).timestamp()) * 10**9


@dataclass
class Greenhouse:
    """A bridge as a report needs it: a clock, and a log that records the queried period."""

    ros_time_ns: int
    criteria: Criteria = field(default_factory=lambda: Criteria.of(Settings(time_zone="UTC")))
    lag_ns: int = 0
    error: Exception | None = None
    journal_id: str = "j1"
    checks: int = 0
    origin: str = "robot"
    alarms: Alarms = field(default_factory=Alarms)
    notes: Any = None

    @property
    def source(self) -> Any:
        return self

    def seen(self) -> GreenhouseState:
        return seen(tag("a", temperature=20.0))

    def journal(self) -> Condition:
        self.checks += 1
        complete_ns = self.ros_time_ns - self.lag_ns
        return Condition(
            JournalState.RECORDING, complete_ns=complete_ns, journal_id=self.journal_id
        )

    async def ask(self, query: Any, _cost_s: float) -> Answered:
        if self.error is not None:
            raise self.error
        of = query.args[0]
        return Answered('"x"', Answer(orjson.dumps([of.start_ns, of.end_ns]), "", {}))


@pytest.fixture(autouse=True)
def in_a_hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(channels, "POLL_S", 0.005)
    for module in (mqtt, webhook):
        monkeypatch.setattr(module, "FIRST_WAIT_S", 0.001)


@asynccontextmanager
async def sending(
    greenhouse: Greenhouse, folder: Path, port: int, zone: tzinfo | None = UTC
) -> AsyncIterator[Webhook]:
    target = Targets.of(Settings(webhook_url=f"http://127.0.0.1:{port}/"), SECRETS).webhook
    assert target is not None
    hook = Webhook(target)
    of: Any = greenhouse
    hook.start(of)
    report = DailyReport(DailyTarget(SIX, zone, folder), hook, of)
    report.start()
    try:
        yield hook
    finally:
        await report.stop()
        await hook.stop()


def periods(at: Receiver) -> list[list[int]]:
    return [it.json["report"] for it in at.posted]


async def noted(folder: Path) -> None:
    await until(lambda: list(folder.glob("*.sent")), "the note of what was sent")


@asynccontextmanager
async def begun(
    folder: Path, *answers: Reply, now: str = "2026-05-01T07:00Z"
) -> AsyncIterator[tuple[Greenhouse, Receiver]]:
    """A bridge that has recorded the last day as sent, and sends the next ones."""
    greenhouse = Greenhouse(ns(now))
    with receiver(*answers) as at:
        async with sending(greenhouse, folder, at.port):
            await noted(folder)
            yield greenhouse, at


async def checks(greenhouse: Greenhouse, count: int = 5) -> None:
    """Wait until it has checked that often and found nothing to do."""
    before = greenhouse.checks
    await until(lambda: greenhouse.checks >= before + count, "more checks")


async def test_each_day_is_sent_once_from_the_first_hour_on_also_after_restarts(
    tmp_path: Path,
) -> None:
    greenhouse = Greenhouse(ns("2026-05-01T05:00Z"))
    with receiver(status(200)) as at:
        async with sending(greenhouse, tmp_path, at.port):
            await noted(tmp_path)
            await checks(greenhouse)
            assert at.posted == []
            greenhouse.ros_time_ns = ns("2026-05-01T06:00Z")
            await until(lambda: at.posted, "the first report")
            await checks(greenhouse)
        async with sending(greenhouse, tmp_path, at.port):
            await checks(greenhouse)
            greenhouse.ros_time_ns = ns("2026-05-02T06:30Z")
            await until(lambda: len(at.posted) == 2, "the second")
            await checks(greenhouse)
        first = [ns("2026-04-30T06:00Z"), ns("2026-05-01T06:00Z")]
        assert periods(at) == [first, [first[1], ns("2026-05-02T06:00Z")]]
        assert at.ids == ["report.20260501T060000Z", "report.20260502T060000Z"]
        assert {it.json["change"] for it in at.posted} == {"report"}
        assert {it.json["id"] for it in at.posted} == set(at.ids)


async def test_missed_days_are_sent_in_order_and_at_most_a_week_of_them(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    greenhouse = Greenhouse(ns("2026-05-01T07:00Z"))
    with receiver(status(200)) as at:
        async with sending(greenhouse, tmp_path, at.port):
            await noted(tmp_path)
        greenhouse.ros_time_ns = ns("2026-05-04T07:00Z")
        async with sending(greenhouse, tmp_path, at.port):
            await until(lambda: len(at.posted) == 3, "three days")
            await checks(greenhouse)
        assert [end for _, end in periods(at)] == [
            ns(f"2026-05-0{day}T06:00Z") for day in (2, 3, 4)
        ]
        assert "too many were missed" not in caplog.text
        greenhouse.ros_time_ns = ns("2026-05-31T07:00Z")
        async with sending(greenhouse, tmp_path, at.port):
            await until(lambda: len(at.posted) == 3 + MOST_DAYS, "a week")
            await checks(greenhouse)
        assert periods(at)[-1][1] == ns("2026-05-31T06:00Z")
        assert "too many were missed" in caplog.text


async def test_a_day_with_too_much_data_holds_up_no_other(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with begun(tmp_path, status(200)) as (greenhouse, at):
        greenhouse.error = PastRefused("about 200000 scans, the limit is 100000")
        greenhouse.ros_time_ns = ns("2026-05-02T07:00Z")
        await until(lambda: "20260502T060000Z is skipped" in caplog.text, "the word of it")
        greenhouse.error, greenhouse.ros_time_ns = None, ns("2026-05-03T07:00Z")
        await until(lambda: at.posted, "the next one")
    assert periods(at) == [[ns("2026-05-02T06:00Z"), ns("2026-05-03T06:00Z")]]


async def test_a_report_that_is_not_accepted_is_sent_again_also_by_the_next_process(
    tmp_path: Path,
) -> None:
    async with begun(tmp_path, status(500)) as (greenhouse, at):
        greenhouse.ros_time_ns = ns("2026-05-02T07:00Z")
        await until(lambda: len(at.posted) >= 3, "some attempts")
    with receiver(status(503), status(200), port=at.port) as again:
        async with sending(greenhouse, tmp_path, at.port):
            await until(lambda: len(again.posted) == 2, "the report")
            await checks(greenhouse)
    assert len({*at.ids, *again.ids}) == 1


async def test_a_report_that_cannot_be_recorded_as_sent_is_not_repeated_endlessly(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with begun(tmp_path, status(200)) as (greenhouse, at):
        [note] = tmp_path.glob("*.sent")
        in_the_way, before = note.with_suffix(".new"), note.read_text()
        in_the_way.mkdir()
        greenhouse.ros_time_ns = ns("2026-05-02T07:00Z")
        await until(lambda: "is not sent by webhook: [Errno" in caplog.text, "why")
        await checks(greenhouse)
        assert len(at.posted) == 1
        in_the_way.rmdir()
        await until(lambda: note.read_text() != before, "the note of it")
        await checks(greenhouse)
        assert len(at.posted) == 1


async def test_a_report_that_the_receiver_refuses_is_dropped_and_logged(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with begun(tmp_path, *[status(413)] * MAX_REFUSALS, status(200)) as (greenhouse, at):
        greenhouse.ros_time_ns = ns("2026-05-02T07:00Z")
        await until(lambda: "was given up by webhook" in caplog.text, "that it is given up")
        greenhouse.ros_time_ns = ns("2026-05-03T07:00Z")
        await until(lambda: len(at.posted) == MAX_REFUSALS + 1, "the next day's")
    assert at.posted[-1].json["lost"] == 1


async def test_it_waits_for_the_log_and_reports_why_there_is_none(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with begun(tmp_path, status(200)) as (greenhouse, at):
        greenhouse.lag_ns = 10 * 10**9
        greenhouse.ros_time_ns = ns("2026-05-02T06:00:05Z")
        await checks(greenhouse)
        assert at.posted == []
        greenhouse.error = NotRemembered("the disk is gone")
        greenhouse.ros_time_ns = ns("2026-05-02T06:00:20Z")
        await until(lambda: "not sent by webhook: the disk is gone" in caplog.text, "why")
        greenhouse.error = None
        await until(lambda: at.posted, "the report")


async def test_a_clock_that_was_ahead_stops_no_reports_and_simulated_time_has_none(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with begun(tmp_path, status(200), now="2036-05-01T07:00Z") as (greenhouse, at):
        greenhouse.ros_time_ns = ns("2026-05-01T07:00Z")
        await checks(greenhouse)
        greenhouse.ros_time_ns = ns("2026-05-02T07:00Z")
        await until(lambda: at.posted, "the report of the true day")
        greenhouse.ros_time_ns = 5_000 * 10**9
        await until(lambda: "the time is simulated" in caplog.text, "why there is none")


async def test_two_greenhouses_with_one_receiver_have_separate_reports(tmp_path: Path) -> None:
    greenhouses = [Greenhouse(ns("2026-05-01T07:00Z"), journal_id=name) for name in ("j1", "j2")]
    with receiver(status(200)) as at:
        for greenhouse in greenhouses:
            async with sending(greenhouse, tmp_path, at.port):
                await checks(greenhouse)
            greenhouse.ros_time_ns = ns("2026-05-02T07:00Z")
            async with sending(greenhouse, tmp_path, at.port):
                await checks(greenhouse, 20)
        assert len(at.posted) == 2


@pytest.mark.parametrize(
    ("now", "start", "end"),
    [
        # Clocks go forward on 29 March 2026, and back on 25 October.
        ("2026-03-29T12:00Z", "2026-03-28T05:00Z", "2026-03-29T04:00Z"),
        ("2026-10-25T12:00Z", "2026-10-24T04:00Z", "2026-10-25T05:00Z"),
    ],
)
def test_a_day_is_one_of_the_greenhouses_clock(now: str, start: str, end: str) -> None:
    target = DailyTarget(SIX, ZoneInfo("Europe/Amsterdam"), Path())
    assert target.ended_ns(ns(now)) == ns(end)
    assert target.ended_ns(ns(end)) == ns(end)
    assert target.ended_ns(ns(end) - 1) == ns(start) == target.ended_ns(ns(end), -1)
    assert target.ended_ns(ns(start), 1) == ns(end)


def test_days_follow_each_other_without_a_gap_for_a_year() -> None:
    for zone in (ZoneInfo("Europe/Amsterdam"), ZoneInfo("Asia/Kathmandu"), UTC):
        for at in (time(0), time(2, 30), time(23, 59)):
            target = DailyTarget(at, zone, Path())
            end_ns = target.ended_ns(ns("2026-01-01T12:00Z"))
            for _ in range(370):
                next_ns = target.ended_ns(end_ns, 1)
                hours = timedelta(seconds=(next_ns - end_ns) / 1e9) / timedelta(hours=1)
                assert 22 < hours < 26
                assert target.ended_ns(next_ns, -1) == end_ns
                assert target.ended_ns(next_ns) == next_ns
                end_ns = next_ns


async def test_a_broker_gets_it_once_reachable_and_retains_it(tmp_path: Path) -> None:
    broker = Broker(tmp_path)
    target = Targets.of(Settings(mqtt_url=broker.url, mqtt_prefix="lt"), Secrets()).mqtt
    assert target is not None
    greenhouse = Greenhouse(ns("2026-05-01T07:00Z"))
    channel = Mqtt(target, Mirror(target.topics, SENSORS))
    of: Any = greenhouse
    channel.start(of)
    report = DailyReport(DailyTarget(SIX, UTC, tmp_path), channel, of)
    report.start()
    try:
        await noted(tmp_path)
        greenhouse.ros_time_ns = ns("2026-05-02T07:00Z")
        await checks(greenhouse, 1)
        with broker.running():
            with Subscriber(broker) as received:
                await until(lambda: received.last("lt/house/report"), "the report")
            with Subscriber(broker, "lt/house/report") as later:
                await until(lambda: later.last("lt/house/report"), "that it is retained")
                found = later.last("lt/house/report")
        assert found["id"] == "report.20260502T060000Z"
        assert found["report"] == [ns("2026-05-01T06:00Z"), ns("2026-05-02T06:00Z")]
    finally:
        await asyncio.gather(report.stop(), channel.stop())


@pytest.mark.parametrize("text", ["6:00", "24:00", "06:60", "06:00:00", "six"])
def test_an_invalid_hour_is_refused(text: str) -> None:
    settings = Settings(report_at=text, webhook_url=f"http://127.0.0.1:{free_port()}/")
    with pytest.raises(SettingError, match="must be from 00:00 to 23:59"):
        Targets.of(settings, SECRETS)
    with pytest.raises(SettingError, match="has no use"):
        Targets.of(Settings(report_at="06:00"), Secrets())
