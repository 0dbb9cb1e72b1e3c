from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.archive import Archive
from tests.support.postgres import Postgres, server


@pytest.fixture(scope="session")
def postgresql() -> Iterator[Postgres]:
    """A server for all tests that leave it as it is."""
    with server() as made:
        yield made


@pytest.fixture
def archive(postgresql: Postgres) -> Archive:
    """A new archive, with the user of the site gh1, and one that may read all."""
    made = Archive(postgresql)
    made.add_user("page", "lupin_page")
    return made
