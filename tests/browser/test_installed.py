"""The page over https can be installed, and opens without the bridge, then without any data."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Browser, Page, expect

from tests.browser.conftest import CHROMIUM, CHROMIUM_ARGS
from tests.support.access import served
from tests.support.tls import certificate
from tests.support.waiting import PATIENCE_S, wait_for

CACHED = """async () => {
  const names = await window.caches.keys();
  const all = await Promise.all(names.map((name) => window.caches.open(name)));
  const found = await Promise.all(all.map((cache) => cache.keys()));
  return found.flat().map(({ url }) => new URL(url).pathname);
}"""
FETCHED = "(path) => fetch(path).then(({ status }) => status, () => 'nothing')"


@contextmanager
def page_that_trusts(browser: Browser) -> Iterator[Page]:
    """In a browser that trusts our certificate: otherwise there is no service worker."""
    chromium = browser.browser_type.launch(
        executable_path=CHROMIUM, args=[*CHROMIUM_ARGS, "--ignore-certificate-errors"]
    )
    with chromium, chromium.new_context(ignore_https_errors=True) as context:
        context.set_default_timeout(PATIENCE_S * 1000)
        yield context.new_page()


def test_a_browser_without_storage_for_the_shell_still_opens_the_page(
    browser: Browser, tmp_path: Path
) -> None:
    ours = certificate(tmp_path)
    with page_that_trusts(browser) as page, served(*ours.options, trust=ours.trust) as running:
        page.goto(running.url)
        page.evaluate("navigator.serviceWorker.ready.then(() => null)")
        full = {"origin": running.url, "quotaSize": 1}
        page.context.new_cdp_session(page).send("Storage.overrideQuotaForOrigin", full)
        page.reload()
        live = page.get_by_test_id("app")
        expect(live).to_have_attribute("data-connection-state", "live")
        assert page.evaluate("navigator.serviceWorker.controller !== null")
        assert page.evaluate(CACHED) == []


def test_the_shell_opens_without_the_bridge_and_no_data_are_stored(
    browser: Browser, tmp_path: Path
) -> None:
    ours = certificate(tmp_path)
    with page_that_trusts(browser) as page:
        app = page.get_by_test_id("app")
        with served(*ours.options, trust=ours.trust) as running:
            page.goto(running.url)
            session = page.context.new_cdp_session(page)
            found = session.send("Page.getInstallabilityErrors")["installabilityErrors"]
            assert {it["errorId"] for it in found} <= {"in-incognito"}
            page.evaluate("navigator.serviceWorker.ready.then(() => null)")
            page.reload()
            expect(app).to_have_attribute("data-connection-state", "live")
            assert page.evaluate(FETCHED, "./api/session") == 200
            wait_for(
                lambda: any("deferred" in path for path in page.evaluate(CACHED)),
                "the page's files",
                meanwhile=lambda _: None,
            )
            cached = page.evaluate(CACHED)
            assert "/" in cached
            assert all(path == "/" or path.startswith("/assets/") for path in cached), cached
        page.reload()
        expect(app).to_be_visible()
        expect(app).not_to_have_attribute("data-connection-state", "live")
        expect(app).to_have_attribute("data-fresh", "false")
        for path in ("./api/session", "./api/state", "./lupin.svg", "./signin"):
            assert page.evaluate(FETCHED, path) == "nothing", path
