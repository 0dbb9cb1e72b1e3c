"""`lupin-twin import`: how a CSV file is read, which rows are refused, and what is written."""

from __future__ import annotations

from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import httpx
import pytest
import yaml

from lupin_twin.journal.paths import Lock
from lupin_twin.journal.runs import Clock
from tests.support.docs import block_named
from tests.support.journal import NOW, SECOND, append, scan, select
from tests.support.processes import lupin_twin, run_here, url_of
from tests.support.waiting import PATIENCE_S, wait_for

WIDE = {
    "time": "at",
    "tag": "bench",
    "sensors": {"temperature": "t", "humidity": {"column": "rh", "factor": 100, "max": 100}},
}
LONG = {
    "time": "_time",
    "tag": "room",
    "sensor": "_field",
    "value": "_value",
    "names": {"temperature": "temp", "co2": "co2"},
}
ROWS = """at,bench,t,rh,note
2024-05-01T12:00:00+02:00,A,21.5,0.55,
2024-05-01T10:05:00Z,A,22.5,,wet
1714558200,B,20.0,0.6,
"""
# As InfluxDB 2 exports it: CRLF line ends, an empty first column, and a header of its own for
# each set of tags.
ANNOTATED = """#group,false,false,true,true,false,false,true,true,true
#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,string,string,string
#default,last,,,,,,,,
,result,table,_start,_stop,_time,_value,_field,_measurement,room
,,0,2024-04-01T00:00:00Z,2024-06-01T00:00:00Z,2024-05-01T10:00:00.123456789Z,21.5,temp,climate,A
,,0,2024-04-01T00:00:00Z,2024-06-01T00:00:00Z,2024-05-01T10:00:10Z,22.5,temp,climate,A

#group,false,false,true,true,true,false,false,true,true,true
#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,string,dateTime:RFC3339,double,string,string,string
#default,last,,,,,,,,,
,result,table,_start,_stop,bay,_time,_value,_field,_measurement,room
,,1,2024-04-01T00:00:00Z,2024-06-01T00:00:00Z,7,2024-05-01T10:00:10Z,800,co2,climate,A
,,1,2024-04-01T00:00:00Z,2024-06-01T00:00:00Z,7,2024-05-01T10:00:20Z,3.1,battery,climate,A

""".replace("\n", "\r\n")
# As Home Assistant's history page exports it, with several entities.
HISTORY = """entity_id,state,last_changed
sensor.bench_temperature,unknown,2024-05-01T09:59:00.000Z
sensor.bench_temperature,21.5,2024-05-01T10:00:00.000Z
sensor.bench_temperature,unavailable,2024-05-01T10:01:00.000Z
sensor.bench_temperature,22.5,2024-05-01T10:02:00.250Z
sensor.bench_humidity,55,2024-05-01T10:00:00.000Z
light.bench,on,2024-05-01T10:00:00.000Z
"""


class Import:
    """A file to import, and the command that imports it."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "r.csv"
        self.map = folder / "columns.yaml"
        self.journal = folder / "j.sqlite"

    def given(self, columns: Any, rows: str | bytes) -> Import:
        self.map.write_text(yaml.safe_dump(columns, sort_keys=False))
        self.file.write_bytes(rows.encode() if isinstance(rows, str) else rows)
        return self

    def run(self, *more: str) -> CompletedProcess[str]:
        return run_here("import", self.file, "--map", self.map, "--journal", self.journal, *more)

    def written(self) -> str:
        """The part of the output about what was written."""
        done = self.run("--write")
        assert done.returncode == 0, done.stderr
        return done.stdout

    def rows(self) -> list[tuple[object, ...]]:
        """Tag, stamp, arrival, sensors, readings and source of each scan, by stamp."""
        return select(
            self.journal,
            "SELECT tag, stamp_ns, arrival_ns, sensors, readings, source FROM scan JOIN series"
            " USING (site, series) ORDER BY stamp_ns, tag, sensors",
        )


@pytest.fixture
def importing(tmp_path: Path) -> Import:
    return Import(tmp_path)


def test_a_dry_run_writes_nothing_and_importing_twice_writes_each_row_once(
    importing: Import,
) -> None:
    assert importing.run().stderr == f"lupin-twin: {importing.map}: No such file or directory\n"
    importing.given(WIDE, ROWS).file.rename(importing.map.with_suffix(".csv"))
    assert importing.run().stderr == f"lupin-twin: {importing.file}: No such file or directory\n"
    done = importing.given(WIDE, ROWS).run()
    assert done.returncode == 0
    assert done.stdout.splitlines() == [
        "3 rows, 3 scans of 2 tags",
        "from 2024-05-01T10:00:00+00:00 to 2024-05-01T10:10:00+00:00",
        "humidity: 2 readings from 55 to 60",
        "temperature: 3 readings from 20 to 22.5",
    ]
    assert "nothing was written; add --write" in done.stderr
    assert not importing.journal.exists()
    importing.given(WIDE | {"places": {"A": [1.5, 2]}}, ROWS)
    assert "3 scans are new" in importing.written()
    then_ns = int(datetime(2024, 5, 1, 10, tzinfo=UTC).timestamp()) * SECOND
    rows = importing.rows()
    assert rows[0] == (
        "A", then_ns, then_ns, '["temperature","humidity"]', "[21.5,55.0]", "import"
    )  # fmt: skip
    assert [(row[0], row[4]) for row in rows[1:]] == [("A", "[22.5]"), ("B", "[20.0,60.0]")]
    assert "0 scans are new" in importing.written()
    assert importing.rows() == rows
    assert select(importing.journal, "SELECT tag, x, y FROM place") == [("A", 1.5, 2.0)]


def test_in_influxdbs_annotated_export_each_table_has_its_own_columns(importing: Import) -> None:
    out = importing.given(LONG, ANNOTATED).written().splitlines()
    then_ns = int(datetime(2024, 5, 1, 10, tzinfo=UTC).timestamp()) * SECOND
    assert [(row[1], row[3], row[4]) for row in importing.rows()] == [
        (then_ns + 123_456_000, '["temperature"]', "[21.5]"),
        (then_ns + 10 * SECOND, '["temperature","co2"]', "[22.5,800.0]"),
    ]
    assert out[0] == "4 rows, 3 scans of 1 tags"
    assert [line for line in out if "refused" in line] == [
        "refused: 1: _field 'battery' is not one of names (line 13)"
    ]


def test_home_assistants_history_names_its_entities_and_reports_what_is_unknown(
    importing: Import,
) -> None:
    columns = yaml.safe_load(block_named("import-home-assistant").text)
    out = importing.given(columns, HISTORY).written().splitlines()
    assert [(row[0], row[3], row[4]) for row in importing.rows()] == [
        ("bench-1", '["temperature","humidity"]', "[21.5,55.0]"),
        ("bench-1", '["temperature"]', "[22.5]"),
    ]
    assert [line for line in out if "refused" in line] == [
        "refused: 1: temperature is unknown (line 2)",
        "refused: 1: temperature is unavailable (line 4)",
        "refused: 1: entity_id 'light.bench' is not one of names (line 7)",
    ]


@pytest.mark.parametrize(
    "text",
    [
        "1714558200",
        "1714558200000",
        "1714558200000000",
        "1714558200000000000",
        "2024-05-01T10:10:00Z",
        " 2024-05-01T12:10:00+02:00",
        "20240501T101000Z",
    ],
)
def test_a_time_is_a_date_or_seconds_or_fractions_of_them(importing: Import, text: str) -> None:
    # A float is a little below this millisecond.
    rows = f"\ufeffat,bench,t,rh\n{text},A,1,\n1713220448650000000,A,1,\n"
    importing.given(WIDE, rows).written()
    stamps = [1_713_220_448_650_000_000, 1_714_558_200 * SECOND]
    assert [row[1] for row in importing.rows()] == stamps


def test_rows_from_before_the_twin_are_in_its_past(importing: Import) -> None:
    append(importing.journal, [scan("A", NOW, temperature=25.0)])
    importing.given(WIDE, ROWS).written()
    assert [row[5] for row in importing.rows()] == ["import"] * 3 + ["robot"]


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ("yesterday,A,1,", "the time is neither ISO 8601 nor seconds since 1970"),
        ("2024-05-01T10:00:00,A,1,", "the time has no offset, and time_zone is not given"),
        ("1900-05-01T10:00:00Z,A,1,", "the time is before 1970"),
        ("9999-12-31T23:59:59Z,A,1,", "the time is in the future"),
        ("9e10,A,1,", "the time is in the future"),
        ("-5,A,1,", "the time is not a moment since 1970"),
        ("1714558200,,1,", "no tag, or one of more than 256 characters"),
        ("1714558200,A,,", "no reading"),
        ("1714558200,A,warm,", "temperature is not a number"),
        ("1714558200,A,nan,", "temperature is not from -inf to inf"),
        ("1714558200,A,1,1.01", "humidity is not from -inf to 100"),
        ("1714558200,A", "too few columns"),
        ("1714558200,A\0B,1,", "a tag with NUL"),
    ],
)
def test_an_invalid_row_is_counted_and_named_and_the_others_are_imported(
    importing: Import, row: str, reason: str
) -> None:
    out = importing.given(WIDE, f"at,bench,t,rh\n{row}\n1714558200,B,20,0.5\n").written()
    assert f"refused: 1: {reason} (line 2)" in out
    assert len(importing.rows()) == 1


def test_more_sensors_than_a_tag_may_have_are_refused(importing: Import) -> None:
    columns = {key: value for key, value in LONG.items() if key != "names"}
    rows = "".join(f"1714558200,A,s{n},1\n" for n in range(70))
    done = importing.given(columns, "_time,room,_field,_value\n" + rows).run()
    assert "refused: 6: sensors: 65, the limit is 64 (line 66, 67, 68)" in done.stdout


def test_a_time_without_offset_is_in_the_given_zone_and_an_hour_may_occur_twice(
    importing: Import,
) -> None:
    rows = (
        "at,bench,t,rh\n2024-05-01T12:00,A,1,\n" + "2024-10-27T02:30,A,9,\n2024-10-27T02:30,A,8,\n"
    )
    out = importing.given(WIDE | {"time_zone": "Europe/Amsterdam"}, rows).written()
    assert importing.rows()[0][1] == 1_714_557_600 * SECOND
    assert "refused: 1: the sensor has another reading at that moment" in out


@pytest.mark.parametrize(
    ("columns", "rows", "complaint"),
    [
        (WIDE | {"time": "when"}, ROWS, "there is no column 'when', but at, bench, t, rh, note"),
        (WIDE | {"zone": "x"}, ROWS, "'zone' is not known, expected one of time_zone, time, tag"),
        (WIDE | {"time_zone": "Mars"}, ROWS, "time_zone is 'Mars', expected such as Europe/"),
        (WIDE | {"tag_id": "A"}, ROWS, "expected either tag, a column, or tag_id"),
        (
            WIDE | {"sensor": "a", "value": "b"},
            ROWS,
            "expected either sensors, or sensor and value",
        ),
        (WIDE | {"sensors": {"t": 5}}, ROWS, "sensors.t is 5, expected keys and values"),
        (WIDE | {"places": {"A": [1, "x"]}}, ROWS, "places.A is [1, 'x'], expected [x, y] or"),
        (WIDE, b"\xff\xfe\x00", "is not CSV in UTF-8"),
        (WIDE, 'at,bench,t,rh\n"' + "x" * 200_000, "is not CSV in UTF-8: field larger than"),
        (WIDE, "at,bench,t,rh\n" + "," * 1_000_001, "line 2 has 1,000,000 characters or more"),
    ],
)
def test_a_file_that_cannot_be_imported_is_refused_in_one_line(
    importing: Import, columns: Any, rows: str | bytes, complaint: str
) -> None:
    done = importing.given(columns, rows).run("--write")
    assert done.returncode == 1
    assert complaint in done.stderr
    assert "Traceback" not in done.stderr
    assert importing.rows() == []


def test_a_journal_in_use_by_a_twin_and_one_of_a_simulation_are_refused(importing: Import) -> None:
    with closing(Lock(importing.journal, "/lupin_twin")):
        done = importing.given(WIDE, ROWS).run("--write")
    assert (done.returncode, "is in use by /lupin_twin" in done.stderr) == (1, True)
    append(importing.journal, [scan("A", 5 * SECOND)], Clock(5 * SECOND, NOW, is_simulated=True))
    done = importing.given(WIDE, ROWS).run("--write")
    assert done.returncode == 1
    assert "is a simulation's: import into another one" in done.stderr


def test_the_page_shows_imported_rows(domain: int, importing: Import) -> None:
    columns = yaml.safe_load(block_named("import").text)
    importing.given(columns, block_named("import-rows").text).written()
    parameters = ("-p", f"journal:={importing.journal}", "-p", "journal_days:=3650")
    with lupin_twin(domain, "serve", "--ros-args", *parameters) as server:
        address = f"{url_of(server)}/api/history?tag_id=bench-1&sensor_type=temperature&from=0"

        def past() -> Any:
            answer = httpx.get(address, timeout=PATIENCE_S, trust_env=False)
            return answer.status_code == 200 and answer.json()

        found = wait_for(past, "the imported past")
        assert [point["value"] for point in found["readings"]] == [21.5, 22.0]
