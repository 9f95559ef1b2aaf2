"""Entry of the processes: `python -m chauffeur.driving.live ROLE FOLDER [PARENT]`; the supervisor starts them.

A `spare` is a policy process that has loaded everything and waits: on SIGUSR1 it takes the place of one that died.
"""

from __future__ import annotations

import json
import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TypeVar

from chauffeur.driving.live.mirror import Mirror, live_world, mirror_of
from chauffeur.driving.live.settings import Settings, ring
from chauffeur.worlds.base import World

_W = TypeVar("_W", bound=World)
FIGURES_FILE = "punctuality.json"
READY_SUFFIX = ".ready"
_ENDS_WITHIN_S = 10.0
"""Time a planner has to end when the drive is over; then it is ended, whatever it hangs in."""


def _told_to_end(parent: int) -> Callable[[], bool]:
    """Whether SIGTERM came, or the process that started this one is gone. Ctrl-C is the supervisor's to hear.

    Args:
        parent: Who started it, as that process said: it may be gone before this one can look.
    """
    asked = False

    def ask(number: int, frame: object) -> None:
        nonlocal asked
        del number, frame
        asked = True

    signal.signal(signal.SIGTERM, ask)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return lambda: asked or os.getppid() != parent


def _end_for_sure(over: Callable[[], bool], within_s: float = _ENDS_WITHIN_S) -> None:
    """End this process some time after the drive is over, even if somebody else's code never comes back."""

    def watch() -> None:
        while not over():
            time.sleep(0.25)
        time.sleep(within_s)
        os._exit(1)

    threading.Thread(target=watch, name="end for sure", daemon=True).start()


def _ready(folder: Path, role: str) -> None:
    (folder / f"{role}{READY_SUFFIX}").touch()


def _begun(world: _W, settings: Settings) -> _W:
    """A world of the drive; what is slow about its starts is done before anything moves."""
    for start in settings.starts:
        world.reset(start.scenario, start.seed)
    return world


def _mirror(folder: Path, settings: Settings) -> Mirror:
    """What control shows, in a copy of its world."""
    world = _begun(mirror_of(settings.starts[0].scenario), settings)
    return Mirror(world, settings.starts, ring(folder, "observations"))


def _control(folder: Path, settings: Settings, over: Callable[[], bool]) -> None:
    from chauffeur.driving.live.control import Control, Rings, run
    from chauffeur.driving.live.realtime import Ticker, become_realtime, punctuality

    world = _begun(live_world(settings.starts[0].scenario), settings)
    rings = Rings(
        ring(folder, "setpoints"), ring(folder, "observations"), ring(folder, "reports"), ring(folder, "hand")
    )
    control = Control(world, settings.starts, rings, speed=settings.speed)
    control.warm_up()
    allowed = become_realtime(settings.realtime)
    for each in (rings.setpoints, rings.observations, rings.reports, rings.hand):
        each.touch_pages()
    _ready(folder, "control")
    ticker = Ticker(control.dt_s / settings.speed)
    lateness = run(control, ticker, over)
    figures = (
        asdict(punctuality(lateness, ticker.missed)) | asdict(allowed) | {"period_s": control.dt_s / settings.speed}
    )
    (folder / FIGURES_FILE).write_text(json.dumps(figures))


def _spare(folder: Path, settings: Settings, over: Callable[[], bool]) -> None:
    called = False

    def call(number: int, frame: object) -> None:
        nonlocal called
        del number, frame
        called = True

    signal.signal(signal.SIGUSR1, call)
    _policy(folder, settings, over, role="spare", called=lambda: called)


def _policy(
    folder: Path,
    settings: Settings,
    over: Callable[[], bool],
    role: str = "policy",
    called: Callable[[], bool] = lambda: True,
) -> None:
    import time

    from chauffeur.driving.live.policy import LIVE_BUDGET, Policy, PolicyRings
    from chauffeur.driving.live.realtime import become_favoured
    from chauffeur.programs import Sandbox

    mirror = _mirror(folder, settings)
    rings = PolicyRings(
        ring(folder, "orders"), ring(folder, "setpoints"), ring(folder, "policy_events"), ring(folder, "checkpoints")
    )
    pause_s = mirror.world.dt_s / settings.speed / 20.0
    if settings.realtime:
        become_favoured()
    with Sandbox(LIVE_BUDGET) as sandbox:
        _ready(folder, role)
        while not called() and not over():
            time.sleep(pause_s)
        policy = Policy(mirror, rings, sandbox)
        while not over():
            if not policy.tick():
                time.sleep(pause_s)
        policy.close()


def _planner(folder: Path, settings: Settings, over: Callable[[], bool]) -> None:
    import asyncio
    import importlib

    from chauffeur.describe.services.sources import read_sources
    from chauffeur.driving.live.planner import Planning, PlanningRings
    from chauffeur.driving.loop import LoopMemory
    from chauffeur.driving.session import Forgetful
    from chauffeur.memory.choice import open_memory
    from chauffeur.planners.registry import make_planner
    from chauffeur.planners.talk2drive.recent import fitting

    _end_for_sure(over)
    mirror = _mirror(folder, settings)
    rings = PlanningRings(
        ring(folder, "requests"), ring(folder, "orders"), ring(folder, "briefs"), ring(folder, "planner_events")
    )
    options = {} if settings.base_url is None else {"base_url": settings.base_url}
    planner = make_planner(settings.planner, **options)
    sources = read_sources(Path(settings.services)) if settings.services else None
    memory: LoopMemory = fitting(open_memory(settings.memory), settings.planner) if settings.memory else Forgetful()
    planning = Planning(
        mirror,
        rings,
        planner,
        memory,
        sources=sources,
        setting="zero-shot" if settings.setting == "zero-shot" else "few-shot",
        speed=settings.speed,
    )
    if settings.planner.startswith("openai/"):
        importlib.import_module("httpx")  # a second on a busy machine: not at the first wish
    _ready(folder, "planner")
    asyncio.run(planning.run(over))


def main(role: str, folder: Path, parent: int) -> None:
    """Be one of the processes of the drive in a folder."""
    logging.basicConfig(level=logging.WARNING)
    over = _told_to_end(parent)
    {"control": _control, "policy": _policy, "spare": _spare, "planner": _planner}[role](
        folder, Settings.read(folder), over
    )


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else os.getppid())
