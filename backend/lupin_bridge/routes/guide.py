"""`/docs/guide/`: the documentation that `make docs` builds and a release's wheel holds."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from fastapi import APIRouter, FastAPI, Request, Response
from starlette.responses import RedirectResponse
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from lupin_bridge.access.security import CONTENT_POLICY
from lupin_bridge.routes.tools import error_response, read_route

router = APIRouter()

PATH: Final = "/docs/guide"
_MISSING: Final = "the guide was not built: run `make docs` in the clone, or install a release"
# Its theme has styles in the pages themselves; scripts are files, as everywhere.
_POLICY: Final = f"{CONTENT_POLICY}; style-src 'self' 'unsafe-inline'"


class _Guide(StaticFiles):
    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers["Content-Security-Policy"] = _POLICY
        return response


@read_route(router, PATH, include_in_schema=False)
async def to_guide(request: Request) -> Response:
    """The documentation, as HTML."""
    return RedirectResponse(f"{request.scope.get('root_path', '')}{PATH}/")


async def _missing(_request: Request) -> Response:
    return error_response(_MISSING, 404)


def add_to(app: FastAPI, folder: Path) -> None:
    """Serve the built guide, or say how to build it."""
    if (folder / "index.html").is_file():
        app.mount(PATH, _Guide(directory=folder, html=True), name="guide")
    else:
        app.add_route(f"{PATH}/{{path:path}}", _missing, include_in_schema=False)
