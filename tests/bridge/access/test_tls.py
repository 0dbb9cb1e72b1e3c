"""TLS: bad files are reported at the start, and good ones serve https and wss."""

import signal
import socket
import ssl
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest
from cryptography.hazmat.primitives.serialization import (
    BestAvailableEncryption,
    Encoding,
    PrivateFormat,
    load_pem_private_key,
)

from lupin_bridge.serving.server import check_pair
from lupin_bridge.settings import SettingError
from tests.support.access import BEARER, TOKEN, Served, refused_start, served
from tests.support.processes import limits
from tests.support.raw_http import handshake
from tests.support.tls import Certificate, certificate
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import ws_url
from tests.support.wss import wss


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
    """Replace the served pair by a new one."""
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


@pytest.mark.parametrize("is_reported", [True, False])
def test_a_renewed_pair_is_served_to_every_new_connection(
    tmp_path: Path, is_reported: bool
) -> None:
    old = certificate(tmp_path)
    with (
        served(*old.options, trust=old.trust) as live,
        wss(ws_url(live.url), old.trust) as connection,
        live.client() as stored,
    ):
        connection.next_state()
        assert stored.get("/healthz").status_code == 200
        new = renew(old, tmp_path / "new")
        if is_reported:
            live.process.send(signal.SIGHUP)
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
            for _ in range(3):
                live.process.send(signal.SIGHUP)
                assert is_trusted(live, ours.trust)
            live.process.wait_for_output(text)
            assert live.process.output.count(text) == 1
        assert live.process.output.count("is refused, the old one stays: --tls-key") == 3
        put(ours.key, key)
        live.process.wait_for_output("new connections use the renewed TLS certificate")
        assert is_trusted(live, ours.trust)
