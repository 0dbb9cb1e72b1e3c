"""Parameters that are read by hand are told as those that FastAPI reads."""

from __future__ import annotations

import json
from typing import Any

from lupin_bridge.openapi import document
from lupin_bridge.past.query import EXPORT_NAMES, HISTORY_NAMES, TIMELINE_NAMES
from lupin_bridge.routes.documented import parameter

PATHS: dict[str, Any] = json.loads(document())["paths"]


def names(path: str) -> set[str]:
    return {described["name"] for described in PATHS[path]["get"]["parameters"]}


def test_a_parameter_is_described_as_openapi_has_it() -> None:
    assert parameter("points", {"type": "integer"}, "how many", required=True) == {
        "name": "points",
        "in": "query",
        "required": True,
        "schema": {"type": "integer"},
        "description": "how many",
    }


def test_what_is_read_is_described_and_nothing_else() -> None:
    assert names("/api/history") == set(HISTORY_NAMES)
    assert names("/api/timeline") == set(TIMELINE_NAMES)
    assert names("/api/export.csv") == set(EXPORT_NAMES)
