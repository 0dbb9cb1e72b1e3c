"""`/` of a bridge whose page was not built: how to build it, instead of a bare 404."""

from __future__ import annotations

from html import escape
from typing import Final

from fastapi import APIRouter, Response

from lupin_bridge.routes.tools import NEVER_KEEP, read_route

router = APIRouter()

HOW: Final = (
    "build it with `npm ci && npm run build` in the project's folder, install the bridge again "
    "(`pip install .`) unless it is installed with -e, and restart it"
)
_PAGE: Final = (
    '<!doctype html><html lang="en"><head><meta charset="utf-8">'
    '<meta name="viewport" content="width=device-width"><title>Lupin twin: no page</title></head>'
    "<body><main><h1>The page was not built</h1>"
    f"<p>The bridge runs, but was installed without its page: {escape(HOW)}.</p>"
    '<p>The data is there: <a href="docs">docs</a>, <a href="api/state">api/state</a>.</p>'
    "</main></body></html>"
)


@read_route(router, "/", include_in_schema=False)
async def no_page() -> Response:
    """503: what was asked for is to be had, but not yet."""
    return Response(_PAGE, 503, NEVER_KEEP, "text/html; charset=utf-8")
