"""`make run-fleet`: a PostgreSQL in a temporary folder, three greenhouses, and the page over them.

Everything ends, and is gone, with this process.
"""

import signal
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

from tests.support.archive import Archive
from tests.support.domains import own_domain, ros_env
from tests.support.postgres import server
from tests.support.state_home import use_own

# A patrol for each: another seed, another pace.
SITES = {"gh1": ("--seed", "1"), "gh2": ("--seed", "2", "--speed", "3"), "north": ("--seed", "7")}
_COMMAND = (sys.executable, "-P", "-m", "lupin_bridge.cli.command")


def main(args: list[str]) -> int:
    """Run it until Ctrl-C; `args` go to `lupin-twin fleet`."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    use_own()
    with tempfile.TemporaryDirectory(prefix="lupin-fleet-") as folder, ExitStack() as ending:
        archive = Archive(ending.enter_context(server()))
        archive.add_user("page", "lupin_page")
        for site, patrol in SITES.items():
            archive.add_user(site)
            domain = ending.enter_context(own_domain())
            words = ("demo", "--port", "0", "--site", site, "--archive-url", archive.url(site))
            log = ending.enter_context((Path(folder) / f"{site}.log").open("w"))
            own = ros_env(domain, XDG_STATE_HOME=f"{folder}/{site}")
            process = subprocess.Popen(
                [*_COMMAND, *words, *patrol], env=own, stdout=log, stderr=log
            )
            ending.callback(_end, process)
        page = subprocess.Popen([*_COMMAND, "fleet", "--archive-url", archive.url("page"), *args])
        ending.callback(_end, page)
        try:
            return page.wait()
        except KeyboardInterrupt:
            return 0


def _end(process: subprocess.Popen[bytes]) -> None:
    process.send_signal(signal.SIGTERM)
    try:
        process.wait(10)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
