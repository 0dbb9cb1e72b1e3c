"""The newest map as a fact of the log, so that who reads the log elsewhere has the floor plan too.

One text, written again when the map is another; of earlier maps nothing is kept.
"""

from __future__ import annotations

import base64
import json
import zlib
from typing import Final

import numpy as np

from lupin_twin.field.explored import OccupancyMap

# A floor of 2 ha at 5 cm is some 100 kB. A larger text is no longer one row among others.
MAX_TEXT: Final = 1_000_000
# So many cells are packed in a tenth of a second.
MAX_CELLS: Final = 16_000_000


def text_of(floor: OccupancyMap) -> str:
    """JSON of a map, its cells deflated and in base64; empty: it is too large for a row."""
    if floor.cells.size > MAX_CELLS:
        return ""
    about = {
        "frame_id": floor.frame_id,
        "stamp_ns": floor.stamp_ns,
        "width": floor.width,
        "height": floor.height,
        "resolution": floor.resolution,
        "origin_x": floor.origin_x,
        "origin_y": floor.origin_y,
        "origin_yaw": floor.origin_yaw,
    }
    cells = base64.b64encode(zlib.compress(floor.cells.tobytes(), 1)).decode()
    text = json.dumps({**about, "cells": cells})
    return text if len(text) <= MAX_TEXT else ""


def map_of(text: str, revision: int) -> OccupancyMap:
    """The map of a text.

    Raises:
        ValueError: it is none.

    """
    try:
        about = json.loads(text)
        size = int(about["width"]) * int(about["height"])
        if not 0 <= size <= MAX_CELLS:
            raise ValueError(f"it has {size} cells, the limit is {MAX_CELLS}")
        # Never more than it says, whatever was packed.
        packed = base64.b64decode(about.pop("cells"), validate=True)
        cells = zlib.decompressobj().decompress(packed, size + 1)
        return OccupancyMap(**about, cells=np.frombuffer(cells, np.int8), revision=revision)
    except (AttributeError, KeyError, TypeError, zlib.error) as error:
        raise ValueError(f"it is no map: {error}") from None
