"""What a page of another origin can read from the bridge, in a real browser: nothing.

The operator's browser reaches the bridge, and any page in it may try to use that.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest
from playwright.sync_api import Browser, Page

from tests.support.domains import own_domain
from tests.support.messages import scan
from tests.support.waiting import PATIENCE_S
from tests.support.web import Bridge, bridge

FIELD = "/api/field.png?sensor_type=co2&resolution=0.5"
# Everything that a page can attempt, each with what it read from the bridge.
TRY = """
async ({ url, field, init }) => {
  const outcome = (promise) => promise.catch((error) => `refused: ${error.name || error}`);
  const element = (tag, attributes) =>
    new Promise((resolve, reject) => {
      const made = Object.assign(document.createElement(tag), attributes);
      made.onload = () => resolve(made);
      made.onerror = () => reject(`<${tag}>`);
      document.body.append(made);
    });
  const pixels = async (attributes) => {
    const picture = await element('img', { ...attributes, src: url + field });
    const canvas = document.createElement('canvas');
    canvas.getContext('2d').drawImage(picture, 0, 0);
    return `${picture.naturalWidth} px, ${canvas.toDataURL().slice(0, 10)}`;
  };
  const socket = (path) =>
    new Promise((resolve, reject) => {
      const made = new WebSocket(url.replace('http', 'ws') + path);
      made.onopen = () => resolve('open');
      made.onerror = () => reject('WebSocket');
      made.onclose = () => reject('WebSocket');
    });
  const source = (path) =>
    new Promise((resolve, reject) => {
      const made = new EventSource(url + path);
      made.onerror = () => (made.close(), reject('EventSource'));
      made.onopen = () => resolve('open');
    });
  return {
    fetch: await outcome(fetch(`${url}/api/state`, init).then((answer) => answer.text())),
    opaque: await outcome(fetch(`${url}/api/state`, { mode: 'no-cors' }).then((a) => a.type)),
    image: await outcome(pixels({})),
    corsImage: await outcome(pixels({ crossOrigin: 'anonymous' })),
    script: await outcome(element('script', { src: `${url}/api/state` }).then(() => 'loaded')),
    style: await outcome(
      element('link', { rel: 'stylesheet', href: `${url}/signin.css` }).then(() => 'loaded'),
    ),
    socket: await outcome(socket('/ws/state')),
    rosbridge: await outcome(socket('/rosbridge')),
    events: await outcome(source('/api/state')),
  };
}
"""

NOTHING = {
    "fetch": "refused: TypeError",
    "opaque": "refused: TypeError",
    "image": "refused: <img>",
    "corsImage": "refused: <img>",
    "script": "refused: <script>",
    "style": "refused: <link>",
    "socket": "refused: WebSocket",
    "rosbridge": "refused: WebSocket",
    "events": "refused: EventSource",
}


@contextmanager
def foreign_page(name: str) -> Iterator[str]:
    """An empty page of another server; returns its origin."""

    class EmptyPage(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><title>Elsewhere</title><body></body>")

        def log_message(self, *_: Any) -> None:
            """Log nothing."""

    with ThreadingHTTPServer(("127.0.0.1", 0), EmptyPage) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://{name}:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with browser.new_context() as context:
        context.set_default_timeout(PATIENCE_S * 1000)
        yield context.new_page()


def try_all(page: Page, origin: str, url: str, **init: Any) -> dict[str, str]:
    """What a page of `origin` reads from the bridge at `url`."""
    page.goto(origin)
    got: dict[str, str] = page.evaluate(TRY, {"url": url, "field": FIELD, "init": init})
    return got


@contextmanager
def bridge_with_a_tag(*options: str) -> Iterator[Bridge]:
    with own_domain() as domain, bridge(*options, domain=domain) as running:
        running.peer.observe(scan("secret tag", {"co2": 400.0}, at=(1, 1)))
        running.tag("secret tag")
        yield running


@pytest.fixture(scope="module")
def running() -> Iterator[Bridge]:
    with bridge_with_a_tag() as it:
        yield it


# A site is scheme and host: another port of this host is the closest foreign origin.
@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"], ids=["same-site", "cross-site"])
def test_a_foreign_page_gets_nothing(page: Page, running: Bridge, host: str) -> None:
    with foreign_page(host) as origin:
        assert try_all(page, origin, running.url) == NOTHING


def test_an_allowed_page_gets_what_it_identifies_itself_for(page: Page) -> None:
    with foreign_page("localhost") as origin, bridge_with_a_tag("--allow-origin", origin) as it:
        got = try_all(page, origin, it.url)
        assert "secret tag" in got["fetch"]
        assert got["corsImage"] == "6 px, data:image"
        assert got["socket"] == got["rosbridge"] == "open"
        # These do not name the page that sends them.
        assert got["image"] == "refused: <img>"
        assert got["script"] == "refused: <script>"
