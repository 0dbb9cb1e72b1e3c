"""A CSV of a million rows of two readings, by `lupin-twin import`: a dry run, then into a journal.

Rows a second of CPU time, the command's start included, beside what Python's own csv reader takes
for the same file.
"""

import csv
import random
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROWS, TAGS = 1_000_000, 100
MAP = """time: time
tag: bench
sensors: {temperature: temp_c, humidity: {column: rh, factor: 100, min: 0, max: 100}}
"""


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "columns.yaml").write_text(MAP)
        _write(folder / "readings.csv")
        begun_s = time.process_time()
        with (folder / "readings.csv").open(newline="") as file:
            assert sum(1 for _ in csv.reader(file)) == ROWS + 1
        plain_s = time.process_time() - begun_s
        print(f"csv.reader alone: {ROWS / plain_s:,.0f} rows a second")
        for what, more in (("a look", ()), ("--write", ("--write",)), ("again", ("--write",))):
            took_s = _import(folder, *more)
            print(f"{what}: {ROWS / took_s:,.0f} rows a second, {took_s / plain_s:.1f} x as long")


def _write(path: Path) -> None:
    some = random.Random(1)
    with path.open("w") as file:
        file.write("time,bench,temp_c,rh\n")
        for n in range(ROWS):
            at = 1_714_558_200 + n // TAGS * 60
            file.write(
                f"{at},b{n % TAGS},{some.uniform(20, 25):.2f},{some.uniform(0.5, 0.7):.3f}\n"
            )


def _import(folder: Path, *more: str) -> float:
    """The CPU time of the command, s."""
    command = [sys.executable, "-m", "lupin_bridge.cli.command", "import", "readings.csv"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [*command, "--map", "columns.yaml", "--journal", "journal.sqlite", *more],
        cwd=folder,
        check=True,
        capture_output=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
