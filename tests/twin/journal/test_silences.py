from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from lupin_twin.journal.schema import open_reader
from lupin_twin.journal.series import series
from lupin_twin.journal.silences import SILENCE_NS
from lupin_twin.past import EVERY_TAG, Event, SeriesPast, SeriesRequest
from tests.support.journal import NOW, SECOND, kept, scan
from tests.support.past_strategy import BEGUN, MINUTE, give_up, lived

END = NOW + 600_000 * SECOND


def ask(
    path: Path, tag_id: str = EVERY_TAG, *, end: int = 0, points: int = 500, now: int = END
) -> SeriesPast:
    connection = open_reader(path)
    try:
        return series(connection, SeriesRequest(tag_id, Event.SILENCES, 0, end, points), now)
    finally:
        connection.close()


def told(answer: SeriesPast) -> list[tuple[int, float]]:
    assert not answer.is_bucketed
    return list(zip(answer.stamps_ns, answer.means, strict=True))


def test_a_silence_is_longer_than_ten_minutes_and_than_three_usual_intervals(
    tmp_path: Path,
) -> None:
    path = tmp_path / "j.sqlite"
    stamps = [0, 1, 2, 3, 600, 603, 1203, 1203 + 601]
    kept(path, [scan(at_ns=NOW + second * SECOND) for second in stamps])
    last = NOW + stamps[-1] * SECOND
    assert told(ask(path, now=last + SILENCE_NS)) == [(NOW + 1203 * SECOND, 601.0)]
    # One that goes on lasts until now.
    assert told(ask(path, now=last + 700 * SECOND))[-1] == (last, 700.0)
    assert told(ask(path, end=last + 9 * SECOND, now=last + 9000 * SECOND))[-1] == (
        last,
        9.0,
    )
    hourly = tmp_path / "hourly.sqlite"
    kept(hourly, [scan(at_ns=NOW + hour * 3600 * SECOND) for hour in (0, 1, 2, 5, 9)])
    silences = told(ask(hourly, now=NOW + 9 * 3600 * SECOND))
    assert silences == []
    seconds = [hour * 3600 for hour in range(5)]
    seconds += [7 * 3600, 10 * 3600 + 1, 11 * 3600 + 1]
    kept(hourly, [scan("9", at_ns=NOW + second * SECOND) for second in seconds])
    silences = told(ask(hourly, "9", now=NOW + seconds[-1] * SECOND))
    assert silences == [(NOW + 7 * 3600 * SECOND, 3 * 3600 + 1.0)]
    kept(hourly, [scan("8", at_ns=NOW + 9 * 1800 * SECOND)])
    assert told(ask(hourly, "8", now=NOW + 18000 * SECOND)) == [(NOW + 9 * 1800 * SECOND, 1800.0)]


def test_too_many_silences_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    stamps = [NOW + (n // 2) * 3600 * SECOND + n for n in range(40)]
    kept(path, [scan(at_ns=stamp_ns) for stamp_ns in stamps])
    now = stamps[-1]
    singly = told(ask(path, points=19, now=now))
    assert len(singly) == 19
    answer = ask(path, points=18, now=now)
    assert answer.is_bucketed
    assert sum(answer.counts) == 19
    start_ns, bucket_ns = answer.start_ns, answer.bucket_ns
    assert bucket_ns is not None
    begins = Counter(start_ns + (at - start_ns) // bucket_ns * bucket_ns for at, _ in singly)
    assert dict(zip(answer.stamps_ns, answer.counts, strict=True)) == begins
    assert answer.means[0] == pytest.approx(3600.0)


def test_of_years_that_were_given_up_silences_are_still_told(tmp_path: Path) -> None:
    stamps = [BEGUN + minute * MINUTE for minute in (*range(30), *range(90, 120))]
    with lived(tmp_path / "j.sqlite", []) as reference:
        reference.write(scan(at_ns=stamp_ns) for stamp_ns in stamps)
        give_up(reference, BEGUN + 110 * MINUTE)
        request = SeriesRequest(EVERY_TAG, Event.SILENCES, BEGUN)
        answer = series(reference.file._connection, request, BEGUN + 121 * MINUTE)
    assert told(answer) == [(BEGUN + 29 * MINUTE, 61 * 60.0)]
