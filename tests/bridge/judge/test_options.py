import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from lupin_bridge.judge.judging import MAX_FILE_BYTES, Criteria, own_sensors, unix_s
from lupin_bridge.settings import SettingError, Settings


def criteria(**settings: Any) -> Criteria:
    return Criteria.of(Settings(**settings))


def test_the_default_is_our_own_file_and_the_scan_interval() -> None:
    chosen = criteria()
    assert chosen.sensors == own_sensors()
    assert chosen.recent_s is None
    assert criteria(reading_validity_s=900.0).recent_s == 900.0


def test_a_mistake_in_the_file_is_reported_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "mine.json"
    file.write_text(own_sensors().text.replace('"ideal": [18, 26]', '"ideal": [26, 18]'), "utf-8")
    says = f"--sensors {file}: sensors.temperature: ideal is [26.0, 18.0], and low must be"
    with pytest.raises(SettingError, match=re.escape(says)):
        criteria(sensors=str(file))


def test_a_file_is_not_read_past_its_limit(tmp_path: Path) -> None:
    file = tmp_path / "long.json"
    text = own_sensors().text
    file.write_text(text + " " * (MAX_FILE_BYTES - len(text.encode())), "utf-8")
    criteria(sensors=str(file))
    with file.open("a") as more:
        more.write(" ")
    with pytest.raises(SettingError, match="has more than 1000000 bytes, the limit"):
        criteria(sensors=str(file))


def test_the_hours_of_the_day_are_those_of_the_greenhouse() -> None:
    clock = criteria(time_zone="Europe/Amsterdam", day_hours="07:30-19:00").clock
    summer = datetime(2026, 7, 1, 5, 29, tzinfo=UTC).timestamp()
    assert not clock.is_day(summer)
    assert clock.is_day(summer + 60)
    winter = datetime(2026, 1, 1, 6, 29, tzinfo=UTC).timestamp()
    assert not clock.is_day(winter)
    assert clock.is_day(winter + 60)


@pytest.mark.parametrize(
    ("name", "values", "says"),
    [
        ("time_zone", ("Mars/Olympus", "../../etc/passwd", "Europe"), "which this machine"),
        (
            "day_hours",
            ("", "6-20", "06:00-24:00", "06:60-20:00", "06:00–20:00", "day"),
            "expected HH:MM-HH:MM",
        ),
    ],
)
def test_an_unknown_time_zone_and_invalid_hours_are_refused(
    name: str, values: Sequence[str], says: str
) -> None:
    for value in values:
        text = re.escape(f"--{name.replace('_', '-')} is '{value}', {says}")
        with pytest.raises(SettingError, match=text):
            criteria(**{name: value})


def test_simulated_time_has_no_hours_of_a_wall_clock() -> None:
    assert unix_s(3_600 * 10**9) is None
    assert unix_s(1_790_000_000 * 10**9) == 1_790_000_000
