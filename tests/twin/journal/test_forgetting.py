"""Forgetting a tag, by the command line, and what a twin knows that is started after it."""

from __future__ import annotations

import getpass
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.messages import look, scan
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, bridge

HOME = {"1": (1.0, 1.0), "2": (3.0, 1.0), "3": (3.0, 3.0)}
LOST = "lost"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """The journal of a twin that has ended, with three tags at home and a lost one, the newest."""
    path = tmp_path / "j.sqlite"
    with twin(path) as running:
        for tag_id, at in HOME.items():
            running.peer.observe(scan(tag_id, {"co2": 400.0}, at=at))
            running.tag(tag_id)
        running.peer.observe(
            look(LOST, "lupin", at=(900.0, 0.0), anomaly=True),
            scan(LOST, {"co2": 500.0}, at=(900.0, 0.0)),
        )
        running.tag(LOST, lambda tag: tag["readings"])
    return path


@contextmanager
def twin(path: Path) -> Iterator[Bridge]:
    """A twin with this journal, killed as soon as that has all of what the twin heard."""
    # In a domain of its own, where nothing that is latched comes from before.
    with bridge("--ros-args", "-p", f"journal:={path}") as running:
        yield running
        wait_for(
            lambda: "\nlupin_journal_rows_waiting 0.0" in running.get("/metrics").text,
            "all rows in the journal",
        )


def journal(path: Path, action: str, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "lupin_bridge.cli.command", "journal", action, *words]
    return subprocess.run(
        [*command, "--journal", str(path)],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )


def place(running: Bridge, tag_id: str) -> tuple[float, float] | None:
    pose = running.tag(tag_id)["pose"]
    position = pose["position"]
    return (position["x"], position["y"]) if pose["orientation"]["w"] else None


def exported(path: Path) -> list[str]:
    """The tags of all rows, in their order."""
    rows = journal(path, "export").stdout.splitlines()
    column = rows[0].split(",").index("tag_id")
    return [row.split(",")[column] for row in rows[1:]]


def test_a_pose_is_forgotten_and_the_next_twin_pins_the_tag_anew(path: Path) -> None:
    said = journal(path, "forget", LOST, "--pose")
    assert (said.returncode, said.stderr) == (0, "")
    assert "the pose of tag 'lost' is forgotten" in said.stdout
    with twin(path) as running:
        assert place(running, LOST) is None
        assert running.tag(LOST)["readings"][0]["value"] == 500.0
        assert {tag_id: place(running, tag_id) for tag_id in HOME} == HOME
        running.peer.observe(scan(LOST, {"co2": 510.0}, at=(1.0, 3.0)))
        running.tag(LOST, lambda tag: tag["pose"]["position"]["y"] == 3.0)
    with twin(path) as running:
        assert place(running, LOST) == (1.0, 3.0)
    assert journal(path, "check").returncode == 0


def test_all_of_a_tag_is_forgotten_and_what_comes_later_is_kept(path: Path) -> None:
    assert exported(path) == [*HOME, LOST]
    said = journal(path, "forget", LOST)
    assert (said.returncode, said.stderr) == (0, "")
    assert "1 scans, 1 inspections, 1 places; counts of the timeline still have them" in said.stdout
    assert exported(path) == [*HOME]
    with twin(path) as running:
        running.tag("3")
        assert {tag["tag_id"] for tag in running.json("/api/state")["tags"]} == set(HOME)
        running.peer.observe(scan(LOST, {"co2": 600.0}, at=(1.0, 3.0)))
        running.tag(LOST)
        assert place(running, LOST) == (1.0, 3.0)
        assert running.tag(LOST)["species"] == ""
    assert exported(path) == [*HOME, LOST]
    assert journal(path, "check").returncode == 0


def test_it_is_on_record_what_was_forgotten_by_whom_and_when(path: Path) -> None:
    assert journal(path, "forget", LOST, "--pose").returncode == 0
    assert journal(path, "forget", LOST).returncode == 0
    told = journal(path, "info").stdout
    by = getpass.getuser()
    assert f"forgotten  the pose of tag 'lost', by {by}, 20" in told
    assert f"forgotten  all of tag 'lost', by {by}, 20" in told


def test_while_a_twin_has_the_journal_nothing_is_forgotten(path: Path) -> None:
    with twin(path) as running:
        said = journal(path, "forget", LOST)
        assert (said.returncode, said.stdout) == (1, "")
        assert "is in use by /lupin_twin (process" in said.stderr
        assert said.stderr.endswith("stop the twin first\n")
        running.tag(LOST)
    assert exported(path) == [*HOME, LOST]


def test_what_is_not_known_is_named_and_nothing_is_put_on_record(path: Path) -> None:
    said = journal(path, "forget", "nobody")
    assert (said.returncode, said.stdout) == (1, "")
    assert "knows no tag 'nobody'" in said.stderr
    assert journal(path, "forget", LOST, "--pose").returncode == 0
    again = journal(path, "forget", LOST, "--pose")
    assert (again.returncode, again.stdout) == (1, "")
    assert "knows no place of tag 'lost'" in again.stderr
    assert journal(path, "info").stdout.count("forgotten") == 1
