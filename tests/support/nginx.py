"""A real nginx with a configuration that we ship or document, on ports of the test's own."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from tests.support.processes import Process, free_port
from tests.support.programs import program

CONFIGURATION = Path(__file__).parents[2] / "backend" / "deploy" / "nginx.conf"
_SHIPPED_PORTS = (8001, 8002, 8003)


def configured(text: str, folder: Path, port: int, upstreams: Sequence[int | Path]) -> str:
    """A configuration with other ports, and with folders of ours to write in."""
    changes = {"listen 80;": f"listen 127.0.0.1:{port};", "http {": f"http {{\n{_scratch(folder)}"}
    for shipped, ours in zip(_SHIPPED_PORTS, upstreams, strict=True):
        address = f"unix:{ours}" if isinstance(ours, Path) else f"127.0.0.1:{ours}"
        changes[f"server 127.0.0.1:{shipped} "] = f"server {address} "
    for old, new in changes.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def _scratch(folder: Path) -> str:
    kinds = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    return "".join(f"{kind}_temp_path {folder / kind};\n" for kind in kinds)


@contextmanager
def nginx(folder: Path, upstreams: Sequence[int | Path], text: str = "") -> Iterator[str]:
    """nginx in front of three bridges, on these ports of loopback or Unix sockets.

    Yields its own address.

    `text` is its configuration, by default the shipped one.
    """
    text = text or CONFIGURATION.read_text(encoding="utf-8")
    port = free_port()
    file = folder / "nginx.conf"
    file.write_text(configured(text, folder, port, upstreams), encoding="utf-8")
    # Root's nginx would switch to a user that may not enter the test's folder.
    user = "user root; " if os.geteuid() == 0 else ""
    own = f"{user}daemon off; pid {folder / 'pid'}; error_log stderr warn;"
    command = [program("nginx"), "-p", str(folder), "-e", "stderr", "-c", str(file), "-g", own]
    with Process(command, os.environ) as process:
        process.wait_until_listening(port)
        yield f"http://127.0.0.1:{port}"
