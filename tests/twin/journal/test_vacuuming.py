from contextlib import closing
from pathlib import Path

import pytest

from lupin_twin.journal.rebuild import vacuum
from lupin_twin.journal.schema import NotPossible, open_reader, open_writer
from tests.support.journal import NOW, SECOND, append, is_whole, known, pin, scan
from tests.twin.journal.conftest import fail_on_a_full_disk


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A journal nine tenths of which are free."""
    made = tmp_path / "j.sqlite"
    append(made, [pin(), *(scan(at_ns=NOW + n * SECOND, a=n / 3) for n in range(5000))])
    with closing(open_writer(made)) as connection:
        connection.execute("DELETE FROM scan WHERE seq < 4500")
        # As the deletion of rows records it.
        until_ns = NOW + 4500 * SECOND
        connection.execute(f"INSERT INTO meta VALUES ('local', 'purged_ns:1', '{until_ns}')")
    return made


def small(path: Path) -> tuple[int, int]:
    return vacuum(path, "a test", lambda what, share: None)


def test_the_file_shrinks_and_its_content_stays(path: Path) -> None:
    size, rows = path.stat().st_size, known(path)
    path.chmod(0o640)
    before, after = small(path)
    assert (before, after) == (size, path.stat().st_size)
    assert after < size / 5
    assert path.stat().st_mode & 0o777 == 0o640
    assert known(path) == rows
    assert is_whole(path)
    assert small(path) == (after, after)
    # It can be written as before, with consecutive numbers.
    assert append(path, [scan("new")]) == 1


def test_it_is_refused_while_the_file_is_read(path: Path) -> None:
    with closing(open_reader(path)) as reader:
        reader.execute("BEGIN")
        reader.execute("SELECT count(*) FROM scan").fetchone()
        with pytest.raises(NotPossible, match=r"another process reads .*j\.sqlite"):
            small(path)
    assert small(path)[1] < path.stat().st_size * 5


def test_a_disk_that_fills_leaves_the_file_unchanged(path: Path) -> None:
    append(path, [scan(at_ns=NOW + n * SECOND, a=n / 3) for n in range(5000, 9000)])
    rows = known(path)
    code = "from lupin_twin.journal.rebuild import vacuum; vacuum(path, 'a test', print)"
    fail_on_a_full_disk(code, path, 100_000)
    assert is_whole(path)
    assert known(path) == rows
    assert small(path)[1] < path.stat().st_size * 2
