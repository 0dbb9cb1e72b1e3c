"""Proxies, the path prefix and TLS: whose headers are trusted, and which files are served."""

import asyncio
import socket
import ssl
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx
import pytest
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    PrivateFormat,
    load_pem_private_key,
)

from lupin_bridge.access.policy import BehindProxies, Proxies, path_of
from lupin_bridge.serving.server import check_pair
from lupin_bridge.settings import SettingError, Settings
from tests.support.access import BEARER, TOKEN, Served, refused_start, served
from tests.support.people import OWN, add, changing
from tests.support.people import TOKEN as SCADA
from tests.support.processes import limits
from tests.support.raw_http import handshake
from tests.support.tls import Certificate, certificate
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import ws_url
from tests.support.wss import wss

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
        ("10.0.0.7", ["203.0.113.5, ::ffff:192.168.0.2"], "203.0.113.5"),  # its IPv6 spelling
        ("10.0.0.7", ["203.0.113.5:4711"], "203.0.113.5"),  # some proxies add the client's port
        ("10.0.0.7", ["192.168.0.3, 192.168.0.2"], "192.168.0.3"),  # a request of the proxy itself
        ("::ffff:10.0.0.7", ["203.0.113.5"], "203.0.113.5"),
        ("fd00::1%eth0", ["203.0.113.5"], "203.0.113.5"),
        ("10.0.0.7", [], "10.0.0.7"),
        ("10.0.0.8", ["203.0.113.5"], "10.0.0.8"),  # not a configured proxy
        ("", ["203.0.113.5"], "unix:"),
    ],
)
def test_the_client_is_the_nearest_address_that_is_not_a_trusted_proxy(
    peer: str, forwarded: list[str], client: str
) -> None:
    headers = [(b"x-forwarded-for", line.encode()) for line in forwarded]
    scope = seen(BEHIND_TWO, client=(peer, 9), headers=headers)
    assert scope["client"][0] == client


@pytest.mark.parametrize(
    ("kind", "lines", "scheme"),
    [
        ("http", ["https"], "https"),
        ("websocket", ["https"], "wss"),
        ("http", ["gopher"], "http"),
        ("http", ["https, http"], "https"),  # the second one was reached by the first
        ("http", ["https", "http"], "https"),  # lines are one list
    ],
)
def test_the_scheme_is_that_of_the_clients_own_request(
    kind: str, lines: list[str], scheme: str
) -> None:
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


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Certificate:
    return certificate(tmp_path_factory.mktemp("tls"))


@pytest.fixture(scope="module")
def secure(ours: Certificate) -> Iterator[Served]:
    with served(*ours.options, trust=ours.trust, LUPIN_TOKEN=TOKEN) as running:
        yield running


def refusal(cert: Path, key: Path) -> str:
    with pytest.raises(SettingError) as refused:
        check_pair(str(cert), str(key))
    message = str(refused.value)
    assert "\n" not in message
    return message


def test_a_pair_of_files_that_cannot_be_served_is_named(ours: Certificate, tmp_path: Path) -> None:
    nowhere, odd = tmp_path / "nowhere.pem", tmp_path / "odd.pem"
    assert refusal(nowhere, ours.key) == f"--tls-cert {nowhere}: No such file or directory"
    assert refusal(ours.cert, nowhere) == f"--tls-key {nowhere}: No such file or directory"
    assert refusal(tmp_path, ours.key) == f"--tls-cert {tmp_path}: Is a directory"
    for content in (b"", b"hello", b"\x00\xff" * 100, ours.key.read_bytes()):
        odd.write_bytes(content)
        assert refusal(odd, ours.key) == f"--tls-cert {odd} holds no PEM certificate"
    odd.write_bytes(ours.cert.read_bytes())
    assert f"--tls-key {odd} is not a usable private key" in refusal(ours.cert, odd)
    other = certificate(tmp_path)
    assert refusal(ours.cert, other.key) == f"--tls-key {other.key} is not the key of {ours.cert}"
    # Without a prompt on the terminal.
    key = load_pem_private_key(ours.key.read_bytes(), None)
    odd.write_bytes(
        key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, BestAvailableEncryption(b"secret"))
    )
    assert "is encrypted: give a key without a passphrase" in refusal(ours.cert, odd)


def test_a_bad_file_ends_the_start_with_one_line(ours: Certificate) -> None:
    line = refused_start("--tls-cert", "/nowhere", "--tls-key", str(ours.key))
    assert line == "lupin-twin: --tls-cert /nowhere: No such file or directory"


def test_https_and_wss_are_served_the_own_origin_is_https_and_the_cookie_is_secure(
    secure: Served, ours: Certificate
) -> None:
    assert secure.url.startswith("https://127.0.0.1:")
    assert secure.get("/api/state", BEARER).json()["tags"] == []
    with wss(ws_url(secure.url), ours.trust, BEARER) as connection:
        first = connection.next_state()["seq"]
        for number in range(1, 4):
            assert connection.next_state()["seq"] == first + number
    for origin, status in ((secure.url, 200), (secure.url.replace("https", "http"), 403)):
        assert secure.get("/api/state", {**BEARER, "Origin": origin}).status_code == status
    cookie = secure.post("/api/signin", BEARER).headers["set-cookie"]
    assert "secure" in [part.strip().lower() for part in cookie.split(";")]
    # No HSTS: a self-signed certificate must not be pinned in a browser.
    assert "strict-transport-security" not in secure.get("/signin").headers


def test_a_request_in_the_same_packet_as_the_end_of_the_handshake_is_answered(
    ours: Certificate,
) -> None:
    """As a fast client sends it: the server's tickets are still unsent when the request arrives."""
    with served(*ours.options, *limits(client_timeout_s=2), trust=ours.trust) as live:
        address = urlsplit(live.url)
        incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        tls = ours.trust.wrap_bio(incoming, outgoing, server_hostname=address.hostname)
        with socket.create_connection((address.hostname, address.port), PATIENCE_S) as client:

            def take() -> None:
                block = client.recv(1 << 16)
                assert block, "the connection was cut off"
                incoming.write(block)

            while True:
                try:
                    tls.do_handshake()
                    break
                except ssl.SSLWantReadError:
                    client.sendall(outgoing.read())
                    take()
            tls.write(handshake("/ws/state"))
            client.sendall(outgoing.read())
            received = b""
            while received.count(b'{"type":"state"') < 5:
                try:
                    received += tls.read(1 << 16)
                except ssl.SSLWantReadError:
                    take()
        assert "cut off" not in live.process.output


def test_old_versions_of_tls_are_refused(secure: Served, ours: Certificate) -> None:
    old = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    ours.authority.configure_trust(old)
    with pytest.warns(DeprecationWarning, match="TLSv1_1"):
        old.maximum_version = ssl.TLSVersion.TLSv1_1
    with pytest.raises(httpx.ConnectError), Served(secure.process, secure.url, old).client() as it:
        it.get("/healthz")


def renew(ours: Certificate, folder: Path) -> Certificate:
    folder.mkdir()
    new = certificate(folder)
    new.key.replace(ours.key)
    new.cert.replace(ours.cert)
    return Certificate(ours.cert, ours.key, new.trust, new.authority)


def put(path: Path, content: bytes) -> None:
    """Replace a file atomically: the bridge checks every two seconds, also in between."""
    new = path.with_name("new")
    new.write_bytes(content)
    new.replace(path)


def is_trusted(live: Served, trust: ssl.SSLContext) -> bool:
    try:
        return Served(live.process, live.url, trust).get("/healthz").status_code == 200
    except httpx.ConnectError:
        return False


def test_a_renewed_pair_is_served_to_every_new_connection(tmp_path: Path) -> None:
    old = certificate(tmp_path)
    with (
        served(*old.options, trust=old.trust) as live,
        wss(ws_url(live.url), old.trust) as connection,
        live.client() as stored,
    ):
        connection.next_state()
        assert stored.get("/healthz").status_code == 200
        new = renew(old, tmp_path / "new")
        wait_for(lambda: is_trusted(live, new.trust), "the new certificate")
        assert not is_trusted(live, old.trust)
        assert live.process.output.count("new connections use the renewed TLS certificate") == 1
        # Open connections go on.
        now_s = stored.get("/api/state").json()["header"]["stamp"]["sec"]
        wait_for(
            lambda: connection.next_state()["state"]["header"]["stamp"]["sec"] > now_s,
            "a later state",
        )
        assert stored.get("/healthz").status_code == 200


def test_a_broken_new_pair_is_logged_once_and_the_old_one_served(tmp_path: Path) -> None:
    ours = certificate(tmp_path)
    key = ours.key.read_bytes()
    with served(*ours.options, trust=ours.trust) as live:
        other = certificate(tmp_path, "other")
        for content, text in (
            (b"nonsense", "is not a usable private key"),
            (other.key.read_bytes(), "is not the key of"),
            (None, "No such file or directory"),
        ):
            if content is None:
                ours.key.unlink()
            else:
                put(ours.key, content)
            live.process.wait_for_output(text)
            assert is_trusted(live, ours.trust)
        assert live.process.output.count("is refused, the old one stays: --tls-key") == 3
        put(ours.key, key)
        live.process.wait_for_output("new connections use the renewed TLS certificate")
        assert is_trusted(live, ours.trust)
