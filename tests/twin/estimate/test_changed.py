"""A tag's last readings held against all else: the same as leaving them out, by the textbook."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.estimate import Model, Readings
from lupin_twin.estimate.changed import CHANGE_READINGS, CHANGE_Z, Change, last_of
from lupin_twin.estimate.kernel import Hyper
from lupin_twin.estimate.readings import Scale
from tests.support import textbook_gp
from tests.support.estimates import DAY_S, hypers, readings_of, some_readings, spots_of

SCALE = Scale(20.0, 2.0)


@given(some_readings(), st.lists(hypers, min_size=1, max_size=3))
def test_what_is_expected_and_how_far_off_it_is_are_the_textbook_s(
    readings: Readings, drawn: list[Hyper]
) -> None:
    model = Model(SCALE, 2.0, DAY_S, drawn[0], tuple(drawn))
    posterior = model.posterior(readings, float(readings.time_s.max()))
    y = SCALE.standardised(readings.value)
    found = zip(posterior.changes(), posterior.expected(), strict=True)
    for tag, (change, expected) in enumerate(found):
        block = last_of(readings, tag).tolist()
        if not block:
            assert change is None
            assert expected is None
            continue
        assert change is not None
        assert expected is not None
        each = [textbook_gp.left_out(spots_of(readings), y, block, h) for h in drawn]
        means = np.array([mean[-1] for mean, _ in each])
        variance = np.mean([covariance[-1, -1] for _, covariance in each]) + means.var()
        assert expected.mean == pytest.approx(20.0 + 2.0 * means.mean(), rel=1e-6, abs=1e-5)
        assert expected.sd == pytest.approx(2.0 * variance**0.5, rel=1e-6)
        mean, covariance = each[0]
        weights = np.linalg.inv(covariance).sum(axis=0)
        offset = float(weights @ (y[block] - mean) / weights.sum())
        assert change.offset == pytest.approx(2.0 * offset, rel=1e-5, abs=1e-5)
        assert change.z == pytest.approx(offset * float(weights.sum()) ** 0.5, rel=1e-5, abs=1e-5)


def test_the_last_four_are_left_out_or_all_since_a_moment_the_oldest_first() -> None:
    rows = [(float(hour), 0, 20.0) for hour in (5, 1, 4, 2, 3, 6)] + [(9.0, 1, 20.0)]
    readings = readings_of(rows, [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)])
    assert last_of(readings, 0).tolist() == [4, 2, 0, 5]
    assert len(last_of(readings, 0)) == CHANGE_READINGS
    assert last_of(readings, 0, 2.0 * 3600.0).tolist() == [3, 4, 2, 0, 5]
    assert last_of(readings, 1).tolist() == [6]
    assert last_of(readings, 2).tolist() == []


def test_a_change_is_beyond_the_limit_on_either_side() -> None:
    assert not Change(CHANGE_Z, 1.0).has_changed
    assert not Change(-CHANGE_Z, 1.0).has_changed
    assert Change(np.nextafter(CHANGE_Z, 9.0), 1.0).has_changed
    assert Change(-np.nextafter(CHANGE_Z, 9.0), 1.0).has_changed
