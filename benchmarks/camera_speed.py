"""How many pictures a second of processor time the camera renders: each rig, each condition, with and without truth.

Every picture is of a new instant; `fresh` ones are of a new place as well, as data engines make them. Run:
python benchmarks/camera_speed.py [--seconds 2] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "camera"))

from staged import agent, open_road, town

from chauffeur.camera import Conditions, Renderer, Rig, make_renderer, rig_of
from chauffeur.concept import Observation

CONDITIONS = {
    "sunny": Conditions(),
    "rain": Conditions(rain=0.7),
    "fog": Conditions(fog=0.7),
    "snow": Conditions(snow=0.7),
    "night": Conditions(night=1.0),
    "rain at night": Conditions(rain=0.7, night=1.0),
}


def scenes() -> list[Observation]:
    """A town and a highway with traffic."""
    traffic = [
        agent(k, 185.0 + 9.0 * k, -4.0 * (k % 3), 0.0, 27.0, kind)  # type: ignore[arg-type]
        for k, kind in enumerate(("car", "truck", "car", "bus", "car", "motorcycle", "car", "car"), 1)
        if not (k % 3 == 1 and abs(9.0 * k - 15.0) < 8.0)
    ]
    return [town(), open_road(*traffic)]


def per_cpu_second(renderer: Renderer, rig: Rig, conditions: Conditions, seconds: float, **how: Any) -> float:
    """Pictures a second of processor time."""
    fresh = how.pop("fresh", False)
    staged, made, tick = scenes(), 0, 0
    for one in staged:
        renderer.render(one, rig, conditions, 0, **how)
    began = time.process_time()
    while (spent := time.process_time() - began) < seconds:
        tick += 1
        observation = replace(staged[tick % len(staged)], tick=tick)
        made += len(renderer.render(observation, rig, conditions, tick if fresh else 0, **how).images)
    return made / spent


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=2.0, help="of processor time for each figure")
    parser.add_argument("--size", default="448x256")
    parser.add_argument("--renderer", default="auto")
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    renderer = make_renderer(given.renderer)
    width, height = map(int, given.size.split("x"))
    rows: list[dict[str, Any]] = []
    print(f"{renderer.engine}, {given.size}, pictures per CPU-second; load {os.getloadavg()[0]:.1f}")
    print(f"{'rig':10}" + "".join(f"{name:>15}" for name in (*CONDITIONS, "sunny, truth", "sunny, fresh")))
    for name in ("front", "nuscenes", "nuplan"):
        rig = rig_of(name, width, height)
        cases: list[tuple[str, Conditions, dict[str, Any]]] = [(label, one, {}) for label, one in CONDITIONS.items()]
        cases += [("sunny, truth", Conditions(), {"truth": True}), ("sunny, fresh", Conditions(), {"fresh": True})]
        found = {label: per_cpu_second(renderer, rig, one, given.seconds, **how) for label, one, how in cases}
        rows.append({"rig": name, **found})
        print(f"{name:10}" + "".join(f"{value:15.0f}" for value in found.values()), flush=True)
    if given.json:
        machine = {"machine": platform.processor() or platform.machine(), "load": os.getloadavg()[0]}
        given.json.write_text(json.dumps({"engine": renderer.engine, "size": given.size, **machine, "rows": rows}))


if __name__ == "__main__":
    main()
