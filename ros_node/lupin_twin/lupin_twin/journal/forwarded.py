"""How far a journal is in the archive: a small file beside it, which its forwarder writes.

Its twin only reads that, and keeps what is not in the archive. Without the file nobody forwards it.
"""

from __future__ import annotations

from pathlib import Path


def mark_of(journal: Path) -> Path:
    """The file: the journal's identity, and the last `seq` that is in the archive."""
    return journal.with_name(journal.name + ".forwarded")


def note_forwarded(journal: Path, journal_id: str, seq: int) -> None:
    """Have it there.

    Raises:
        OSError: it cannot be written.

    """
    mark = mark_of(journal)
    new = mark.with_name(mark.name + ".new")
    new.write_text(f"{journal_id} {seq}\n", encoding="ascii")
    new.replace(mark)


def forwarded_seq(journal: Path, journal_id: str | None) -> int | None:
    """The last number that is in the archive, of another journal 0; None: nobody forwards it."""
    try:
        words = mark_of(journal).read_text(encoding="ascii").split()
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError):
        return 0
    is_ours = len(words) == 2 and words[0] == journal_id and words[1].isdecimal()
    return int(words[1]) if is_ours else 0
