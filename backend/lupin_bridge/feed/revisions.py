"""For how long an answer stands that was asked for: until something changes, and a few seconds.

What has no revision of its own is known by its content: who has it already need not get it again.
"""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Hashable
from dataclasses import dataclass
from hashlib import blake2b
from typing import Final

import numpy as np

from lupin_twin.estimate.engine import Estimate

# How long an answer stands while nothing is heard of a change. There are some that no state tells:
# a map that reached the twin later than this process, a model that was fitted anew.
REVISION_TTL_S: Final = 5.0
# A page asks for a few; so many may be told without asking the twin.
MAX_REVISIONS: Final = 256


class RevisionCache:
    """The revisions of answers. An epoch is whatever changes when they may.

    One stands for `ttl_s` at most.
    """

    def __init__(self, ttl_s: float = REVISION_TTL_S) -> None:
        self._ttl_s = ttl_s
        self._cached: OrderedDict[Hashable, _Cached] = OrderedDict()

    def put(self, question: Hashable, epoch: Hashable, revision: str) -> None:
        """An answer that was asked for in `epoch`, which still is."""
        self._cached[question] = _Cached(epoch, revision, time.monotonic() + self._ttl_s)
        self._cached.move_to_end(question)
        if len(self._cached) > MAX_REVISIONS:
            self._cached.popitem(last=False)

    def revision(self, question: Hashable, epoch: Hashable) -> str | None:
        """That of the answer, as long as it stands; None: ask."""
        cached = self._cached.get(question)
        if cached is None:
            return None
        if cached.epoch != epoch or time.monotonic() > cached.until_s:
            del self._cached[question]
            return None
        return cached.revision


@dataclass(frozen=True, slots=True)
class _Cached:
    epoch: Hashable
    revision: str
    until_s: float


@dataclass(frozen=True, slots=True)
class RevisedEstimate:
    """An estimate, and a digest of it: the same in all replicas."""

    estimate: Estimate
    revision: str


def revised(estimate: Estimate) -> RevisedEstimate:
    """An estimate with its digest; a large one takes milliseconds, so call it on a worker."""
    grid = estimate.grid
    about = (grid.width, grid.height, grid.origin_x, grid.origin_y, grid.resolution, grid.sd_known)
    counts = (estimate.sample_count, estimate.reading_count)
    # As they are on the wire, in float32: a twin elsewhere tells no more.
    digest = blake2b(repr((tuple(map(_float32, about)), counts)).encode(), digest_size=12)
    for cells in (grid.mean, grid.sd):
        digest.update(cells.data)
    return RevisedEstimate(estimate, digest.hexdigest())


def _float32(value: float) -> float:
    with np.errstate(over="ignore"):
        return float(np.float32(value))
