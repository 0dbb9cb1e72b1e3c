"""Forgetting a tag on the command line, and the state of the next twin."""

import getpass
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import pytest

from lupin_bridge.cli.command import main
from lupin_twin.core.state import Write
from tests.support import messages
from tests.support.journal import NOW, append, inspection, pin, restored, scan, select
from tests.support.waiting import wait_for
from tests.support.web import bridge

HOME = {"1": 1.0, "2": 3.0, "3": 5.0}
LOST = "lost"


class Ended(NamedTuple):
    returncode: int
    stdout: str
    stderr: str


Journal = Callable[..., Ended]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """The journal of a stopped twin, with three tags at home and a lost one, the latest."""
    path = tmp_path / "j.sqlite"
    rows: list[Write] = [scan(tag_id, co2=400.0) for tag_id in HOME]
    rows += [pin(tag_id, x=x) for tag_id, x in HOME.items()]
    append(path, [*rows, inspection(LOST), scan(LOST, NOW + 1, co2=500.0), pin(LOST, x=900.0)])
    return path


@pytest.fixture
def journal(path: Path, capsys: pytest.CaptureFixture[str]) -> Journal:
    def run(action: str, *words: str) -> Ended:
        capsys.readouterr()
        return Ended(
            main(["journal", action, *words, "--journal", str(path)]), *capsys.readouterr()
        )

    return run


def exported(journal: Journal) -> list[str]:
    """The tags of all rows, in order."""
    rows = journal("export").stdout.splitlines()
    column = rows[0].split(",").index("tag_id")
    return [row.split(",")[column] for row in rows[1:]]


def test_a_pose_is_forgotten_and_the_next_twin_pins_the_tag_anew(
    path: Path, journal: Journal
) -> None:
    message = journal("forget", LOST, "--pose")
    assert (message.returncode, message.stderr) == (0, "")
    assert "the pose of tag 'lost' is forgotten" in message.stdout
    # In a domain of its own, without latched messages from before.
    with bridge("--ros-args", "-p", f"journal:={path}") as running:
        assert not running.tag(LOST)["pose"]["orientation"]["w"]
        assert running.tag(LOST)["readings"][0]["value"] == 500.0
        assert {tag_id: running.tag(tag_id)["pose"]["position"]["x"] for tag_id in HOME} == HOME
        while_it_runs = journal("forget", LOST)
        assert (while_it_runs.returncode, while_it_runs.stdout) == (1, "")
        assert "is in use by /lupin_twin (process" in while_it_runs.stderr
        assert while_it_runs.stderr.endswith("stop the twin first\n")
        running.peer.observe(messages.scan(LOST, {"co2": 510.0}, at=(1.0, 3.0)))
        running.tag(LOST, lambda tag: tag["pose"]["position"]["y"] == 3.0)
        wait_for(
            lambda: "\nlupin_journal_rows_waiting 0.0" in running.get("/metrics").text,
            "all rows in the journal",
        )
    places = f"SELECT x FROM place WHERE tag = '{LOST}' AND is_copy = 0"
    assert select(path, places) == [(1.0,)]
    assert journal("check").returncode == 0


def test_all_of_a_tag_is_forgotten_and_later_rows_are_stored(path: Path, journal: Journal) -> None:
    assert exported(journal) == [*HOME, LOST]
    message = journal("forget", LOST)
    assert (message.returncode, message.stderr) == (0, "")
    assert (
        "1 scans, 1 inspections, 1 places; counts of the timeline still have them" in message.stdout
    )
    assert exported(journal) == [*HOME]
    assert {tag.tag_id for tag in restored(path).known.tags} == set(HOME)
    append(path, [scan(LOST, NOW + 2, co2=600.0)])
    assert [tag.flower.species for tag in restored(path).known.tags if tag.tag_id == LOST] == [""]
    assert exported(journal) == [*HOME, LOST]
    assert journal("check").returncode == 0


def test_it_is_on_record_with_person_and_time(path: Path, journal: Journal) -> None:
    assert journal("forget", LOST, "--pose").returncode == 0
    again = journal("forget", LOST, "--pose")
    assert (again.returncode, again.stdout) == (1, "")
    assert "has no place of tag 'lost'" in again.stderr
    assert journal("forget", LOST).returncode == 0
    assert "has no tag 'lost'" in journal("forget", LOST).stderr
    reported = journal("info").stdout
    by = getpass.getuser()
    assert f"forgotten    the pose of tag 'lost', by {by}, 20" in reported
    assert f"forgotten    all of tag 'lost', by {by}, 20" in reported
    assert reported.count("forgotten") == 2
