"""Times of a recording in which nothing is to be published: how they are told. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Final

# Who waits longer than that for something to happen, s, is told of it.
TOLD_S: Final = 60.0
_UNITS: Final = ((86_400, "d"), (3_600, "h"), (60, "min"), (1, "s"))


@dataclass(frozen=True, slots=True)
class Gap:
    """From one message to the next, ns; `is_skipped`: it is jumped over."""

    start_ns: int
    end_ns: int
    is_skipped: bool = False

    @property
    def seconds(self) -> float:
        """How long it is in the recording, s."""
        return (self.end_ns - self.start_ns) / 1e9

    def told(self, speed: float) -> str:
        """What a person is told of it, who sees so many recorded seconds a second."""
        until = f"until {_utc(self.end_ns)}"
        if self.is_skipped:
            return f"skipped {lasting(self.seconds)} in which nothing is to be published, {until}"
        waited = f", waited for {lasting(self.seconds / speed)}" if speed != 1.0 else ""
        return (
            f"nothing is to be published for {lasting(self.seconds)}, {until}{waited}: --skip-gaps "
            "SECONDS jumps over what is longer"
        )


def lasting(seconds: float) -> str:
    """Such a time by its two largest units: `3 h 12 min`."""
    rest = round(seconds)
    parts: list[str] = []
    for size, unit in _UNITS:
        count, rest = divmod(rest, size)
        if count or parts or unit == "s":
            parts.append(f"{count:,} {unit}")
    return " ".join(part for part in parts[:2] if not part.startswith("0 ")) or "0 s"


def _utc(stamp_ns: int) -> str:
    return f"{datetime.fromtimestamp(stamp_ns // 10**9, UTC):%Y-%m-%d %H:%M:%S} UTC"
