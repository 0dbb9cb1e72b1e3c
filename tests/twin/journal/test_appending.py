from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lupin_twin.journal.rows import ScanRow
from tests.support.journal import NOW, SECOND, kept, look, scan, select


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "j.sqlite"


def sent(row: ScanRow, own_ns: int) -> ScanRow:
    """As it is taken in where its stamp could not be true."""
    return replace(row, own_stamp_ns=own_ns)


@pytest.mark.parametrize("in_one_life", [True, False])
def test_a_write_is_known_by_tag_kind_own_stamp_and_source(
    path: Path, *, in_one_life: bool
) -> None:
    first = scan("7", NOW, temperature=20.0)
    again = [
        scan("7", NOW, temperature=25.0),
        replace(first, status=2, detail="no"),
        replace(first, readings=()),
    ]
    others = [
        scan("8", NOW),
        scan("7", NOW + 1),
        scan("7", NOW - 1),
        scan("7", NOW, source="other"),
        replace(first, kind=1, readings=(), status=2),
    ]
    if in_one_life:
        assert kept(path, [first, *again, *others]) == (1 + len(others), 0)
    else:
        assert kept(path, [first]) == (1, 0)
        assert kept(path, again) == (0, 0)
        assert kept(path, others) == (len(others), 0)
    assert kept(path, [*others, *again]) == (0, 0)


def test_of_what_is_known_new_sensors_are_a_further_part(path: Path) -> None:
    kept(
        path, [scan(temperature=20.0), scan(temperature=25.0, co2=400.0), scan(co2=1.0, light=2.0)]
    )
    asked = "SELECT sensors, readings FROM scan JOIN series USING (series) ORDER BY seq"
    found = select(path, asked)
    assert found == [('["temperature"]', "[20.0]"), ('["co2"]', "[400.0]"), ('["light"]', "[2.0]")]


def test_a_stamp_from_the_future_is_known_when_it_has_come(path: Path) -> None:
    own_ns = NOW + 60 * SECOND
    assert kept(path, [sent(scan(at_ns=NOW), own_ns)]) == (1, 0)
    assert kept(path, [sent(scan(at_ns=NOW + 30 * SECOND), own_ns)]) == (0, 0)
    assert kept(path, [scan(at_ns=own_ns)]) == (0, 0)
    assert kept(path, [scan(at_ns=own_ns, co2=400.0)]) == (1, 0)
    assert select(path, "SELECT stamp_ns, own_stamp_ns FROM scan") == [(NOW, own_ns)] * 2


def test_a_look_and_one_that_failed_are_of_one_kind(path: Path) -> None:
    failed = ScanRow("7", NOW, NOW, kind=1, status=2, source="robot")
    assert kept(path, [look(), failed, look(anomaly=True)]) == (1, 0)


def test_what_is_no_text_or_no_number_costs_nothing_else(path: Path) -> None:
    odd = replace(scan("\ud800", t=float("nan"), u=float("inf"), v=1.5), mission="\udfff")
    assert kept(path, [odd]) == (1, 0)
    assert select(path, "SELECT tag, readings FROM scan JOIN series USING (series)") == [
        ("?", "[null,null,1.5]")
    ]
