"""docs/log.md is right: its queries run, and it names every table and column."""

import re
import shutil
from contextlib import closing
from pathlib import Path

import pytest

from lupin_twin.journal.rebuild import upgrade
from lupin_twin.journal.schema import open_reader

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "log.md").read_text(encoding="utf-8")
QUERIES = re.findall(r"```sql\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A day of a small greenhouse, whose tag 0 is called 12 here."""
    path = tmp_path_factory.mktemp("log") / "j.sqlite"
    shutil.copy(ROOT / "tests" / "fixtures" / "journals" / "day.sqlite", path)
    upgrade(path, lambda share: None)
    return path


def rows(path: Path, sql: str) -> list[tuple[object, ...]]:
    with closing(open_reader(path)) as connection:
        return connection.execute(sql).fetchall()


def test_the_temperature_of_a_day(path: Path) -> None:
    found = rows(path, QUERIES[0].replace("'12'", "'0'"))
    assert len(found) == 90
    assert found[0] == ("2025-11-21 00:00:00", 13.02)


def test_the_failed_attempts_of_a_week(path: Path) -> None:
    found = rows(path, QUERIES[1])
    assert len(found) == 11
    times = [str(row[0]) for row in found]
    assert times == sorted(times, reverse=True)
    assert {row[3] for row in found} >= {"no answer 5", "camera is dark"}


def test_the_mean_of_each_day(path: Path) -> None:
    found = {row[1:3]: row for row in rows(path, QUERIES[2])}
    assert len(QUERIES) == 3
    readings = [value for _, value in rows(path, QUERIES[0].replace("'12'", "'0'"))]
    day, _, _, mean, low, high = found["0", "temperature"]
    assert day == "2025-11-21"
    assert mean == pytest.approx(sum(map(float, map(str, readings))) / 90)
    assert (low, high) == (min(readings, key=float), max(readings, key=float))  # type: ignore[arg-type]


def test_every_table_and_column_is_named(path: Path) -> None:
    for (table,) in rows(path, "SELECT name FROM sqlite_schema WHERE type = 'table'"):
        [line] = [line for line in PAGE.splitlines() if line.startswith(f"| `{table}` |")]
        for (column,) in rows(path, f"SELECT name FROM pragma_table_info('{table}')"):
            assert column == "site" or f"`{column}`" in line, (table, column)
