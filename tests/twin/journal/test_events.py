"""Series, events and exports of a log."""

from contextlib import closing
from pathlib import Path
from sqlite3 import Connection

import pytest

from lupin_twin.core.past import (
    EVERY_TAG,
    SILENCE_NS,
    Event,
    NotRemembered,
    SeriesPast,
    SeriesRequest,
)
from lupin_twin.journal.queries import series
from lupin_twin.journal.schema import open_reader
from lupin_twin.journal.writes import LOT, Export, rows
from tests.support.journal import SECOND, inspection, scan
from tests.support.log_life import BEGUN, HOUR, LATEST, MINUTE, lived

END = BEGUN + (LATEST + 200) * MINUTE


def query(
    connection: Connection,
    event: Event,
    tag_id: str = EVERY_TAG,
    *,
    start: int = 0,
    end: int = 0,
    now: int = END,
) -> SeriesPast:
    return series(connection, SeriesRequest(tag_id, event, start, end), now)


def reported(answer: SeriesPast) -> list[tuple[int, float]]:
    assert not answer.is_bucketed
    return list(zip(answer.stamps_ns, answer.means, strict=True))


def test_of_deleted_inspections_the_presence_of_a_pest_is_known(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        life.write([inspection(at_ns=BEGUN, anomaly=True)])
        life.delete(BEGUN + HOUR)
        life.write(
            [inspection(at_ns=BEGUN + 2 * HOUR, anomaly=True), inspection(at_ns=BEGUN + 3 * HOUR)]
        )
        assert reported(query(life.connection, Event.PESTS_SEEN)) == [(BEGUN, 1.0)]
        assert reported(query(life.connection, Event.PESTS_CLEARED)) == [(BEGUN + 3 * HOUR, 0.0)]


def test_runs_are_intervals_of_the_period(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite", [("back", 30)]) as life:
        life.write([scan(at_ns=BEGUN + 100 * MINUTE)])
        log = life.connection

        def runs(start: int, end: int) -> list[tuple[int, float]]:
            return reported(query(log, Event.RUNS, start=start, end=end))

        assert runs(BEGUN, BEGUN + 200 * MINUTE) == [
            (BEGUN, 30 * 60.0),
            (BEGUN + 30 * MINUTE, 170 * 60.0),
        ]
        assert runs(BEGUN + 40 * MINUTE, BEGUN + 50 * MINUTE) == [(BEGUN + 40 * MINUTE, 600.0)]
        answer = query(log, Event.RUNS)
        assert answer.minima == answer.maxima == (1.0,)


def test_a_silence_is_longer_than_ten_minutes_and_than_three_usual_intervals(
    tmp_path: Path,
) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        log = life.connection
        stamps = [0, 1, 2, 3, 600, 603, 1203, 1203 + 601]
        life.write(scan(at_ns=BEGUN + second * SECOND) for second in stamps)
        last = BEGUN + stamps[-1] * SECOND
        expected = [(BEGUN + 1203 * SECOND, 601.0)]
        assert reported(query(log, Event.SILENCES, now=last + SILENCE_NS)) == expected
        # One that continues lasts until now.
        assert reported(query(log, Event.SILENCES, now=last + 700 * SECOND))[-1] == (last, 700.0)
        cut = query(log, Event.SILENCES, end=last + 9 * SECOND, now=last + 9000 * SECOND)
        assert reported(cut)[-1] == (last, 9.0)
    with lived(tmp_path / "hourly.sqlite") as life:
        log = life.connection
        life.write([scan(at_ns=BEGUN + hour * HOUR) for hour in (0, 1, 2, 5, 9)])
        assert reported(query(log, Event.SILENCES, now=BEGUN + 9 * HOUR)) == []
        seconds = [hour * 3600 for hour in range(5)]
        seconds += [7 * 3600, 10 * 3600 + 1, 11 * 3600 + 1]
        life.write([scan("9", at_ns=BEGUN + second * SECOND) for second in seconds])
        silences = reported(query(log, Event.SILENCES, "9", now=BEGUN + seconds[-1] * SECOND))
        assert silences == [(BEGUN + 7 * HOUR, 3 * 3600 + 1.0)]


def test_a_rest_between_two_patrols_is_no_silence(tmp_path: Path) -> None:
    rounds = [20 * MINUTE * number for number in (*range(4), *range(30, 34))]
    with lived(tmp_path / "j.sqlite") as life:
        life.write(
            scan(str(tag), at_ns=BEGUN + at_ns + 5 * SECOND * tag)
            for at_ns in rounds
            for tag in range(6)
        )
        end = BEGUN + rounds[-1] + 20 * MINUTE
        # Also where nothing but a rest is in the period.
        for start in (BEGUN, BEGUN + rounds[-2] + 5 * MINUTE):
            found = reported(query(life.connection, Event.SILENCES, start=start, now=end))
            away = (BEGUN + rounds[3] + 25 * SECOND, 27 * 20 * 60 - 25.0)
            assert found == ([away] if start == BEGUN else [])


def test_more_scans_of_a_tag_do_not_make_its_usual_interval_dearer(tmp_path: Path) -> None:
    """Counted in SQLite's own steps: a year's timeline was 25 times slower without this."""
    with lived(tmp_path / "j.sqlite") as life:
        steps: list[int] = []

        def step() -> int:
            steps[-1] += 1
            return 0

        for first in (0, 200):
            life.write([scan(at_ns=BEGUN + n * MINUTE) for n in range(first, first + 200)])
            steps.append(0)
            life.connection.set_progress_handler(step, 1)
            assert reported(query(life.connection, Event.SILENCES, now=BEGUN + 900 * MINUTE))
            life.connection.set_progress_handler(None, 1)
        assert steps[1] < 1.5 * steps[0], steps


def test_silences_in_deleted_years_are_still_reported(tmp_path: Path) -> None:
    stamps = [BEGUN + minute * MINUTE for minute in (*range(30), *range(90, 120))]
    with lived(tmp_path / "j.sqlite") as life:
        life.write(scan(at_ns=stamp_ns) for stamp_ns in stamps)
        life.delete(BEGUN + 110 * MINUTE)
        answer = query(life.connection, Event.SILENCES, start=BEGUN, now=BEGUN + 121 * MINUTE)
    assert reported(answer) == [(BEGUN + 29 * MINUTE, 61 * 60.0)]


def temperature(start_ns: int = 0, end_ns: int = 0, points: int = 500) -> SeriesRequest:
    return SeriesRequest("7", "temperature", start_ns, end_ns, points)


def test_as_many_readings_as_points_come_singly_and_more_in_buckets(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        life.write(scan(at_ns=BEGUN + n * SECOND, temperature=float(n)) for n in range(10))
        exact = series(life.connection, temperature(BEGUN, BEGUN + 10 * SECOND, 10), END)
        assert exact.means == tuple(map(float, range(10)))
        assert exact.counts == (1,) * 10
        assert not exact.is_bucketed
        fewer = series(life.connection, temperature(BEGUN, BEGUN + 10 * SECOND, 9), END)
        assert fewer.is_bucketed
        assert fewer.counts == (2, *(1,) * 8)


def test_too_many_scans_come_by_the_hour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        life.write(scan(at_ns=BEGUN + n * MINUTE) for n in range(300))
        request = temperature(BEGUN, BEGUN + 300 * MINUTE, 299)
        monkeypatch.setattr("lupin_twin.journal.counts.MAX_ROWS", 300)
        assert len(series(life.connection, request, END).stamps_ns) > 200
        monkeypatch.setattr("lupin_twin.journal.counts.MAX_ROWS", 299)
        assert series(life.connection, request, END).counts == (60,) * 5


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
