"""The QoS that a recording tells of, as rosbag2 has written it over the years."""

from __future__ import annotations

import pytest

from lupin_bridge.bags.offered_qos import MAX_DEPTH, Offered, offered

CONTRACT = Offered(is_reliable=True, is_latched=True, depth=50)

NUMBERS = """- history: 1
  depth: 7
  reliability: 1
  durability: 1
  deadline:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1"""
NAMES = """- history: keep_last
  depth: 7
  reliability: reliable
  durability: transient_local
  liveliness: automatic"""
WEAK = """- history: unknown
  depth: 0
  reliability: best_effort
  durability: volatile"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", CONTRACT),
        ("[]", CONTRACT),
        (NAMES, Offered(depth=7)),
        (NUMBERS, Offered(depth=7)),
        ('[{"depth": 7, "reliability": 2, "durability": "volatile"}]', Offered(False, False, 7)),
        (WEAK, Offered(is_reliable=False, is_latched=False, depth=50)),
        (WEAK.replace("best_effort", "2").replace("volatile", "2"), Offered(False, False, 50)),
        ("- reliability: system_default\n  durability: unknown", CONTRACT),
        ("- depth: 9999999999999", CONTRACT),
        (f"- depth: {MAX_DEPTH}", Offered(depth=MAX_DEPTH)),
        (f"- depth: {MAX_DEPTH + 1}", Offered(depth=MAX_DEPTH)),
        ("- depth: -3\n  reliability: {", CONTRACT),
    ],
)
def test_what_is_said_counts_and_the_contract_for_what_is_not(text: str, expected: Offered) -> None:
    assert offered(text, CONTRACT) == expected


def test_of_several_publishers_the_strongest_counts() -> None:
    assert offered(f"{WEAK}\n{NAMES}", CONTRACT) == Offered(depth=7)
    assert offered(f"{NUMBERS}\n{WEAK}", Offered(False, False, 1)) == Offered(depth=7)
