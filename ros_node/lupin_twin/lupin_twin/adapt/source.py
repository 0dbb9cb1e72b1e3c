"""What `/diagnostics` and `--check` say of a source: a topic, or the broker."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Final

from lupin_twin.core.diagnostics import OK, WARN, Finding
from lupin_twin.core.drops import Tally

# The source that all topics of the broker are.
MQTT: Final = "MQTT"


@dataclass(slots=True)
class Source:
    """What came, what of it is in a scan, and what was dropped.

    `problem` is what is wrong with it now, `shown` what it said last. `dropped` counts by case:
    what is wrong with one sensor must not hide what is wrong with another. `name` is the topic's
    in ROS.
    """

    name: str
    type_name: str = ""
    received: int = 0
    used: int = 0
    received_s: float = 0.0
    problem: str = ""
    shown: dict[str, str] = field(default_factory=dict)
    dropped: Tally = field(default_factory=Tally)

    def finding(self, topic: str) -> Finding:
        """The same for `/diagnostics`."""
        counts = self.dropped.value(time.monotonic())
        wrong = [self.problem] if self.problem else []
        wrong += [recent.message for recent in counts.recent]
        return Finding(
            topic,
            WARN if wrong else OK,
            "; ".join(wrong) or ("connected" if topic == MQTT else "receiving"),
            {
                "received": str(self.received),
                "used": str(self.used),
                **self.shown,
                **{f"dropped: {case}": str(count) for case, count in counts.dropped.items()},
            },
        )
