"""A disk for one test: full, read-only, slow, or cut off from power at any moment."""

import struct
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NamedTuple

_NOTE = struct.Struct("<cqIqI")

Weather = Literal["well", "full", "readonly", "slow-sync", "slow-write"]


def build(folder: Path) -> Path:
    """Compile the library between a process and its disk."""
    library = folder / "disk.so"
    source = Path(__file__).with_name("disk.c")
    subprocess.run(
        ["cc", "-shared", "-fPIC", "-O1", "-o", library, source, "-ldl"], check=True, timeout=60
    )
    return library


@dataclass
class Disk:
    """A folder for a child process that has these variables (`env`) too."""

    folder: Path
    library: Path
    control: Path
    log: Path | None = None

    @property
    def env(self) -> dict[str, str]:
        return {
            "LD_PRELOAD": str(self.library),
            "DISK_FOLDER": str(self.folder),
            "DISK_CONTROL": str(self.control),
            "DISK_LOG": str(self.log or ""),
        }

    def be(self, weather: Weather) -> None:
        """From the next operation on, the disk behaves like this."""
        new = self.control.with_suffix(".new")
        new.write_text("" if weather == "well" else weather)
        new.rename(self.control)


class Note(NamedTuple):
    """One operation: W(rite), T(runcate), C(reate), U(nlink), B(egin) and E(nd) of a sync."""

    kind: str
    at_ns: int
    name: str
    offset: int
    data: bytes


def notes(log: Path) -> list[Note]:
    """The operations so far, in order."""
    whole, at, found = log.read_bytes(), 0, []
    while at < len(whole):
        kind, ns, name_length, offset, length = _NOTE.unpack_from(whole, at)
        at += _NOTE.size
        name = whole[at : at + name_length].decode()
        at += name_length
        found.append(Note(kind.decode(), ns, name, offset, whole[at : at + length]))
        at += length
    return found


@dataclass
class _File:
    content: bytearray = field(default_factory=bytearray)
    unsynced: list[Note] = field(default_factory=list)
    is_named: bool = False  # the folder was synced after it was made


def after_power_cut(done: list[Note], into: Path) -> None:
    """Write what survives of these operations after a power cut at their end.

    Of a file: the writes before a completed sync began. Of a name: the folder's last sync.
    A real disk may hold more; this one is as bad as it may be.
    """
    stored = _Stored()
    for note in done:
        stored.follow(note)
    for path, file in stored.files.items():
        if file.is_named:
            (into / Path(path).name).write_bytes(bytes(file.content))


class _Stored:
    """Files, and the syncs that have begun: each with its file and how much of that it covers."""

    def __init__(self) -> None:
        self.files: dict[str, _File] = {}
        self._syncs: dict[int, tuple[str, int]] = {}

    def follow(self, note: Note) -> None:
        match note.kind:
            case "C":
                self.files[note.name] = _File()
            case "U":
                self.files.pop(note.name, None)
            case "B":
                unsynced = self.files.get(note.name, _File()).unsynced
                self._syncs[note.offset] = (note.name, len(unsynced))
            case "E":
                self._end(*self._syncs.pop(note.offset))
            case _:
                self.files.setdefault(note.name, _File()).unsynced.append(note)

    def _end(self, name: str, count: int) -> None:
        if name not in self.files:  # a folder
            for path, file in self.files.items():
                file.is_named |= str(Path(path).parent) == name
            return
        file = self.files[name]
        for write in file.unsynced[:count]:
            _apply(file.content, write)
        del file.unsynced[:count]
        for number, (other, length) in self._syncs.items():
            if other == name:
                self._syncs[number] = (other, max(0, length - count))


def _apply(content: bytearray, write: Note) -> None:
    if write.kind == "T":
        del content[write.offset :]
        content.extend(bytes(write.offset - len(content)))
        return
    end = write.offset + len(write.data)
    content.extend(bytes(max(0, end - len(content))))
    content[write.offset : end] = write.data
