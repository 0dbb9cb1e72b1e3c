"""The shared token and its sessions; the accounts file, its roles, and its commands."""

import asyncio
import csv
import re
import resource
import sqlite3
import stat
import time
from contextlib import closing
from pathlib import Path
from subprocess import CompletedProcess

import pytest
from argon2 import PasswordHasher

from lupin_bridge.access import credentials
from lupin_bridge.access import people as people_module
from lupin_bridge.access.accounts import SESSION_S, Accounts, Audited, Device
from lupin_bridge.access.credentials import (
    MIN_TOKEN_LENGTH,
    SHARED_SESSION_S,
    AccountError,
    Credentials,
    Person,
    check_password,
    cookies_of,
    digest,
)
from lupin_bridge.access.people import ATTEMPT_BURST, MAX_WAITING, People, verify
from lupin_bridge.serving.admission import ClientLimitError
from lupin_bridge.settings import SettingError
from tests.support.people import PASSWORD, add, begin_session, changing, remove
from tests.support.people import TOKEN as SCADA
from tests.support.processes import run_here

TOKEN = "correct-horse~battery.staple/42+x="
OURS = Credentials(TOKEN)
NOW_S = 1_700_000_000.0


def test_a_token_that_is_short_or_that_no_header_can_carry_is_refused_and_never_shown() -> None:
    for token in ("", "short", "x" * (MIN_TOKEN_LENGTH - 1)):
        length = f"LUPIN_TOKEN has {len(token)} characters, must have at least {MIN_TOKEN_LENGTH}"
        with pytest.raises(SettingError, match=length) as refused:
            Credentials(token)
        assert not token or token not in str(refused.value)
    for odd in (" ", "\n", "ä", '"', ";", ",", "\x00", "=x"):
        with pytest.raises(SettingError, match="RFC 6750") as refused:
            Credentials(f"0123456789abcdef{odd}0123456789")
        assert "0123456789" not in str(refused.value)


def test_a_session_holds_at_every_replica_of_the_token_until_it_ends() -> None:
    cookie, replica = OURS.cookie(NOW_S), Credentials(TOKEN)
    session = replica.session_of(cookie, NOW_S + SHARED_SESSION_S - 1)
    assert session is not None
    assert (session.name, session.role) == ("", "viewer")
    assert session.ends_at_s == NOW_S + SHARED_SESSION_S
    assert replica.cookie_name == OURS.cookie_name
    assert not OURS.session_of(cookie, NOW_S + SHARED_SESSION_S)
    another = Credentials(TOKEN + "=")
    assert not another.session_of(cookie, NOW_S)
    assert another.cookie_name != OURS.cookie_name
    assert TOKEN not in cookie + repr(OURS) + str(vars(OURS))


@pytest.mark.parametrize("made_up", ["", ".", "\u0660", "x" * 8_000])
def test_a_changed_cookie_is_refused(made_up: str) -> None:
    ends, name, mac = OURS.cookie(NOW_S).split(".")
    for cookie in (
        made_up,
        f"{int(ends) + 1}.{name}.{mac}",
        f"{ends}0.{name}.{mac}",
        f"{ends}.{name[::-1]}.{mac}",
        f"{ends}.{name}.{mac[::-1]}",
        f"{ends}.{name}.{made_up}",
        f"{ends}.{mac}",
    ):
        assert not OURS.session_of(cookie, NOW_S)


def test_signed_out_sessions_are_remembered_up_to_a_limit_the_longest_lasting_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(credentials, "MAX_SIGNED_OUT", 2)
    ours = Credentials(TOKEN)
    cookies = [ours.cookie(NOW_S + later_s) for later_s in range(4)]
    for cookie in cookies[:3]:
        session = ours.session_of(cookie, NOW_S)
        assert session is not None
        ours.sign_out(session)
        assert not ours.still(session, NOW_S)
    assert [ours.session_of(cookie, NOW_S) is not None for cookie in cookies] == [
        *(True, False, False, True)
    ]


NAME = "lupin_session_0011aabb"


def test_every_value_of_the_name_is_found_in_all_header_lines_and_nothing_else() -> None:
    for header, values in (
        ("", []),
        (f"theme=dark; {NAME}=a.b; other=1", ["a.b"]),
        (f"theme=dark;{NAME}=a.b\t;", ["a.b"]),
        (f"x{NAME}=a", []),
        (f"{NAME}x=a", []),
        (f"{NAME}=a; {NAME}=b", ["a", "b"]),
        (f'{NAME}="a\\"b"', ['"a\\"b"']),
    ):
        assert cookies_of(NAME, [(b"host", b"x"), (b"cookie", header.encode())]) == values
    # Bytes that are no text do no harm.
    lines = [(b"cookie", f"{NAME}=a".encode()), (b"cookie", f"{NAME}=\xff".encode("latin-1"))]
    assert cookies_of(NAME, lines) == ["a", "\xff"]
    assert cookies_of(NAME, [(b"set-cookie", f"{NAME}=a".encode())]) == []


NOW = 1_800_000_000


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "state" / "accounts.sqlite"


def test_only_its_owner_can_read_the_file_and_it_holds_no_secret(path: Path) -> None:
    add(path, anna="operator")
    add(path, "token", scada="viewer")
    with changing(path) as accounts:
        cookie = begin_session(accounts)
        assert [stat.S_IMODE(file.stat().st_mode) for file in path.parent.iterdir()] == [0o600] * 3
        raw = b"".join(file.read_bytes() for file in path.parent.iterdir())
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    for secret in (PASSWORD, SCADA, cookie):
        assert secret.encode() not in raw
    assert b"$argon2id$" in raw


def test_sessions_per_name_are_limited_and_end_when_they_expire_and_with_their_account(
    path: Path,
) -> None:
    add(path, anna="operator")
    with changing(path) as accounts:
        names = [digest(begin_session(accounts, NOW + n)) for n in range(25)]
        found = [accounts.of_session(name, NOW) for name in names]
        assert [it is not None for it in found] == [False] * 5 + [True] * 20
        name, anna = digest(begin_session(accounts)), accounts.of_name("anna")
        whose = accounts.of_session(name, NOW + SESSION_S - 1)
        assert whose == Person("anna", "operator", session=name, ends_at_s=NOW + SESSION_S)
        assert accounts.of_session(name, NOW + SESSION_S) is None
        accounts.remove("anna", "account", by="a test", now_s=NOW)
        assert accounts.of_session(name, NOW) is None
        assert anna is not None
        assert accounts.begin_session(anna, "::1", NOW) is None
    assert b"$argon2id$" not in path.read_bytes(), "it is gone, and not only forgotten"
    add(path, anna="admin")
    with closing(Accounts(path)) as accounts:
        assert accounts.of_session(name, NOW) is None, "of another anna"


def test_a_name_belongs_to_one_person_or_one_token(path: Path) -> None:
    add(path, anna="operator")
    with pytest.raises(AccountError, match="there is account 'anna' already"):
        add(path, "token", anna="admin")
    with pytest.raises(AccountError, match="no token 'anna'"):
        remove(path, "anna", "token")
    for name in ("", "-x", "a b", "a\n", "ä", "x" * 65, "<b>", "a\0b"):
        with changing(path) as accounts, pytest.raises(AccountError, match="the name is"):
            accounts.add(name, "account", "viewer", "", by="a test", now_s=NOW)


@pytest.mark.parametrize("length", [0, 9, 513, 10**6])
def test_a_password_has_length_limits(length: int) -> None:
    with pytest.raises(AccountError, match=f"has {length} characters, must have 10 to 512"):
        check_password("x" * length)


def test_another_users_file_is_left_alone(path: Path) -> None:
    path.parent.mkdir()
    path.write_text("no database, but something dear to somebody")
    with pytest.raises(AccountError):
        add(path, anna="admin")
    assert path.read_text().startswith("no database")
    path.unlink()
    with changing(path), closing(sqlite3.connect(path)) as later:
        later.execute("PRAGMA user_version = 9")
    with pytest.raises(AccountError, match="is of version 9"):
        Accounts(path)


def test_a_reader_cannot_write_and_the_audit_trail_drops_its_oldest_rows(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lupin_bridge.access.accounts.MAX_AUDITED", 3)
    add(path, anna="operator")
    with changing(path) as accounts:
        for number in range(9):
            accounts.note(Audited(NOW, "anna", "comment", str(number), "::1"))
    with closing(Accounts(path)) as accounts:
        assert [row.subject for row in accounts.audited()] == ["8", "7", "6"]
        with pytest.raises(AccountError, match="cannot be written"):
            accounts.note(Audited(NOW, "anna", "comment", "", ""))


async def test_an_unknown_name_takes_as_much_work_as_a_wrong_password(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    add(path, anna="operator")
    with changing(path) as accounts:  # signs in elsewhere
        accounts.add("bert", "account", "operator", "", by="a test", now_s=NOW)
    worked: list[str] = []
    verify = PasswordHasher.verify

    def counted(hasher: PasswordHasher, stored: str, password: str) -> bool:
        worked.append(stored)
        return verify(hasher, stored, password)

    monkeypatch.setattr(PasswordHasher, "verify", counted)
    people = People(path)
    assert await people.check("anna", PASSWORD, "1") == Person("anna", "operator")
    for name in ("anna", "nobody", "bert"):
        assert await people.check(name, "wrong" + PASSWORD, "1") is None
    assert await people.check("nobody", "", "1") is None
    assert [stored[:10] for stored in worked] == ["$argon2id$"] * 5


async def test_a_flood_of_sign_ins_waits_in_a_short_queue_while_other_writes_go_on(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    add(path, anna="operator")
    at_work: list[int] = []

    def slow(stored: str, password: str) -> bool:
        at_work.append(1)
        assert len(at_work) == 1, "two at once"
        at_work.pop()
        return False

    monkeypatch.setattr(people_module, "verify", slow)
    people = People(path)
    attempts = (people.check("anna", "x", str(n)) for n in range(3 * MAX_WAITING))
    found = await asyncio.gather(*attempts, return_exceptions=True)
    assert found.count(None) == MAX_WAITING
    assert sum(isinstance(it, ClientLimitError) for it in found) == 2 * MAX_WAITING
    flood = [asyncio.ensure_future(people.check("anna", "x", f"b{n}")) for n in range(20)]
    await asyncio.sleep(0)
    await people.write(lambda it, at_s: it.note(Audited(at_s, "anna", "comment", "site", "")))
    assert (await people.write(lambda it, _: it.audited(1)))[0].what == "comment"
    await asyncio.gather(*flood, return_exceptions=True)
    reads = (people.write(lambda it, _: it.audited(1)) for _ in range(2 * MAX_WAITING + 1))
    *_, refused = await asyncio.gather(*reads, return_exceptions=True)
    assert f"{2 * MAX_WAITING} sign-ins and changes are waiting" in str(refused)


async def test_a_sign_in_that_its_client_cancels_still_counts_as_an_attempt(path: Path) -> None:
    add(path, anna="operator")
    people = People(path)
    for _ in range(ATTEMPT_BURST):
        leaving = asyncio.create_task(people.check("anna", PASSWORD, "1"))
        await asyncio.sleep(0)
        leaving.cancel()
        await people.write(lambda it, _: it.audited(1))  # behind it on the thread
    with pytest.raises(ClientLimitError, match="1 has failed"):
        await people.check("anna", PASSWORD, "1")


def test_a_deleted_or_unreadable_accounts_file_opens_nothing(path: Path) -> None:
    people = People(path)
    before = people.is_on
    add(path, "token", scada="viewer")
    assert (before, people.is_on) == (False, True)
    assert people.by_token(SCADA) == Person("scada", "viewer", by="token")
    path.unlink()
    assert people.is_on
    with pytest.raises(AccountError):
        people.by_token(SCADA)
    add(path, "token", digest("another"), scada="viewer")  # another file in its place
    assert people.by_token(SCADA) is None
    path.unlink()
    path.symlink_to(path)  # it cannot be read
    assert People(path).is_on


def test_a_name_from_a_proxy_is_checked_again_on_every_use(path: Path) -> None:
    add(path, anna="operator")
    people = People(path, is_proxied=True)
    anna = people.by_proxy("anna")
    assert anna is not None
    assert people.may_stay(anna)
    remove(path, "anna")
    assert not people.may_stay(anna)


def test_only_devices_of_people_who_may_read_the_site_are_notified(path: Path) -> None:
    with changing(path) as accounts:
        accounts.add("anna", "account", "viewer", "", by="a test", now_s=NOW, sites=["north"])
        accounts.add_device("anna", Device("https://push.example/x", "", "", "en"), "::1", NOW)
        found = [len(accounts.devices(site)) for site in ("north", "south", "")]
    assert found == [1, 0, 0]


STAMP = r"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\dZ"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "accounts.sqlite"


def ended(file: Path, words: str) -> CompletedProcess[str]:
    return run_here(*words.split(), "--accounts", file)


def printed(file: Path, words: str) -> str:
    """What it prints; it must succeed."""
    done = ended(file, words)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_user_is_added_listed_and_removed(file: Path) -> None:
    assert f"there is no file of accounts {file}: user add" in ended(file, "user list").stderr
    secret = file.with_name("password")
    secret.write_text("short\n")
    words = "user add anna --role operator --for-site gh1 --for-site gh2 --password-file"
    refused = ended(file, f"{words} {secret}")
    assert (refused.returncode, file.exists()) == (1, False)
    assert "has 5 characters, must have 10 to 512" in refused.stderr
    secret.write_text(f"{PASSWORD}\n")
    added = ended(file, f"{words} {secret}")
    assert (added.returncode, added.stdout) == (
        0,
        "account anna is added, with the role operator\n",
    )
    assert f"{file} is created: from now on, bridges" in added.stderr
    assert printed(file, "user add bert --role viewer --no-password") == (
        "account bert is added, with the role viewer\n"
    )
    assert re.fullmatch(
        rf"anna  operator  {STAMP}  gh1 gh2\nbert  viewer  {STAMP}\n", printed(file, "user list")
    )
    with closing(Accounts(file, is_writer=True)) as accounts:
        found = accounts.of_name("anna")
        assert found is not None
        assert found == Person("anna", "operator", sites=("gh1", "gh2"))
        assert verify(found.secret, PASSWORD)
        session = digest(begin_session(accounts, int(time.time())))
    assert printed(file, "user remove anna") == "account anna is removed\n"
    assert printed(file, "user list").startswith("bert ")
    with closing(Accounts(file)) as accounts:
        assert accounts.of_name("anna") is None
        assert accounts.of_session(session, int(time.time())) is None
    last = ended(file, "user remove bert")
    assert (last.returncode, printed(file, "user list")) == (0, "")
    assert "nobody can sign in any more" in last.stderr


def test_a_token_is_printed_once_listed_and_revoked(file: Path) -> None:
    token = printed(file, "token add scada --role viewer --for-site gh1").strip()
    listed = printed(file, "token list")
    assert re.fullmatch(rf"scada  viewer  {STAMP}  gh1\n", listed)
    assert printed(file, "user list") == ""
    with closing(Accounts(file)) as accounts:
        found = accounts.of_token(digest(token))
        assert found is not None
        assert (found.name, found.role, found.sites) == ("scada", "viewer", ("gh1",))
    assert printed(file, "token revoke scada") == "token scada is removed\n"
    assert printed(file, "token list") == ""
    with closing(Accounts(file)) as accounts:
        assert accounts.of_token(digest(token)) is None


def test_the_audit_trail_is_csv_with_the_latest_row_first(file: Path) -> None:
    printed(file, "user add anna --role admin --no-password")
    token = printed(file, "token add scada --role viewer").strip()
    with closing(Accounts(file, is_writer=True)) as accounts:
        begin_session(accounts, int(time.time()))
    printed(file, "token revoke scada")
    text = printed(file, "audit")
    header, *rows = csv.reader(text.splitlines())
    assert header == ["time", "who", "what", "subject", "address"]
    assert all(re.fullmatch(STAMP, row[0]) for row in rows)
    by = rows[0][1]
    assert by.endswith(" on this machine")
    assert [row[1:] for row in rows] == [
        [by, "remove token", "scada", ""],
        ["anna", "sign in", "", "192.0.2.7"],
        [by, "add token", "scada viewer", ""],
        [by, "add account", "anna admin", ""],
    ]
    assert token not in text


def test_a_full_disk_is_reported_with_what_to_do(file: Path) -> None:
    printed(file, "user add anna --role viewer --no-password")
    _, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1, most))
    try:
        done = ended(file, "user list")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))
    assert f"{file} cannot be read: disk I/O error; if its disk is full, make room" in done.stderr


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ("user add no/name --role viewer --no-password", "the name is 'no/name'"),
        ("user add anna --role viewer --no-password", "there is account 'anna' already"),
        ("user add bert --role viewer", "there is no terminal to enter the password in"),
        ("user add bert --role viewer --password-file /nowhere", "--password-file /nowhere: No "),
        ("user remove bert", "there is no account 'bert'"),
        ("token revoke anna", "there is no token 'anna'"),
    ],
)
def test_a_failed_command_is_one_line_and_changes_nothing(
    file: Path, words: str, reason: str
) -> None:
    printed(file, "user add anna --role viewer --no-password")
    before = printed(file, "user list"), printed(file, "audit")
    done = ended(file, words)
    assert (done.returncode, done.stdout) == (1, "")
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"lupin-twin: {reason}")
    assert (printed(file, "user list"), printed(file, "audit")) == before
