"""What is typed while a recording plays."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
import termios

from lupin_bridge.bags.keys import Keys, keys

SCRIPT = """
import fcntl, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
from lupin_bridge.bags.keys import keys
with keys(sys.stdin) as typed:
    print("ready", flush=True)
    count = 0
    while count < 2:
        count += typed.wishes()
print(count, flush=True)
"""


def test_each_line_of_a_pipe_is_a_wish_and_its_end_is_none() -> None:
    out, into = os.pipe()
    with os.fdopen(out) as stream, keys(stream) as typed:
        assert typed.wishes() == 0
        os.write(into, b"pause now\n\nno line")
        assert typed.wishes() == 2
        os.close(into)
        assert typed.wishes() == 0
        assert typed.wishes() == 0


def test_space_and_enter_are_wishes_as_they_are_hit() -> None:
    master, slave = pty.openpty()
    before = termios.tcgetattr(slave)
    with subprocess.Popen(
        [sys.executable, "-c", SCRIPT],
        stdin=slave,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        os.write(master, b"x ")
        os.write(master, b"\n")
        assert process.stdout.readline() == "2\n"
    assert termios.tcgetattr(slave) == before
    os.close(master)
    os.close(slave)


def test_somebody_else_s_terminal_is_left_alone() -> None:
    master, slave = pty.openpty()
    before = termios.tcgetattr(slave)
    os.write(master, b"\n")
    with os.fdopen(slave) as stream, keys(stream) as typed:
        assert termios.tcgetattr(slave) == before
        assert typed.wishes() == 0
    os.close(master)


def test_a_terminal_that_is_gone_is_no_wish() -> None:
    master, slave = pty.openpty()
    os.close(slave)
    typed = Keys(master, is_terminal=True)
    assert (typed.wishes(), typed.wishes()) == (0, 0)
    os.close(master)


def test_without_an_input_there_are_no_wishes() -> None:
    with keys(None) as typed:
        assert typed.wishes() == 0
