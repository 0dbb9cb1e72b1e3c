"""What becomes of each scan that is heard: held against what was foretold for it, then learnt from.

Pure. A round takes the scans of one sensor that were heard since the one before. They are graded by
a posterior that was loaded before any of them was heard; then the readings are screened for tags
that have changed, and loaded anew. `Watch` belongs to the node's thread; a `Round` that was handed
out is immutable, and any thread may run it. Metres in the map frame, times ns of ROS time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

import numpy as np

from lupin_twin.estimate import Check, Model, Posterior, TiledPosterior, screen
from lupin_twin.estimates import TagPast, is_usable, readings_of
from lupin_twin.grading import HALF_WIDTH_SDS, Grades, Record, Tally
from lupin_twin.idw import never
from lupin_twin.state import NANOSECONDS_PER_SECOND, Scan
from lupin_twin.workers import in_turns

# A round of a sensor comes as often at most, s.
ROUND_REST_S: Final = 2.0
# One posterior foretells for so long, a share of the day: a quarter of an hour. From one moment to
# the next anybody can foretell; a day that is far too long is seen by what is foretold for later.
HOLD_SHARE: Final = 1.0 / 96.0
# Of more scans a round, the first are graded.
MAX_GRADED: Final = 256


@dataclass(frozen=True, slots=True)
class Heard:
    """A reading that has just come."""

    tag_id: str
    stamp_ns: int
    value: float


@dataclass(frozen=True, slots=True)
class TagCheck:
    """A tag's newest reading beside what is expected of it; see `estimate.Check`."""

    tag_id: str
    measured: float
    observed_at_ns: int
    expected: float
    expected_sd: float
    z: float
    offset: float
    changed_since_ns: int | None


@dataclass(frozen=True, slots=True, eq=False)
class Loaded:
    """What a sensor's readings say as of `at_ns`, by a model; made of all but the changed tags."""

    at_ns: int
    model: Model
    posterior: Posterior | TiledPosterior
    checks: tuple[TagCheck, ...]

    @property
    def changed(self) -> Mapping[str, int]:
        """The tags that are left out, and since when."""
        return MappingProxyType(
            {
                one.tag_id: one.changed_since_ns
                for one in self.checks
                if one.changed_since_ns is not None
            }
        )

    def grade(self, heard: Sequence[Heard], places: Mapping[str, tuple[float, float]]) -> Tally:
        """How many of what came later lie where they were foretold.

        What is not later was known, or is heard again; of a tag that is left out, or that has no
        place, nothing is foretold.
        """
        newest_s = float(self.posterior.readings.time_s.max())
        changed = self.changed
        those = [
            (one, later_s)
            for one in heard
            if (later_s := (one.stamp_ns - self.at_ns) / NANOSECONDS_PER_SECOND) > newest_s
            and one.tag_id in places
            and one.tag_id not in changed
        ]
        if not those:
            return Tally()
        mean, sd = self.posterior.foretell(
            np.array([places[one.tag_id] for one, _ in those]),
            np.array([later_s for _, later_s in those]),
        )
        off = np.abs(np.array([one.value for one, _ in those]) - mean)
        return Tally(len(those), int((off <= HALF_WIDTH_SDS * sd).sum()))


@dataclass(frozen=True, slots=True)
class Done:
    """What a round came to: the grades, what was loaded, and what is held to foretell."""

    graded: Tally
    loaded: Loaded
    foretelling: Loaded


@dataclass(frozen=True, slots=True)
class Round:
    """A round that is not run yet."""

    sensor: str
    model: Model
    heard: tuple[Heard, ...]
    before: Loaded | None
    foretelling: Loaded | None

    def run(
        self,
        pasts: Sequence[TagPast],
        now_ns: int,
        should_stop: Callable[[], bool] = never,
    ) -> Done:
        """Grade, screen and load; `pasts` is what memory holds, of these scans too.

        Raises:
            lupin_twin.idw.Abandoned: `should_stop`, asked every few milliseconds, said so.
            lupin_twin.fields.FieldRefused: see `readings_of`.
            numpy.linalg.LinAlgError: numbers that nothing can be made of.

        """
        graded = Tally()
        if self.foretelling is not None:
            places = {past.tag_id: (past.x, past.y) for past in pasts}
            graded = self.foretelling.grade(self.heard, places)
        changed = {} if self.before is None else self.before.changed
        loaded = load(self.model, pasts, now_ns, changed, should_stop)
        held = self.foretelling
        hold_ns = HOLD_SHARE * self.model.day_length_s * NANOSECONDS_PER_SECOND
        if held is None or not 0 <= now_ns - held.at_ns < hold_ns:
            held = loaded
        return Done(graded, loaded, held)


def load(
    model: Model,
    pasts: Sequence[TagPast],
    at_ns: int,
    changed: Mapping[str, int],
    should_stop: Callable[[], bool] = never,
) -> Loaded:
    """What the readings say as of `at_ns`, without the tags that have changed.

    `changed` are those that had, and since when. Raises as `Round.run` does.
    """
    reach_ns = int(model.day_length_s * NANOSECONDS_PER_SECOND)
    those = [
        past
        for past in in_turns(pasts)
        if any(0 <= at_ns - ns <= reach_ns for ns, _ in past.readings)
    ]
    readings = readings_of(those, at_ns, model.day_length_s)
    before = {
        row: (changed[past.tag_id] - at_ns) / NANOSECONDS_PER_SECOND
        for row, past in enumerate(those)
        if past.tag_id in changed
    }
    screening = screen(model, readings, before, should_stop)
    posterior = model.posterior(screening.readings, 0.0)
    checks = [
        _check(past, check, at_ns)
        for past, check in in_turns(zip(those, screening.checks, strict=True))
        if check is not None
    ]
    return Loaded(at_ns, model, posterior, tuple(checks))


def _check(past: TagPast, check: Check, at_ns: int) -> TagCheck:
    observed_at_ns, measured = max(one for one in past.readings if one[0] <= at_ns)
    since_s = check.since_s
    return TagCheck(
        past.tag_id,
        measured,
        observed_at_ns,
        check.expected,
        check.expected_sd,
        check.z,
        check.offset,
        None if since_s is None else at_ns + round(since_s * NANOSECONDS_PER_SECOND),
    )


@dataclass(slots=True)
class _Sensor:
    grades: Grades
    heard: list[Heard] = field(default_factory=list)
    not_graded: int = 0
    loaded: Loaded | None = None
    foretelling: Loaded | None = None
    rested_s: float = -math.inf


class Watch:
    """Each sensor's scans since its last round, its grades, and whose turn it is.

    Seconds are of a clock that never jumps. `skipped` counts scans that were too many to be graded.
    """

    def __init__(self, day_length_s: float) -> None:
        self.skipped = 0
        self._day_length_s = day_length_s
        self._sensors: dict[str, _Sensor] = {}
        self._running: str | None = None

    def hear(self, scan: Scan) -> None:
        """A scan was accepted."""
        for reading in scan.readings:
            one = self._sensors.get(reading.name)
            if one is None or not is_usable(reading.value):
                continue  # nothing was foretold yet
            if len(one.heard) < MAX_GRADED:
                one.heard.append(Heard(scan.tag_id, scan.stamp_ns, reading.value))
            else:
                self.skipped += 1
                one.not_graded += 1

    def due(self, models: Mapping[str, Model], now_s: float) -> Round | None:
        """The round that is to be run now, of the sensor that waits longest; None: nobody's turn.

        `models` are those that serve. A model that is another is a reason too.
        """
        if self._running is not None:
            return None
        waiting = []
        for name, model in models.items():
            one = self._sensors.get(name)
            if one is None:
                one = self._sensors[name] = _Sensor(Grades(self._day_length_s))
            is_new = one.loaded is None or one.loaded.model is not model
            if (one.heard or is_new) and now_s - one.rested_s >= ROUND_REST_S:
                waiting.append((one.rested_s, name))
        if not waiting:
            return None
        name = min(waiting)[1]
        one = self._sensors[name]
        return Round(name, models[name], tuple(one.heard), one.loaded, one.foretelling)

    def begin(self, round_: Round) -> int:
        """It has begun; how many of its scans are not graded, being too many."""
        one = self._sensors[round_.sensor]
        self._running = round_.sensor
        one.heard, left = [], one.not_graded
        one.not_graded = 0
        return left

    def end(self, outcome: Done | Exception, now_s: float, now_ns: int) -> None:
        """It has ended; one that came to nothing leaves what was loaded before."""
        assert self._running is not None
        name, self._running = self._running, None
        one = self._sensors[name]
        one.rested_s = now_s
        if not isinstance(outcome, Exception):
            one.loaded, one.foretelling = outcome.loaded, outcome.foretelling
            one.grades.add(outcome.graded, now_ns)

    def loaded(self, sensor: str) -> Loaded | None:
        """What was loaded last; None: nothing yet."""
        one = self._sensors.get(sensor)
        return None if one is None else one.loaded

    def record(self, sensor: str, now_ns: int) -> Record:
        """How a sensor's estimates have done."""
        one = self._sensors.get(sensor)
        return Record(None, Tally(), Tally()) if one is None else one.grades.record(now_ns)

    def distrusted(self, now_ns: int) -> list[str]:
        """The sensors whose models are wrong, by their record."""
        return [
            name for name, one in self._sensors.items() if not one.grades.record(now_ns).is_trusted
        ]
