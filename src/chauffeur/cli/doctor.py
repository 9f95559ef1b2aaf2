"""`chauffeur doctor`: what works here, what is missing, and the command that adds it."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version

import typer

from chauffeur.concept.extras import LAB, install_command
from chauffeur.concept.lab import has_lab

EXAMPLES = """
Examples:

    chauffeur doctor
"""

_PURPOSES = {
    "models": "training our own models",
    "transformers": "open models in this process",
    "speech": "speaking to the car",
    "town": "the town world (SUMO)",
    "carla": "the CARLA world",
    "map": "OpenStreetMap files",
    "ros": "vehicles behind ROS",
    "chroma": "Chroma as the memory's store",
    "cluster": "benchmarks on a Ray cluster",
    "inspect": "reports as Inspect AI logs",
    "page": "pages that talk back",
}
_DEVELOPMENT = ("dev", "docs", "fuzz", "mutation", "oracle")
_REQUIREMENT = re.compile(r"^\s*([A-Za-z0-9._-]+)")
_EXTRA = re.compile(r"""extra\s*==\s*['"]([^'"]+)['"]""")


@dataclass(frozen=True, slots=True)
class DoctorPart:
    """One requirement: distribution name and installed version, None when missing."""

    name: str
    installed: str | None


def doctor() -> None:
    """Check this installation: parts, extras, sandbox, keys. Exit code 1 when driving cannot work."""
    from rich.text import Text

    from chauffeur.cli.console import columns, plain, stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.version import __version__

    console = stdout()
    core, extras = installed_parts()
    missing = [part.name for part in core if part.installed is None]
    sandbox = "" if missing else _sandbox_problem()
    good, bad, optional = Text("ok", "green"), Text("missing", "bold red"), Text("not installed", "yellow")

    console.print(f"Chauffeur {__version__}, Python {platform.python_version()}, {platform.platform(terse=True)}")
    console.print("\nNeeded to drive", style="bold")
    rows: list[tuple[str, Text]] = [(part.name, Text(part.installed) if part.installed else bad) for part in core]
    rows.append(("program sandbox", (good if not sandbox else plain(sandbox)) if not missing else bad))
    console.print(columns(rows))

    console.print("\nExtras", style="bold")
    lab = good if has_lab() else optional
    lines: list[tuple[str, Text]] = [("lab", Text.assemble("benchmarks and training: ", lab))]
    if not has_lab():
        lines.append(("", Text(install_command(), "cyan")))
    for extra, parts in extras.items():
        absent = [part.name for part in parts if part.installed is None]
        state = good if not absent else Text.assemble(optional, f": {', '.join(absent)}")
        lines.append((extra, Text.assemble(f"{_PURPOSES.get(extra, extra)}: ", state)))
        if absent:
            lines.append(("", Text(install_command(extra), "cyan")))
    console.print(columns(lines))

    if carla := _carla_server():
        console.print("\nCARLA server", style="bold")
        console.print(columns([("", plain(one)) for one in carla]))

    console.print("\nReal time", style="bold")
    console.print(columns([("scheduling", Text(_realtime()))]))

    console.print("\nSettings", style="bold")
    console.print(columns(_settings()))
    if missing:
        console.print(Text(f"\nDriving cannot work without {', '.join(missing)}.", "bold red"))
        console.print(Text("  pip install --upgrade --force-reinstall chauffeur", "cyan"))
    elif sandbox:
        console.print(Text("\nDriving cannot work: the program sandbox does not start.", "bold red"))
    else:
        console.print(Text("\nEverything needed to drive is here.", "green"))
    if missing or sandbox:
        raise typer.Exit(FAILED)


def _carla_server() -> tuple[str, ...]:
    """What the CARLA server that the environment names lacks, in sentences; nothing where it names none."""
    from chauffeur.concept import ChauffeurError
    from chauffeur.worlds.carla.server import SERVER_VARIABLE, connect, lacks

    if not os.environ.get(SERVER_VARIABLE):
        return ()
    try:
        return lacks(connect()) or ("It has everything that driving needs.",)
    except (ChauffeurError, RuntimeError) as error:
        return (f"{error}",)


_TRY_REALTIME = "import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))"


def _realtime() -> str:
    """Whether `chauffeur talk` may have a core to itself when it needs one; tried in a process of its own."""
    tried = subprocess.run([sys.executable, "-I", "-c", _TRY_REALTIME], capture_output=True, check=False)  # noqa: S603
    if tried.returncode == 0:
        return "allowed: control keeps its rate whatever else runs"
    return "not allowed: control may be late on a busy machine. Allow it with rtprio in /etc/security/limits.conf."


def installed_parts() -> tuple[tuple[DoctorPart, ...], dict[str, tuple[DoctorPart, ...]]]:
    """(what the core needs, what each extra needs), read from the packages' metadata; nothing is imported."""
    core: list[DoctorPart] = []
    extras: dict[str, list[DoctorPart]] = {}
    for line in (*(requires("chauffeur") or ()), *_of_the_lab()):
        found = _REQUIREMENT.match(line)
        if found is None:
            continue
        part = DoctorPart(found.group(1), _installed(found.group(1)))
        extra = _EXTRA.search(line)
        if extra is None:
            core.append(part)
        elif extra.group(1) not in _DEVELOPMENT:
            extras.setdefault(extra.group(1), []).append(part)
    return tuple(core), {name: tuple(parts) for name, parts in extras.items()}


def _of_the_lab() -> list[str]:
    """Requirements of the lab's extras; none where it is not installed."""
    try:
        return [line for line in requires(LAB) or () if _EXTRA.search(line)]
    except PackageNotFoundError:
        return []


def _installed(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _sandbox_problem() -> str:
    """Why the program sandbox does not start; empty when it does."""
    from chauffeur.concept import ChauffeurError
    from chauffeur.programs.sandbox import Sandbox

    try:
        with Sandbox():
            return ""
    except (ChauffeurError, OSError) as error:
        return str(error)


def _settings() -> list[tuple[str, str]]:
    """Environment the parts look at. Keys are said to be set or not, never shown."""
    rows = [
        (name, "set" if os.environ.get(name) else "not set; only language-model planners need it")
        for name in ("OPENAI_API_KEY",)
    ]
    rows += [
        (name, os.environ.get(name) or f"not set; {otherwise}")
        for name, otherwise in (
            ("CHAUFFEUR_BASE_URL", "OpenAI's own endpoint, unless --base-url says otherwise"),
            ("CHAUFFEUR_LAMPILOT", "LaMPilot's samples need --data DIR"),
            ("CHAUFFEUR_DATA", "benchmarks and training read the data sets that came with the lab"),
        )
    ]
    rows.append(("processors", str(os.cpu_count() or 1)))
    rows.append(("free disk", f"{shutil.disk_usage('.').free / 1e9:.1f} GB"))
    return rows
