from __future__ import annotations

import random
import shutil
from pathlib import Path

import pytest

from lupin_twin.journal.packing import unpack_buckets
from lupin_twin.journal.rollups import Folding
from lupin_twin.journal.rows import Row
from lupin_twin.journal.salvage import Salvage, set_aside
from lupin_twin.journal.schema import open_writer, transaction
from tests.support.journal import NOW, SECOND, is_whole, kept, known, look, pin, scan, select

TAGS = [str(tag) for tag in range(20)]
ROWS: list[Row] = [
    *(pin(tag) for tag in TAGS),
    *(scan(tag, NOW + n * SECOND, temperature=n / 7) for n in range(100) for tag in TAGS),
    *(look(tag) for tag in TAGS),
]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A journal of 2,000 scans, all of it in the file and in the rollups."""
    path = tmp_path_factory.mktemp("whole") / "j.sqlite"
    kept(path, ROWS)
    connection = open_writer(path)
    folding = Folding(connection, len(ROWS))
    has_more = True
    while has_more:
        with transaction(connection):
            has_more = folding.step()
    connection.close()
    return path


@pytest.fixture
def damaged(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(whole, tmp_path / "damaged.sqlite"))


def salvaged(damaged: Path) -> Path:
    new = damaged.with_name("new.sqlite")
    connection = open_writer(new)
    for _ in Salvage(damaged, connection).steps():
        pass
    connection.close()
    assert is_whole(new)
    return new


def scans(path: Path) -> set[tuple[object, ...]]:
    return set(select(path, "SELECT id, tag_id, stamp_ns, readings FROM scans"))


def test_a_whole_file_comes_back_whole(whole: Path, damaged: Path) -> None:
    new = salvaged(damaged)
    assert scans(new) == scans(whole)
    assert known(new) == known(whole)
    assert set(select(new, "SELECT * FROM rollup")) == set(select(whole, "SELECT * FROM rollup"))
    (folded,) = select(new, "SELECT value FROM meta WHERE key = 'rolled_id'")
    assert folded == (len(ROWS),)


@pytest.mark.parametrize("share", [0.9, 0.5, 0.3])
def test_of_a_truncated_file_what_is_left_is_read(whole: Path, damaged: Path, share: float) -> None:
    size = damaged.stat().st_size
    with damaged.open("rb+") as file:
        file.truncate(int(size * share))
    found = scans(salvaged(damaged))
    assert found < scans(whole)
    assert len(found) > (share - 0.2) * 2000


@pytest.mark.parametrize("share", [0.95, 0.5])
def test_rows_are_found_although_the_top_of_their_tree_was_cut_off(
    tmp_path: Path, share: float
) -> None:
    """Written in one go, the page above all others comes last."""
    path = tmp_path / "damaged.sqlite"
    rows = [scan("7", NOW + n * SECOND, a=float(n)) for n in range(5000)]
    kept(path, rows)
    with path.open("rb+") as file:
        file.truncate(int(path.stat().st_size * share))
    new = salvaged(path)
    found = select(new, "SELECT stamp_ns FROM scans ORDER BY id")
    assert len(found) > (share - 0.1) * 5000
    assert {stamp for (stamp,) in found} <= {row.stamp_ns for row in rows}


def test_what_was_given_up_does_not_come_back(tmp_path: Path) -> None:
    path = tmp_path / "damaged.sqlite"
    kept(path, [scan("7", NOW + n * SECOND, a=float(n)) for n in range(5000)])
    connection = open_writer(path)
    connection.execute("DELETE FROM scan WHERE id <= 2000")
    connection.execute("INSERT INTO meta VALUES ('purged_id', 2000)")
    connection.close()
    with path.open("rb+") as file:
        file.truncate(int(path.stat().st_size * 0.9))
    ((first,),) = select(salvaged(path), "SELECT min(id) FROM scan")
    assert first == 2001


def test_of_overwritten_pages_what_lies_beside_them_is_read(whole: Path, damaged: Path) -> None:
    with damaged.open("rb+") as file:
        for at in range(20, damaged.stat().st_size // 1024, 20):
            file.seek(at * 1024)
            file.write(b"\xa5" * 1024)
    found = scans(salvaged(damaged))
    assert found < scans(whole)
    assert len(found) > 1000


@pytest.mark.parametrize("seed", range(30))
def test_a_flipped_byte_gives_no_wrong_value(whole: Path, damaged: Path, seed: int) -> None:
    at = random.Random(seed).randrange(100, damaged.stat().st_size)
    with damaged.open("rb+") as file:
        file.seek(at)
        (byte,) = file.read(1)
        file.seek(at)
        file.write(bytes([byte ^ 0x21]))
    new = salvaged(damaged)
    right = {(tag_id, stamp_ns, readings) for _, tag_id, stamp_ns, readings in scans(whole)}
    names = set(TAGS)
    for _, tag_id, stamp_ns, readings in scans(new):
        if tag_id in names:  # the byte may be that of a tag's name
            assert (tag_id, stamp_ns, readings) in right


def test_new_numbers_are_past_all_that_may_be_lost(damaged: Path) -> None:
    new = salvaged(damaged)
    kept(new, [scan("new", NOW + 999 * SECOND)])
    ((number,),) = select(new, "SELECT id FROM scans WHERE tag_id = 'new'")
    assert isinstance(number, int)
    assert number > len(ROWS) + 1_000_000


def test_what_is_no_database_gives_nothing(tmp_path: Path) -> None:
    text = tmp_path / "damaged.sqlite"
    text.write_text("no such thing" * 1000)
    assert scans(salvaged(text)) == set()


def test_salvage_that_is_cut_short_goes_on_where_it_was(whole: Path, damaged: Path) -> None:
    new = damaged.with_name("new.sqlite")
    connection = open_writer(new)
    steps = Salvage(damaged, connection).steps()
    for _ in range(3):
        next(steps)
    del steps
    connection.close()
    assert scans(salvaged(damaged)) == scans(whole)


def test_rollups_that_cannot_be_read_are_folded_again(damaged: Path) -> None:
    connection = open_writer(damaged)
    connection.execute("DROP TABLE meta")
    connection.close()
    new = salvaged(damaged)
    assert select(new, "SELECT * FROM rollup") == []
    connection = open_writer(new)
    folding = Folding(connection, len(ROWS))
    has_more = True
    while has_more:
        with transaction(connection):
            has_more = folding.step()
    connection.close()
    (packed,) = select(new, "SELECT buckets FROM rollup WHERE series = 1")[0]
    assert isinstance(packed, bytes)
    (bucket,) = unpack_buckets(packed, 1)
    assert (bucket.n, bucket.low) == (100, 0.0)
    assert bucket.mean == pytest.approx(99 / 14)


def test_what_is_set_aside_keeps_its_log_and_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    names = []
    for text in ("first", "second"):
        path.write_text(text)
        path.with_name("j.sqlite-wal").write_text(text + "'s log")
        path.with_name("j.sqlite-shm").write_text("index")
        names.append(set_aside(path, "20261121T141500Z"))
    assert [name.name for name in names] == [
        "j.sqlite.damaged-20261121T141500Z",
        "j.sqlite.damaged-20261121T141500Z-1",
    ]
    assert [name.read_text() for name in names] == ["first", "second"]
    logs = [name.with_name(name.name + "-wal").read_text() for name in names]
    assert logs == ["first's log", "second's log"]
    assert sorted(tmp_path.iterdir()) == sorted(
        [*names, *(name.with_name(name.name + "-wal") for name in names)]
    )
