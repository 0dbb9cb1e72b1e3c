"""The last scans and attempts of one tag, from the log and its newest state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from lupin_bridge.feed.query import Find
from lupin_bridge.past.plans import Plan, of_content
from lupin_bridge.stream.state_json import history
from lupin_twin.core.history import LatestRequest, tag_history
from lupin_twin.core.state import Inspection, Scan, TagState
from lupin_twin.journal.queries import SERIES_S

# What writing a scan takes, roughly and at worst, s of one core.
_WRITE_SCAN_S: Final = 20e-6


@dataclass(frozen=True, slots=True)
class LatestOfTag:
    """`schema.TagHistory`: the last scans and attempts of a tag, `count` of each at most.

    `newest` is its state now, where that is known: it may show what the log does not hold yet.
    """

    tag_id: str
    newest: TagState | None
    count: int

    def cost_s(self, tags: int) -> float:  # noqa: ARG002
        """See `Query`."""
        return SERIES_S + self.count * _WRITE_SCAN_S

    def look(self, find: Find) -> Plan:
        """See `Query`."""
        found: list[Scan | Inspection] = find(LatestRequest(self.tag_id, self.count))
        return of_content(history(self.tag_id, tag_history(found, self.newest, self.count)))
