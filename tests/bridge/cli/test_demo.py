"""The demo's own journal and its past."""

from dataclasses import replace
from pathlib import Path

import pytest

from lupin_bridge.cli.roles import (
    DAY_S,
    Feed,
    fill_past,
    patrolled,
    since_morning_s,
    with_past,
)
from lupin_patrol.cli import parse as patrol_options
from lupin_patrol.perception import SECONDS_PER_DAY
from lupin_twin.core.parameters import World
from tests.support.journal import CLOCK, NOW, kept, scan, select

ENV = {"XDG_STATE_HOME": "/state"}
SHORT = ["--speed=50"]


def test_a_demo_keeps_a_journal_of_its_own_by_seed() -> None:
    for patrol_args, name in (([], "demo-seed-0"), (["--seed=3"], "demo-seed-3")):
        path = f"/state/lupin-twin/{name}.sqlite"
        args = ["--ros-args", "-p", f'journal:="{path}"', "--"]
        feed = patrolled(ENV, patrol_args, ["--ros-args", "-p", "idw_power:=3.0"])
        assert (feed.twin_args, feed.journal) == (args, Path(path))


@pytest.mark.parametrize("patrol_args", [[], ["--speed=1"], ["--speed=50"], ["--speed=0.5"]])
def test_a_demo_s_twin_knows_how_long_its_patrol_s_day_takes(patrol_args: list[str]) -> None:
    patrol = patrol_options(patrol_args)
    day_s = SECONDS_PER_DAY / patrol.day_speed / patrol.speed
    assert patrolled(ENV, patrol_args, []).world == World("simulated", day_s)


@pytest.mark.parametrize("speed", ["0", "nan", "inf", "-1"])
def test_what_is_no_speed_is_left_for_the_patrol_to_refuse(speed: str) -> None:
    assert patrolled(ENV, [f"--speed={speed}"], []).world.day_length_s == 1440.0


@pytest.mark.parametrize(
    "ros_args",
    [
        ["-p", "journal:=off"],
        ["-p", "journal:=/somewhere/else.sqlite"],
        ["--params-file", "twin.yaml"],
        ["-p", "use_sim_time:=true"],
    ],
)
def test_another_journal_or_none_or_another_clock_gets_no_past(ros_args: list[str]) -> None:
    assert patrolled(ENV, [], ["--ros-args", *ros_args]).journal is None


def test_started_again_it_goes_on_with_the_day(tmp_path: Path) -> None:
    path = tmp_path / "demo.sqlite"
    feed = Feed("patrol", ["lupin_patrol", "--end-with-parent", *SHORT], [], World(), path, SHORT)
    assert with_past(feed) == feed, "the first time it is nine"
    [(until_ns,)] = select(path, "SELECT value FROM meta WHERE key = 'simulated_until_ns'")
    # Fifty times as fast, a day takes 28.8 s.
    for later_s, since_s in ((0.0, 0.0), (14.4, 720.0), (28.8, 0.0), (2_894.4, 720.0)):
        now_ns = int(str(until_ns)) + round(later_s * 1e9)
        assert since_morning_s(path, SHORT, now_ns) == pytest.approx(since_s, abs=1e-6)
    again = with_past(feed)
    module, since, *words = again.command
    assert [module, *words] == feed.command
    assert again == replace(feed, command=again.command)
    assert 0.0 <= patrol_options([since]).since_morning < DAY_S


@pytest.mark.parametrize("journal", ["another's", "empty", "none", "no journal"])
def test_of_a_journal_without_such_a_past_there_is_no_day_to_go_on_with(
    tmp_path: Path, journal: str
) -> None:
    path = tmp_path / "demo.sqlite"
    if journal == "another's":
        kept(path, [scan()], CLOCK)
    elif journal != "none":
        path.write_text("" if journal == "empty" else "nonsense" * 1_000)
    assert since_morning_s(path, SHORT, NOW) is None


def test_somebody_s_journal_is_left(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path = tmp_path / "demo.sqlite"
    kept(path, [scan()], CLOCK)
    assert not fill_past(path, SHORT)
    assert select(path, "SELECT count(*) FROM scan") == [(1,)]
    assert caplog.records == []


def test_what_hinders_it_is_told_and_is_no_end(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    assert not fill_past(tmp_path / "demo.sqlite", ["--speed=0"])
    (tmp_path / "no").write_text("a file where a folder should be")
    assert not fill_past(tmp_path / "no" / "demo.sqlite", SHORT)
    told = [record.message for record in caplog.records]
    assert len(told) == 2
    assert "argument --speed" in told[0]
    assert "File exists" in told[1]
