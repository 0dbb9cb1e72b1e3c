"""A field with its error, in space and time, from all readings of a day.

Pure: numpy and the standard library only.
"""

from lupin_twin.estimate.advice import Place
from lupin_twin.estimate.cells import EstimateGrid
from lupin_twin.estimate.fitting import FitFailed
from lupin_twin.estimate.left_out import Change
from lupin_twin.estimate.model import SDS_OF_IDEAL, Model, fit
from lupin_twin.estimate.neighbours import MAX_EXACT, PER_TAG
from lupin_twin.estimate.posterior import Posterior
from lupin_twin.estimate.readings import MAX_PER_TAG, Readings

__all__ = [
    "MAX_EXACT",
    "MAX_PER_TAG",
    "PER_TAG",
    "SDS_OF_IDEAL",
    "Change",
    "EstimateGrid",
    "FitFailed",
    "Model",
    "Place",
    "Posterior",
    "Readings",
    "fit",
]
