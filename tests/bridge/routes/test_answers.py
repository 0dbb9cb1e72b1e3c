"""The small parts that all routes share."""

from __future__ import annotations

import asyncio

import httpx
from fastapi import APIRouter, FastAPI, Request, Response

from lupin_bridge.routes.answers import (
    NEVER_STORE,
    bridge_of,
    error_response,
    json_response,
    read_route,
)
from lupin_bridge.serving.admission import REVALIDATE
from lupin_bridge.stream import schema


def test_a_read_route_answers_get_and_head_and_is_described_once() -> None:
    router, app = APIRouter(), FastAPI()

    @read_route(router, "/answer", summary="The answer")
    async def answer(request: Request) -> Response:
        assert bridge_of(request) is app.state.bridge
        return Response("42")

    app.state.bridge = object()
    app.include_router(router)

    async def ask() -> list[httpx.Response]:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://twin") as client:
            return [await client.request(method, "/answer") for method in ("GET", "HEAD", "POST")]

    got, head, posted = asyncio.run(ask())
    assert (got.status_code, got.text) == (200, "42")
    assert (head.status_code, head.headers) == (200, got.headers)
    assert posted.status_code == 405
    assert list(app.openapi()["paths"]["/answer"]) == ["get"]


def test_json_is_kept_by_nobody_unless_its_headers_say_so() -> None:
    plain = json_response(b"{}")
    assert (plain.status_code, plain.media_type) == (200, "application/json")
    assert plain.headers["cache-control"] == NEVER_STORE["Cache-Control"] == "no-store"
    assert json_response(b"{}", headers=REVALIDATE).headers["cache-control"] == "no-cache"


def test_an_error_is_the_contracts_whatever_it_says() -> None:
    response = error_response('no "tag" <b>\n', 404, {"Retry-After": "3"})
    message = schema.ErrorMessage.model_validate_json(bytes(response.body), strict=True)
    assert (response.status_code, message.detail) == (404, 'no "tag" <b>\n')
    assert response.headers["retry-after"] == "3"
