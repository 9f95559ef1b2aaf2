"""How punctual control is: a fixed rate for minutes, both cores loaded, planner and policy killed at random.

    python benchmarks/live_jitter.py --hz 20 --minutes 10 --busy 2 --out FOLDER

The world is simulated; at 20 Hz its 0.1 s go by in 50 ms. Wishes are asked all the time, so that plans are made,
checked and driven while processes die. Writes FOLDER/jitter.json and prints the row of benchmarks/RESULTS.md.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import os
import platform
import random
import signal
import time
from collections import Counter
from importlib.metadata import version
from pathlib import Path
from typing import Any

from chauffeur.driving.events import DriveEvent
from chauffeur.driving.live.messages import Report
from chauffeur.driving.live.settings import Settings
from chauffeur.driving.live.starts import Start
from chauffeur.driving.live.supervisor import Role, Runtime
from chauffeur.driving.scenarios import find

SCENARIOS = ("overtake", "following", "left-lane", "emergency-lane", "intersection")
WISHES = ("Overtake the car in front of you.", "Slow down a bit.", "Keep 30 m to the car ahead.", "I'm in a hurry.",
          "Change to the left lane.", "Go back up to 25 m/s.")  # fmt: skip


def _burn() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        sum(range(10_000))


class Watch:
    """Counts what comes by."""

    def __init__(self) -> None:
        self.levels: Counter[str] = Counter()
        self.outcomes: Counter[str] = Counter()
        self.events: Counter[str] = Counter()
        self.rules: Counter[str] = Counter()
        self.faults = 0
        self.longest_s = 0.0
        self.trip = 0
        self.recoveries_s: list[float] = []
        self._lost_at: float | None = None
        self.dt_s = 0.1

    def kill(self, at_s: float) -> None:
        if self._lost_at is None:
            self._lost_at = at_s

    def __call__(self, event: DriveEvent) -> None:
        heard = event.value
        if heard is None:
            self.events[event.kind] += 1
        if not isinstance(heard, Report):
            return
        self.levels[heard.level] += 1
        self.rules.update({change.rule for change in heard.interventions})
        self.faults = heard.faults
        self.trip = heard.trip
        if heard.level != "follow":
            self.longest_s = max(self.longest_s, heard.age_s)
        elif self._lost_at is not None and heard.age_s < 0.15:
            self.recoveries_s.append(time.monotonic() - self._lost_at)
            self._lost_at = None
        if heard.ended:
            self.outcomes["began in a crash" if heard.tick == 0 else heard.outcome] += 1


def measure(options: argparse.Namespace) -> dict[str, Any]:
    """Drive, load, kill."""
    rng = random.Random(options.seed)
    speed = options.hz * 0.1
    seconds = options.minutes * 60.0
    trips = int(seconds * speed / 8.0) + 20
    starts = tuple(Start(find(rng.choice(SCENARIOS)), rng.randrange(40), most_s=30.0) for _ in range(trips))
    settings = Settings(starts, planner=options.planner, speed=speed, realtime=not options.no_realtime)
    watch = Watch()
    burners = [multiprocessing.Process(target=_burn, daemon=True) for _ in range(options.busy)]
    kills: Counter[str] = Counter()
    with Runtime(settings, watch) as runtime:
        for burner in burners:
            burner.start()
        begun = time.monotonic()
        next_wish, next_kill = begun, begun + rng.expovariate(1.0 / options.kill_every)
        while runtime.driving and (now := time.monotonic()) - begun < seconds:
            runtime.poll()
            if now >= next_wish:
                runtime.ask(rng.choice(WISHES))
                next_wish = now + rng.uniform(1.0, 4.0)
            if now >= next_kill:
                role: Role = rng.choice(("planner", "policy"))
                with contextlib.suppress(ProcessLookupError):  # it died already, and is being replaced
                    os.kill(runtime.pid(role), signal.SIGKILL)
                kills[role] += 1
                if role == "policy":
                    watch.kill(now)
                next_kill = now + rng.expovariate(1.0 / options.kill_every)
            time.sleep(0.005)
        lasted = time.monotonic() - begun
        runtime.stop()
        figures = runtime.figures()
        answered = sum(interaction.stage == "closed" for interaction in runtime.interactions.values())
        asked, lost_reports = len(runtime.interactions), runtime.lost_reports
    for burner in burners:
        burner.kill()
    recoveries = sorted(watch.recoveries_s)
    return {
        "options": {key: str(value) if isinstance(value, Path) else value for key, value in vars(options).items()},
        "control": figures,
        "seconds": round(lasted, 1),
        "load": os.getloadavg(),
        "kills": dict(kills),
        "trips": watch.trip,
        "outcomes": dict(watch.outcomes),
        "levels": dict(watch.levels),
        "events": dict(watch.events),
        "interventions_by_rule": dict(watch.rules),
        "faults_in_control": watch.faults,
        "oldest_wish_s": round(watch.longest_s, 2),
        "recovery_s": {
            "n": len(recoveries),
            "p50": round(recoveries[len(recoveries) // 2], 2) if recoveries else None,
            "max": round(recoveries[-1], 2) if recoveries else None,
        },
        "wishes": {"asked": asked, "answered": answered},
        "reports_lost": lost_reports,
        "simulated": True,
        "versions": {"chauffeur": version("chauffeur"), "python": platform.python_version()},
        "machine": f"{platform.system()} {platform.release()} {platform.machine()}, {os.cpu_count()} cores",
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--hz", type=float, default=20.0, help="control periods a second")
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--busy", type=int, default=os.cpu_count() or 2, help="processes that only burn time")
    parser.add_argument("--kill-every", type=float, default=3.0, help="mean seconds between kills")
    parser.add_argument("--planner", default="onboard")
    parser.add_argument("--no-realtime", action="store_true", help="do not ask for real-time scheduling")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    result = measure(options)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "jitter.json").write_text(json.dumps(result, indent=1))
    control = result["control"]
    late = control["missed"] / max(1, control["missed"] + control["ticks"])
    print(json.dumps(result, indent=1))
    print(
        f"| {control['scheduling']} | {options.hz:g} Hz | {control['ticks']} | {control['missed']} ({late:.2%}) "
        f"| {control['p50_ms']:.3f} | {control['p99_ms']:.3f} | {control['p999_ms']:.3f} | {control['max_ms']:.2f} "
        f"| {sum(result['kills'].values())} | {result['recovery_s']['p50']} |"
    )


if __name__ == "__main__":
    main()
