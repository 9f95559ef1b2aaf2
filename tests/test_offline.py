"""An offline product opens no connection that nobody asked for: drives, talks and benches in a network of their own.

The commands run in a fresh network namespace that holds nothing but loopback, where the kernel counts whatever finds
no way out: native libraries' attempts are seen like Python's. Name servers are on the outside, so a look-up counts.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from chauffeur.telemetry import SWITCHES, switch_off

INSIDE = """
import fcntl, json, socket, struct, subprocess, sys
with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as loopback:
    fcntl.ioctl(loopback, 0x8914, struct.pack("16sh14x", b"lo", 0x1 | 0x40))  # SIOCSIFFLAGS: up and running
subprocess.run(["mount", "--bind", sys.argv[1], "/etc/resolv.conf"], check=True)
running = [subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=2) for command in json.loads(sys.argv[2])]
codes = [each.wait() for each in running]
names, numbers = open("/proc/net/snmp").read().splitlines()[:2]
lost = int(dict(zip(names.split(), numbers.split()))["OutNoRoutes"])
lost += sum(int(line.split()[1]) for line in open("/proc/net/snmp6") if line.startswith("Ip6OutNoRoutes"))
print(json.dumps([codes, lost]))
"""
CHAUFFEUR = [sys.executable, "-c", "from chauffeur.cli.main import run; run()"]


def _namespaces() -> str:
    """Why no network namespace can be had; empty where it can."""
    if shutil.which("unshare") is None:
        return "unshare is not installed"
    tried = subprocess.run(["unshare", "-rnm", "true"], capture_output=True, text=True, timeout=20, check=False)
    return tried.stderr.strip() if tried.returncode else ""


def _attempts(commands: list[list[str]], folder: Path, **environment: str) -> tuple[list[int], int, str]:
    """Exit codes of commands run at once, how often one of their processes tried to reach the outside, their output."""
    if why := _namespaces():
        pytest.skip(f"no network namespace: {why}")
    servers = folder / "resolv.conf"
    servers.write_text("nameserver 192.0.2.1\n")  # RFC 5737: an address for documentation
    done = subprocess.run(
        ["unshare", "-rnm", sys.executable, "-c", INSIDE, str(servers), json.dumps(commands)],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
        env=os.environ | environment,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    codes, lost = json.loads(done.stdout)
    return codes, lost, done.stderr


def test_a_look_up_and_a_connection_are_seen(tmp_path: Path) -> None:
    look_up = "import socket\ntry: socket.getaddrinfo('example.org', 80)\nexcept OSError: pass"
    connect = "import socket\ntry: socket.create_connection(('192.0.2.7', 80), 1)\nexcept OSError: pass"
    loopback = "import socket\ntry: socket.create_connection(('127.0.0.1', 9), 1)\nexcept OSError: pass"
    assert _attempts([[sys.executable, "-c", look_up]], tmp_path)[1] > 0
    assert _attempts([[sys.executable, "-c", connect]], tmp_path)[1] > 0
    assert _attempts([[sys.executable, "-c", loopback]], tmp_path)[1] == 0


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_driving_talking_and_benching_open_no_connection_and_leave_nothing_of_anybodys(tmp_path: Path) -> None:
    from chauffeur.worlds.highway.scenarios import BUILT_IN

    cache, data = tmp_path / "cache", tmp_path / "data"
    data.mkdir()
    road = next(scenario for scenario in BUILT_IN if scenario.id == "overtake").config
    sample = {"env": road, "eval": {"type": "LaneChangeEval", "direction": "left"}, "seed": 17}
    (data / "left_lc.json").write_text(json.dumps({"commands": ["Change to the left lane."], "samples": [sample]}))
    (cache / "chauffeur").mkdir(parents=True)
    compiled = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "chauffeur"
    for folder in compiled.glob("kernels-*"):  # machine code is not compiled anew for this
        (cache / "chauffeur" / folder.name).symlink_to(folder)
    talk = """
import time
from chauffeur.driving.live.settings import Settings
from chauffeur.driving.live.starts import Start
from chauffeur.driving.scenarios import find
from chauffeur.driving.talk.session import Talk
from chauffeur.driving.talk.messages import Say
if __name__ == "__main__":
    with Talk(Settings((Start(find("overtake"), 17),), planner="onboard"), print) as session:
        session.take(Say("Overtake the car in front of you."))
        until = time.monotonic() + 13.0  # telemetry waits some ten seconds before it sends for the first time
        while session.driving and time.monotonic() < until:
            session.poll()
            time.sleep(0.02)
        session.abort()
"""
    (tmp_path / "talk.py").write_text(talk)
    commands = [
        [*CHAUFFEUR, "drive", "Overtake the car in front of you.", "--quiet", "--save", str(tmp_path / "trip")],
        [*CHAUFFEUR, "bench", "lampilot", "--data", str(data), "--out", str(tmp_path / "run"), "--workers", "1"],
        [sys.executable, str(tmp_path / "talk.py")],
    ]
    codes, attempts, output = _attempts(commands, tmp_path, XDG_CACHE_HOME=str(cache), HOME=str(tmp_path / "home"))
    assert codes == [0, 0, 0], output[-3000:]
    assert attempts == 0
    others = {str(path.relative_to(cache)) for path in cache.iterdir()} - {"chauffeur", "matplotlib"}
    assert not others, "a library keeps something in the cache"


def test_what_somebody_has_set_deliberately_is_kept() -> None:
    environment = {"ORT_DISABLE_TELEMETRY": "0", "DO_NOT_TRACK": ""}
    switch_off(environment)
    assert environment == SWITCHES | {"ORT_DISABLE_TELEMETRY": "0"}


def test_every_process_that_imports_the_package_has_them_off() -> None:
    code = "import os, json, chauffeur; print(json.dumps(dict(os.environ)))"
    bare = {name: value for name, value in os.environ.items() if name not in SWITCHES}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=bare, timeout=600, check=True
    )
    assert SWITCHES.items() <= json.loads(done.stdout).items()
