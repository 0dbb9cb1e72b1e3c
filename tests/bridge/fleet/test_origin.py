"""What no robot observed says so, on the overview and below its site's path."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lupin_twin.core.diagnostics import Origin
from tests.support.archive import Archive, forward_once
from tests.support.fleet import fleet, scans_lately, wall, write
from tests.support.journal import recording


@pytest.mark.parametrize(
    ("origin", "is_simulated", "said"),
    [
        ("robot", False, "robot"),
        ("simulated", False, "simulated"),
        ("recorded", True, "recorded"),
        # By such a clock no robot works.
        ("robot", True, "sim_time"),
    ],
)
def test_where_it_comes_from_is_in_the_log(
    archive: Archive, tmp_path: Path, origin: Origin, is_simulated: bool, said: str
) -> None:
    journal = tmp_path / "journal.sqlite"
    with recording(journal, replace(wall(), is_simulated=is_simulated), origin=origin) as twin:
        for row in scans_lately():
            twin.write(row)
    forward_once(archive, journal)
    with fleet(archive) as page:
        page.site(origin=said)
        assert page.http.get("/sites/gh1/readyz").json()["origin"] == said


def test_a_journal_that_is_used_for_something_else_says_that(
    archive: Archive, tmp_path: Path
) -> None:
    journal = tmp_path / "journal.sqlite"
    origins: tuple[Origin, ...] = ("simulated", "robot")
    with fleet(archive) as page:
        for origin in origins:
            with recording(journal, wall(), origin=origin):
                pass
            forward_once(archive, journal)
            page.site(origin=origin)


def test_of_a_log_that_does_not_say_it_is_not_known(archive: Archive, tmp_path: Path) -> None:
    journal = tmp_path / "journal.sqlite"
    write(journal, scans_lately())
    forward_once(archive, journal)
    with fleet(archive) as page:
        page.site(origin="unknown", last_verdict="healthy")
        assert page.http.get("/sites/gh1/readyz").json()["origin"] == "unknown"
