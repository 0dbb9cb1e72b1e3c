"""GetEstimate without ROS: which readings count, when a model is fitted, and what an answer is.

Pure. `Models` belongs to the node's thread; an `EstimateJob` that was handed out is immutable, and
any thread may compute it. Metres in the map frame, times ns of ROS time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from lupin_twin.estimate import (
    LAST,
    LONGER,
    MAX_EXACT,
    NOTHING,
    EstimateGrid,
    FitFailed,
    Model,
    Nearby,
    Readings,
    fit,
    gains,
    longer_by,
)
from lupin_twin.fields import FieldRefused, FieldRequest, check_request
from lupin_twin.history import PastScan
from lupin_twin.idw import Abandoned, never
from lupin_twin.state import FLOAT32_MAX, NANOSECONDS_PER_SECOND, Reading, TagState

# The service's name, relative to the node's namespace.
ESTIMATE_SERVICE: Final = "twin/get_estimate"
MAX_TAGS: Final = 10_000
# The readings of so few tags all hang together: what they cost grows with the third power of their
# number. Of each of more tags, so many count.
MAX_READINGS: Final = 640
PER_MANY_TAGS: Final = LAST
# The parameters of a house are as well known from these as from more.
MAX_FITTED: Final = 400
# With fewer there is little to learn: each answer is fitted by itself.
FIRST_FIT: Final = 10
# The first model of a sensor is waited for, after a restart those of all sensors: it is fitted to
# so few, a tenth of the work, and serves until the next one.
FIRST_FITTED: Final = 64
# A model is fitted anew as often, s, where anything was heard since, and where this much was.
FIT_PERIOD_S: Final = 300.0
FIT_REST_S: Final = 10.0
GROWN: Final = 1.5
# A fit that takes so long is told of, s; it waits for the round of a house of 10,000 tags.
FIT_SLOW_S: Final = 120.0
# An estimate of now is one of the last whole minute of a day of so many, or of the newest reading.
MINUTES_A_DAY: Final = 1_440
# What answers take, roughly and at worst, s of one core: for each pair of readings or, of many
# tags, for each of these; and for each cell.
_PAIR_S: Final = 0.6e-6
_TAG_S: Final = 150e-6
_CELL_S: Final = 0.2e-6


@dataclass(frozen=True, slots=True)
class EstimateRequest:
    """A sensor over a box, as GetField asks for it, as of a moment; `at_ns` 0 is now."""

    box: FieldRequest
    at_ns: int = 0

    def check(self, now_ns: int, max_grid_cells: int) -> None:
        """Refuse what cannot be answered.

        Raises:
            FieldRefused: names the field, the value and the limit.

        """
        check_request(self.box, max_grid_cells)
        if self.at_ns < 0 or self.at_ns > now_ns:
            at_s, now_s = self.at_ns / NANOSECONDS_PER_SECOND, now_ns / NANOSECONDS_PER_SECOND
            raise FieldRefused(f"at is {at_s} s, the limits are 0 and now, {now_s} s")


@dataclass(frozen=True, slots=True)
class TagPast:
    """A tag's place, and its readings of one sensor: (ns, value), in any order."""

    tag_id: str
    x: float
    y: float
    readings: tuple[tuple[int, float], ...]


@dataclass(frozen=True, slots=True)
class Estimate:
    """An answer: the grid, and how many tags and readings it was made of."""

    grid: EstimateGrid
    sample_count: int
    reading_count: int


def is_usable(value: float) -> bool:
    """Whether an estimate, whose numbers become float32, can take a value; NaN it cannot."""
    return abs(value) <= FLOAT32_MAX


def past_of(tag: TagState, scans: Iterable[PastScan], sensor: str) -> TagPast | None:
    """What memory holds of a tag and a sensor; None without a place, or without a finite reading.

    The newest is in the state: it may be older than any scan that is kept.
    """
    if tag.pose is None:
        return None
    read = [(scan.stamp_ns, reading) for scan in scans for reading in scan.readings]
    read += [
        (reading.observed_at_ns, reading)
        for reading in tag.readings
        if reading.observed_at_ns is not None
    ]
    found = {
        (stamp_ns, reading.value)
        for stamp_ns, reading in read
        if reading.name == sensor and is_usable(reading.value)
    }
    return TagPast(tag.tag_id, tag.pose.x, tag.pose.y, tuple(sorted(found))) if found else None


def moment_of(tags: Sequence[TagPast], now_ns: int, day_length_s: float) -> int:
    """The moment that an estimate of now is made for, not later than `now_ns`.

    A minute of the day changes nothing that anybody could tell; but of the same readings the same
    estimate is made throughout it, to the last bit.
    """
    minute_ns = int(day_length_s / MINUTES_A_DAY * NANOSECONDS_PER_SECOND)
    stamps_ns = (ns for tag in tags for ns, _ in tag.readings if ns <= now_ns)
    return max(now_ns - now_ns % minute_ns, max(stamps_ns, default=0))


def readings_of(tags: Sequence[TagPast], at_ns: int, day_length_s: float) -> Readings:
    """Those that count as of `at_ns`, by seconds from then on (they are not greater than 0).

    A day's, as many of each tag as all tags together may have: see `Readings.thinned`.

    Raises:
        FieldRefused: no reading within a day, or more tags than can be reckoned with.

    """
    all_of = Readings(
        np.array([(ns - at_ns) / NANOSECONDS_PER_SECOND for tag in tags for ns, _ in tag.readings]),
        np.array([index for index, tag in enumerate(tags) for _ in tag.readings], dtype=np.int64),
        np.array([value for tag in tags for _, value in tag.readings]),
        np.array([(tag.x, tag.y) for tag in tags]).reshape(-1, 2),
    )
    recent = all_of.recent(0.0, day_length_s=day_length_s)
    present = np.unique(recent.tag)
    if len(present) > MAX_TAGS:
        raise FieldRefused(
            f"{len(present)} tags have this sensor, an estimate is made of {MAX_TAGS} at most"
        )
    if not len(present):
        raise FieldRefused(f"no tag has a reading of the {day_length_s:g} s before that moment")
    index = np.searchsorted(present, recent.tag)
    those = Readings(recent.time_s, index, recent.value, recent.xy[present])
    is_few = len(present) <= MAX_EXACT
    per_tag = MAX_READINGS // len(present) if is_few else PER_MANY_TAGS
    return those.thinned(per_tag)


def fitted(
    readings: Readings,
    day_length_s: float,
    should_stop: Callable[[], bool] = never,
    most: int = MAX_FITTED,
) -> Model:
    """A model of readings that `readings_of` has chosen; of more than `most`, of some of them.

    They lie anywhere; of many tags, they are of some groups of a dozen that are near each other.

    Raises:
        lupin_twin.estimate.FitFailed: they do not let themselves be fitted.
        Abandoned: `should_stop`, asked every few milliseconds, said so.

    """
    return fit(_some(readings, most), day_length_s=day_length_s, should_stop=should_stop)


def gains_of_longer_days(
    tags: Sequence[TagPast],
    at_ns: int,
    day_length_s: float,
    should_stop: Callable[[], bool] = never,
) -> tuple[float, ...]:
    """How much better longer days explain what was read over many: see `estimate.gains`.

    Raises:
        FieldRefused: see `readings_of`.
        lupin_twin.estimate.FitFailed: they do not let themselves be fitted.
        Abandoned: `should_stop`, asked every few milliseconds, said so.

    """
    readings = readings_of(tags, at_ns, max(LONGER) * day_length_s)
    return gains(_some(readings, FIRST_FITTED), day_length_s, should_stop)


def _some(readings: Readings, most: int) -> Readings:
    """About so many of them, if they are more."""
    if len(np.unique(readings.tag)) > MAX_EXACT:
        return Nearby(readings).some(most)
    if len(readings) <= most:
        return readings
    chosen = np.random.default_rng(len(readings)).permutation(len(readings))[:most]
    return readings.take(np.sort(chosen))


@dataclass(frozen=True, slots=True)
class EstimateJob:
    """An estimate that is not computed yet; without a model, one is fitted for it alone.

    `changed` are the tags that it does without, by since when.
    """

    request: EstimateRequest
    model: Model | None
    day_length_s: float
    changed: Mapping[str, int] = field(default_factory=dict)

    def compute(
        self, tags: Sequence[TagPast], now_ns: int, should_stop: Callable[[], bool] = never
    ) -> Estimate:
        """The estimate of what `tags` remember, as of the moment asked for.

        Raises:
            FieldRefused: see `readings_of`; or there are numbers among them that nothing can be
                made of.
            Abandoned: `should_stop`, asked between the steps, said so.

        """
        at_ns = self.request.at_ns or moment_of(tags, now_ns, self.day_length_s)
        tags = [tag for tag in tags if self.changed.get(tag.tag_id, at_ns + 1) > at_ns]
        readings = readings_of(tags, at_ns, self.day_length_s)
        box = self.request.box
        try:
            model = self.model
            if model is None:
                model = fitted(readings, self.day_length_s, should_stop)
            posterior = model.posterior(readings, 0.0, should_stop)
            _go_on_unless(should_stop)
            grid = posterior.grid(
                bbox_min_x=box.bbox_min_x,
                bbox_min_y=box.bbox_min_y,
                bbox_max_x=box.bbox_max_x,
                bbox_max_y=box.bbox_max_y,
                resolution=box.resolution,
            )
        except (FitFailed, np.linalg.LinAlgError) as error:
            raise FieldRefused(f"these readings cannot be reckoned with: {error}") from error
        return Estimate(grid, len(readings.xy), len(readings))


def _go_on_unless(should_stop: Callable[[], bool]) -> None:
    if should_stop():
        raise Abandoned


def cost_s(request: EstimateRequest, tags: int, max_grid_cells: int) -> float:
    """About how long an estimate of so many tags takes, s of one core."""
    width, height = check_request(request.box, max_grid_cells)
    readings = min(MAX_READINGS, 32 * tags)
    of_tags = readings**2 * _PAIR_S if tags <= MAX_EXACT else tags * _TAG_S
    return of_tags + width * height * _CELL_S


@dataclass(frozen=True, slots=True)
class Fit:
    """The model that serves, and when it was fitted, ns of ROS time; None: there is none.

    `problem` is why the last fit came to nothing, that one takes long, or that the day's length is
    wrong; empty: nothing is.
    """

    model: Model | None = None
    at_ns: int | None = None
    problem: str = ""


@dataclass(slots=True)
class _Sensor:
    heard: int = 0
    fitted_at: int = 0
    fitted_s: float = -math.inf
    fit: Fit = Fit()
    gains: tuple[float, ...] = NOTHING


@dataclass(slots=True)
class Models:
    """The newest model of each sensor, and whose turn it is. One fit at a time.

    Seconds are of a clock that never jumps. Until a fit comes to something, the model before it
    serves; `failed` counts those that came to nothing.
    """

    failed: int = 0
    _sensors: dict[str, _Sensor] = field(default_factory=dict)
    _fitting: str | None = None

    def hear(self, readings: Iterable[Reading]) -> bool:
        """Readings were accepted; whether a sensor has just got enough for its first model."""
        is_enough = False
        for reading in readings:
            if is_usable(reading.value):
                one = self._sensors.setdefault(reading.name, _Sensor())
                one.heard += 1
                is_enough = is_enough or one.heard == FIRST_FIT
        return is_enough

    def of(self, sensor: str) -> Fit:
        """What serves; without a model, too little was heard, or nothing was fitted yet."""
        known = self._sensors.get(sensor)
        if known is None:
            return Fit()
        return replace(known.fit, problem=self._problem(known))

    def serving(self) -> dict[str, Model]:
        """The models that serve, by sensor."""
        return {
            name: one.fit.model for name, one in self._sensors.items() if one.fit.model is not None
        }

    def problems(self) -> dict[str, str]:
        """What is wrong with fits, by sensor."""
        told = {name: self._problem(one) for name, one in self._sensors.items()}
        return {name: problem for name, problem in told.items() if problem}

    @property
    def day_problem(self) -> str:
        """Why the day's length is wrong; empty: nothing says so."""
        longer = longer_by([one.gains for one in self._sensors.values()])
        if longer is None:
            return ""
        return f"by its readings, a day takes some {longer:g} times as long as day_length_s"

    def weigh(self, sensor: str, gains: tuple[float, ...]) -> None:
        """By how many nats longer days explain a sensor's readings better than the one told."""
        self._sensors[sensor].gains = gains

    def _problem(self, one: _Sensor) -> str:
        return one.fit.problem or ("" if one.fit.model is None else self.day_problem)

    def due(self, now_s: float) -> str | None:
        """The sensor that is to be fitted now, the one that waits longest; None: nobody's turn."""
        if self._fitting is not None:
            self._tell_slowness(self._sensors[self._fitting], now_s)
            return None
        waiting = [
            (one.fitted_s, name) for name, one in self._sensors.items() if _is_due(one, now_s)
        ]
        return min(waiting)[1] if waiting else None

    def begin(self, sensor: str, now_s: float) -> int:
        """A fit has begun, of so many readings at most."""
        one = self._sensors[sensor]
        one.fitted_s, one.fitted_at = now_s, one.heard
        self._fitting = sensor
        return FIRST_FITTED if one.fit.model is None else MAX_FITTED

    def end(self, sensor: str, outcome: Model | Exception, now_ns: int) -> None:
        """It has ended."""
        self._fitting = None
        one = self._sensors[sensor]
        if isinstance(outcome, Exception):
            self.failed += 1
            one.fit = replace(one.fit, problem=str(outcome) or repr(outcome))
        else:
            if one.fit.model is None:  # what it was not fitted to is still to be learnt from
                one.fitted_at = min(one.fitted_at, FIRST_FITTED)
            one.fit = Fit(outcome, now_ns)

    def _tell_slowness(self, one: _Sensor, now_s: float) -> None:
        if now_s - one.fitted_s > FIT_SLOW_S:
            one.fit = replace(one.fit, problem=f"a fit takes longer than {FIT_SLOW_S:g} s")


def _is_due(one: _Sensor, now_s: float) -> bool:
    if one.heard < FIRST_FIT or one.heard == one.fitted_at:
        return False
    since_s = now_s - one.fitted_s
    has_grown = one.heard >= GROWN * one.fitted_at
    return since_s >= FIT_PERIOD_S or (has_grown and since_s >= FIT_REST_S)
