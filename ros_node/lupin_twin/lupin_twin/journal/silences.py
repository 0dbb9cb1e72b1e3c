"""Stretches in which nothing was tried, longer than is usual."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from statistics import median
from typing import Final

from lupin_twin.journal.happenings import Happenings
from lupin_twin.journal.spans import FOREVER_NS, Span

# A silence is longer than this, and than so many median intervals between the tries of the period.
SILENCE_NS: Final = 600 * 1_000_000_000
INTERVALS: Final = 3

Silence = tuple[int, float]


def silences(
    happened: Happenings, axis: Sequence[Span], start_ns: int, end_ns: int, now_ns: int
) -> Iterator[Silence]:
    """(start, seconds) of each, cut to the period; the last one lasts until now.

    `axis` are all spans. Before the first try that is known there is no silence.
    """
    within = list(cut(axis, start_ns, end_ns))
    longest_ns = max(SILENCE_NS, INTERVALS * _usual_ns(happened, within, end_ns - start_ns))
    found = sorted(extent for span in within for extent in happened.extents(span, SILENCE_NS))
    before_ns = last_before(happened, axis, start_ns)
    if before_ns is not None:
        found.insert(0, (before_ns, before_ns))
    if not found:
        return
    after_ns = first_from(happened, axis, end_ns)
    last_ns = max(now_ns, *(last for _, last in found)) if after_ns is None else after_ns
    found.append((last_ns, last_ns))
    heard_ns = found[0][0]
    for first, last in found:
        silent_ns = (max(heard_ns, start_ns), min(first, end_ns))
        if first - heard_ns > longest_ns and silent_ns[0] < silent_ns[1]:
            yield silent_ns[0], (silent_ns[1] - silent_ns[0]) / 1e9
        heard_ns = max(heard_ns, last)


def _usual_ns(happened: Happenings, within: Sequence[Span], period_ns: int) -> float:
    """The median interval; 0 where it is too short to matter."""
    # Half of the intervals would have to be longer than that, and there is no room for so many.
    if sum(happened.tries(span) for span in within) - 1 > 2 * INTERVALS * period_ns / SILENCE_NS:
        return 0.0
    stamps = sorted(stamp_ns for span in within for stamp_ns in happened.stamps(span))
    return median(b - a for a, b in pairwise(stamps)) if len(stamps) > 1 else 0.0


def cut(axis: Sequence[Span], start_ns: int, end_ns: int) -> Iterator[Span]:
    """The spans of a period."""
    for span in axis:
        first, last = max(span.start_ns, start_ns), min(span.end_ns, end_ns)
        if first < last:
            yield Span(span.run, first, last)


def last_before(happened: Happenings, axis: Sequence[Span], at_ns: int) -> int | None:
    """The last try before a moment; None if there is none."""
    for span in reversed(list(cut(axis, 0, at_ns))):
        ends = happened.ends(span)
        if ends is not None:
            return ends[1]
    return None


def first_from(happened: Happenings, axis: Sequence[Span], at_ns: int) -> int | None:
    """The first try at a moment or after; None if there is none."""
    for span in cut(axis, at_ns, FOREVER_NS):
        ends = happened.ends(span)
        if ends is not None:
            return ends[0]
    return None
