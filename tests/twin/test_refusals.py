from __future__ import annotations

from lupin_twin.past import lasting, lasts, may_pass, passing


def test_what_passes_says_so_once() -> None:
    assert passing("32 are computed") == "32 are computed: ask again later"
    assert passing(passing("32 are computed")) == passing("32 are computed")
    assert may_pass(passing("32 are computed"))
    assert not may_pass("tag_id is 'ask again later or never'")


def test_what_lasts_says_why() -> None:
    assert lasts(lasting("no journal")) == "no journal"
    assert lasts("no journal") is None
    assert not may_pass(lasting("no journal"))
