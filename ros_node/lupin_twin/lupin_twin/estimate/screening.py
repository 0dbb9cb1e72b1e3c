"""Which tags an estimate is made without: those that have changed, and for how long.

Pure. Times are s of ROS time, values the sensor's own unit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from lupin_twin.estimate.changed import CHANGE_Z, Expected, Jury, Off, expected, last_of
from lupin_twin.estimate.kernel import Hyper, pairs_of
from lupin_twin.estimate.model import MAX_EXACT, Model
from lupin_twin.estimate.nearby import Nearby
from lupin_twin.estimate.readings import Readings
from lupin_twin.idw import Abandoned, never

# A tag that had changed has come back when it is not even as far off as this.
RETURN_Z: Final = 2.0
# Of a normal distribution: its sd, as a multiple of the median of what lies off its mean.
_SD_OF_MEDIAN: Final = 1.4826


@dataclass(frozen=True, slots=True)
class Check:
    """A tag's newest reading beside what everything else foretells for it, the sensor's unit.

    `since_s` is the time of the first reading of a tag that has changed; None: it has not.
    """

    z: float
    offset: float
    expected: float
    expected_sd: float
    since_s: float | None

    @property
    def is_left_out(self) -> bool:
        """Whether the estimate does without the tag."""
        return self.since_s is not None


@dataclass(frozen=True, slots=True, eq=False)
class Screening:
    """What of a sensor's readings an estimate is to be made of.

    `checks` are by tag, None for one without readings; `readings` are all but those of changed
    tags, whose rows of `xy` stay.
    """

    checks: tuple[Check | None, ...]
    readings: Readings

    @property
    def changed(self) -> dict[int, float]:
        """The tags left out, by their numbers: since when."""
        return {
            tag: check.since_s
            for tag, check in enumerate(self.checks)
            if check is not None and check.since_s is not None
        }


def screen(
    model: Model,
    readings: Readings,
    before: Mapping[int, float] | None = None,
    should_stop: Callable[[], bool] = never,
) -> Screening:
    """Tell which tags have changed, the clearest first, each held against those that have not.

    As far off as none is by chance, counted in sds; or where the others are off by more than their
    sds, in multiples of that.

    `before` is what had changed at the last call, by tag: since when. What such a tag has read
    since then does not count as its own past. It has come back when its last four readings are
    where they are expected again; or when all that it said before is too old to count: it is then
    a place that is different. At most half of the tags can have changed.

    More than 64 tags are judged a dozen at a time, by eight readings of each tag near them, and
    by the most probable parameters alone.

    Raises:
        lupin_twin.idw.Abandoned: `should_stop`, asked every few milliseconds, said so.

    """
    if len(np.unique(readings.tag)) > MAX_EXACT:
        return _of_many(model, readings, before or {}, should_stop)
    return _of_few(model, readings, before or {}, should_stop)


def _of_many(
    model: Model,
    readings: Readings,
    before: Mapping[int, float],
    should_stop: Callable[[], bool],
) -> Screening:
    one = replace(model, drawn=(model.most_probable,))
    checks: list[Check | None] = [None] * len(readings.xy)
    for near in Nearby(readings).all():
        numbers = near.tags.tolist()
        known = {row: before[tag] for row, tag in enumerate(numbers) if tag in before}
        found = _of_few(one, near.readings, known, should_stop)
        for row in near.judged.tolist():
            checks[numbers[row]] = found.checks[row]
    changed = [tag for tag, check in enumerate(checks) if check is not None and check.is_left_out]
    return Screening(tuple(checks), readings.take(~np.isin(readings.tag, changed)))


def _of_few(
    model: Model,
    readings: Readings,
    before: Mapping[int, float],
    should_stop: Callable[[], bool],
) -> Screening:
    present = [int(tag) for tag in np.unique(readings.tag)]
    since = {tag: at_s for tag, at_s in before.items() if tag in present}
    if 2 * len(since) > len(present):
        since = {}
    for tag, at_s in list(since.items()):
        is_new = bool((readings.time_s[readings.tag == tag] >= at_s).all())
        if is_new or abs(_of_changed(model, readings, since, tag)[0].z) < RETURN_Z:
            del since[tag]
    if not present:
        return Screening((None,) * len(readings.xy), readings)
    while True:
        if should_stop():
            raise Abandoned
        those = _without(readings, since)
        jury = _jury(model, model.most_probable, those)
        blocks = {tag: last_of(those, tag) for tag in present if tag not in since}
        offs = {tag: jury.off(block) for tag, block in blocks.items()}
        worst = max(offs, key=lambda tag: abs(offs[tag].z))
        onset_s = float(those.time_s[blocks[worst][offs[worst].onset]])
        if 2 * (len(since) + 1) > len(present) or not _is_too_far(
            abs(offs[worst].z), model, readings, since | {worst: onset_s}
        ):
            break
        since[worst] = onset_s
    juries = [_jury(model, h, those) for h in model.drawn]
    foretold = {tag: expected(juries, those, block, model.scale) for tag, block in blocks.items()}
    for tag in since:
        offs[tag], foretold[tag] = _of_changed(model, readings, since, tag)
    checks: list[Check | None] = [None] * len(readings.xy)
    for tag, off in offs.items():
        offset, (mean, sd) = off.offset * model.scale.spread, foretold[tag]
        checks[tag] = Check(off.z, offset, mean, sd, since.get(tag))
    return Screening(tuple(checks), those)


def _is_too_far(z: float, model: Model, readings: Readings, without: Mapping[int, float]) -> bool:
    """Whether a tag is so far off, also as a multiple of how far the other tags are.

    Where all are off by more than was foretold it is the model that does not fit the house, and not
    a tag that has changed. How far is told by the median, which a second changed tag hardly moves.
    """
    if z <= CHANGE_Z:
        return False
    those = _without(readings, without)
    jury = _jury(model, model.most_probable, those)
    others = [abs(jury.off(last_of(those, int(tag))).z) for tag in np.unique(those.tag)]
    return z > CHANGE_Z * _SD_OF_MEDIAN * float(np.median(others))


def _of_changed(
    model: Model, readings: Readings, since: Mapping[int, float], tag: int
) -> tuple[Off, Expected]:
    """A tag that has changed, against what it said before, and those that have not."""
    those = _without(readings, {one: at_s for one, at_s in since.items() if one != tag})
    block = last_of(those, tag, since[tag])
    off = _jury(model, model.most_probable, those).off(block)
    juries = [_jury(model, h, those) for h in model.drawn]
    return off, expected(juries, those, block, model.scale)


def _without(readings: Readings, tags: Mapping[int, float]) -> Readings:
    return readings.take(~np.isin(readings.tag, list(tags)))


def _jury(model: Model, h: Hyper, readings: Readings) -> Jury:
    pairs = pairs_of(readings, model.day_length_s)
    return Jury(h, pairs, model.scale.standardised(readings.value))
