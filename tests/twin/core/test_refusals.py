from __future__ import annotations

from lupin_twin.core.past import NotRemembered, lasts, may_pass, message_of


def test_what_passes_says_so_once() -> None:
    message = message_of(NotRemembered("32 are computed", is_lasting=False))
    assert message == "32 are computed: ask again later"
    assert message_of(NotRemembered(message, is_lasting=False)) == message
    assert may_pass(message)
    assert not may_pass("tag_id is 'ask again later or never'")


def test_what_lasts_says_why() -> None:
    message = message_of(NotRemembered("no journal", is_lasting=True))
    assert lasts(message) == "no journal"
    assert lasts("no journal") is None
    assert not may_pass(message)
