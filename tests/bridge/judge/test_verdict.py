"""The table `verdicts.json`: value and age (s) of each reading, and an expert's verdict."""

import json
import math
from collections import Counter
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from lupin_bridge.judge.day import Day
from lupin_bridge.judge.scans import RecentScans
from lupin_bridge.judge.sensors_file import parse
from lupin_bridge.judge.verdict import Health, Kind, Verdict, judge_site, judge_tag
from lupin_twin.core.state import NO_FLOWER, Attempt, Flower, Reading, TagState

CASES = json.loads(Path(__file__).with_name("verdicts.json").read_text(encoding="utf-8"))
SENSORS = parse(files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8"))
NOW_NS = 1_000_000_000_000_000
HOLDS_NS = 600_000_000_000


def ago(seconds: float | None) -> int | None:
    return None if seconds is None else NOW_NS - int(seconds * 1e9)


def tag_of(case: dict[str, Any]) -> TagState:
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
    tag = tag_of(case)

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


def test_the_table_has_every_kind_of_reason_that_a_tag_can_have() -> None:
    reported = {kind for case in CASES for kind, *_ in case["reasons"]}
    assert reported == set(Kind) - {Kind.SILENT, Kind.STOPPED, Kind.CHANGED}


def test_a_reason_names_the_observation_that_it_comes_from() -> None:
    by_name = {case["name"]: case for case in CASES}
    (cold,) = judge(by_name["a lethal cold"]).reasons
    assert cold.since_ns == ago(60)
    (pest,) = judge(by_name["a pest among good readings"]).reasons
    assert pest.since_ns == ago(90)
    (failed,) = judge(by_name["the last try failed"]).reasons
    assert failed.since_ns == ago(30)
    (never,) = judge(by_name["never scanned"]).reasons
    assert never.since_ns is None


def test_a_reading_from_the_future_counts_as_read_now() -> None:
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
