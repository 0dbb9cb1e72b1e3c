"""Whom a trusted proxy names, and nobody else may: real connections from several addresses."""

from collections.abc import Iterator

import pytest

from tests.support.access import Served, refused_start, served
from tests.support.people import TOKEN, add, changing

PROXY, STRANGER = "127.0.8.1", "127.0.8.2"


@pytest.fixture(scope="module")
def behind(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    path = tmp_path_factory.mktemp("accounts") / "accounts.sqlite"
    with changing(path) as accounts:
        accounts.add("anna@example.org", "account", "operator", "", by="a test", now_s=1)
    add(path, "token", scada="viewer")
    with served(
        "--accounts", str(path), "--trusted-proxy", PROXY, "--proxy-user-header", "Remote-User"
    ) as running:
        yield running


def who(live: Served, address: str, *headers: tuple[str, str]) -> str:
    """The name and the role of a request from an address, or its status."""
    with live.client(address) as client:
        answer = client.get("/api/session", headers=list(headers))
    if answer.status_code != 200:
        return str(answer.status_code)
    body = answer.json()
    return f"{body['name']} {body['role']}"


def test_a_name_is_believed_of_the_proxy_and_of_nobody_else(behind: Served) -> None:
    anna = ("Remote-User", "anna@example.org")
    assert who(behind, PROXY, anna) == "anna@example.org operator"
    assert who(behind, PROXY, ("remote-user", "new@example.org")) == "new@example.org viewer"
    assert who(behind, STRANGER, anna) == "401"
    assert who(behind, STRANGER, anna, ("X-Forwarded-For", PROXY)) == "401"
    assert who(behind, STRANGER, anna, ("Authorization", f"Bearer {TOKEN}")) == "scada viewer"
    assert who(behind, PROXY) == "401", "who has not signed in there"


def test_what_a_client_adds_to_the_proxys_word_names_nobody(behind: Served) -> None:
    anna = ("Remote-User", "anna@example.org")
    assert who(behind, PROXY, anna, ("Remote-User", "boss")) == "401"
    assert who(behind, PROXY, anna, anna) == "401"
    for name in ("", "a b", "anna@example.org, boss", "x" * 65, "<script>"):
        assert who(behind, PROXY, ("Remote-User", name)) == "401", name


def test_the_settings_of_a_proxy_go_together() -> None:
    assert "nobody is believed" in refused_start("--proxy-user-header", "Remote-User")
    wrong = refused_start("--proxy-user-header", "a b", "--trusted-proxy", PROXY)
    assert "must be a header's name" in wrong
