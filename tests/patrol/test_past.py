"""The past of a demo: what the patrol would have observed until it begins."""

from __future__ import annotations

import json
from statistics import fmean
from typing import Any

import pytest
from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.cli import parse
from lupin_patrol.greenhouse import read_greenhouse
from lupin_patrol.mission import START_OF_DAY_S
from lupin_patrol.past import DAYS, main, past
from tests.support.climate import Truth

DAY_SPEED = 60.0


def made(*options: str) -> list[dict[str, Any]]:
    return list(past(parse(options)))


@pytest.fixture(scope="module")
def events() -> list[dict[str, Any]]:
    return made()


@pytest.fixture(scope="module")
def scans(events: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [event for event in events if "status" in event]


def test_it_is_three_days_of_the_demo_s_own_length_up_to_now(events: list[dict[str, Any]]) -> None:
    times = [event["at_s"] for event in events]
    assert times == sorted(times)
    assert -DAYS * 86_400 / DAY_SPEED <= times[0] < -DAYS * 86_400 / DAY_SPEED + 10
    assert -10 < times[-1] < 0


def test_every_tag_is_scanned_in_every_pass_and_some_scans_fail(
    scans: list[dict[str, Any]],
) -> None:
    tags = {tag.tag_id for tag in read_greenhouse(GreenhouseSimulator()).tags}
    last = scans[-1]["pass"]
    assert last > 50
    for number in range(1, last):
        tried = [event for event in scans if event["pass"] == number]
        assert {event["tag_id"] for event in tried} == tags
        failed = [event for event in tried if event["status"]]
        assert {event["status"] for event in failed} == {1, 2}
        assert not any(event["readings"] or event["pose"] for event in failed)


def test_pests_come_and_are_cleared(events: list[dict[str, Any]]) -> None:
    seen = [(event["tag_id"], event["bug_count"] > 0) for event in events if "bug_count" in event]
    assert all(
        event["anomaly"] == (event["bug_count"] > 0) for event in events if "anomaly" in event
    )
    infested = {tag for tag, has_bugs in seen if has_bugs}
    assert len(infested) > 5
    last = {tag for tag, has_bugs in dict(seen).items() if has_bugs}
    assert len(last) < len(infested)


def test_places_are_exact_at_first(events: list[dict[str, Any]]) -> None:
    greenhouse = read_greenhouse(GreenhouseSimulator())
    first = {event["tag_id"]: event["pose"] for event in reversed(events) if event["pose"]}
    for tag in greenhouse.tags:
        assert tuple(first[tag.tag_id][:2]) == tag.position


def test_its_time_of_day_is_that_of_the_patrol(scans: list[dict[str, Any]]) -> None:
    """Readings follow the climate's own curve, at the time of day that leads up to the start."""
    greenhouse = read_greenhouse(GreenhouseSimulator())
    truth = Truth(GreenhouseSimulator())

    def off_by(hours: float) -> float:
        return fmean(
            abs(
                value
                - truth.of(
                    "temperature",
                    greenhouse.tag(event["tag_id"]).position,
                    START_OF_DAY_S + event["at_s"] * DAY_SPEED + hours * 3600,
                )
            )
            for event in scans
            for name, value in event["readings"]
            if name == "temperature"
        )

    assert off_by(0) < min(off_by(hours) for hours in (-2, -1, 1, 2)) / 1.5


def test_options_are_the_patrol_s(capsys: pytest.CaptureFixture[str]) -> None:
    main(["--speed", "10", "--day-speed", "3600", "--seed", "3"])
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert -DAYS * 86_400 / 3600 / 10 <= lines[0]["at_s"] < lines[-1]["at_s"] < 0
    assert lines == json.loads(json.dumps(made("--speed=10", "--day-speed=3600", "--seed=3")))
    assert lines != json.loads(json.dumps(made("--speed=10", "--day-speed=3600", "--seed=4")))
    with pytest.raises(SystemExit):
        main(["--speed", "0"])


def test_where_the_day_stands_still_there_is_no_past() -> None:
    assert made("--day-speed=0") == []
