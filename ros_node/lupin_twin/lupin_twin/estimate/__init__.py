"""A field with its error, in space and time, from all readings of a day: beside IDW, for who asks.

Pure: numpy and the standard library only.
"""

from lupin_twin.estimate.advice import Place
from lupin_twin.estimate.cells import EstimateGrid
from lupin_twin.estimate.changed import Change, Expected
from lupin_twin.estimate.day_length import LONGER, NOTHING, STRONG_NATS, gains, longer_by
from lupin_twin.estimate.fitting import FitFailed
from lupin_twin.estimate.model import MAX_EXACT, Model, fit
from lupin_twin.estimate.nearby import LAST, Nearby
from lupin_twin.estimate.posterior import Posterior
from lupin_twin.estimate.readings import MAX_PER_TAG, Readings
from lupin_twin.estimate.screening import Check, Screening, screen
from lupin_twin.estimate.tiled import TiledPosterior

__all__ = [
    "LAST",
    "LONGER",
    "MAX_EXACT",
    "MAX_PER_TAG",
    "NOTHING",
    "STRONG_NATS",
    "Change",
    "Check",
    "EstimateGrid",
    "Expected",
    "FitFailed",
    "Model",
    "Nearby",
    "Place",
    "Posterior",
    "Readings",
    "Screening",
    "TiledPosterior",
    "fit",
    "gains",
    "longer_by",
    "screen",
]
