"""Occupancy grids by their rows."""

from typing import Any

import numpy as np

from lupin_twin.field.explored import OccupancyMap


def map_of(rows: Any, **changes: Any) -> OccupancyMap:
    """A map of these rows (row 0 first), 1 m cells from the origin unless changed."""
    cells = np.array(rows, dtype=np.int8)
    given = {
        "frame_id": "map",
        "stamp_ns": 5,
        "width": cells.shape[1],
        "height": cells.shape[0],
        "resolution": 1.0,
        "origin_x": 0.0,
        "origin_y": 0.0,
        "origin_yaw": 0.0,
        "cells": cells.ravel(),
        "revision": 1,
    }
    return OccupancyMap(**{**given, **changes})
