"""The episodes of one tag, from which alarms are made: what was wrong, from when to when.

Pure; times are ns of ROS time. An alarm is one episode of a reason at a tag, or of the greenhouse.
It is never stored: it is derived from the observations and the ranges.

An occasion is all that was received of a tag with one stamp. A reason that holds at two occasions
in a row raises an alarm, and two without it clear that; only occasions that can show it count. But:
- Failed attempts have to go on for the tag's usual interval: a second one in the same round says no
  more than the first.
- A sensor that scans leave out is old once its reading is no longer valid, but not before three
  times the sensor's own last interval: a sensor of every tenth scan is not missing from the others.
  Received once, it has no interval yet.
- Too little light has to last two hours: before that, it may be dawn or dusk.
- A pest raises an alarm at once: a later inspection that sees none may have missed it.
- A value out of range counts as such until it is inside by 5 % of the range's width: a value that
  wobbles about a limit is one episode.
- A daily quantity is known at the first scan of the next day. Its one value raises or clears the
  alarm, without deadband.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from hashlib import blake2b
from typing import Final

from lupin_bridge.judge.day import LIGHT, TagDays
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.judge.quantities import DAILY, DERIVED, IsDay
from lupin_bridge.judge.scans import INTERVALS, holds_ns
from lupin_bridge.judge.verdict import (
    DEADBAND,
    Kind,
    Reason,
    Verdict,
    derive,
    failed,
    judge_value,
    pest,
    worst,
)
from lupin_twin.core.past import FOREVER_NS, interval_ns
from lupin_twin.core.state import STATUS_OK, Observation, Reading

# The `tag_id` of an alarm of the whole greenhouse.
SITE = ""


@dataclass(frozen=True, slots=True)
class Alarm:
    """What was wrong, where, from when to when, and how bad at worst.

    `reason` is as it was when the alarm was raised, `tag_id` is `SITE` for the greenhouse. `worst`
    is the value farthest beyond its limit, in the sensor's unit; of a pest, the most counted. The
    reason's verdict is the worst so far, `raised_as` the one with which it was raised, and
    `worse_at_ns` the observation that made it worse.
    """

    id: str
    reason: Reason
    tag_id: str
    raised_at_ns: int
    cleared_at_ns: int | None = None
    worst: float | None = None
    raised_as: Verdict | None = None
    worse_at_ns: int | None = None

    @property
    def is_worse(self) -> bool:
        """Whether its verdict is worse than the one with which it was raised."""
        return self.raised_as is not None and self.reason.verdict is not self.raised_as

    @property
    def is_active(self) -> bool:
        """Whether it has not been cleared."""
        return self.cleared_at_ns is None

    @property
    def cause(self) -> tuple[str, Kind, str, bool]:
        """What is wrong, and where: tag, kind, sensor, and whether the value is too low."""
        value, limit = self.reason.value, self.reason.limit
        is_low = value is not None and limit is not None and value < limit
        return self.tag_id, self.reason.kind, self.reason.sensor, is_low


def alarm_id(tag_id: str, kind: str, sensor: str, run_ns: int, began_ns: int) -> str:
    """The id of an episode, the same in every process that computes it.

    `began_ns` is the observation with which it began. `run_ns` is the start of that run of the
    twin's clock: a simulation has the same times again and again.
    """
    digest = blake2b(digest_size=12)
    for part in (tag_id, kind, sensor, str(run_ns), str(began_ns)):
        text = part.encode("utf-8", "surrogatepass")
        digest.update(len(text).to_bytes(4, "big"))
        digest.update(text)
    return digest.hexdigest()


def silence(last_ns: int) -> Alarm:
    """The alarm of a silent twin, which was last received at `last_ns`."""
    reason = Reason(Kind.SILENT, Verdict.UNKNOWN, since_ns=last_ns)
    return Alarm(alarm_id(SITE, Kind.SILENT, "", 0, last_ns), reason, SITE, last_ns)


# Occasions in a row that raise, and that clear.
HOLD: Final = 2
# Dawn and dusk, and a cloud, are over by then.
TWILIGHT_NS: Final = 2 * 3600 * 1_000_000_000
# Cleared episodes kept per tag by default, however wild a sensor goes.
MAX_EPISODES: Final = 100

# Kind, sensor, and what distinguishes two of these: the side of a range, the kind of an attempt.
Key = tuple[Kind, str, str]
_DIM: Final[Key] = (Kind.RANGE, LIGHT, "low")


@dataclass(frozen=True, slots=True)
class _Watch:
    """A reason being watched at a tag; `against` counts the occasions in a row without it."""

    began_ns: int
    reason: Reason
    worst: float | None
    against: int
    raised_at_ns: int | None = None
    raised_as: Verdict | None = None
    worse_at_ns: int | None = None


@dataclass(frozen=True, slots=True)
class _Finding:
    """What an occasion says of a key; `reason` None: nothing new, though it may still hold."""

    key: Key
    holds: bool
    still_holds: bool
    reason: Reason | None = None
    worse: Callable[[float, float], float] | None = None


@dataclass(slots=True)
class TagEpisodes:
    """A tag's episodes in one run of the clock; `step` takes its occasions in the order of time.

    Of cleared episodes, the last `max_episodes` are kept.
    """

    tag_id: str
    run_ns: int
    by: Criteria
    days: TagDays
    max_episodes: int = MAX_EPISODES
    _first_ns: int = FOREVER_NS
    _species: str = ""
    _scans_ns: tuple[int, ...] = ()
    # By sensor: the last scan that had it, and the time since the one before, ns.
    _received_ns: dict[str, tuple[int, int]] = field(default_factory=dict)
    _watches: dict[Key, _Watch] = field(default_factory=dict)
    _done: tuple[Alarm, ...] = ()

    def copy(self) -> TagEpisodes:
        """An independent copy."""
        return replace(
            self,
            days=self.days.copy(),
            _received_ns=dict(self._received_ns),
            _watches=dict(self._watches),
        )

    def alarms(self, ended_ns: int | None = None) -> Iterator[Alarm]:
        """Yield all alarms; if the run has ended, at `ended_ns`, so have the open ones."""
        yield from self._done
        for key, watch in self._watches.items():
            if watch.raised_at_ns is not None:
                yield self._alarm(key, watch, ended_ns)

    @property
    def may_begin_earlier(self) -> bool:
        """Whether an alarm of now began with the first occasion, so that it may be older."""
        raised = (it.began_ns for it in self._watches.values() if it.raised_at_ns is not None)
        return self._first_ns in raised

    def step(self, writes: Sequence[Observation], is_day: IsDay) -> None:
        """Take the next occasion: `writes` of one stamp, in the order of receipt."""
        stamp_ns = writes[0].stamp_ns
        self._first_ns = min(self._first_ns, stamp_ns)
        for write in writes:
            if write.flower is not None and write.flower.sure_species:
                self._species = write.flower.sure_species
        readings = readings_of(writes)
        if readings:
            self._scans_ns = (*self._scans_ns, stamp_ns)[-INTERVALS - 1 :]
            for name in [reading.name for reading in readings]:
                before_ns, _ = self._received_ns.get(name, (stamp_ns, 0))
                self._received_ns[name] = (stamp_ns, stamp_ns - before_ns)
        for finding in self._findings(writes, readings, stamp_ns, is_day):
            self._note(finding, stamp_ns)

    # --- what an occasion says -----------------------------------------------------------------

    def _findings(
        self,
        writes: Sequence[Observation],
        readings: Sequence[Reading],
        stamp_ns: int,
        is_day: IsDay,
    ) -> Iterator[_Finding]:
        day: bool | None = None
        for reading in (*readings, *derive(readings)):
            name = reading.name
            sensor = self.by.sensors.named(name)
            is_good = sensor.is_plausible(reading.value)
            key = (Kind.READING_FAILED, name, "")
            if name not in DERIVED and (not is_good or key in self._watches):
                yield _Finding(key, not is_good, not is_good, failed(reading, sensor))
            if is_good:
                day = is_day(stamp_ns) if day is None else day
                yield from self._of_range(reading, is_day=day)
                for of_day in self.days.step(name, reading.value, stamp_ns):
                    # A sensor of that name takes precedence.
                    if of_day.name not in self._received_ns:
                        yield from self._of_range(of_day, is_day=True)
        if readings:
            yield from self._of_age({reading.name for reading in readings}, stamp_ns)
        for kind, status in {write.kind: write.status for write in writes}.items():
            fails, key = status != STATUS_OK, (Kind.SCAN_FAILED, "", str(kind))
            if fails or key in self._watches:
                reason = Reason(
                    Kind.SCAN_FAILED, Verdict.UNKNOWN, value=float(status), since_ns=stamp_ns
                )
                yield _Finding(key, fails, fails, reason)
        seen = next((w.flower for w in reversed(writes) if w.flower is not None), None)
        if seen is not None:
            reason = pest(seen.bug_count, stamp_ns)
            yield _Finding((Kind.PEST, "", ""), seen.anomaly, seen.anomaly, reason, max)

    def _of_range(self, reading: Reading, *, is_day: bool) -> Iterator[_Finding]:
        ranges = self.by.sensors.named(reading.name).ranges(is_day=is_day, species=self._species)
        ideal, value = ranges.ideal, reading.value
        for side in ("low", "high"):
            key = (Kind.RANGE, reading.name, side)
            if ideal is None:
                yield _Finding(key, holds=False, still_holds=False)
                continue
            is_out = value < ideal.low if side == "low" else value > ideal.high
            if not is_out and key not in self._watches:
                continue
            band = 0.0 if reading.name in DAILY else DEADBAND * ideal.width
            is_near = value < ideal.low + band if side == "low" else value > ideal.high - band
            reason = judge_value(reading, ranges) if is_out else None
            yield _Finding(key, is_out, is_near, reason, min if side == "low" else max)

    def _of_age(self, present: Collection[str], stamp_ns: int) -> Iterator[_Finding]:
        """Findings on the age of each known sensor, whether the scan has it or left it out."""
        holds: int | None = None
        for name, (last_ns, interval) in self._received_ns.items():
            key = (Kind.OLD, name, "")
            if name in present:
                if key in self._watches:
                    yield _Finding(key, holds=False, still_holds=False)
                continue
            if holds is None:
                holds = self.by.holds_ns(self._scans_ns)
            is_fixed = self.by.recent_s is not None
            limit_ns = holds if is_fixed else max(holds, holds_ns(interval or None))
            is_old = stamp_ns - last_ns > limit_ns
            old = Reason(Kind.OLD, Verdict.UNKNOWN, name, limit=limit_ns / 1e9, since_ns=last_ns)
            yield _Finding(key, is_old, is_old, old)

    # --- how it goes on ------------------------------------------------------------------------

    def _note(self, finding: _Finding, stamp_ns: int) -> None:
        watch = self._watches.get(finding.key)
        is_daily = finding.key[1] in DAILY
        if watch is None:
            if finding.holds and finding.reason is not None:
                value = finding.reason.value if finding.worse else None
                watch = _Watch(stamp_ns, finding.reason, value, 0)
                if is_daily or finding.key[0] is Kind.PEST:
                    verdict = finding.reason.verdict
                    watch = replace(watch, raised_at_ns=stamp_ns, raised_as=verdict)
                self._watches[finding.key] = watch
            return
        if watch.raised_at_ns is None and not finding.holds:
            del self._watches[finding.key]
        elif not finding.still_holds:
            watch = replace(watch, against=watch.against + 1)
            self._watches[finding.key] = watch
            if watch.against == (1 if is_daily else HOLD):
                done = self._alarm(finding.key, watch, stamp_ns)
                self._done = (*self._done, done)[-self.max_episodes :]
                del self._watches[finding.key]
        else:
            self._watches[finding.key] = self._ongoing(watch, finding, stamp_ns)

    def _ongoing(self, watch: _Watch, finding: _Finding, stamp_ns: int) -> _Watch:
        """The watch after one more occasion at which its reason held."""
        now, reason, extreme = finding.reason, watch.reason, watch.worst
        if now is None:
            return replace(watch, against=0)
        if finding.worse is not None and now.value is not None and extreme is not None:
            extreme = finding.worse(extreme, now.value)
        verdict = worst((reason.verdict, now.verdict)) or now.verdict
        if watch.raised_at_ns is not None:
            # Most occasions say nothing new, and a dense day has a hundred thousand.
            if (verdict, extreme, 0) == (reason.verdict, watch.worst, watch.against):
                return watch
            if verdict is not reason.verdict:
                watch = replace(watch, worse_at_ns=stamp_ns)
        elif self._has_lasted(finding.key, watch, stamp_ns):
            # Raised now, with the current reason, since the first occasion; `old` is since its last
            # reading.
            is_old = now.kind is Kind.OLD
            reason = now if is_old else replace(now, since_ns=watch.began_ns)
            watch = replace(watch, raised_at_ns=stamp_ns, raised_as=verdict)
        return replace(watch, against=0, worst=extreme, reason=replace(reason, verdict=verdict))

    def _has_lasted(self, key: Key, watch: _Watch, stamp_ns: int) -> bool:
        if key == _DIM:
            return stamp_ns - watch.began_ns >= TWILIGHT_NS
        if key[0] is not Kind.SCAN_FAILED:
            return True
        usual_ns = interval_ns(self._scans_ns)
        if usual_ns is None:
            # Scanned once: the first failure shows when the next round came.
            usual_ns = watch.began_ns - self._scans_ns[0] if self._scans_ns else 0
        return stamp_ns - watch.began_ns >= usual_ns

    def _alarm(self, key: Key, watch: _Watch, cleared_at_ns: int | None) -> Alarm:
        assert watch.raised_at_ns is not None
        kind, sensor, which = key
        return Alarm(
            id=alarm_id(self.tag_id, f"{kind} {which}", sensor, self.run_ns, watch.began_ns),
            reason=watch.reason,
            tag_id=self.tag_id,
            raised_at_ns=watch.raised_at_ns,
            cleared_at_ns=cleared_at_ns,
            worst=watch.worst,
            raised_as=watch.raised_as,
            worse_at_ns=watch.worse_at_ns,
        )


def readings_of(writes: Sequence[Observation]) -> tuple[Reading, ...]:
    """The readings of an occasion: for each sensor, the one received last."""
    stamp_ns = writes[0].stamp_ns
    latest = {name: value for write in writes for name, value in write.readings.items()}
    return tuple(Reading(name, value, stamp_ns) for name, value in latest.items())
