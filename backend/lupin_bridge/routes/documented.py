"""Parts of the OpenAPI document that several routes share."""

from __future__ import annotations

from typing import Any, Final

from lupin_bridge.stream import schema

NOT_REMEMBERED: Final[dict[int | str, dict[str, Any]]] = {
    304: {"description": "the ETag still holds"},
    400: {"model": schema.ErrorMessage, "description": "refused; detail says why"},
    404: {"model": schema.ErrorMessage, "description": "nothing of the past is kept here"},
    429: {"model": schema.ErrorMessage, "description": "this client asks for too much"},
    503: {"model": schema.ErrorMessage, "description": "it cannot be read now, or too much is"},
    504: {"model": schema.ErrorMessage, "description": "it took too long"},
}
