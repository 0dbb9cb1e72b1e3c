"""Damage of a journal: found row by row, quarantined, and the rest salvaged."""

import random
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from lupin_twin.core.state import Write
from lupin_twin.journal.appending import Appender, simulated
from lupin_twin.journal.checking import find_all_damage
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.retention import kept
from lupin_twin.journal.salvage import replace_journal, salvage
from lupin_twin.journal.schema import DamagedFile, open_reader, open_writer
from tests.support.journal import (
    NOW,
    SECOND,
    append,
    inspection,
    is_whole,
    known,
    pin,
    scan,
    select,
)

TAGS = [str(tag) for tag in range(20)]
ROWS: list[Write] = [
    *(pin(tag) for tag in TAGS),
    *(inspection(tag) for tag in TAGS),
    *(scan(tag, NOW + n * SECOND, temperature=n / 7) for n in range(100) for tag in TAGS),
]
SCANS = "SELECT seq, series, stamp_ns, readings FROM scan"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("whole") / "j.sqlite"
    append(path, ROWS)
    return path


@pytest.fixture
def damaged(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(whole, tmp_path / "damaged.sqlite"))


def salvaged(damaged: Path) -> Path:
    salvage(damaged)
    assert is_whole(damaged)
    with closing(open_reader(damaged)) as connection:
        assert list(find_all_damage(connection, lambda what, share: None)) == []
    return damaged


def scans(path: Path) -> set[tuple[object, ...]]:
    return set(select(path, SCANS))


def test_a_sound_file_is_salvaged_completely(whole: Path, damaged: Path) -> None:
    damaged.with_name("damaged.sqlite.salvage").write_text("left by a salvage that was killed")
    new = salvaged(damaged)
    assert known(new) == known(whole)
    assert select(new, "SELECT count(*) FROM meta WHERE key = 'lost_ns:1'") == [(1,)]
    for table in ("run", "series", "scan", "look", "place", "hour", "tally", "event"):
        every = f"SELECT * FROM {table}"
        if table != "run":  # reading the latest state starts a run
            assert set(select(new, every)) == set(select(whole, every)), table


def test_rows_in_the_wal_beside_it_are_salvaged_too(whole: Path, tmp_path: Path) -> None:
    path = Path(shutil.copy(whole, tmp_path / "j.sqlite"))
    with closing(open_writer(path)) as writer:
        writer.execute("INSERT INTO meta VALUES ('local', 'last', 'word')")
        for end in ("", "-wal"):
            shutil.copy(f"{path}{end}", tmp_path / f"damaged.sqlite{end}")
    new = salvaged(tmp_path / "damaged.sqlite")
    assert select(new, "SELECT value FROM meta WHERE key = 'last'") == [("word",)]
    assert scans(new) == scans(whole)


def test_a_new_file_that_is_not_complete_replaces_nothing(damaged: Path, tmp_path: Path) -> None:
    """As on a full disk: SQLite closes a file without an error, and its last rows stay in a WAL."""
    new = tmp_path / "new"
    before = damaged.read_bytes()
    new.write_text("most rows")
    new.with_name("new-wal").write_text("the last rows")
    with pytest.raises(OSError, match="could not be moved"):
        replace_journal(damaged, new, ".old")
    assert damaged.read_bytes() == before


@pytest.mark.parametrize("share", [0.9, 0.5, 0.3])
def test_the_rest_of_a_truncated_file_is_read(whole: Path, damaged: Path, share: float) -> None:
    size = damaged.stat().st_size
    with damaged.open("rb+") as file:
        file.truncate(int(size * share))
    found = scans(salvaged(damaged))
    assert found < scans(whole)
    assert len(found) > (share - 0.2) * 2000


def test_deleted_rows_do_not_come_back_but_their_hours_do(tmp_path: Path) -> None:
    path = tmp_path / "damaged.sqlite"
    append(path, [scan("7", NOW + n * 60 * SECOND, a=float(n)) for n in range(500)])
    hours = set(select(path, "SELECT * FROM hour"))
    with closing(open_writer(path)) as connection:
        connection.execute("DELETE FROM scan WHERE seq <= 190")
        until = NOW + 189 * 60 * SECOND  # in the middle of an hour
        connection.execute(f"INSERT INTO meta VALUES ('local', 'purged_ns:1', '{until}')")
        connection.execute("INSERT INTO meta VALUES ('local', 'purged_seq', '190')")
    new = salvaged(path)
    assert select(new, "SELECT min(seq), count(*) FROM scan") == [(191, 310)]
    assert set(select(new, "SELECT * FROM hour")) == hours


def test_counts_that_cannot_be_read_are_made_again_of_the_rows(whole: Path, damaged: Path) -> None:
    root = "SELECT rootpage FROM sqlite_schema WHERE name IN ('hour', 'tally', 'event')"
    with damaged.open("rb+") as file:
        for (page,) in select(whole, root):
            assert isinstance(page, int)
            file.seek((page - 1) * 1024)
            file.write(b"\xa5" * 1024)
    new = salvaged(damaged)
    for table, shown in (
        ("hour", "series, hour, sensor, n, low, high"),
        ("tally", "*"),
        ("event", "*"),
    ):
        every = f"SELECT {shown} FROM {table}"
        assert set(select(new, every)) == set(select(whole, every)), table


def test_of_overwritten_pages_the_others_are_read(whole: Path, damaged: Path) -> None:
    with damaged.open("rb+") as file:
        for at in range(20, damaged.stat().st_size // 1024, 20):
            file.seek(at * 1024)
            file.write(b"\xa5" * 1024)
    found = scans(salvaged(damaged))
    assert found < scans(whole)
    assert len(found) > 1000


@pytest.mark.parametrize("seed", range(6))
def test_a_flipped_byte_costs_at_most_its_own_page(whole: Path, damaged: Path, seed: int) -> None:
    at = random.Random(seed).randrange(100, damaged.stat().st_size)
    with damaged.open("rb+") as file:
        file.seek(at)
        (byte,) = file.read(1)
        file.seek(at)
        file.write(bytes([byte ^ 0x21]))
    new = salvaged(damaged)
    # A lost series loses its scans too: a hundred of them.
    lost = scans(whole) - scans(new)
    assert len(lost) < 130
    assert len(scans(new) - scans(whole)) <= 1


@pytest.mark.parametrize("text", [b"local", b"[7.0]"])
def test_an_invalid_row_is_left_out(whole: Path, damaged: Path, text: bytes) -> None:
    content = bytearray(damaged.read_bytes())
    at = content.index(b"robotm1[7.0]")
    content[content.rindex(text, 0, at + 12)] ^= 0x20
    damaged.write_bytes(content)
    assert len(scans(whole) - scans(salvaged(damaged))) == 1


@pytest.mark.parametrize("text", ["9x", "9" * 19, "9" * 20, "9" * 5_000])
@pytest.mark.parametrize(
    "key", ["last_seq", "purged_seq", "purged_ns:1", "lost_ns:1", "simulated_from_ns"]
)
def test_a_fact_that_is_no_number_is_damage_and_is_left_out(
    whole: Path, damaged: Path, key: str, text: str
) -> None:
    def read(path: Path) -> None:
        with closing(open_writer(path)) as connection:
            Appender(connection)
            kept(connection)
            simulated(connection)

    changed(damaged, f"INSERT OR REPLACE INTO meta VALUES ('local', '{key}', '{text}')")
    with pytest.raises(DamagedFile, match=f"{key} in the journal is '9.*', which is not a number"):
        read(damaged)
    new = salvaged(damaged)
    read(new)
    assert scans(new) == scans(whole)


def test_new_numbers_are_beyond_all_that_may_be_lost(damaged: Path) -> None:
    new = salvaged(damaged)
    append(new, [scan("new", NOW + 999 * SECOND)])
    ((number,),) = select(
        new, "SELECT seq FROM scan JOIN series USING (site, series) WHERE tag = 'new'"
    )
    assert isinstance(number, int)
    assert number > len(ROWS) + 1_000_000


def test_a_file_that_is_no_database_yields_nothing(tmp_path: Path) -> None:
    text = tmp_path / "damaged.sqlite"
    text.write_text("no such thing" * 1000)
    assert scans(salvaged(text)) == set()


@pytest.mark.parametrize("seed", range(4))
def test_salvage_ends_whatever_is_on_the_pages(whole: Path, damaged: Path, seed: int) -> None:
    chance = random.Random(seed)
    content = bytearray(damaged.read_bytes())
    for _ in range(len(content) // 20):
        content[chance.randrange(len(content))] = chance.randrange(256)
    damaged.write_bytes(content)
    salvaged(damaged)


def test_what_the_disk_cannot_read_is_lost_alone(
    whole: Path, damaged: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Or the salvage would fail again and again, and nothing be recorded meanwhile."""

    class BadDisk(sqlite3.Connection):
        def execute(self, sql: str, values: Any = ()) -> sqlite3.Cursor:
            if sql.startswith("SELECT seq, * FROM scan") and 1_000 in next(
                zip(*super().execute(sql, values), strict=True), ()
            ):
                error = sqlite3.OperationalError("disk I/O error")
                error.sqlite_errorcode = sqlite3.SQLITE_IOERR_READ
                raise error
            return super().execute(sql, values)

    monkeypatch.setattr("sqlite3.connect", partial(sqlite3.connect, factory=BadDisk))
    assert len(scans(whole) - scans(salvaged(damaged))) == 1


@pytest.mark.parametrize("size", [100, 1024])
def test_without_its_first_page_all_is_read(whole: Path, damaged: Path, size: int) -> None:
    content = damaged.read_bytes()
    damaged.write_bytes(bytes(size) + content[size:])
    assert scans(salvaged(damaged)) == scans(whole)
    assert not any(damaged.parent.glob("*.mended*"))


def test_a_damaged_file_is_quarantined_with_its_wal_and_never_overwritten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("time.strftime", lambda *_: "20261121T141500Z")
    path = tmp_path / "j.sqlite"
    names = []
    for text in ("first", "second"):
        path.write_text(text)
        path.with_name("j.sqlite-wal").write_text(text + "'s log")
        path.with_name("j.sqlite-shm").write_text("index")
        names.append(salvage(path))
    assert [name.name for name in names] == [
        "j.sqlite.damaged-20261121T141500Z",
        "j.sqlite.damaged-20261121T141500Z-1",
    ]
    assert [name.read_text() for name in names] == ["first", "second"]
    logs = [name.with_name(name.name + "-wal").read_text() for name in names]
    assert logs == ["first's log", "second's log"]
    assert sorted(tmp_path.iterdir()) == sorted(
        [path, *names, *(name.with_name(name.name + "-wal") for name in names)]
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    made = tmp_path / "j.sqlite"
    scans = [scan(at_ns=NOW + n * SECOND, a=n / 3, b=float(n)) for n in range(300)]
    append(made, [pin(), inspection(), *scans])
    return made


def damage(path: Path) -> list[str]:
    with closing(open_reader(path)) as connection:
        return list(find_all_damage(connection, lambda what, share: None))


def changed(path: Path, sql: str) -> None:
    with closing(open_writer(path)) as connection:
        connection.execute(sql)


def test_a_sound_file_passes(path: Path) -> None:
    assert damage(path) == []


@pytest.mark.parametrize("where", ["structure", "scan"])
def test_an_interruption_is_no_damage(where: str, path: Path) -> None:
    with closing(open_reader(path)) as connection:

        def report(what: str, share: float) -> None:
            if what == where:
                connection.set_progress_handler(lambda: 1, 1)

        with pytest.raises(sqlite3.OperationalError, match="interrupted"):
            list(find_all_damage(connection, report))


@pytest.mark.parametrize(
    ("sql", "message"),
    [
        ("UPDATE scan SET readings = '[1.0]' WHERE seq = 7", "scan 7 of tag '7' is not what was"),
        ("UPDATE scan SET readings = '[1.0,' WHERE seq = 7", "scan 7 of tag '7' is not what was"),
        ("UPDATE scan SET series = 99 WHERE seq = 7", "scan 7 of tag None is not what was"),
        ("UPDATE scan SET status = 'x' WHERE seq = 7", "scan 7 of tag '7' is not what was"),
        (
            "UPDATE scan SET readings = '[1.0,[]]' WHERE seq = 7",
            "scan 7 of tag '7' is not what was",
        ),
        ("UPDATE look SET blooms = '[[1,2]]'", "look 2 of tag '7' is not what was written"),
        ("UPDATE look SET blooms = '[['", "look 2 of tag '7' is not what was written"),
        ("UPDATE look SET run = 5", "look 2 of tag '7' is not what was written"),
        ("UPDATE place SET run = 5", "place 1 of tag '7' is not what was written"),
        ("UPDATE run SET joins = 3", "run 1 joins run 3, which is missing"),
        ("INSERT INTO meta VALUES ('local', 'lost_ns:1', 'x')", "lost_ns:1 is 'x', which is not"),
    ],
)
def test_damage_is_reported_by_row(path: Path, sql: str, message: str) -> None:
    changed(path, sql)
    assert any(found.startswith(message) for found in damage(path))


def test_all_damage_is_found_and_progress_is_reported(path: Path) -> None:
    changed(path, "UPDATE scan SET readings = '[]' WHERE seq % 2")
    reported: list[tuple[str, float]] = []

    def found() -> Iterator[str]:
        with closing(open_reader(path)) as connection:
            yield from find_all_damage(
                connection, lambda what, share: reported.append((what, share))
            )

    assert len([wrong for wrong in found() if wrong.startswith("scan")]) == 150
    order = ["structure", "scan", "look", "place"]
    assert list(dict.fromkeys(what for what, _ in reported)) == order
    assert {what: share for what, share in reported if what != "structure"} == dict.fromkeys(
        order[1:], 1.0
    )


@pytest.mark.parametrize("text", ["[1,", "[1],[2]", "7", '["x",1]', "", "[[1]]"])
def test_a_query_that_meets_an_invalid_list_of_numbers_reports_damage(
    path: Path, text: str
) -> None:
    changed(path, f"UPDATE scan SET readings = '{text}'")
    with closing(open_reader(path)) as connection, pytest.raises(DamagedFile):
        state_at(connection, NOW + 300 * SECOND, "map")
