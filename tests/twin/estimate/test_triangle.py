"""The root of a covariance's inverse, by halves."""

from __future__ import annotations

import numpy as np
import pytest

from lupin_twin.estimate.triangle import root_of_inverse


@pytest.mark.parametrize("size", [1, 2, 48, 49, 97, 130])
def test_the_root_s_square_is_the_inverse_and_it_is_a_triangle(size: int) -> None:
    some = np.random.default_rng(size).normal(size=(size, size))
    covariance = some @ some.T + np.eye(size)
    root = root_of_inverse(np.tril(covariance))
    assert root.T @ root == pytest.approx(np.linalg.inv(covariance), abs=1e-9)
    assert not np.triu(root, 1).any()
    assert (np.diagonal(root) > 0.0).all()


def test_it_is_made_in_the_place_that_is_given() -> None:
    covariance = np.diag(np.arange(1.0, 61.0))
    place = np.zeros((60, 60))
    assert root_of_inverse(covariance, place) is place
    assert place == pytest.approx(np.diag(np.arange(1.0, 61.0) ** -0.5))


@pytest.mark.parametrize("size", [3, 60])
def test_what_is_no_covariance_is_refused(size: int) -> None:
    wrong = np.eye(size)
    wrong[-1, -1] = -1.0
    with pytest.raises(np.linalg.LinAlgError):
        root_of_inverse(wrong)
