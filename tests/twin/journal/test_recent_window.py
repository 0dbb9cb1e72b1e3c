"""What each tag read before a moment: those with a place and that sensor, as far back as asked."""

from __future__ import annotations

import math
from pathlib import Path

from lupin_twin.journal.fold import recent_readings
from tests.support.log_life import BEGUN, lived, pin, scan

S = 1_000_000_000


def test_the_readings_of_a_sensor_up_to_a_moment(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        life.write([pin("a", BEGUN - S), pin("c", BEGUN - S)])
        life.write(scan("a", BEGUN + n * S, temperature=20.0 + n) for n in range(4))
        life.write(
            [
                scan("a", BEGUN + 4 * S, temperature=math.nan),
                scan("b", BEGUN + S, temperature=1.0),
                scan("c", BEGUN + S, humidity=50.0),
            ]
        )
        reader = life.connection
        found = list(recent_readings(reader, "temperature", BEGUN + 2 * S, S, 9))
        assert found == [("a", 1.5, 2.5, ((BEGUN + S, 21.0), (BEGUN + 2 * S, 22.0)))]
        ((*_, later),) = recent_readings(reader, "temperature", BEGUN + 9 * S, 100 * S, 9)
        assert [value for _, value in later] == [20.0, 21.0, 22.0, 23.0]
        assert list(recent_readings(reader, "temperature", BEGUN - 2 * S, 100 * S, 9)) == []


def test_of_very_many_readings_the_last_are_told_past_those_that_are_no_number(
    tmp_path: Path,
) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        values = [float(n) if n % 3 else math.nan for n in range(90)]
        life.write([pin("a", BEGUN - S)])
        life.write(scan("a", BEGUN + n * S, temperature=v) for n, v in enumerate(values))
        ((*_, found),) = recent_readings(
            life.connection, "temperature", BEGUN + 80 * S, 3600 * S, 4
        )
    assert found == tuple((BEGUN + n * S, float(n)) for n in (76, 77, 79, 80))
