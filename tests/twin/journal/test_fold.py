from __future__ import annotations

from contextlib import closing
from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest
from hypothesis import given, settings

from lupin_twin.core.state import Attempt, Reading, TagState
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.schema import open_reader
from tests.support.journal import NOW, kept, opened, pin, scan
from tests.support.replay import Received, Step, steps


def shown(tag: TagState) -> object:
    """All of a tag, in a form in which NaN is NaN and the order of sensors means nothing."""
    readings = {r.name: (repr(r.value), r.observed_at_ns) for r in tag.readings}
    return (
        tag.tag_id,
        repr(tag.pose),
        readings,
        tag.last_observed_ns,
        repr(tag.flower),
        tag.looked_at_ns,
        tag.last_try,
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("asof")


_numbers = count()


@settings(max_examples=60, deadline=None)
@given(steps=steps)
def test_as_of_a_moment_is_what_a_plain_replay_of_all_writes_up_to_then_leaves(
    folder: Path, steps: list[Step]
) -> None:
    path = folder / f"{next(_numbers)}.sqlite"
    with opened(path) as file:
        heard = Received(file, steps)
    with closing(open_reader(path)) as reader:
        for at_ns in heard.moments:
            found = state_at(reader, at_ns, "map")
            assert (found.stamp_ns, found.frame_id) == (at_ns, "map")
            assert [shown(tag) for tag in found.tags] == [
                shown(tag) for tag in heard.known_at(at_ns)
            ], (at_ns, steps)


# --- by example -----------------------------------------------------------------------------------


def at(path: Path, at_ns: int) -> dict[str, TagState]:
    with closing(open_reader(path)) as reader:
        return {tag.tag_id: tag for tag in state_at(reader, at_ns, "map").tags}


def test_before_all_that_is_known_there_is_nothing(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan(at_ns=NOW), pin(at_ns=NOW)])
    assert at(path, NOW - 1) == at(path, 0) == at(path, -1) == {}
    assert at(path, NOW).keys() == {"7"}


def test_a_journal_without_a_run_is_empty(tmp_path: Path) -> None:
    with opened(tmp_path / "j.sqlite"):
        pass
    assert at(tmp_path / "j.sqlite", NOW) == {}


def test_a_late_observation_belongs_to_its_own_stamp(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    kept(path, [scan(at_ns=NOW + 9), scan(at_ns=NOW + 3, temperature=5.0), pin(at_ns=NOW + 9)])
    tag = at(path, NOW + 8)["7"]
    assert (tag.readings, tag.last_observed_ns) == (
        (Reading("temperature", 5.0, NOW + 3),),
        NOW + 3,
    )
    assert tag.pose is None
    assert at(path, NOW + 9)["7"].readings == (Reading("temperature", 21.5, NOW + 9),)


def test_of_equal_stamps_what_came_later_counts(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    failed = replace(scan(at_ns=NOW), readings=(), status=2, detail="no")
    before = scan(at_ns=NOW - 1, source="other")
    other = scan(at_ns=NOW, source="other", temperature=5.0)
    kept(path, [before, scan(at_ns=NOW), failed, other])
    tag = at(path, NOW)["7"]
    assert tag.last_try == Attempt(NOW)
    assert tag.readings == (Reading("temperature", 5.0, NOW),)
