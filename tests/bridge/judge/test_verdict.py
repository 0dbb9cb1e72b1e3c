"""The tables `verdicts.json` and `states.json`: what a tag and a greenhouse are judged as.

Each state goes the bridge's own way: scans and inspections into a store, its snapshots to the
judge, and the journal's rows to the alarms. The page's tests render the same tables.
`tests/README.md` describes their form.
"""

import asyncio
import json
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, time
from pathlib import Path
from typing import Any

import pytest

from lupin_bridge.alarms import feed as feed_module
from lupin_bridge.alarms.board import AlarmBoard
from lupin_bridge.alarms.feed import AlarmFeed
from lupin_bridge.feed.source import TwinUpdate
from lupin_bridge.judge.day import ClockDay, Day
from lupin_bridge.judge.judging import Criteria, Judge, Judged, own_sensors, silenced
from lupin_bridge.judge.scans import RecentScans
from lupin_bridge.judge.verdict import Health, Kind, Verdict, judge_site, judge_tag
from lupin_twin.core.state import (
    NO_FLOWER,
    Attempt,
    Flower,
    Observation,
    Pose,
    Reading,
    TagState,
    TwinStore,
)
from tests.bridge.alarms.test_board import Journal, changed

CASES = json.loads(Path(__file__).with_name("verdicts.json").read_text(encoding="utf-8"))
SENSORS = own_sensors()
NOW_NS = 1_000_000_000_000_000
HOLDS_NS = 600_000_000_000


def ago(seconds: float | None) -> int | None:
    return None if seconds is None else NOW_NS - int(seconds * 1e9)


def tag_state(case: dict[str, Any]) -> TagState:
    status, tried_s = case.get("last_try", (0, 60))
    flower = NO_FLOWER
    if "pest" in case or "species" in case:
        flower = Flower(
            case.get("species", "rose"), 0.9, "pest" in case, bug_count=case.get("pest", 0)
        )
    return TagState(
        "tag_7",
        readings=tuple(
            Reading(name, math.nan if value is None else value, ago(age_s))
            for name, (value, age_s) in case["readings"].items()
        ),
        flower=flower,
        looked_at_ns=ago(90),
        last_try=Attempt(NOW_NS - int(tried_s * 1e9), status),
    )


def judge(case: dict[str, Any], now_ns: int = NOW_NS) -> Health:
    tag = tag_state(case)

    def day_of(*_: object) -> Day:
        return Day(case.get("is_day", True), "light")

    recent = RecentScans.of([tag], (), day_of).tag(tag.tag_id)
    return judge_tag(tag, now_ns, SENSORS, recent, holds_ns=HOLDS_NS, changed={}, days=())


@pytest.mark.parametrize("case", CASES, ids=[case["name"] for case in CASES])
def test_a_tag_is_judged_as_an_expert_would(case: dict[str, Any]) -> None:
    health = judge(case)
    assert health.verdict == case["verdict"]
    reported = [(r.kind, r.verdict, r.sensor, r.value, r.limit) for r in health.reasons]
    assert reported == [
        (*names, value if value is None else pytest.approx(value, rel=1e-3), limit)
        for *names, value, limit in case["reasons"]
    ]


def test_the_tables_have_every_sensor_every_kind_and_every_verdict() -> None:
    reported = {kind for case in CASES for kind, *_ in case["reasons"]}
    assert reported == set(Kind) - {Kind.SILENT, Kind.STOPPED, Kind.CHANGED}
    reasons = [
        reason for state in STATES for tag in tags_of(state).values() for reason in tag["reasons"]
    ]
    of_greenhouse = {kind for state in STATES for kind in state["house"]["reasons"]}
    alarmed = {kind for state in STATES for _, kind, _, _ in state["alarms"]}
    assert {kind for kind, *_ in reasons} | of_greenhouse | {"stopped"} == set(Kind) - {
        Kind.CHANGED
    }
    assert alarmed == set(Kind) - {Kind.CHANGED}
    measured = ("temperature", "humidity", "co2", "light", "soil_moisture")
    for sensor in measured:
        of_sensor = [reason for reason in reasons if reason[2] == sensor]
        sides = {value < limit for kind, _, _, value, limit in of_sensor if kind == "range"}
        assert sides == {True, False}, f"{sensor} low and high"
        assert {kind for kind, *_ in of_sensor} >= {"range", "reading_failed", "old"}
    assert {state["house"]["verdict"] for state in STATES} == {
        "critical",
        "stressed",
        "unknown",
        "healthy",
    }


def test_a_reason_names_its_observation_and_a_reading_from_the_future_counts_as_read_now() -> None:
    by_name = {case["name"]: case for case in CASES}
    (cold,) = judge(by_name["a lethal cold"]).reasons
    assert cold.since_ns == ago(60)
    (pest,) = judge(by_name["a pest among good readings"]).reasons
    assert pest.since_ns == ago(90)
    (failed,) = judge(by_name["the last try failed"]).reasons
    assert failed.since_ns == ago(30)
    (never,) = judge(by_name["never scanned"]).reasons
    assert never.since_ns is None
    assert judge(CASES[0], NOW_NS - 10**12).verdict is Verdict.HEALTHY


@pytest.mark.parametrize(
    ("tags", "greenhouse"),
    [
        (["healthy", "healthy"], "healthy"),
        (["healthy", "stressed"], "stressed"),
        (["stressed", "critical", "healthy"], "critical"),
        (["unknown", "healthy"], "unknown"),
        (["unknown", "stressed", "healthy"], "stressed"),
        (["unknown", "unknown", "critical"], "critical"),
        (["unknown", "unknown", "stressed"], "unknown"),
        ([], "unknown"),
    ],
)
def test_a_greenhouse_has_its_worst_tags_verdict_or_is_unknown_where_most_tags_are(
    tags: list[str], greenhouse: str
) -> None:
    assert judge_site(Counter(map(Verdict, tags)), is_silent=False).verdict == greenhouse


TABLE = json.loads(Path(__file__).with_name("states.json").read_text(encoding="utf-8"))
STATES = TABLE["states"]
S = 1_000_000_000
EVERY_S, ROUNDS = 120, 5
SCAN, LOOK = 0, 1

Write = tuple[int, str, Observation]


def now_ns(state: dict[str, Any]) -> int:
    """The 21st of June by the state's clock, which is that of the greenhouse."""
    hour = time.fromisoformat(state.get("clock", "12:00"))
    day = datetime(2026, 6, 21, hour.hour, hour.minute, tzinfo=UTC)
    return int(day.timestamp()) * S


def tags_of(state: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Each tag as it is written, those that are as another state's included."""
    return {
        tag_id: TABLE["alike"][tag] if isinstance(tag, str) else tag
        for tag_id, tag in state["tags"].items()
    }


def writes_of(state: dict[str, Any]) -> list[Write]:
    """All received observations, in the order of time."""
    received = [
        write for tag_id, tag in tags_of(state).items() for write in of_tag(state, tag_id, tag)
    ]
    return sorted(received, key=lambda write: write[0])


def of_tag(state: dict[str, Any], tag_id: str, tag: dict[str, Any]) -> Iterator[Write]:
    now, every_s = now_ns(state), state.get("every_s", EVERY_S)
    rounds, was = state.get("rounds", ROUNDS), tag.get("was", {})
    scans: dict[int, dict[str, float]] = {}
    for name, (value, age_s) in tag["readings"].items():
        for back in range(rounds):
            found = was.get(name, value) if back else value
            at_ns = now - (age_s + back * every_s) * S
            scans.setdefault(at_ns, {})[name] = math.nan if found is None else found
    for at_ns, values in scans.items():
        yield at_ns, tag_id, Observation(tag_id, at_ns, values)
    for status, age_s in tag.get("failed", ()):
        at_ns = now - age_s * S
        yield at_ns, tag_id, Observation(tag_id, at_ns, status=status)
    if "species" in tag or "pest" in tag:
        at_ns, bugs = now - tag.get("looked_s", 90) * S, tag.get("pest", 0)
        flower = Flower(tag.get("species", ""), 0.9, anomaly=bugs > 0, bug_count=bugs)
        yield at_ns, tag_id, Observation(tag_id, at_ns, kind=LOOK, flower=flower)


def journal_rows(writes: list[Write]) -> list[Observation]:
    return [replace(write, number=number, run=1) for number, (_, _, write) in enumerate(writes, 1)]


def criteria() -> Criteria:
    return Criteria(SENSORS, None, ClockDay(UTC))


def judged(state: dict[str, Any]) -> Judged:
    store, judge = TwinStore(), Judge(criteria())
    for at_ns, _, write in writes_of(state):
        store.record(write)
        judge.see(store.snapshot(at_ns, "map"))
    for tag_id, tag in tags_of(state).items():
        if not tag["readings"]:
            store.pin(tag_id, Pose(1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0))
    moment_ns = now_ns(state)
    message = judge.see(store.snapshot(moment_ns, "map"))
    return silenced(message) if state.get("twin", "live") != "live" else message


async def alarms(state: dict[str, Any]) -> list[list[str]]:
    """What is active then, as `/api/alarms` has it; a feed hears what the bridge's would."""
    source, board, moment_ns = Journal(), AlarmBoard(), now_ns(state)
    feed = AlarmFeed(source, Judge(criteria()), board, lambda: moment_ns, 7.0)  # type: ignore[arg-type]
    feed.start()
    try:
        source.writes_now = journal_rows(writes_of(state))
        is_silent = state.get("twin") == "silent"
        feed.on_silence(is_silent=is_silent, last_ns=moment_ns - 60 * S)
        if state.get("twin") != "never_seen":
            feed.on_state(TwinUpdate(TwinStore().snapshot(moment_ns, "map"), "1"))
            await changed(board)
    finally:
        await feed.stop()
        source.workers.close()
    return sorted(
        [it.tag_id, str(it.reason.kind), it.reason.sensor, str(it.reason.verdict)]
        for it in board.now.active
    )


def reported(health: Health) -> list[list[Any]]:
    return [[r.kind, r.verdict, r.sensor, r.value, r.limit] for r in health.reasons]


def expected(reasons: list[list[Any]]) -> list[list[Any]]:
    return [
        [*names, None if value is None else pytest.approx(value, rel=1e-3), limit]
        for *names, value, limit in reasons
    ]


@pytest.mark.parametrize("state", STATES, ids=[state["name"] for state in STATES])
def test_a_greenhouse_is_judged_as_an_expert_would(
    state: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(feed_module, "JOURNAL_S", 0.0)
    message, greenhouse = judged(state), state["house"]
    assert message.house.verdict == greenhouse["verdict"]
    assert [reason.kind for reason in message.house.reasons] == greenhouse["reasons"]
    assert [message.day.is_day, message.day.source] == greenhouse["day"]
    assert message.patrol.overdue == greenhouse["overdue"]
    of_tags = tags_of(state)
    assert {tag_id: health.verdict for tag_id, health in message.tags.items()} == {
        tag_id: tag["verdict"] for tag_id, tag in of_tags.items()
    }
    for tag_id, tag in of_tags.items():
        assert reported(message.tags[tag_id]) == expected(tag["reasons"])
    assert asyncio.run(alarms(state)) == state["alarms"]
