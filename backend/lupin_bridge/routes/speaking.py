"""Which language a page that the bridge writes itself is in."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Final

# RFC 9110, section 12.5.4; what is no weight counts as 1, which is what browsers leave out.
_WEIGHT: Final = re.compile(r";\s*q=(0(?:\.\d{0,3})?)\s*$")


def language_of(asked: str | None, accepted: str, spoken: Collection[str]) -> str:
    """One of `spoken`: what `?lang=` asks for, else the best of `Accept-Language`, else English.

    As in the HMI, "de-AT" and "DE" are German, and who asks for what is not spoken gets English.
    """
    if asked is not None:
        return _of(asked, spoken) or "en"
    found = "en", 0.0
    for part in accepted.split(","):
        language = _of(part.partition(";")[0], spoken)
        weight = _WEIGHT.search(part)
        share = 1.0 if weight is None else float(weight.group(1))
        if language is not None and share > found[1]:  # of equals the first
            found = language, share
    return found[0]


def _of(tag: str, spoken: Collection[str]) -> str | None:
    name = tag.strip().partition("-")[0].lower()
    return name if name in spoken else None
