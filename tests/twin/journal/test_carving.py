from __future__ import annotations

import random
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from lupin_twin.journal.carving import carve
from lupin_twin.journal.reading import LOOK, SCAN
from lupin_twin.journal.schema import PAGE_SIZE, open_reader
from lupin_twin.state import Bloom
from tests.support.journal import NOW, SECOND, kept, look, pin, scan

COLUMNS = (len(SCAN.split(",")), len(LOOK.split(",")))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A journal with rows that go on on other pages, and one that is as long as a page."""
    made = tmp_path_factory.mktemp("whole") / "j.sqlite"
    large = look("9", NOW + 7)
    bloom = Bloom(1.5, 2.5, 0.3, 0.25, "lupin", 0.8, anomaly=False)
    flower = large.flower
    looks = [
        type(large)(
            "9", NOW + n, NOW, type(flower)("lupin", 1.0, False, n, 0, (bloom,) * n), "robot", "m"
        )
        for n in range(0, 200, 7)
    ]
    kept(
        made,
        [pin(), *(scan(at_ns=NOW + n * SECOND, a=n / 3, b=2.0) for n in range(500)), *looks],
    )
    return made


def carved(path: Path) -> set[tuple[Any, ...]]:
    return {row for lot in carve(path, PAGE_SIZE, COLUMNS) for row in lot}


def written(path: Path) -> set[tuple[Any, ...]]:
    with closing(open_reader(path)) as connection:
        return {
            row
            for table, what in (("scan", SCAN), ("look", LOOK))
            for row in connection.execute(f"SELECT {what} FROM {table}")
        }


def test_every_row_is_found_as_sqlite_reads_it(path: Path) -> None:
    rows = written(path)
    assert len(rows) == 529
    assert rows <= carved(path)


def test_other_tables_rows_are_left(path: Path) -> None:
    # A run has as many columns as a scan; whoever takes the rows checks them.
    assert len(carved(path) - written(path)) == 1


@pytest.mark.parametrize("seed", range(20))
def test_whatever_stands_on_the_pages_it_ends(path: Path, tmp_path: Path, seed: int) -> None:
    chance = random.Random(seed)
    broken = bytearray(path.read_bytes())
    for _ in range(200):
        at = chance.randrange(len(broken))
        broken[at : at + 4] = chance.randbytes(4)
    (tmp_path / "broken").write_bytes(broken[: chance.randrange(len(broken))])
    carved(tmp_path / "broken")
