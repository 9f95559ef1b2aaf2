"""A recorded situation with another planner, side by side; and where a replay first differs."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from chauffeur.cli.main import app
from chauffeur.driving.recording import read_trip, write_trip

WISH = "Slow down a bit."
MINE = """
from chauffeur.concept import Plan, Program, Thoughts

class Brisk:
    id, model = "brisk", "brisk-v1"
    async def plan(self, request):
        source = "def go():\\n    set_target_speed(30.0)\\n    while True:\\n        yield autopilot()\\n"
        return Plan(Thoughts("I drive at 30.0 m/s."), Program(source), intent="speed.set", planner=self.id)
"""


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recorded")
    assert invoke("drive", WISH, "--scenario", "cruise", "--save", str(folder), "-q").exit_code == 0
    return folder / "trip.mcap"


def test_another_planner_drives_the_same_situation(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "brisk_planner.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    result = invoke("what-if", str(recording), "--planner", "brisk_planner:Brisk", "--save", str(tmp_path / "trip"))
    assert result.exit_code == 0, result.output
    then, now = read_trip(recording), read_trip(tmp_path / "trip" / "trip.mcap")
    assert now.scenario == then.scenario and now.trip.seed == then.trip.seed
    assert now.trip.instruction == then.trip.instruction and now.trip.plan.planner == "brisk"
    assert now.frames[0].observation == then.frames[0].observation, "the same beginning, bit for bit"
    lines = {line[:16].strip(): line for line in result.output.splitlines() if line[:1].strip()}
    assert "I drive at 108 km/h." in result.output, "in the person's unit"
    assert "at 0." in lines["Set-points part"] and "108 km/h" in lines["Set-points part"]
    assert "never" not in lines["Motion parts"]


def test_the_same_planner_never_parts(recording: Path) -> None:
    result = invoke("what-if", str(recording), "--planner", "onboard")
    assert result.exit_code == 0, result.output
    assert result.output.count("never") == 4


def test_a_recording_that_was_declined_can_be_driven_by_another(tmp_path: Path) -> None:
    assert invoke("drive", "Set my speed to 500 km/h", "--scenario", "cruise", "--save", str(tmp_path)).exit_code == 1
    result = invoke("what-if", str(tmp_path / "trip.mcap"), "--planner", "keyword")
    assert result.exit_code == 0, result.output
    assert "Declined" in result.output and "part" not in result.output, "nothing parts where only one has driven"


def test_bounds_of_the_recording_hold_where_they_are_stricter(recording: Path, tmp_path: Path) -> None:
    then = read_trip(recording)
    record = dict(then.trip.record)
    record["limits"] = {**record["limits"], "max_speed_mps": 20.0, "min_time_headway_s": 0.0}
    trip = replace(then.trip, record=tuple(record.items()))
    path = write_trip(tmp_path / "trip.mcap", trip, then.frames, then.scenario, final=then.final)
    result = invoke("what-if", str(path), "--planner", "onboard", "--save", str(tmp_path / "now"))
    assert "wider limits" in result.output
    limits = dict(read_trip(tmp_path / "now" / "trip.mcap").trip.record)["limits"]
    assert (limits["max_speed_mps"], limits["min_time_headway_s"]) == (20.0, 0.5)


def test_a_screen_of_80_columns_loses_nothing(recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chauffeur.cli.console._PIPED_WIDTH", 80)
    result = invoke("what-if", str(recording), "--planner", "meaning")
    assert max(map(len, result.output.splitlines())) <= 80
    assert "onboard" in result.output and "meaning" in result.output


@pytest.mark.parametrize(
    ("spoil", "quantity", "reason"),
    [
        ("ego", "observation.ego.x_m", "one of rounding"),
        ("setpoints", "setpoints.time_headway_s", "other set-points"),
        ("applied", "applied.acceleration_mps2", "safety filter or the actuator"),
        ("length", "number of frames", "ends earlier"),
        ("outcome", "outcome", "judged otherwise"),
    ],
)
def test_a_replay_names_the_first_divergence(
    recording: Path, tmp_path: Path, spoil: str, quantity: str, reason: str
) -> None:
    shutil.copy(recording, tmp_path / "trip.mcap")
    then = read_trip(recording)
    frames, trip = list(then.frames), then.trip
    frame = frames[4]
    match spoil:
        case "ego":
            ego = replace(frame.observation.ego, x_m=frame.observation.ego.x_m + 1e-9)
            frames[4] = replace(frame, observation=replace(frame.observation, ego=ego))
        case "setpoints":
            frames[4] = replace(frame, setpoints=replace(frame.setpoints, time_headway_s=2.25))
        case "applied":
            frames[4] = replace(frame, applied=replace(frame.applied, acceleration_mps2=0.125))
        case "length":
            frames = frames[:-1]
        case _:
            trip = replace(trip, outcome="timeout")
    record = {**dict(trip.record), "chauffeur": "0.0.1", "shield": "shield-v0"}
    old = replace(trip.verdicts[0], check="format-v0")
    trip = replace(trip, record=tuple(record.items()), verdicts=(old, *trip.verdicts[1:]))
    path = write_trip(tmp_path / "trip.mcap", trip, frames, then.scenario, final=then.final)
    result = invoke("replay", str(path))
    said = " ".join(result.output.split())
    assert result.exit_code == 1
    where = {"length": len(frames), "outcome": None}.get(spoil, 4)
    assert ("after the last" if where is None else f"in control period {where} (at ") in said
    assert f"Quantity {quantity}" in said and "Recorded " in said and " Now " in said
    assert reason in said
    for changed in ("Chauffeur 0.0.1", "the safety filter shield-v0", "check format-v0; now format-v"):
        assert changed in said
