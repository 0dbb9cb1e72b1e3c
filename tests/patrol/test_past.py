"""The past of a demo: what the patrol would have observed until it starts."""

from pathlib import Path
from statistics import fmean

import pytest
from greenhouse_sim.simulator import GreenhouseSimulator

from lupin_patrol.cli import fill_past, parser
from lupin_patrol.greenhouse import read_greenhouse
from lupin_patrol.mission import DAYS, PAST_SOURCE, START_OF_DAY_S, past
from lupin_twin.core.state import Observation, Pin, Write
from tests.support.climate import Truth
from tests.support.journal import NOW, append, scan, select

DAY_SPEED = 60.0
SHORT = ["--speed=50"]


def made(*options: str) -> list[Write]:
    patrol = parser().parse_args(options)
    return list(past(GreenhouseSimulator(), patrol.seed, patrol.day_speed, patrol.speed, NOW))


def at_s(row: Write) -> float:
    """Seconds after now."""
    return (row.stamp_ns - NOW) / 1e9


@pytest.fixture(scope="module")
def rows() -> list[Write]:
    return made()


@pytest.fixture(scope="module")
def scans(rows: list[Write]) -> list[Observation]:
    return [row for row in rows if isinstance(row, Observation) and not row.kind]


def test_it_is_three_days_of_the_demos_own_length_up_to_now(rows: list[Write]) -> None:
    times = [at_s(row) for row in rows]
    assert times == sorted(times)
    assert -DAYS * 86_400 / DAY_SPEED <= times[0] < -DAYS * 86_400 / DAY_SPEED + 10
    assert -10 < times[-1] < 0


def test_every_tag_is_scanned_in_every_round_and_some_scans_fail(scans: list[Observation]) -> None:
    tags = {tag.tag_id for tag in read_greenhouse(GreenhouseSimulator()).tags}
    last = int(scans[-1].mission.removeprefix("past-"))
    assert last > 50
    for number in range(1, last):
        attempted = [row for row in scans if row.mission == f"past-{number:04d}"]
        assert {row.tag_id for row in attempted} == tags
        failed = [row for row in attempted if row.status]
        assert {row.status for row in failed} == {1, 2}
        assert all(row.status_detail for row in failed)
        assert not any(row.readings for row in failed)


def test_each_tag_gets_its_exact_position_before_anything_else(rows: list[Write]) -> None:
    greenhouse = read_greenhouse(GreenhouseSimulator())
    pins = {row.tag_id: row.pose for row in rows if isinstance(row, Pin)}
    assert {tag: (pose.x, pose.y) for tag, pose in pins.items()} == {
        tag.tag_id: tag.position for tag in greenhouse.tags
    }
    placed: set[str] = set()
    for row in rows:
        if isinstance(row, Pin):
            assert row.tag_id not in placed, "it is pinned once"
            placed.add(row.tag_id)
        assert row.tag_id in placed or (isinstance(row, Observation) and row.status)


def test_its_time_of_day_is_that_of_the_patrol(scans: list[Observation]) -> None:
    """Readings follow the climate's own curve, at the time of day that leads up to the start."""
    tags = {tag.tag_id: tag for tag in read_greenhouse(GreenhouseSimulator()).tags}
    truth = Truth(GreenhouseSimulator())

    def off_by(hours: float) -> float:
        return fmean(
            abs(
                row.readings["temperature"]
                - truth.of(
                    "temperature",
                    tags[row.tag_id].position,
                    START_OF_DAY_S + at_s(row) * DAY_SPEED + hours * 3600,
                )
            )
            for row in scans
            if "temperature" in row.readings
        )

    assert off_by(0) < min(off_by(hours) for hours in (-2, -1, 1, 2)) / 1.5


def test_options_are_those_of_the_patrol() -> None:
    rows = made("--speed=10", "--day-speed=3600", "--seed=3")
    assert -DAYS * 86_400 / 3600 / 10 <= at_s(rows[0]) < at_s(rows[-1]) < 0
    assert rows == made("--speed=10", "--day-speed=3600", "--seed=3")
    assert rows != made("--speed=10", "--day-speed=3600", "--seed=4")


def test_where_the_day_stands_still_there_is_no_past() -> None:
    assert made("--day-speed=0") == []


def test_it_fills_a_new_journal_and_leaves_a_used_one_alone(tmp_path: Path) -> None:
    path = tmp_path / "demo.sqlite"
    assert fill_past(path, parser().parse_args(SHORT)) == 0
    made_of = select(
        path, "SELECT DISTINCT source, is_copy FROM scan UNION SELECT source, is_copy FROM look"
    )
    assert made_of == [(PAST_SOURCE, 0)]
    assert select(path, "SELECT count(*) > 3 FROM look") == [(1,)]
    theirs = tmp_path / "theirs.sqlite"
    append(theirs, [scan()])
    assert fill_past(theirs, parser().parse_args(SHORT)) == 0
    assert select(theirs, "SELECT count(*) FROM scan") == [(1,)]


def test_an_error_ends_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "no").write_text("a file where a folder should be")
    assert fill_past(tmp_path / "no" / "demo.sqlite", parser().parse_args(SHORT)) == 2
    assert "File exists" in capsys.readouterr().err
