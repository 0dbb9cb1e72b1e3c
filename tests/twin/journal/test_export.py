from contextlib import closing
from pathlib import Path

import pytest

from lupin_twin.core.past import NotRemembered
from lupin_twin.journal.schema import open_reader
from lupin_twin.journal.writes import LOT, Export, rows
from tests.support.journal import SECOND, scan
from tests.support.log_life import BEGUN, LATEST, MINUTE, lived

END = BEGUN + (LATEST + 200) * MINUTE


def test_batches_come_on_demand_and_nothing_stays_open_between_them(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with lived(path) as life, closing(open_reader(path)) as reader:
        life.write(scan(at_ns=BEGUN + n * SECOND) for n in range(3 * LOT))
        lots = rows(reader, 0, END)
        taken = len(next(lots))
        assert 0 < taken <= LOT
        assert not reader.in_transaction
        life.write([scan("8", BEGUN - SECOND)])
        # The whole WAL can be checkpointed while an export waits for its reader.
        checkpoint = life.connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
        assert checkpoint == (0, 0, 0)
        assert sum(map(len, lots)) == 3 * LOT - taken


def test_a_deletion_of_rows_still_to_come_ends_the_export(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_twin.journal.writes.STRETCH", 400)
    total = 3_000
    with lived(tmp_path / "j.sqlite") as life:
        life.write(scan(at_ns=BEGUN + n * SECOND) for n in range(total))
        life.delete(BEGUN + 100 * SECOND)  # long ago
        whole, late, early = (Export(0, END, None, None) for _ in range(3))

        def taken(export: Export, at_least: int) -> int:
            reported = 0
            while reported < at_least:
                reported += len(export.step(life.connection) or [])
            return reported

        taken(late, 1)
        reported = taken(whole, 2_000)
        life.delete(BEGUN + 1_000 * SECOND)
        # An export past these rows gets the rest.
        while (found := whole.step(life.connection)) is not None:
            reported += len(found)
        assert reported == total - 100
        with pytest.raises(NotRemembered, match="deleted while"):
            taken(late, total)
        # And one that has not started begins later.
        left = 0
        while (found := early.step(life.connection)) is not None:
            left += len(found)
        assert left == total - 1_000
