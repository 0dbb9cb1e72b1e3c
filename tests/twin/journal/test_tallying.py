from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lupin_twin.journal.rollups import get_meta
from lupin_twin.journal.rows import Row
from lupin_twin.journal.schema import open_writer, transaction
from lupin_twin.journal.tallying import KINDS, TALLIED, tally_step
from lupin_twin.past import HOUR_NS, SLOT_NS
from tests.support.journal import SECOND, kept, look, pin, scan, select
from tests.support.past_strategy import BEGUN

NUMBERS = ", ".join(f"{kind}_{part}" for kind in KINDS for part in ("n", "total", "low", "high"))


def tally(path: Path, steps: int = 10**6) -> bool:
    """Take some steps, as one life of a twin; returns whether there are more."""
    connection = open_writer(path)
    has_more = True
    while has_more and steps:
        steps -= 1
        with transaction(connection):
            has_more = tally_step(connection)
    connection.close()
    return has_more


def failed(at_ns: int, status: int) -> Row:
    return replace(scan(at_ns=at_ns), readings=(), status=status)


ROWS: list[Row] = [
    scan(at_ns=BEGUN, co2=1.0, temperature=2.0),
    failed(BEGUN + 1, 3),
    failed(BEGUN + 2, 1),
    pin(),
    look(at_ns=BEGUN + 200 * SECOND, anomaly=True),
    scan("8", BEGUN + 700 * SECOND, co2=1.0),
    scan("8", BEGUN + HOUR_NS, co2=1.0),
]


def test_five_minutes_and_an_hour_are_a_row_each(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, ROWS)
    assert not tally(path)
    slot, hour = BEGUN // SLOT_NS, BEGUN // HOUR_NS
    assert select(path, f"SELECT slot, first_ns, last_ns, {NUMBERS} FROM tally") == [
        (slot, BEGUN, BEGUN + 200 * SECOND, 1, 2, 2, 2, 2, 4, 1, 3, 1, 1, 1, 1),
        (slot + 2, *(BEGUN + 700 * SECOND,) * 2, 1, 1, 1, 1, 0, 0, *(None,) * 6),
        (slot + 12, *(BEGUN + HOUR_NS,) * 2, 1, 1, 1, 1, 0, 0, *(None,) * 6),
    ]
    assert select(path, f"SELECT slot, first_ns, last_ns, gap_ns, {NUMBERS} FROM tally_hour") == [
        (hour, BEGUN, BEGUN + 700 * SECOND, 500 * SECOND, 2, 3, 1, 2, 2, 4, 1, 3, 1, 1, 1, 1),
        (hour + 1, *(BEGUN + HOUR_NS,) * 2, 0, 1, 1, 1, 1, 0, 0, *(None,) * 6),
    ]


@pytest.mark.parametrize("steps", [1, 2, 3])
def test_each_is_counted_once_however_often_it_is_cut_short(
    tmp_path: Path, steps: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, path = tmp_path / "whole.sqlite", tmp_path / "j.sqlite"
    kept(whole, ROWS)
    tally(whole)
    monkeypatch.setattr("lupin_twin.journal.tallying.STEP", 2)
    # Late ones, too: the last hour is written first.
    kept(path, ROWS[-1:])
    while tally(path, steps):
        pass
    kept(path, ROWS)
    while tally(path, steps):
        pass
    for table in ("tally", "tally_hour"):
        assert select(path, f"SELECT * FROM {table}") == select(whole, f"SELECT * FROM {table}")


def test_how_far_it_has_come_stands_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, ROWS)
    tally(path)
    connection = open_writer(path)
    assert get_meta(connection, TALLIED) == len(ROWS)
    assert not tally_step(connection)
    connection.close()
