from contextlib import closing
from itertools import count
from pathlib import Path

import pytest
from hypothesis import given, settings

from lupin_twin.core.state import TagState
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.schema import open_reader
from tests.support.journal import opened
from tests.support.replay import Received, Step, steps
from tests.twin.journal.conftest import Engines


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
    folder: Path, engines: Engines, steps: list[Step]
) -> None:
    path = folder / f"{next(_numbers)}.sqlite"
    with opened(path) as file:
        heard = Received(file, steps)
    with closing(open_reader(path)) as reader:
        logs = engines(reader)
        for at_ns in heard.moments:
            right = [shown(tag) for tag in heard.known_at(at_ns)]
            for log in logs:
                found = state_at(log, at_ns, "map")  # type: ignore[arg-type]
                assert (found.stamp_ns, found.frame_id) == (at_ns, "map")
                assert [shown(tag) for tag in found.tags] == right, (at_ns, steps)
