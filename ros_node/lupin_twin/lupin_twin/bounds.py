"""How much one robot may make us keep, and the refusal of what is past that. Pure.

A greenhouse compartment has hundreds of tags and a tag carries a handful of sensors; the bounds are
far above that and keep memory finite when a producer is broken or hostile.
"""

from __future__ import annotations

MAX_TAGS = 20_000
MAX_SENSORS_PER_TAG = 64
MAX_TEXT_LENGTH = 256
MAX_BLOOMS_PER_TAG = 2_000
MAX_FOOTPRINT_POINTS = 64
# And on all of it together, for those multiply: each reading, flower and footprint point counted,
# 20,000 tags with ten sensors and forty flowers. A reading with its name is some hundred bytes.
MAX_ITEMS = 1_000_000


class Rejected(ValueError):
    """A write that the store refuses; the message names the field, the value and the limit."""


def check_texts(*texts: str) -> None:
    """Raise `Rejected` for a text longer than `MAX_TEXT_LENGTH` characters."""
    for text in texts:
        if len(text) > MAX_TEXT_LENGTH:
            raise Rejected(
                f"text {text[:24]!r}… has {len(text)} characters, the limit is {MAX_TEXT_LENGTH}"
            )


def check_length(what: str, length: int, limit: int) -> None:
    """Raise `Rejected` where `length` of `what` is past `limit`."""
    if length > limit:
        raise Rejected(f"{what}: {length}, the limit is {limit}")
