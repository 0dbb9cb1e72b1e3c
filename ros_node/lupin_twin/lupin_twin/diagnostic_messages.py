"""Findings and the messages on `/diagnostics`, which many nodes share: each has its node's name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

from lupin_twin.convert import time_msg
from lupin_twin.diagnostics import STATE_TOPIC, Finding


def diagnostics(findings: Iterable[Finding], node: str, now_ns: int) -> Any:
    """Findings as diagnostic_msgs/DiagnosticArray; `node` is the node's full name."""
    return DiagnosticArray(
        header=Header(stamp=time_msg(now_ns)),
        status=[
            DiagnosticStatus(
                level=bytes([finding.level]),
                name=f"{node}: {finding.name}",
                message=finding.message,
                hardware_id=node,
                values=[KeyValue(key=key, value=value) for key, value in finding.values.items()],
            )
            for finding in findings
        ],
    )


def findings_of(msg: Any, state_topic: str) -> Iterator[Finding]:
    """What the twin says of itself that publishes `state_topic`, by its name from the root on."""
    node = _node_of(msg, state_topic)
    begin = f"{node}: "
    for status in msg.status:
        if status.hardware_id == node and status.name.startswith(begin):
            yield Finding(
                name=status.name.removeprefix(begin),
                level=status.level[0],
                message=status.message,
                values={each.key: each.value for each in status.values},
            )


def _node_of(msg: Any, state_topic: str) -> str | None:
    for status in msg.status:
        if any(each.key == STATE_TOPIC and each.value == state_topic for each in status.values):
            return str(status.hardware_id)
    return None
