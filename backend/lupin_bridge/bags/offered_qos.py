"""What a recording tells of how its publishers offered a topic (`offered_qos_profiles`). Pure.

rosbag2 writes YAML there, a list with an entry a publisher; its policies are names from version 9
on and numbers before that.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

# No publisher of a greenhouse keeps more for who comes late; more is memory for each topic.
MAX_DEPTH: Final = 1000

# rmw/types.h: the numbers of the policies.
_RELIABLE: Final = {"reliable", "1"}
_BEST_EFFORT: Final = {"best_effort", "2"}
_TRANSIENT_LOCAL: Final = {"transient_local", "1"}
_VOLATILE: Final = {"volatile", "2"}
# Of the graph alone a recorder learns no depth: it writes 0 then.
_POLICY: Final = re.compile(r"\b(reliability|durability|depth)[\"']?\s*:\s*[\"']?(\w+)")


@dataclass(frozen=True, slots=True)
class Offered:
    """How a topic is published: reliably or not, latched or not, and how many messages are kept."""

    is_reliable: bool = True
    is_latched: bool = True
    depth: int = 1


def offered(text: str, otherwise: Offered) -> Offered:
    """What `text` says; of what it does not say, `otherwise`.

    Of several publishers it is the strongest: whoever asked for less is content with that too.
    """
    said: dict[str, set[str]] = {"reliability": set(), "durability": set(), "depth": set()}
    for policy, value in _POLICY.findall(text):
        said[policy].add(value.lower())
    depths = [int(depth) for depth in said["depth"] if depth.isdecimal() and len(depth) < 10]
    return Offered(
        _strongest(said["reliability"], _RELIABLE, _BEST_EFFORT, otherwise.is_reliable),
        _strongest(said["durability"], _TRANSIENT_LOCAL, _VOLATILE, otherwise.is_latched),
        min(max([0, *depths]), MAX_DEPTH) or otherwise.depth,
    )


def _strongest(said: set[str], strong: set[str], weak: set[str], otherwise: bool) -> bool:
    if said & strong:
        return True
    return otherwise and not said & weak
