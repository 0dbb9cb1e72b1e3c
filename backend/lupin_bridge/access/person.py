"""Who makes a request and what they may: names, roles, sites. Pure."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal

Role = Literal["viewer", "operator", "admin", "writer"]
# What each may, the ones before it may too.
ROLES: Final[tuple[Role, ...]] = ("viewer", "operator", "admin")
# A token of a sensor posts observations, and may nothing else: it stands in no one's row.
WRITER: Final = "writer"
TOKEN_ROLES: Final[tuple[Role, ...]] = (*ROLES, WRITER)
Kind = Literal["account", "token"]

MIN_PASSWORD: Final = 10
MAX_PASSWORD: Final = 512
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@+-]{0,63}")


class AccountError(Exception):
    """It cannot be done; the message is the one line that says why."""


@dataclass(frozen=True, slots=True)
class Person:
    """Who makes a request, what they may, and how that is known.

    `session` is its id; `ends_at_s` when it ends, s since the epoch. `token` is the digest of the
    one that a request came with. `name` is empty for the shared token. `sites` are those whose data
    they may read, empty: all.
    """

    name: str
    role: Role
    by: Literal["account", "token", "proxy", "shared token"] = "account"
    session: str = ""
    ends_at_s: int = 0
    token: str = ""
    sites: tuple[str, ...] = ()

    def may(self, role: Role) -> bool:
        """Whether that role's rights are among theirs."""
        return self.role in ROLES and ROLES.index(self.role) >= ROLES.index(role)

    def reads(self, site: str) -> bool:
        """Whether the data of a site are for them; "": a bridge without a name of its site."""
        return not self.sites or site in self.sites


def is_name(text: str) -> bool:
    """Whether it can be the name of a person or token."""
    return _NAME.fullmatch(text) is not None


def check_name(name: str) -> None:
    """Refuse what can be no name.

    Raises:
        AccountError: it cannot.

    """
    if not is_name(name):
        raise AccountError(
            f"the name is {name[:80]!r}, must be 1 to 64 letters, digits and ._@+-, and begin with "
            "a letter or digit"
        )


def check_site(site: str) -> None:
    """Refuse what can be no site's name in the archive.

    Raises:
        AccountError: it cannot.

    """
    if not site or len(site) > 64 or not site.isprintable():
        raise AccountError(f"the site is {site[:80]!r}, must be 1 to 64 characters")


def check_password(password: str) -> None:
    """Refuse what is too short or too long.

    Raises:
        AccountError: it is.

    """
    if not MIN_PASSWORD <= len(password) <= MAX_PASSWORD:
        raise AccountError(
            f"the password has {len(password)} characters, must have {MIN_PASSWORD} to "
            f"{MAX_PASSWORD}"
        )
