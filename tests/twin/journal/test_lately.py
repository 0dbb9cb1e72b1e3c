"""What each tag read before a moment: those with a place and that sensor, as far back as asked."""

from __future__ import annotations

import math
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from lupin_twin.journal.lately import lately
from lupin_twin.journal.packing import unpack_numbers
from lupin_twin.journal.schema import open_reader
from lupin_twin.past import HOUR_NS
from tests.support.journal import NOW, kept, pin, scan
from tests.support.past_strategy import BEGUN, MINUTE, give_up, lived

S = 1_000_000_000


def test_the_readings_of_a_sensor_up_to_a_moment(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    degrees = [scan("a", NOW + second * S, temperature=20.0 + second) for second in range(4)]
    kept(
        path,
        [
            pin("a", NOW - S),
            pin("c", NOW - S),
            *degrees,
            scan("a", NOW + 4 * S, temperature=math.nan),
            scan("b", NOW + S, temperature=1.0),
            scan("c", NOW + S, humidity=50.0),
        ],
    )
    with closing(open_reader(path)) as reader:
        found = list(lately(reader, "temperature", NOW + 2 * S, S, 9))
        assert found == [("a", 1.5, 2.5, ((NOW + S, 21.0), (NOW + 2 * S, 22.0)))]
        ((*_, later),) = lately(reader, "temperature", NOW + 9 * S, 100 * S, 9)
        assert [value for _, value in later] == [20.0, 21.0, 22.0, 23.0]
        assert list(lately(reader, "temperature", NOW - 2 * S, 100 * S, 9)) == []


def test_of_very_many_readings_the_last_and_no_others_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [pin("a", NOW - S), *(scan("a", NOW + n * S, temperature=n) for n in range(90))])
    read = 0

    def counting(*args: Any) -> Any:
        nonlocal read
        read += 1
        return unpack_numbers(*args)

    monkeypatch.setattr("lupin_twin.journal.series.unpack_numbers", counting)
    with closing(open_reader(path)) as reader:
        ((*_, found),) = lately(reader, "temperature", NOW + 80 * S, 3600 * S, 4)
    assert found == tuple((NOW + n * S, float(n)) for n in range(77, 81))
    assert read == 4


def test_where_scans_were_given_up_the_means_of_hours(tmp_path: Path) -> None:
    hours = 5
    with lived(tmp_path / "j.sqlite", []) as reference:
        reference.write([pin("7", BEGUN)])
        reference.write(
            scan(at_ns=BEGUN + n * 20 * MINUTE, temperature=float(n)) for n in range(3 * hours)
        )
        connection = reference.file._connection
        at_ns = BEGUN + hours * HOUR_NS
        asked = (connection, "temperature", at_ns, hours * HOUR_NS, 99)
        ((*_, before),) = lately(*asked)
        assert [value for _, value in before] == [float(n) for n in range(3 * hours)]
        give_up(reference, BEGUN + 2 * HOUR_NS)
        ((*_, found),) = lately(*asked)
    assert found == tuple((BEGUN + n * HOUR_NS + HOUR_NS // 2, 3.0 * n + 1.0) for n in range(hours))
