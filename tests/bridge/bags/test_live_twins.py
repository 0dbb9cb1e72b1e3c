"""Whom a replay would feed: nobody who keeps a journal."""

from __future__ import annotations

from lupin_bridge.bags.live_twins import LiveTwins
from lupin_twin.diagnostics import Finding


def said(state: str, file: str = "") -> list[Finding]:
    return [Finding("journal", 0, state, {"state": state, "file": file})]


def test_where_nobody_hears_nothing_is_refused() -> None:
    twins = LiveTwins()
    twins.see([])
    assert twins.refusal(0, is_patient=False) is None


def test_a_journal_is_refused_with_its_twin_its_domain_and_its_file() -> None:
    for state in ("starting", "recording", "slow", "failing", "in_use", "foreign"):
        twins = LiveTwins()
        twins.see(["/gh1/lupin_twin"])
        twins.hear("/gh1/lupin_twin", said(state, "/home/me/domain-7.sqlite"))
        refusal = twins.refusal(7, is_patient=True) or ""
        assert "/gh1/lupin_twin in ROS domain 7 keeps a journal (/home/me/domain-7.s" in refusal
        assert "--into-live" in refusal


def test_a_twin_without_a_journal_and_one_s_own_are_fed() -> None:
    twins = LiveTwins(own_journal="/tmp/own.sqlite")
    twins.see(["/a", "/b"])
    assert twins.awaited == {"/a", "/b"}
    twins.hear("/a", said("off"))
    twins.hear("/b", said("recording", "/tmp/own.sqlite"))
    assert twins.awaited == frozenset()
    assert twins.refusal(0, is_patient=False) is None


def test_a_twin_that_says_nothing_is_forgiven_for_a_while() -> None:
    twins = LiveTwins()
    twins.see(["/old"])
    twins.hear("/old", [Finding("clock", 0, "", {})])
    assert twins.refusal(0, is_patient=True) is None
    assert "/old in ROS domain 0 does not say" in (twins.refusal(0, is_patient=False) or "")


def test_of_two_by_one_name_the_worse_counts_until_it_is_gone() -> None:
    twins = LiveTwins()
    twins.see(["/lupin_twin"])
    twins.hear("/lupin_twin", said("recording", "/live.sqlite"))
    twins.hear("/lupin_twin", said("off"))
    assert "/live.sqlite" in (twins.refusal(0, is_patient=True) or "")
    twins.see([])
    assert twins.refusal(0, is_patient=False) is None
    twins.see(["/lupin_twin"])
    assert twins.awaited == {"/lupin_twin"}


def test_what_a_twin_lost_is_counted_from_when_it_was_heard_first() -> None:
    def lost(count: int) -> list[Finding]:
        queues = Finding("queues", 0, "", {"lost": str(count)})
        return [*said("off"), Finding("drops", 0, "", {}), queues]

    twins = LiveTwins()
    twins.see(["/a", "/b"])
    twins.hear("/a", lost(5))
    twins.hear("/b", lost(0))
    twins.ask_again()
    twins.hear("/a", lost(16))
    assert (twins.lost, twins.has_said) == ({"/a": 11}, False)
    twins.hear("/b", lost(0))
    assert (twins.lost, twins.has_said) == ({"/a": 11}, True)
    # It was started again.
    twins.hear("/a", lost(2))
    assert twins.lost == {}
    twins.ask_again()
    twins.see(["/b"])
    twins.hear("/b", lost(0))
    assert twins.has_said
