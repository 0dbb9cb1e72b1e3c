"""Repeatable chance: one independent stream of random numbers for each thing that happens."""

from __future__ import annotations

import random


def stream(seed: int, *occasion: str | int) -> random.Random:
    """Return the random stream of one occasion, such as `stream(seed, "look", tag_id, pass)`.

    The same seed and occasion give the same numbers in every process, whatever was drawn
    elsewhere before: an event does not depend on the order in which the others were made.
    A text as seed is hashed with SHA-512 by the standard library, not by the process's `hash`.
    """
    text = "/".join(str(part) for part in (seed, *occasion))
    return random.Random(text)  # noqa: S311  # a simulation, not a secret
