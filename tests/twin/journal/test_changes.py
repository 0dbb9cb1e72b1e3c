from __future__ import annotations

from pathlib import Path

from tests.support.journal import NOW, kept, look, select


def changes(path: Path) -> list[tuple[object, ...]]:
    return select(path, "SELECT stamp_ns - 1763700000000000000, anomaly FROM change ORDER BY 1")


def heard(path: Path, *told: tuple[int, bool]) -> list[tuple[object, ...]]:
    kept(path, [look(at_ns=NOW + at, anomaly=anomaly) for at, anomaly in told])
    return changes(path)


def test_a_look_that_differs_from_the_one_before_is_a_change(tmp_path: Path) -> None:
    told = [(0, False), (1, True), (2, True), (3, False), (4, False), (5, True)]
    assert heard(tmp_path / "j.sqlite", *told) == [(1, 1), (3, 0), (5, 1)]


def test_the_first_look_counts_if_it_sees_a_pest(tmp_path: Path) -> None:
    assert heard(tmp_path / "j.sqlite", (3, True)) == [(3, 1)]


def test_one_that_comes_late_is_the_change_instead_of_the_next(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    assert heard(path, (0, False), (4, True), (8, False)) == [(4, 1), (8, 0)]
    assert heard(path, (2, True)) == [(2, 1), (8, 0)]
    assert heard(path, (6, False)) == [(2, 1), (6, 0)]


def test_one_that_comes_late_makes_the_next_a_change(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    assert heard(path, (0, False), (4, False), (9, True)) == [(9, 1)]
    assert heard(path, (2, True)) == [(2, 1), (4, 0), (9, 1)]
    assert heard(path, (3, True)) == [(2, 1), (4, 0), (9, 1)]


def test_tags_are_apart(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [look("1", NOW, anomaly=True), look("2", NOW + 1), look("2", NOW + 2, anomaly=True)])
    assert changes(path) == [(0, 1), (2, 1)]
