"""The API page: everything in the document, nothing external, nothing unescaped."""

import json
from html.parser import HTMLParser
from typing import Any

import pytest

from lupin_bridge.app import document
from lupin_bridge.routes.pages import render
from tests.support.web import ROUTES

DOCUMENT: dict[str, Any] = json.loads(document())
PAGE = render(DOCUMENT, "http://twin:8000")


class Page(HTMLParser):
    """A page's text, ids and links; refuses tags that are not closed in order."""

    VOID = ("meta", "link", "br", "img", "input")

    def __init__(self, html: str) -> None:
        super().__init__()
        self.text = ""
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self._open: list[str] = []
        self.feed(html)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data

    def attributes(self, name: str) -> list[str]:
        return [attrs[name] or "" for _, attrs in self.tags if name in attrs]


def test_every_route_field_and_parameter_is_listed_with_a_line_for_curl() -> None:
    text = Page(PAGE).text
    for path, described in ROUTES.items():
        assert (f"GET {path}" in text) == described
        assert (f"curl 'http://twin:8000{path}" in text) == described
    assert "curl 'http://twin:8000/api/field.png?sensor_type=…'" in text
    for described_type in DOCUMENT["components"]["schemas"].values():
        assert all(field in text for field in described_type["properties"])
    for parameter in DOCUMENT["paths"]["/api/field"]["get"]["parameters"]:
        assert parameter["description"] in text


def test_every_type_is_listed_and_every_link_leads_to_one() -> None:
    page = Page(PAGE)
    assert set(page.attributes("id")) == set(DOCUMENT["components"]["schemas"])
    links = page.attributes("href")
    assert len(links) > len(ROUTES)
    elsewhere = {"openapi.json", "docs/guide/"}
    assert set(links) - elsewhere <= {f"#{name}" for name in page.attributes("id")}


def test_nothing_is_loaded_from_elsewhere_and_nothing_is_inline() -> None:
    page = Page(PAGE)
    assert not {tag for tag, _ in page.tags} & {"script", "style", "link", "img", "iframe"}
    assert page.attributes("style") == []


@pytest.mark.parametrize("kind", ["route", "parameter", "type", "address"])
def test_text_that_looks_like_markup_stays_text(kind: str) -> None:
    markup, address = "<script>alert('x')</script>", "http://twin"
    hostile = json.loads(document())
    if kind == "route":
        hostile["paths"][f"/{markup}"] = hostile["paths"]["/api/state"]
    elif kind == "parameter":
        hostile["paths"]["/api/field"]["get"]["parameters"][0]["description"] = markup
    elif kind == "type":
        hostile["components"]["schemas"]["Time"]["description"] = markup
    else:
        address = f"http://{markup}"
    page = Page(render(hostile, address))
    assert "script" not in {tag for tag, _ in page.tags}
    assert markup in page.text
