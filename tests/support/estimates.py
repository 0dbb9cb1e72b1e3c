"""Readings for estimates, at random and by hand."""

import numpy as np
from hypothesis import strategies as st

from lupin_twin.estimate.engine import Estimate
from lupin_twin.estimate.kernel import Hyper, Readings
from lupin_twin.estimate.posterior import EstimateGrid
from lupin_twin.field.grid import FloatArray
from tests.support.textbook_gp import Spot

DAY_S = 86_400.0


def readings_of(
    rows: list[tuple[float, int, float]], places: list[tuple[float, float]]
) -> Readings:
    """Readings from (hour, tag, value) at positions (m)."""
    columns = np.array(rows, dtype=np.float64).reshape(-1, 3).T
    return Readings(columns[0] * 3600.0, columns[1].astype(np.int64), columns[2], np.array(places))


def spots_of(readings: Readings) -> list[Spot]:
    """The position and time of each."""
    return [
        Spot(float(readings.xy[tag, 0]), float(readings.xy[tag, 1]), time_s / 3600.0)
        for time_s, tag in zip(readings.time_s, readings.tag, strict=True)
    ]


def spot_at(place: FloatArray, hour: float) -> Spot:
    """A position (2,), m, at an hour."""
    return Spot(float(place[0]), float(place[1]), hour)


def a_day(tags: int = 8, passes: int = 12) -> Readings:
    """A greenhouse with a warm end, scanned in rounds over a day, °C."""
    chance = np.random.default_rng(0)
    xy = chance.uniform((0.0, 0.0), (4.0, 8.0), (tags, 2))
    time_s = np.sort(chance.uniform(0.0, DAY_S, tags * passes))
    tag = np.tile(np.arange(tags), passes)
    value = 21.0 + 4.0 * np.sin(2.0 * np.pi * time_s / DAY_S) + 0.4 * xy[tag, 1]
    return Readings(time_s, tag, value + chance.normal(0.0, 0.2, len(tag)), xy)


def an_estimate(width: int, height: int, sd_known: float = 2.25) -> Estimate:
    """Means 20, 21, .. and sds 0, 0.5, ..: cells of half a metre, from (-1, 2) on."""
    cells = np.arange(width * height, dtype=np.float32).reshape(height, width)
    mean, sd = cells + np.float32(20.0), cells * np.float32(0.5)
    grid = EstimateGrid(width, height, -1.0, 2.0, 0.5, mean, sd, sd < sd_known, sd_known)
    return Estimate(grid, 3, 7)


_HOURS = st.floats(0.0, 24.0).map(lambda hour: round(hour, 1))
_METRES = st.floats(-5.0, 5.0).map(lambda metres: round(metres, 1))
_VALUES = st.floats(-50.0, 50.0).map(lambda value: round(value, 1))


@st.composite
def some_readings(draw: st.DrawFn) -> Readings:
    """One tag or several, perhaps at one position; one reading or two; one time, one value."""
    places = draw(st.lists(st.tuples(_METRES, _METRES), min_size=1, max_size=4))
    tags = st.integers(0, len(places) - 1)
    hours = draw(st.sampled_from((_HOURS, st.just(7.0))))
    values = draw(st.sampled_from((_VALUES, st.just(21.0))))
    rows = draw(st.lists(st.tuples(hours, tags, values), min_size=1, max_size=10))
    if draw(st.booleans()):
        rows.append(rows[0])
    return readings_of(rows, places)


def _about(median: float) -> st.SearchStrategy[float]:
    return st.floats(0.3, 3.0).map(lambda factor: median * factor)


hypers = st.builds(
    Hyper,
    sg=_about(1.0),
    lg=_about(5.0),
    sp=_about(1.0),
    sa=_about(1.0),
    sh=_about(0.5),
    lh=_about(8.0),
    sq=_about(0.4),
    l=_about(2.5),
    tau=_about(0.15),
    half=_about(0.3),
)
