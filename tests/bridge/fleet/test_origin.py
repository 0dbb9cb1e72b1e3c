"""What no robot observed says so, on the overview and below its site's path."""

from dataclasses import replace
from pathlib import Path

from lupin_twin.core.diagnostics import Origin
from lupin_twin.core.parameters import World
from tests.support.archive import Archive, forward_once
from tests.support.fleet import fleet, scans_lately, wall, write
from tests.support.journal import recording

# Site, what its twin says, by which clock, and what is shown.
SITES: tuple[tuple[str, Origin, bool, str], ...] = (
    ("robot", "robot", False, "robot"),
    ("simulated", "simulated", False, "simulated"),
    ("recorded", "recorded", True, "recorded"),
    # By such a clock no robot works.
    ("clock", "robot", True, "sim_time"),
)


def forward(archive: Archive, journal: Path, origin: Origin, *, is_simulated: bool = False) -> None:
    with recording(
        journal, replace(wall(), is_simulated=is_simulated), world=World(origin)
    ) as twin:
        for row in scans_lately():
            twin.write(row)
    forward_once(archive, journal)


def test_where_it_comes_from_is_in_the_log(archive: Archive, tmp_path: Path) -> None:
    for site, origin, is_simulated, _ in SITES:
        forward(archive.of_site(site), tmp_path / site, origin, is_simulated=is_simulated)
    write(tmp_path / "gh1", scans_lately())  # which does not say it
    forward_once(archive, tmp_path / "gh1")
    with fleet(archive) as page:
        for site, said in [*((site, said) for site, _, _, said in SITES), ("gh1", "unknown")]:
            page.site(site, origin=said)
            assert page.http.get(f"/sites/{site}/readyz").json()["origin"] == said
        # A journal that is used for something else says that.
        forward(archive.of_site("simulated"), tmp_path / "simulated", "robot")
        page.site("simulated", origin="robot")
