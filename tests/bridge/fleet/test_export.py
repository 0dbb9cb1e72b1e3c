"""Rows of one site or of many, as CSV and as Parquet."""

import csv
import io
from pathlib import Path

import pyarrow
from pyarrow import parquet

from tests.support.archive import Archive, forward_once
from tests.support.fleet import fleet, scans_lately, write
from tests.support.waiting import wait_for


def test_sites_are_exported_together_or_by_name(archive: Archive, tmp_path: Path) -> None:
    write(tmp_path / "journal", scans_lately(tags=2, scans=3))
    forward_once(archive, tmp_path / "journal")
    archive.copy_site("gh2", "gh3")
    with fleet(archive) as page:
        wait_for(lambda: len(page.sites()) == 3, "all sites")
        one = page.http.get("/sites/gh1/api/export.csv").text
        both = page.http.get("/api/export.csv?sites=gh3,gh1,gh3").text
        rows = list(csv.DictReader(io.StringIO(both, newline=""), strict=True))
        assert [row.pop("site") for row in rows] == ["gh3"] * 6 + ["gh1"] * 6
        assert rows[6:] == list(csv.DictReader(io.StringIO(one, newline="")))
        every = page.http.get("/api/export.parquet?sensor_type=temperature")
        assert "X-Complete-To" in every.headers
        table = parquet.read_table(pyarrow.BufferReader(every.content))
        assert table["site"].to_pylist() == [
            name for name in ("gh1", "gh2", "gh3") for _ in "6rows!"
        ]
        assert table.schema.field("value").metadata[b"units"] == "°C".encode()
        of_site = page.http.get("/sites/gh2/api/export.parquet")
        alone = parquet.read_table(pyarrow.BufferReader(of_site.content))
        assert "site" not in alone.column_names
        assert alone["value"] == table.slice(6, 6)["value"]
        for query, status, said in (
            ("sites=gh1,gh9", 404, "there is no site 'gh9' in the archive (3 others are)"),
            ("sites=", 404, "there is no site ''"),
            ("site=gh1", 400, "parameter 'site' is unknown, expected from, to, tag_id,"),
            ("from=5&to=4", 400, "to is 4.000000000 s, before from,"),
        ):
            for kind in ("csv", "parquet"):
                answer = page.http.get(f"/api/export.{kind}?{query}")
                assert answer.status_code == status, query
                assert said in answer.json()["detail"]
        assert page.http.head("/api/export.parquet").headers["content-disposition"]
