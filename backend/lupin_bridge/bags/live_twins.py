"""Which twins a replay feeds, whether it may, and what they lose: none that keeps a journal. Pure.

A twin says of its journal once a second on `/diagnostics`. What a replay feeds it would be written
there beside what a robot observed, for good.
"""

from __future__ import annotations

from collections.abc import Iterable

from lupin_twin.counts import LOST
from lupin_twin.diagnostics import Finding, self_report
from lupin_twin.journal.condition import JournalState

WHAT_TO_DO = (
    "give the recording a twin of its own (lupin-twin demo --from FILE.mcap), replay in another "
    "ROS_DOMAIN_ID, start that twin without a journal (--ros-args -p journal:=off), or insist "
    "with --into-live"
)


class LiveTwins:
    """What the twins that hear a replay say of their journals.

    `own_journal` is the file of the twin that was started for this replay, "" without one.
    """

    def __init__(self, own_journal: str = "") -> None:
        self._own_journal = own_journal
        self._silent: set[str] = set()
        self._files: dict[str, str] = {}
        # How many messages a twin had lost when it was heard first, and last.
        self._lost: dict[str, tuple[int, int]] = {}
        self._to_say: set[str] = set()

    def see(self, names: Iterable[str]) -> None:
        """Which twins are there now, by their nodes' full names."""
        names = set(names)
        self._silent = {name for name in names if name in self._silent or name not in self._files}
        self._files = {name: file for name, file in self._files.items() if name in names}
        self._to_say &= names

    def hear(self, name: str, said: Iterable[Finding]) -> None:
        """A twin says how it does; two of the same name may say two things: the worse counts."""
        report = self_report(said)
        self._to_say.discard(name)
        if report.counts is not None:
            lost = report.counts.dropped.get(LOST, 0)
            self._lost[name] = (min(self._lost.get(name, (lost, 0))[0], lost), lost)
        journal = report.journal
        if journal.state is JournalState.UNKNOWN:
            return
        is_kept = journal.state is not JournalState.OFF and journal.path != self._own_journal
        self._silent.discard(name)
        self._files[name] = (journal.path if is_kept else "") or self._files.get(name, "")

    @property
    def awaited(self) -> frozenset[str]:
        """Twins that have not said yet."""
        return frozenset(self._silent)

    def ask_again(self) -> None:
        """From now on, `has_said` tells whether every twin has said how it does since."""
        self._to_say = set(self._files)

    @property
    def has_said(self) -> bool:
        """See `ask_again`."""
        return not self._to_say

    @property
    def lost(self) -> dict[str, int]:
        """By twin, how many messages came too fast for it since it was heard first."""
        return {name: last - first for name, (first, last) in self._lost.items() if last > first}

    def refusal(self, domain: int, *, is_patient: bool) -> str | None:
        """Why a replay must not begin, or go on; None: it may.

        A twin that says nothing is forgiven as long as one `is_patient`.
        """
        for name, file in self._files.items():
            if file:
                return (
                    f"the twin {name} in ROS domain {domain} keeps a journal ({file}), and what is "
                    f"replayed would be written into it: {WHAT_TO_DO}"
                )
        if self._silent and not is_patient:
            return (
                f"the twin {min(self._silent)} in ROS domain {domain} does not say whether it keeps"
                f" a journal (one that was killed is forgotten within 20 s): {WHAT_TO_DO}"
            )
        return None
