"""Ctrl-C shows no traceback, whenever it comes: while the command line is still loading, or when all is over."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

_STUB = """
import atexit, os, signal, sys, time, types
{first}
main = types.ModuleType("chauffeur.cli.main")
def command():
    {then}
main.run = command
sys.modules["chauffeur.cli.main"] = main
from chauffeur.__main__ import run
run()
"""
_INTERRUPT = "os.kill(os.getpid(), signal.SIGINT); time.sleep(60)"


@pytest.mark.parametrize(
    ("first", "then", "code"),
    [
        ("", _INTERRUPT, 130),
        (f"def at_exit():\n    {_INTERRUPT}\natexit.register(at_exit)", "sys.exit(130)", -signal.SIGINT),
    ],
)
def test_ctrl_c_shows_no_traceback(first: str, then: str, code: int) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _STUB.format(first=first, then=then)],
        check=False,
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert (done.returncode, done.stdout, done.stderr) == (code, "", "")
