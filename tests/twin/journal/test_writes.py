import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from lupin_twin.core.past import PastWrites, WritesRequest, recent_of
from lupin_twin.core.state import NO_FLOWER, Observation
from lupin_twin.journal.writes import recent, writes
from tests.support.journal import SECOND, inspection, pin, scan
from tests.support.log_life import BEGUN, Life, failure, lived
from tests.twin.journal.conftest import Copied

DAY = 86_400 * SECOND


def requested(connection: Any, **query: Any) -> PastWrites:
    return writes(connection, WritesRequest(**query))


def test_writes_come_in_the_order_of_receipt_and_once_each(tmp_path: Path, copied: Copied) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        life.write([scan("7", BEGUN + 5), pin("7"), inspection("7", BEGUN + 4, anomaly=True)])
        life.write([failure("8", BEGUN + 3)])
        life.write(scan("9", BEGUN + n, co2=400.0 + n, light=1.0) for n in range(7))
        whole = requested(life.connection)
        assert whole.is_all
        assert len(whole.journal) == 32
        reported = [(w.tag_id, w.stamp_ns - BEGUN, w.kind, w.status) for w in whole.writes]
        assert reported[:3] == [("7", 5, 0, 0), ("7", 4, 1, 0), ("8", 3, 0, 2)]
        seen = whole.writes[1]
        assert seen.flower is not None
        assert (seen.flower.species, seen.flower.anomaly, seen.flower.bug_count) == (
            ("lupin", True, 1)
        )
        assert whole.writes[3].readings == {"co2": 400.0, "light": 1.0}
        assert [(span.start_ns, span.end_ns) for span in whole.spans] == [(0, 2**63 - 1)]
        assert requested(copied(life.connection)) == whole

        found: list[Observation] = []
        part = requested(life.connection, max_count=3)
        while True:
            found += part.writes
            if part.is_all:
                break
            part = requested(life.connection, after=part.last, max_count=3)
        assert tuple(found) == whole.writes
        assert requested(life.connection, after=whole.last).writes == ()
        life.write([scan("7", BEGUN - 60 * SECOND)])
        late = requested(life.connection, after=whole.last)
        assert [write.stamp_ns for write in late.writes] == [BEGUN - 60 * SECOND]
        assert late.journal == whole.journal


def test_reading_from_the_beginning_is_limited(tmp_path: Path) -> None:
    now = time.time_ns()

    def count(life: Life, **query: Any) -> int:
        return len(requested(life.connection, **query).writes)

    with lived(tmp_path / "j.sqlite") as life:
        life.write(scan("7", now - n * DAY) for n in range(9, -1, -1))
        assert count(life, reach_s=2.5 * 86_400) == 3
        assert count(life, reach_count=4) == 4
        assert count(life, reach_s=2.5 * 86_400, reach_count=2) == 2
        assert count(life, reach_s=1e9) == 10
    with lived(tmp_path / "empty.sqlite") as life:
        empty = requested(life.connection)
        assert (empty.writes, empty.is_all) == ((), True)


def test_the_recent_window_has_the_last_nine_scans_and_inspections_of_each_tag(
    tmp_path: Path, copied: Copied
) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        life.write(scan("7", BEGUN + n, t=float(n)) for n in range(0, 40, 2))
        # Two sets of sensors, and two scans of one moment: these are one of the nine.
        life.write(scan("7", BEGUN + n, h=float(n)) for n in range(1, 20, 2))
        life.write([scan("7", BEGUN + 17, source="b", h=5.0), failure("7", BEGUN + 16)])
        life.write([scan("8", BEGUN - 3 * DAY + 16, t=1.0), scan("8", BEGUN - 3 * DAY + 17, t=2.0)])
        life.write(inspection("8", BEGUN + n, anomaly=bool(n % 2)) for n in range(20))
        then = BEGUN + 17
        found = recent(life.connection, then)
        stamps = {
            (tag, kind): [w.stamp_ns - BEGUN for w in found if (w.tag_id, w.kind) == (tag, kind)]
            for tag in "78"
            for kind in (0, 1)
        }
        assert stamps == {
            ("7", 0): [9, 10, 11, 12, 13, 14, 15, 16, 17, 17],
            ("7", 1): [],
            ("8", 0): [16 - 3 * DAY, 17 - 3 * DAY],
            ("8", 1): [9, 10, 11, 12, 13, 14, 15, 16, 17],
        }
        assert recent(copied(life.connection), then) == found
        assert recent_of(requested(life.connection).writes, then) == found
        assert recent(life.connection, BEGUN - 9 * DAY) == ()


def test_an_uncertain_species_is_left_out(tmp_path: Path) -> None:
    with lived(tmp_path / "j.sqlite") as life:
        for number, confidence in enumerate((0.05, 0.49, 0.5, 1.0)):
            one = inspection("7", BEGUN + number)
            flower = replace(one.flower or NO_FLOWER, confidence=confidence)
            life.write([replace(one, flower=flower)])
        seen = [write.flower for write in requested(life.connection).writes]
        assert [it.sure_species for it in seen if it] == ["", "", "lupin", "lupin"]
