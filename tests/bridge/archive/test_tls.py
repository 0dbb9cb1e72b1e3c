"""An archive over TLS, as libpq has it: who it is is checked, and said in one line if it is not."""

import random
from pathlib import Path

from tests.support.archive import Archive, run
from tests.support.fleet import fleet, scans_lately, write
from tests.support.postgres import server
from tests.support.tls import certificate


def test_the_servers_certificate_is_checked(tmp_path: Path) -> None:
    journal = tmp_path / "journal.sqlite"
    write(journal, scans_lately())
    made, other = certificate(tmp_path), certificate(tmp_path, "other")
    trusted, foreign = tmp_path / "trusted.pem", tmp_path / "foreign.pem"
    made.authority.cert_pem.write_to_path(str(trusted))
    other.authority.cert_pem.write_to_path(str(foreign))
    # Of its own, so that no other test's server has the port.
    address = f"127.{random.randint(1, 250)}.{random.randint(1, 250)}.{random.randint(2, 250)}"
    with server() as own:
        archive = Archive(own)
        archive.add_user("page", "lupin_page")
        own.listen_with_tls(address, made.cert, made.key)

        def url(user: str, root: Path) -> str:
            where = f"{user}@localhost/{archive.name}?hostaddr={address}"
            return f"postgresql://{where}&sslmode=verify-full&sslrootcert={root}"

        words = ("forward", "--site", "gh1", "--journal", str(journal), "--once")
        refused = run(*words, "--archive-url", url("gh1", foreign))
        assert refused.returncode == 1
        assert "certificate verify failed" in refused.stderr
        assert len(refused.stderr.splitlines()) == 1
        assert archive.rows()["scan"] == []
        done = run(*words, "--archive-url", url("gh1", trusted))
        assert done.returncode == 0, done.stderr
        assert len(archive.rows()["scan"]) == len(scans_lately()) - 5
        with fleet(_At(archive, url("page", trusted))) as page:
            page.site(last_verdict="healthy")
        with fleet(_At(archive, url("page", foreign))) as page:
            page.process.wait_for_output("certificate verify failed")
            assert page.http.get("/readyz").status_code == 503


class _At(Archive):
    """An archive at an address that is given."""

    def __init__(self, archive: Archive, url: str) -> None:
        vars(self).update(vars(archive))
        self._url = url

    def url(self, user: str | None = None) -> str:
        """See there."""
        return self._url
