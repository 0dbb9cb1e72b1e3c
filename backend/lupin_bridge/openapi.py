"""`python -m lupin_bridge.openapi`: the OpenAPI document, without a twin and without ROS."""

from __future__ import annotations

import sys
from functools import cache

import orjson

from lupin_bridge.app import create_app


@cache
def document() -> bytes:
    """The document as indented JSON with a newline at its end."""
    options = orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE
    return orjson.dumps(create_app(None).openapi(), option=options)


if __name__ == "__main__":
    sys.stdout.buffer.write(document())
