"""A field with its error, in space and time, from all readings of a day.

Pure: numpy and the standard library only.
"""

from lupin_twin.estimate.cholesky import MAX_EXACT, PER_TAG, Change, Place
from lupin_twin.estimate.kernel import MAX_PER_TAG, Readings
from lupin_twin.estimate.model import FitFailed, Model, fit
from lupin_twin.estimate.posterior import EstimateGrid, Posterior

__all__ = [
    "MAX_EXACT",
    "MAX_PER_TAG",
    "PER_TAG",
    "Change",
    "EstimateGrid",
    "FitFailed",
    "Model",
    "Place",
    "Posterior",
    "Readings",
    "fit",
]
