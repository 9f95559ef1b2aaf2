"""No control period waits for machine code: what an emergency needs is loaded before anything moves."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from live_bench import OVERTAKE, Bench

from chauffeur.concept import MissingExtraError, Trajectory
from chauffeur.executors import executor_for

PROGRAM = """
import sys, tempfile
from pathlib import Path
from live_bench import OVERTAKE, Bench
from chauffeur.concept import Command, Limits, Scenario
from chauffeur.driving.actuate import actuate
from chauffeur.driving.live.starts import Start
from chauffeur.safety.shield import shield_for
from chauffeur.safety.shield import rollout
from chauffeur.worlds.highway import HighwayWorld

def loaded():
    return {name: len(one.signatures) for name, one in vars(rollout).items() if hasattr(one, "signatures")}

road = {"type": "dt-intersection-v0", "num_vehicles_left": 3, "num_vehicles_right": 3}
crossing = Scenario("crossing", "highway", road, 4000)
bench = Bench(Path(tempfile.mkdtemp()), (OVERTAKE, Start(crossing, 4000)))
bench.control.warm_up()
before, rules = loaded(), set()
world = HighwayWorld()
world.reset(crossing, 4000)
driver, shield = world.driver(), shield_for(world, Limits())
setpoints = driver.initial_setpoints()
for _ in range(120):
    if world.ended:
        break
    observation = world.observe()
    settled = driver.settle(setpoints)
    steered = driver.command(settled)
    command = Command(5.0, steered.steering_rad + 0.1)  # full throttle, and off its way
    done = actuate(world, observation, command, settled.target_lane, shield)
    rules |= {change.rule for change in done.interventions if change.after.steering_rad != change.before.steering_rad}
assert rules, "nobody had to steer back: this tests nothing"
assert loaded() == before, {name: count for name, count in loaded().items() if count != before[name]}
assert sum(before.values()) >= 7
"""


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_the_first_rescue_at_a_crossing_loads_nothing(tmp_path: Path) -> None:
    here = Path(__file__).parent
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=here, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr[-1500:]


def test_what_an_absent_extra_would_drive_does_not_keep_control_from_starting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "osqp", None)
    bench = Bench(tmp_path, (OVERTAKE,))
    bench.control.warm_up()
    assert bench.control.begin_trip()
    assert bench.tick().faults == 0
    with pytest.raises(MissingExtraError, match=r"-m pip install .*\[motion\]"):  # said before a wheel turns
        executor_for(Trajectory(((1.0, 0.0), (2.0, 0.0)), 0.5), bench.world)
