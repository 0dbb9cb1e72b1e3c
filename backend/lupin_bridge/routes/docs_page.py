"""`/openapi.json`, and `/docs`: the same as a page that loads nothing from anywhere."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from html import escape
from typing import Any, Final

import orjson
from fastapi import APIRouter, Request, Response

from lupin_bridge.bridge import Bridge
from lupin_bridge.routes.computing import kept_or_computed, made, or_refusal
from lupin_bridge.routes.tools import JSON_TYPE, REVALIDATE, read_route
from lupin_bridge.serving.kept import Answer

router = APIRouter()

# What writing either document takes, roughly, s.
_WRITE_S: Final = 0.02


@read_route(router, "/openapi.json", include_in_schema=False)
async def openapi(request: Request) -> Response:
    """The OpenAPI document."""
    app, prefix = request.app, request.scope.get("root_path", "")

    def write() -> bytes:
        document = app.openapi()
        if prefix:
            document = {**document, "servers": [{"url": prefix}]}
        return orjson.dumps(document, option=orjson.OPT_INDENT_2)

    return await _written_once(request, f"openapi {prefix}", write, JSON_TYPE)


@read_route(router, "/docs", include_in_schema=False)
async def docs(request: Request) -> Response:
    """The OpenAPI document for people."""
    app, base_url = request.app, str(request.base_url).rstrip("/")

    def write() -> bytes:
        return render(app.openapi(), base_url).encode()

    return await _written_once(request, f"docs {base_url}", write, "text/html; charset=utf-8")


async def _written_once(
    request: Request, key: str, write: Callable[[], bytes], media_type: str
) -> Response:
    bridge: Bridge | None = request.app.state.bridge
    if bridge is None:
        return Response(write(), headers=REVALIDATE, media_type=media_type)

    def compute() -> Coroutine[Any, Any, Answer]:
        return made(request, key, write, media_type, cost=_WRITE_S, headers=REVALIDATE)

    return await or_refusal(kept_or_computed(request, key, compute))


def render(document: dict[str, Any], base_url: str) -> str:
    """An OpenAPI document as one HTML page: routes, parameters, answers, and lines for curl."""
    info = document["info"]
    routes = "".join(
        _route(path, operations["get"], base_url) for path, operations in document["paths"].items()
    )
    schemas = "".join(
        _schema(name, described) for name, described in document["components"]["schemas"].items()
    )
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        f"<title>{escape(info['title'])}: API</title></head><body><main>"
        f"<h1>{escape(info['title'])}: API</h1><p>{escape(info['summary'])}</p>"
        f"<p>{escape(info['description'])}</p>"
        '<p>As a document for tools: <a href="openapi.json">/openapi.json</a></p>'
        '<p>For people, with tutorials: <a href="docs/guide/">the guide</a></p>'
        f"<h2>Routes</h2>{routes}<h2>Types</h2>{schemas}</main></body></html>"
    )


def _route(path: str, operation: dict[str, Any], base_url: str) -> str:
    parameters = operation.get("parameters", [])
    required = [p for p in parameters if p.get("required") and p["in"] == "query"]
    query = "&".join(f"{p['name']}=…" for p in required)
    rows = "".join(
        f"<tr><td><code>{escape(p['name'])}</code></td><td>{escape(p['schema'].get('type', ''))}"
        f"{' (required)' if p.get('required') else ''}</td>"
        f"<td>{escape(p.get('description', ''))}</td></tr>"
        for p in parameters
    )
    answers = "".join(
        f"<li>{escape(code)}: {escape(answer['description'])} {_types(answer)}</li>"
        for code, answer in operation["responses"].items()
    )
    url = f"{base_url}{path}{'?' + query if query else ''}"
    return (
        f"<section><h3><code>GET {escape(path)}</code></h3>"
        f"<p>{escape(operation.get('summary', ''))}. {escape(operation.get('description', ''))}</p>"
        f"<pre>curl '{escape(url)}'</pre>"
        + (f"<table border='1'>{rows}</table>" if rows else "")
        + f"<ul>{answers}</ul></section>"
    )


def _types(answer: dict[str, Any]) -> str:
    names = []
    for media_type, content in answer.get("content", {}).items():
        name = content.get("schema", {}).get("$ref", "").rpartition("/")[2]
        link = f' <a href="#{escape(name)}">{escape(name)}</a>' if name else ""
        names.append(f"<code>{escape(media_type)}</code>{link}")
    return ", ".join(names)


def _schema(name: str, described: dict[str, Any]) -> str:
    rows = "".join(
        f"<tr><td><code>{escape(field)}</code></td><td>{_type_of(prop)}</td>"
        f"<td>{escape(prop.get('description', ''))}</td></tr>"
        for field, prop in described.get("properties", {}).items()
    )
    return (
        f'<section id="{escape(name)}"><h3>{escape(name)}</h3>'
        f"<p>{escape(described.get('description', ''))}</p>"
        f"<table border='1'>{rows}</table></section>"
    )


def _type_of(prop: dict[str, Any]) -> str:
    if "$ref" in prop:
        name = prop["$ref"].rpartition("/")[2]
        return f'<a href="#{escape(name)}">{escape(name)}</a>'
    if "anyOf" in prop:
        return " or ".join(_type_of(option) for option in prop["anyOf"])
    if prop.get("type") == "array":
        return f"list of {_type_of(prop['items'])}"
    if "enum" in prop:
        return ", ".join(escape(repr(value)) for value in prop["enum"])
    return escape(str(prop.get("const", prop.get("type", ""))))
