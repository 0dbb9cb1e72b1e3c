"""Proxies and the path prefix: whose headers are trusted, and what the application receives."""

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.access.policy import BehindProxies, Proxies, path_of
from lupin_bridge.settings import SettingError, Settings
from tests.support.access import BEARER, OWN, TOKEN, Served, refused_start, served
from tests.support.people import TOKEN as SCADA
from tests.support.people import add, changing

BEHIND_TWO = Proxies.of(Settings(trusted_proxy=("10.0.0.7", "192.168.0.0/24", "fd00::/64")))


def seen(proxies: Proxies, path: str = "/", kind: str = "http", **scope: Any) -> Any:
    """The scope that the application behind `proxies` is called with."""
    scopes: list[Any] = []

    async def app(scope: Any, *_: Any) -> None:
        scopes.append(scope)

    plain = {"type": kind, "path": path, "headers": [], "client": ("10.0.0.7", 9), "scheme": "http"}
    asyncio.run(BehindProxies(app, proxies)({**plain, **scope}, None, None))  # type: ignore[arg-type]
    return scopes[0]


@pytest.mark.parametrize(
    ("peer", "forwarded", "client"),
    [
        ("10.0.0.7", ["6.6.6.6, 203.0.113.5"], "203.0.113.5"),  # the left one is unverified
        ("10.0.0.7", ["6.6.6.6", "203.0.113.5"], "203.0.113.5"),  # lines are one list
        ("10.0.0.7", ["203.0.113.5, 192.168.0.2"], "203.0.113.5"),  # through both proxies
        ("10.0.0.7", ["192.168.0.3, 192.168.0.2"], "192.168.0.3"),  # a request of the proxy itself
        ("10.0.0.7", ["203.0.113.5:4711"], "203.0.113.5"),
        ("10.0.0.7", ["[2001:db8::1]:4711"], "2001:db8::1"),
        ("10.0.0.7", ["::ffff:203.0.113.5"], "203.0.113.5"),
        ("::ffff:10.0.0.7", ["203.0.113.5"], "203.0.113.5"),
        ("fd00::1%eth0", ["203.0.113.5"], "203.0.113.5"),
        ("10.0.0.7", ["203.0.113.5, unknown"], "10.0.0.7"),
        ("10.0.0.7", [], "10.0.0.7"),
        ("10.0.0.8", ["203.0.113.5"], "10.0.0.8"),  # not a configured proxy
        ("", ["203.0.113.5"], ""),
    ],
)
def test_the_client_is_the_nearest_address_that_is_not_a_trusted_proxy(
    peer: str, forwarded: list[str], client: str
) -> None:
    assert BEHIND_TWO.client(peer, forwarded) == client
    headers = [(b"x-forwarded-for", line.encode()) for line in forwarded]
    scope = seen(BEHIND_TWO, client=(peer, 9), headers=headers)
    assert scope["client"][0] == client


@given(st.lists(st.text(max_size=20), max_size=5))
def test_a_forged_header_breaks_nothing_and_does_not_change_the_client(lines: list[str]) -> None:
    assert BEHIND_TWO.client("203.0.113.5", lines) == "203.0.113.5"
    assert isinstance(BEHIND_TWO.client("10.0.0.7", lines), str)


@pytest.mark.parametrize(
    ("kind", "lines", "scheme"),
    [
        ("http", ["https"], "https"),
        ("websocket", ["https"], "wss"),
        ("http", ["HTTPS "], "https"),
        ("http", ["https, http"], "http"),
        ("http", ["http", "https"], "https"),
        ("http", ["gopher"], "http"),
    ],
)
def test_the_scheme_is_that_of_the_nearest_proxy(kind: str, lines: list[str], scheme: str) -> None:
    headers = [(b"x-forwarded-proto", line.encode()) for line in lines]
    assert seen(BEHIND_TWO, kind=kind, headers=headers)["scheme"] == scheme
    assert seen(BEHIND_TWO, client=("6.6.6.6", 9), headers=headers)["scheme"] == "http"
    assert seen(Proxies(), headers=headers)["scheme"] == "http"


@pytest.mark.parametrize("proxy", ["", "proxy.example", "10.0.0.1/8", "10.0.0.0/33", "10.0.0.7:80"])
def test_a_proxy_is_an_address_or_a_network(proxy: str) -> None:
    with pytest.raises(SettingError, match=r"^LUPIN_TRUSTED_PROXY is .* must be an address") as it:
        Proxies.of(
            Settings(trusted_proxy=(proxy,), given_as={"trusted_proxy": "LUPIN_TRUSTED_PROXY"})
        )
    assert repr(proxy) in str(it.value)


@pytest.mark.parametrize(
    ("path", "whole"),
    [
        ("/gh1/api/state", "/gh1/api/state"),  # a proxy that keeps it
        ("/api/state", "/gh1/api/state"),  # a proxy that strips it
        ("/gh1", "/gh1"),
        ("/", "/gh1/"),
        ("/gh12", "/gh1/gh12"),
    ],
)
def test_the_prefix_may_be_stripped_or_kept(path: str, whole: str) -> None:
    scope = seen(Proxies(path_prefix="/gh1"), path)
    assert (scope["path"], scope["root_path"]) == (whole, "/gh1")
    assert path_of(scope) == whole.removeprefix("/gh1")
    assert path_of(seen(Proxies(), path)) == path


INVALID = (*("gh1", "/", "/gh1/", "//gh1", "/gh 1", "/..", "/a/./b", "/a?b", "http://x/gh1", "/ä"),)


def test_a_prefix_is_a_path() -> None:
    for prefix in ("/gh1", "/a/b.c/~d_e-f", "/.well", "/..."):
        assert Proxies.of(Settings(path_prefix=prefix)).path_prefix == prefix
    for prefix in INVALID:
        with pytest.raises(SettingError, match=r"--path-prefix is .* must be a path such as") as it:
            Proxies.of(Settings(path_prefix=prefix))
        assert repr(prefix) in str(it.value)


PROXY, STRANGER = "127.0.0.3", "127.0.0.4"


@pytest.fixture(scope="module")
def live() -> Iterator[Served]:
    with served(
        "--trusted-proxy", PROXY, "--path-prefix", "/gh1", "--allow-host", "twin.example",
        LUPIN_TOKEN=TOKEN,
    ) as running:  # fmt: skip
        yield running


def status(live: Served, address: str, **headers: str) -> int:
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    with live.client(address) as client:
        return client.get("/api/state", headers={**BEARER, **named}).status_code


def test_origins_and_cookies_use_the_scheme_of_the_proxy(live: Served) -> None:
    ours = {"Host": "twin.example", "Origin": "https://twin.example"}
    assert status(live, PROXY, X_Forwarded_Proto="https", **ours) == 200
    assert status(live, PROXY, X_Forwarded_Proto="http", **ours) == 403
    for stranger in (STRANGER, "127.0.0.1"):
        assert status(live, stranger, X_Forwarded_Proto="https", **ours) == 403
    with live.client(PROXY) as client:
        answer = client.post(
            "/gh1/api/signin", headers={**BEARER, **OWN, "X-Forwarded-Proto": "https"}
        )
        cookie = [part.strip() for part in answer.headers["set-cookie"].split(";")]
        assert {"Secure", "Path=/gh1/"} <= set(cookie)
        answer = client.post("/gh1/api/signin", headers={**BEARER, **OWN})
        assert "Secure" not in answer.headers["set-cookie"]


def test_every_route_is_served_with_the_prefix_and_without_and_links_stay_below_it(
    live: Served,
) -> None:
    for prefix in ("", "/gh1"):
        assert live.get(f"{prefix}/healthz").status_code == 200
        assert live.get(f"{prefix}/api/state").status_code == 401
        assert live.get(f"{prefix}/api/state", BEARER).status_code == 200
        assert live.get(f"{prefix}/", BEARER).status_code == 200
        assert live.get(f"{prefix}/lupin.svg", BEARER).status_code == 200
        assert live.get(f"{prefix}/nowhere", BEARER).status_code == 404
        assert live.handshake(f"{prefix}/ws/state", BEARER) == 101
    assert live.get("/gh1/gh1/healthz", BEARER).status_code == 404
    page = {"Accept": "text/html"}
    for path, location in (("/", "signin"), ("/gh1/a/b", "../signin")):
        assert live.get(path, page).headers["location"] == location
    assert live.get("/gh1", BEARER).headers["location"].endswith("/gh1/")


@pytest.fixture(scope="module")
def behind(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    path = tmp_path_factory.mktemp("accounts") / "accounts.sqlite"
    with changing(path) as accounts:
        accounts.add("anna@example.org", "account", "operator", "", by="a test", now_s=1)
    add(path, "token", scada="operator")
    with served(
        "--accounts", str(path), "--trusted-proxy", PROXY, "--proxy-user-header", "Remote-User"
    ) as running:
        yield running


def identity(live: Served, address: str, *headers: tuple[str, str]) -> str:
    """The name and the role of a request from an address, or its status."""
    with live.client(address) as client:
        answer = client.get("/api/session", headers=list(headers))
    if answer.status_code != 200:
        return str(answer.status_code)
    body = answer.json()
    return f"{body['name']} {body['role']}"


def test_only_the_proxys_own_user_header_is_trusted(behind: Served) -> None:
    anna = ("Remote-User", "anna@example.org")
    assert identity(behind, PROXY, anna) == "anna@example.org operator"
    assert identity(behind, PROXY, ("remote-user", "new@example.org")) == "new@example.org viewer"
    assert identity(behind, STRANGER, anna) == "401"
    assert identity(behind, STRANGER, anna, ("X-Forwarded-For", PROXY)) == "401"
    assert (
        identity(behind, STRANGER, anna, ("Authorization", f"Bearer {SCADA}")) == "scada operator"
    )
    assert identity(behind, PROXY, ("Remote-User", "scada")) == "scada viewer", "no token's right"
    assert identity(behind, PROXY) == "401", "who has not signed in there"
    anna = ("Remote-User", "anna@example.org")
    assert identity(behind, PROXY, anna, ("Remote-User", "boss")) == "401"
    assert identity(behind, PROXY, anna, anna) == "401"
    for name in ("", "a b", "anna@example.org, boss", "x" * 65, "<script>"):
        assert identity(behind, PROXY, ("Remote-User", name)) == "401", name


def test_proxy_settings_that_depend_on_each_other_are_checked_together() -> None:
    assert "no proxy is trusted" in refused_start("--proxy-user-header", "Remote-User")
    wrong = refused_start("--proxy-user-header", "a b", "--trusted-proxy", PROXY)
    assert "must be a header's name" in wrong
