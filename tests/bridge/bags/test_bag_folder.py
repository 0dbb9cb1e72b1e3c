"""What is named, and which files that are."""

from __future__ import annotations

from pathlib import Path

import pytest

from lupin_bridge.bags.bag_folder import files_in
from lupin_bridge.bags.recording import RecordingError

METADATA = """\
rosbag2_bagfile_information:
  version: 9
  storage_identifier: mcap
  relative_file_paths:
    - run_1.mcap
    - "run 0.mcap"
    - 'run_2.mcap'
  files:
    - path: run_1.mcap
"""


def names(*named: Path) -> list[str]:
    return [file.name for file in files_in(named)]


def test_of_a_folder_what_its_metadata_lists_and_without_it_all_recordings(tmp_path: Path) -> None:
    for name in ("b.mcap", "a.mcap", "a.txt"):
        (tmp_path / name).touch()
    assert names(tmp_path) == ["a.mcap", "b.mcap"]
    assert names(tmp_path / "b.mcap", tmp_path / "no.mcap") == ["b.mcap", "no.mcap"]
    (tmp_path / "metadata.yaml").write_text(METADATA)
    assert names(tmp_path) == ["run_1.mcap", "run 0.mcap", "run_2.mcap"]
    (tmp_path / "metadata.yaml").write_text("  relative_file_paths:\n  - a.mcap")
    assert names(tmp_path) == ["a.mcap"]


def refused(*named: Path) -> str:
    with pytest.raises(RecordingError) as error:
        files_in(named)
    return str(error.value)


def test_a_folder_that_has_none_says_so(tmp_path: Path) -> None:
    assert refused(tmp_path) == f"{tmp_path} is a folder in which no file ends in .mcap"
    path = tmp_path / "metadata.yaml"
    path.write_text("relative_file_paths: []")
    none = f"{tmp_path} is a folder in which no file is listed in its metadata.yaml"
    assert refused(tmp_path) == none
    path.write_bytes(b"\xff\xfe")
    assert refused(tmp_path).startswith(f"cannot read {path}: ")


def test_no_file_is_named_twice(tmp_path: Path) -> None:
    file = tmp_path / "a.mcap"
    file.touch()
    assert refused(file, tmp_path) == f"{tmp_path}/a.mcap is named twice"


def test_a_name_that_cannot_be_looked_at_is_told(tmp_path: Path) -> None:
    """As of a file in a folder that is closed to us, which is none for who is root."""
    path = tmp_path / f"{'a' * 300}.mcap"
    assert refused(path) == f"cannot read {path}: File name too long"
    listed = tmp_path / "metadata.yaml"
    listed.write_text(f"relative_file_paths:\n- {'a' * 300}.mcap\n")
    assert names(tmp_path) == [path.name], "what reads it tells"
