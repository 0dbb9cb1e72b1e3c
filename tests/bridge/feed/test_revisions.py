"""For how long an answer stands, and what it is known by."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from lupin_bridge.feed import revisions
from lupin_bridge.feed.revisions import REVISION_TTL_S, RevisionCache, revised
from tests.support.estimates import an_estimate


def test_an_answer_stands_until_something_changes_or_some_seconds_have_passed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    known = RevisionCache()
    now_s = time.monotonic()
    monkeypatch.setattr(time, "monotonic", lambda: now_s)
    assert known.revision("q", 1) is None
    known.put("q", 1, "r")
    monkeypatch.setattr(time, "monotonic", lambda: now_s + REVISION_TTL_S)
    assert known.revision("q", 1) == "r"
    assert known.revision("q", 2) is None
    assert known.revision("q", 1) is None, "a change is not taken back"
    known.put("q", 1, "r")
    monkeypatch.setattr(time, "monotonic", lambda: now_s + 2 * REVISION_TTL_S + 0.001)
    assert known.revision("q", 1) is None


def test_so_many_are_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(revisions, "MAX_REVISIONS", 2)
    known = RevisionCache()
    for name in ("a", "b", "a", "c"):
        known.put(name, 0, name)
    assert [known.revision(name, 0) for name in ("a", "b", "c")] == ["a", None, "c"]


def test_an_estimate_is_known_by_all_that_is_in_it() -> None:
    estimate = an_estimate(3, 2)
    first = revised(estimate)
    assert first.estimate is estimate
    assert revised(an_estimate(3, 2)).revision == first.revision
    grid = estimate.grid
    others = [
        replace(estimate, reading_count=8),
        replace(estimate, grid=replace(grid, sd_known=1.0)),
        replace(estimate, grid=replace(grid, sd=grid.sd + np.float32(1.0))),
        an_estimate(2, 3),
    ]
    assert first.revision not in {revised(other).revision for other in others}
