"""One POST to a real server: what is sent, and how little of the answer is read."""

import asyncio
import ssl
from collections.abc import Iterator
from pathlib import Path

import pytest

from lupin_bridge.notify import webhook
from lupin_bridge.notify.destinations import Targets, WebhookTarget
from lupin_bridge.notify.webhook import PostError, post
from lupin_bridge.settings import Secrets, Settings
from tests.support.processes import free_port
from tests.support.receiver import Posted, receiver, status
from tests.support.tls import certificate


def target(url: str, ca: str = "") -> WebhookTarget:
    settings = Settings(webhook_url=url, webhook_ca=ca)
    found = Targets.of(settings, Secrets(webhook_secret="s" * 16)).webhook
    assert found is not None
    return found


def sent(url: str, answer_s: float = 60.0, ca: str = "") -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(webhook, "ANSWER_S", answer_s)
        asyncio.run(post(target(url, ca), {"webhook-id": "1"}, b'{"a":1}'))


def refusal(url: str, answer_s: float = 60.0, ca: str = "") -> str:
    with pytest.raises(PostError) as refused:
        sent(url, answer_s, ca)
    return str(refused.value)


def message(port: int) -> tuple[int, int]:
    """The status of a refusal, and its Retry-After."""
    with pytest.raises(PostError) as refused:
        sent(f"http://127.0.0.1:{port}/")
    return refused.value.status, refused.value.retry_after_s


def test_a_post_has_its_headers_and_body() -> None:
    with receiver(status(204)) as server:
        sent(f"http://127.0.0.1:{server.port}/hook?a=b")
    (posted,) = server.posted
    assert (posted.path, posted.body) == ("/hook?a=b", b'{"a":1}')
    assert posted.headers["content-type"] == "application/json"
    assert posted.headers["host"] == f"127.0.0.1:{server.port}"
    assert posted.headers["webhook-id"] == "1"


@pytest.mark.parametrize("code", [302, 404, 500])
def test_any_other_status_fails_and_a_redirect_is_not_followed(code: int) -> None:
    with receiver(status(200)) as elsewhere:
        place = f"Location: http://127.0.0.1:{elsewhere.port}/"
        with receiver(status(code, place, "Retry-After: 7")) as server:
            assert message(server.port) == (code, 7)
    assert elsewhere.posted == []


def test_a_missing_receiver_is_reported_in_the_systems_words() -> None:
    assert refusal(f"http://127.0.0.1:{free_port()}/") == "Connection refused"
    assert refusal("http://a..b/") == "its host name cannot be looked up"


@pytest.mark.parametrize("begin", [b"", b"HTTP/1.1 200 OK\r\nX: "])
def test_no_answer_in_time_is_a_failure_and_so_is_a_partial_one(begin: bytes) -> None:
    with receiver(lambda _: iter([begin, None])) as server:
        assert refusal(f"http://127.0.0.1:{server.port}/", 0.05) == "no answer within 0.05 s"


def test_a_body_is_not_read_however_much_arrives() -> None:
    given: list[int] = []

    def flood(_: Posted) -> Iterator[bytes | None]:
        yield b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n"
        while True:
            given.append(65_536)
            yield b"10000\r\n" + b"x" * 65_536 + b"\r\n"

    with receiver(flood) as server:
        sent(f"http://127.0.0.1:{server.port}/")
    assert sum(given) < 20_000_000  # more than the sockets hold


def test_a_head_is_read_up_to_a_limit() -> None:
    def long(_: Posted) -> Iterator[bytes | None]:
        yield b"HTTP/1.1 200 OK\r\nX: "
        while True:
            yield b"x" * 1000

    with receiver(long) as server:
        why = "no HTTP answer: Receive buffer too long"
        assert refusal(f"http://127.0.0.1:{server.port}/", 5.0) == why


@pytest.mark.parametrize(
    ("message", "why"),
    [
        (b"SSH-2.0-OpenSSH\r\n\r\n", "no HTTP answer: "),
        (b"", "the connection was closed before an answer"),
        (b"HTTP/1.1 200", "the connection was closed before an answer"),
    ],
)
def test_an_invalid_answer_is_reported(message: bytes, why: str) -> None:
    with receiver(lambda _: iter([message])) as server:
        assert refusal(f"http://127.0.0.1:{server.port}/").startswith(why)


def test_an_interim_response_is_skipped() -> None:
    first = b"HTTP/1.1 103 Early Hints\r\n\r\nHTTP/1.1 202 OK\r\n\r\n"
    with receiver(lambda _: iter([first])) as server:
        sent(f"http://127.0.0.1:{server.port}/")


@pytest.mark.parametrize(
    ("retry_after", "reported_s"),
    [("Wed, 21 Oct 2026 07:28:00 GMT", 0), ("9" * 5_000, 999_999_999)],
)
def test_retry_after_is_a_number(retry_after: str, reported_s: int) -> None:
    with receiver(status(503, f"Retry-After: {retry_after}")) as server:
        assert message(server.port) == (503, reported_s)


def test_https_trusts_its_authority_alone(tmp_path: Path) -> None:
    made = certificate(tmp_path)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(made.cert, made.key)
    with receiver(status(200), tls=context) as server:
        url = f"https://127.0.0.1:{server.port}/"
        assert "certificate verify failed" in refusal(url)
        ca = tmp_path / "ca.pem"
        made.authority.cert_pem.write_to_path(str(ca))
        sent(url, ca=str(ca))
    assert len(server.posted) == 1
