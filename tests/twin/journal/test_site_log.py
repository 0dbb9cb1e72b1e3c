from __future__ import annotations

from pathlib import Path

import psycopg

from lupin_twin.journal.schema import SiteLog
from tests.support.log_life import lived
from tests.twin.journal.conftest import Copied


def test_a_view_of_either_engine_is_of_one_moment(tmp_path: Path, copied: Copied) -> None:
    count = "SELECT count(*) FROM scan WHERE site = :site"
    with lived(tmp_path / "j.sqlite") as life:
        found = copied(life.connection)
        archive, site = found.connection, found.site
        with psycopg.connect(archive.info.dsn, autocommit=True) as second:
            log, writer = SiteLog(archive, site), SiteLog(second, site)
            with log.one_view():
                assert log.execute(count).fetchone() == (0,)
                writer.execute_many(
                    "INSERT INTO scan VALUES (?, 1, 1, 1, NULL, 1, 0, '', '', '', 0, '[]')",
                    [(site,)],
                )
                assert log.execute(count).fetchone() == (0,)
            assert log.execute(count).fetchone() == (1,)
        log = SiteLog(life.connection)
        with log.one_view(), log.one_view():
            assert life.connection.in_transaction
        assert not life.connection.in_transaction
