"""Triangular roots: what solves with a covariance, as products of matrices.

Pure. NumPy has no solver for triangles. By halves, factor and inverse are found together, almost
all of it in products of large matrices, in half the time of finding one after the other.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from lupin_twin.grid import FloatArray

# Below, halving costs more than it saves.
_SMALL: Final = 48


def root_of_inverse(covariance: FloatArray, into: FloatArray | None = None) -> FloatArray:
    """Lower triangular W (n, n) with W' W the inverse of a covariance (n, n).

    Of the covariance it reads the lower triangle alone. `into` is overwritten and returned, if
    given; its upper triangle must be 0.

    With [[A, .], [B, C]] and V' V = A^-1 the Schur complement is S = C - (B V')(B V')'; with
    U' U = S^-1 the root is [[V, 0], [-U B V' V, U]].

    Raises:
        numpy.linalg.LinAlgError: it is not positive definite, as far as floats can tell.

    """
    result = np.zeros_like(covariance) if into is None else into
    _root(covariance, result)
    return result


def _root(covariance: FloatArray, into: FloatArray) -> None:
    if len(covariance) <= _SMALL:
        into[:] = np.tril(np.linalg.inv(np.linalg.cholesky(covariance)))
        return
    half = len(covariance) // 2
    first, last = into[:half, :half], into[half:, half:]
    _root(covariance[:half, :half], first)
    across = covariance[half:, :half] @ first.T
    schur = across @ across.T
    np.subtract(covariance[half:, half:], schur, out=schur)
    _root(schur, last)
    below = into[half:, :half]
    np.matmul(last, across @ first, out=below)
    np.negative(below, out=below)
