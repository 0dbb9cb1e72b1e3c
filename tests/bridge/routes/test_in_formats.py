"""One answer in every format, and what becomes of a refusal, without a twin."""

import asyncio
from typing import Any

import httpx
import pytest
from fastapi import APIRouter, FastAPI, Request, Response

from lupin_bridge import field as formats
from lupin_bridge.feed.source import TwinTimeoutError
from lupin_bridge.field import FieldFormat
from lupin_bridge.routes.answers import add_refusals
from lupin_bridge.routes.field import InFormats
from lupin_bridge.serving.admission import BusyError, ClientLimitError
from lupin_bridge.stream import schema
from lupin_twin.core.past import NotRemembered, PastRefused
from lupin_twin.field.engine import FieldRefused

PLANTS = InFormats(
    name="plants",
    summary="The plants",
    description="All of them.",
    parameters=[{"name": "at", "in": "query", "required": False, "schema": {"type": "string"}}],
    model=schema.GetFieldResponse,
    refusal_json=formats.refusal_json,
)


def app(error: Exception | None = None) -> FastAPI:
    router = APIRouter()

    async def answer(_: Request, field_format: FieldFormat) -> Response:
        if error is not None:
            raise error
        return Response(field_format.name, media_type=field_format.media_type)

    PLANTS.register(router, answer)
    application = FastAPI()
    add_refusals(application)
    application.include_router(router)
    return application


def get(path: str, error: Exception | None = None, **headers: str) -> httpx.Response:
    async def asked() -> httpx.Response:
        transport = httpx.ASGITransport(app(error))
        async with httpx.AsyncClient(transport=transport, base_url="http://test") as client:
            return await client.get(path, headers=headers)

    return asyncio.run(asked())


@pytest.mark.parametrize(
    ("error", "status"),
    [(FieldRefused("why"), 400), (PastRefused("why"), 400), (ClientLimitError("why", 7), 429)],
    ids=lambda it: type(it).__name__,
)
def test_what_is_refused_has_the_body_of_the_service(error: Exception, status: int) -> None:
    for path in ("/api/plants", "/api/plants.png"):
        answer = get(path, error)
        assert answer.status_code == status
        assert answer.content == formats.refusal_json("why")
    assert ("retry-after" in answer.headers) == (status == 429)


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (NotRemembered("why", is_lasting=True), 404),
        (BusyError("why", 7), 503),
        (TwinTimeoutError("why"), 504),
    ],
    ids=lambda it: type(it).__name__,
)
def test_what_else_stands_in_the_way_is_told_as_everywhere(error: Exception, status: int) -> None:
    answer = get("/api/plants.json", error)
    assert (answer.status_code, answer.json()) == (status, {"detail": "why"})
    assert get("/api/plants", error).headers["vary"] == "Accept"


def test_the_document_tells_of_each_path_and_each_refusal() -> None:
    paths: dict[str, Any] = app().openapi()["paths"]
    assert list(paths) == ["/api/plants", *(f"/api/plants.{it.name}" for it in formats.FORMATS)]
    for path, told in paths.items():
        described = told["get"]
        assert [each["name"] for each in described["parameters"]] == ["at"]
        refused = {"304", "400", "404", "429", "503", "504"}
        assert set(described["responses"]) == {
            "200",
            *refused,
            *(["406"] if path == "/api/plants" else []),
        }
    assert paths["/api/plants"]["get"]["description"] == "All of them."
