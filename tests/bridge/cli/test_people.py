"""`lupin-twin user`, `token` and `audit`: what they print, and what the file then holds."""

import csv
import re
import time
from contextlib import closing
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from lupin_bridge.access.accounts import Accounts
from lupin_bridge.access.credentials import Person, digest
from lupin_bridge.access.people import verify
from tests.support.people import PASSWORD, begin_session
from tests.support.processes import run_here

NOW = r"20\d\d-\d\d-\d\dT\d\d:\d\d:\d\dZ"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "accounts.sqlite"


def ended(file: Path, words: str) -> CompletedProcess[str]:
    """The command on this file."""
    return run_here(*words.split(), "--accounts", file)


def printed(file: Path, words: str) -> str:
    """What it prints; it must succeed."""
    done = ended(file, words)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_user_is_added_listed_and_removed(file: Path) -> None:
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
        rf"anna  operator  {NOW}  gh1 gh2\nbert  viewer  {NOW}\n", printed(file, "user list")
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
    assert re.fullmatch(rf"scada  viewer  {NOW}  gh1\n", listed)
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
    assert all(re.fullmatch(NOW, row[0]) for row in rows)
    by = rows[0][1]
    assert by.endswith(" on this machine")
    assert [row[1:] for row in rows] == [
        [by, "remove token", "scada", ""],
        ["anna", "sign in", "", "192.0.2.7"],
        [by, "add token", "scada viewer", ""],
        [by, "add account", "anna admin", ""],
    ]
    assert token not in text


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
