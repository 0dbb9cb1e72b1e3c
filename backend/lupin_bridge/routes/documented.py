"""Parts of the OpenAPI document that several routes share: parameters that are read by hand."""

from __future__ import annotations

from typing import Any, Final

from lupin_bridge.field import query as field_query
from lupin_bridge.past.moments import EXPECTED
from lupin_bridge.stream import schema
from lupin_twin.bounds import MAX_TEXT_LENGTH
from lupin_twin.fields import DEFAULT_RESOLUTION_M
from lupin_twin.past import DEFAULT_POINTS, MAX_POINTS


def parameter(name: str, schema_: dict[str, Any], description: str, required: bool = False) -> Any:
    """A parameter of a query."""
    return {
        "name": name,
        "in": "query",
        "required": required,
        "schema": schema_,
        "description": description,
    }


_NUMBER: Final = {"type": "number"}
SENSOR: Final = parameter(
    "sensor_type",
    {"type": "string", "minLength": 1, "maxLength": MAX_TEXT_LENGTH},
    "name of a sensor, as in a reading",
    True,
)
# What is asked of a field, but for its moment.
FIELD: Final = (
    SENSOR,
    parameter(
        "resolution",
        {**_NUMBER, "exclusiveMinimum": 0, "default": DEFAULT_RESOLUTION_M},
        "m, side of a square cell; without a box either: doubled until the field is small enough",
    ),
    *(
        parameter(
            name,
            _NUMBER,
            "m, map frame; without a box: all pinned tags but those far off, and their reach",
        )
        for name in field_query.BOX_NAMES
    ),
    parameter(
        "scale",
        {"type": "integer", "minimum": 1, "maximum": 1000, "default": 1},
        "PNG only: pixels a cell along each side",
    ),
)
_MOMENT: Final = {"type": "string"}
AT: Final = parameter("at", _MOMENT, f"as of this moment: {EXPECTED}; default: now")
PERIOD: Final = (
    parameter("from", _MOMENT, f"{EXPECTED}; default: the oldest that is kept"),
    parameter("to", _MOMENT, "as `from`; this moment itself is not in the period; default: now"),
)
POINTS: Final = parameter(
    "points",
    {"type": "integer", "minimum": 1, "maximum": MAX_POINTS, "default": DEFAULT_POINTS},
    "at most so many readings or buckets",
)
NOT_REMEMBERED: Final[dict[int | str, dict[str, Any]]] = {
    304: {"description": "the ETag still holds"},
    400: {"model": schema.ErrorMessage, "description": "refused; detail says why"},
    404: {"model": schema.ErrorMessage, "description": "nothing of the past is kept here"},
    429: {"model": schema.ErrorMessage, "description": "this client asks for too much"},
    503: {"model": schema.ErrorMessage, "description": "it cannot be read now, or too much is"},
    504: {"model": schema.ErrorMessage, "description": "it took too long"},
}
