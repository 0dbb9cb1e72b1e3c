"""Topics: where what is published, and how any name becomes a safe part of one. Pure.

A part of a topic is letters, digits, `-` and `_` alone: `/`, `+` and `#` mean something to a
broker, and Home Assistant takes no other characters in what it discovers.
"""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

MAX_PLAIN: Final = 64
_KEPT_OF_LONG: Final = 24
_UNSAFE: Final = re.compile(rb"[^A-Za-z0-9-]")


@lru_cache(maxsize=50_000)
def safe(name: str) -> str:
    """The name as a part of a topic: no two names have the same.

    What is no letter, digit or `-` becomes `_` and two hexadecimal digits a byte of UTF-8. Of a
    name that gets too long, the beginning is kept, and a digest of all of it stands behind `__`,
    which no other has.
    """
    raw = name.encode("utf-8", "surrogatepass")
    plain = _UNSAFE.sub(lambda found: b"_%02X" % found[0][0], raw).decode("ascii")
    if 0 < len(plain) <= MAX_PLAIN:
        return plain
    digest = hashlib.blake2b(raw, digest_size=16).hexdigest()
    # Never half of an escape: the beginning is for people to read.
    return f"{re.sub(r'_.?$', '', plain[:_KEPT_OF_LONG])}__{digest}"


@dataclass(frozen=True, slots=True)
class Topics:
    """The topics below one prefix; `discovery` is Home Assistant's prefix, empty: no discovery."""

    prefix: str
    discovery: str

    @property
    def status(self) -> str:
        """`online` while the bridge is connected; its last will says `offline`."""
        return f"{self.prefix}/status"

    @property
    def birth(self) -> str:
        """Where Home Assistant says that it has started."""
        return f"{self.discovery}/status"

    @property
    def twin(self) -> str:
        """Whether the twin is live."""
        return f"{self.prefix}/house/twin"

    def of(self, tag_id: str | None, what: str) -> str:
        """Something of a tag, or of the house (None), such as `health`."""
        return f"{self.prefix}/{'house' if tag_id is None else f'tags/{safe(tag_id)}'}/{what}"

    def reading(self, tag_id: str, sensor: str) -> str:
        """One sensor of one tag."""
        return self.of(tag_id, f"readings/{safe(sensor)}")

    def device(self, tag_id: str | None) -> str:
        """What Home Assistant knows a tag, or the house, by."""
        return f"{safe(self.prefix)}_{'house' if tag_id is None else f'tag_{safe(tag_id)}'}"

    def config(self, component: str, tag_id: str | None, what: str) -> str:
        """Where an entity is announced; `what` is a part of a topic already."""
        place = "house" if tag_id is None else f"tag_{safe(tag_id)}"
        return f"{self.discovery}/{component}/{safe(self.prefix)}/{place}_-_{what}/config"
