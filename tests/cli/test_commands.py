"""The command line: what it prints, how it fails, what it leaves unimported."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import entry_points
from pathlib import Path

import click
import pytest
import typer
from pydantic import TypeAdapter
from typer.testing import CliRunner, Result

from chauffeur.cli.doctor import installed_parts
from chauffeur.cli.failures import show_crash
from chauffeur.cli.lab.bench import BenchGroup, command_of
from chauffeur.cli.main import app
from chauffeur.concept import ChauffeurError, PlannerError, ScenarioError, Verdict
from chauffeur.concept.extras import install_command
from chauffeur.driving.recording import read_trip, write_trip
from chauffeur.version import __version__

WISH = "Change to the left lane."
PROGRAM = """def overtake():
    left = get_left_lane(get_ego_vehicle())
    while not is_safe_enter(left):
        yield autopilot()
    say("Changing to the [bold]left[/] lane.")
    set_target_lane(left)
    for _ in range(20):
        yield autopilot()
"""
DECLINED = "Keep to this lane."
MISTOLD = "Change lanes."


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Specification of a planner that needs no model."""
    path = tmp_path_factory.mktemp("answers") / "answers.jsonl"
    plan = {"thoughts": {"text": "Left is free."}, "policy": {"kind": "program", "source": PROGRAM}, "intent": "pass"}
    no = {"thoughts": {"text": ""}, "policy": None, "refusal": "A car cannot fly."}
    mistold = plan | {"thoughts": {"text": "I move to the right lane."}}
    known = ((WISH, plan), (DECLINED, no), (MISTOLD, mistold))
    lines = [{"version": 1, "instruction": w, "plan": p} for w, p in known]
    path.write_text("\n".join(json.dumps(line) for line in lines))
    return f"replay/{path}"


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture
def driven(answers: str, tmp_path: Path) -> Path:
    """Folder of a saved drive."""
    folder = tmp_path / "trip"
    assert invoke("drive", WISH, "--planner", answers, "--save", str(folder), "--quiet").exit_code == 0
    return folder


def every_command() -> Iterator[tuple[tuple[str, ...], click.Command]]:
    """Each command and group with the words that name it."""

    def walk(command: click.Command, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], click.Command]]:
        yield path, command
        for name, child in getattr(command, "commands", {}).items():
            yield from walk(child, (*path, name))
        if isinstance(command, BenchGroup):  # and those that are made of the options of a benchmark
            own = entry_points(group="chauffeur.benchmarks")
            for name in sorted({one.name for one in own if one.value.startswith("chauffeur.")} - set(command.commands)):
                yield (*path, name), command_of(name)

    yield from walk(typer.main.get_command(app), ())


def test_help_has_examples_everywhere() -> None:
    """Of itself: each example begins with the command it explains."""
    for path, command in every_command():
        assert "Examples:" in (command.epilog or ""), path
        assert " ".join(("chauffeur", *path)) in (command.epilog or ""), path
    for path in ((), ("drive",), ("show",), ("me", "erase")):
        result = invoke(*path, "--help")
        assert result.exit_code == 0 and "Examples:" in result.output, path


def test_the_top_of_the_help_is_what_somebody_comes_for() -> None:
    panels = dict[str, list[str]]()
    for name, command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
        panels.setdefault(command.rich_help_panel, []).append(name)
    assert {heading: sorted(names) for heading, names in panels.items()} == {
        "Drive": ["drive", "feedback", "me", "talk"],
        "Look": ["doctor", "plugins", "replay", "report", "show", "view", "what-if"],
        "Measure": ["bench", "evaluate"],
        "Build": ["audit", "check", "maps", "model", "vehicle"],
    }


@pytest.mark.parametrize("columns", [80, 120])
def test_the_help_fits_the_terminal(columns: int) -> None:
    result = CliRunner().invoke(app, ["--help"], env={"COLUMNS": str(columns), "TERMINAL_WIDTH": str(columns)})
    lines = result.output.splitlines()
    assert max(map(len, lines)) <= columns
    assert len(lines) < 70, "two screens"
    assert [line.split("─")[1].strip() for line in lines if line.startswith("╭")] == [
        "Options", "Drive", "Look", "Measure", "Build",
    ]  # fmt: skip


def test_an_option_has_one_name() -> None:
    """What is asked for in one command by a name is asked for by it in all; a name means one thing."""
    options = [
        parameter
        for _, command in every_command()
        for parameter in command.params
        if parameter.param_type_name == "option"
    ]
    names = {name for option in options for name in option.opts}
    synonyms = {"--cases", "--n", "--first", "--driver", "--person", "--model", "--url", "--kinds", "--output"}
    assert not names & synonyms
    kinds = dict[str, set[object]]()
    for option in options:
        kind = repr(option.type_descriptor.annotation).replace(" | None", "")
        kind = "text" if re.search(r"Path|str|Literal", kind) else kind
        kinds.setdefault(max(option.opts, key=len), set()).add(kind)
    del kinds["--frames"]  # `single` and `multi` stand for numbers
    assert {name: found for name, found in kinds.items() if len(found) > 1} == {}


@pytest.mark.parametrize(
    ("arguments", "module", "extra"),
    [
        (("model", "train", "onboard", "--out", "run"), "torch", "models"),
        (("model", "adapt-vlm", "--checkpoint", "base", "--out", "run"), "peft", "models"),
        (("report", "run", "--inspect", "run.eval"), "inspect_ai", "inspect"),
        (("bench", "lampilot", "--data", "DbLv1", "--ray", "local"), "ray", "cluster"),
    ],
)
def test_a_missing_extra_is_said_before_any_work(
    arguments: tuple[str, ...], module: str, extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, module, None)
    result = invoke(*arguments)
    assert result.exit_code == 2
    said = " ".join(result.output.split())
    assert module in said and "".join(install_command(extra).split()) in "".join(result.output.split())
    assert list(tmp_path.iterdir()) == [], "nothing was begun"


def test_a_command_that_stands_in_a_group_is_found() -> None:
    for name, where in (("scenarios", "chauffeur show scenarios"), ("train", "chauffeur model train")):
        result = invoke(name)
        assert result.exit_code == 2
        assert f"Did you mean: {where}?" in " ".join(result.output.replace("│", " ").split())


def test_the_module_is_the_command() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "chauffeur", "--version"], capture_output=True, text=True, timeout=600, check=False
    )
    assert (done.returncode, done.stdout.strip()) == (0, f"chauffeur {__version__}")


def test_version() -> None:
    assert invoke("--version").output.strip() == f"chauffeur {__version__}"


def test_importing_the_command_line_loads_nothing_heavy() -> None:
    simulation = ["highway_env", "gymnasium", "pandas", "matplotlib", "pygame", "numpy", "PIL"]
    heavy = [*simulation, "httpx", "pydantic", "pydantic_monty", "mcap", "sqlcipher3"]
    script = f"import sys, chauffeur.cli.main; print([m for m in {heavy!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_wish_is_driven_and_everything_is_said(answers: str) -> None:
    result = invoke("drive", WISH, "--planner", answers)
    assert result.exit_code == 0, result.output
    for words in (WISH, "Left is free.", "def overtake():", "✓", "simulated drive"):
        assert words in result.output
    assert result.output.startswith("✓ Done after 4 s"), "what came of it comes first"
    assert "Changing to the [bold]left[/] lane." in result.output, "a program's words are not markup"
    assert "\x1b" not in result.output, "no colour and no moving cursor in a pipe"


def test_an_explanation_that_does_not_fit_is_told_and_the_drive_goes_on(answers: str, tmp_path: Path) -> None:
    log = tmp_path / "audit.jsonl"
    arguments = ("drive", MISTOLD, "--planner", answers, "--save", str(tmp_path), "--full")
    result = invoke(*arguments, "--audit", str(log))
    assert result.exit_code == 0, result.output
    told = " ".join(result.output.split())
    for words in (
        "≠ The explanation does not fit the program (score 0.00 of 1, 1 claim compared) alignment-v1",
        "wrong side: “I move to the right lane.”, but it changes lanes to the left (line 6)",
        "≠ The drive did not go as explained (score 0.00 of 1, 1 claim compared) alignment-driven-v1",
        "wrong side: “I move to the right lane.”, but it changed lanes to the left",
        "≠ Done after 4 s, not as explained (simulated drive)",
    ):
        assert words in told, words

    recorded = read_trip(tmp_path / "trip.mcap")
    assert [(v.check, v.passed, v.stops) for v in recorded.trip.verdicts][-2:] == [
        ("alignment-v1", False, False),
        ("alignment-driven-v1", False, False),
    ]
    found = recorded.trip.verdicts[-2].alignment
    assert found is not None and [one.kind for one in found.mismatches] == ["wrong-side"]
    assert "The same, bit for bit" in invoke("replay", str(tmp_path / "trip.mcap")).output
    logged = [json.loads(line) for line in log.read_text().splitlines()]
    failed = {one["body"]["check"]: one["texts"]["reason"]["text"] for one in logged if one["kind"] == "verdict"}
    assert "Wrong side: “I move to the right lane.”, but it changes lanes to the left" in failed["alignment-v1"]
    assert "score 0.00 of 1" in failed["alignment-v1"]
    quiet = invoke("drive", MISTOLD, "--planner", answers, "-q").output
    assert quiet.strip() == "≠ Done after 4 s, not as explained (simulated drive)"


def test_a_recording_from_before_explanations_were_judged_is_read(driven: Path) -> None:
    path = driven / "trip.mcap"
    written = TypeAdapter(tuple[Verdict, ...]).dump_python(read_trip(path).trip.verdicts)
    plain = [{name: verdict[name] for name in ("check", "passed", "reason", "line", "remedy")} for verdict in written]
    old = TypeAdapter(tuple[Verdict, ...]).validate_python(plain)
    assert [(verdict.vetoes, verdict.alignment) for verdict in old] == [(True, None)] * len(written)


def test_a_judge_of_explanations_that_breaks_stops_nothing(answers: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RecursionError

    monkeypatch.setattr("chauffeur.safety.faithfulness.check.judge", broken)
    result = invoke("drive", WISH, "--planner", answers, "--full")
    assert result.exit_code == 0, result.output
    assert "– not compared: the check check_faithfulness could not judge this plan (RecursionError)." in " ".join(
        result.output.split()
    )


def test_quiet_says_one_line(answers: str) -> None:
    assert len(invoke("drive", WISH, "--planner", answers, "-q").output.strip().splitlines()) == 1


def test_a_saved_drive_replays_bit_for_bit(driven: Path) -> None:
    assert {p.name for p in driven.iterdir()} == {"trip.mcap", "trip.html", "filmstrip.png"}
    result = invoke("replay", str(driven / "trip.mcap"))
    assert result.exit_code == 0, result.output
    assert "The same, bit for bit" in result.output


def test_a_changed_recording_is_noticed(driven: Path) -> None:
    path = driven / "trip.mcap"
    recorded = read_trip(path)
    frame = recorded.frames[4]
    ego = replace(frame.observation.ego, x_m=frame.observation.ego.x_m + 1e-9)
    frames = list(recorded.frames)
    frames[4] = replace(frame, observation=replace(frame.observation, ego=ego))
    trip = replace(recorded.trip, record=(*recorded.trip.record[1:], ("chauffeur", "0.0.1")))
    write_trip(path, trip, frames, recorded.scenario, final=recorded.final)
    result = invoke("replay", str(path))
    assert result.exit_code == 1
    assert "in control period 4" in result.output and "observation.ego.x_m" in result.output
    assert "Recorded with Chauffeur 0.0.1" in result.output


def test_a_page_is_rendered_again(driven: Path) -> None:
    page, strip = driven / "again.html", driven / "again.png"
    result = invoke(
        "show", "page", str(driven / "trip.mcap"), "--out", str(page), "--filmstrip", str(strip), "--pictures", "2"
    )
    assert result.exit_code == 0, result.output
    assert page.read_text(encoding="utf-8") == (driven / "trip.html").read_text(encoding="utf-8")
    assert strip.read_bytes().startswith(b"\x89PNG")


def test_a_refusal_is_explained_and_is_a_failure(answers: str, tmp_path: Path) -> None:
    result = invoke("drive", DECLINED, "--planner", answers, "--save", str(tmp_path))
    assert result.exit_code == 1
    assert "A car cannot fly." in result.output
    assert "Declined" in result.output
    assert {p.name for p in tmp_path.iterdir() if p.suffix} == {"trip.mcap", "trip.html"}
    replayed = invoke("replay", str(tmp_path / "trip.mcap"))
    assert replayed.exit_code == 2
    assert "holds no drive" in replayed.output


def test_feedback_reaches_the_last_trip(answers: str) -> None:
    before = invoke("feedback", "Too close for me.", "--as", "ana")
    assert before.exit_code == 2
    assert "Drive first" in before.output
    assert invoke("drive", WISH, "--planner", answers, "--as", "ana", "-q").exit_code == 0
    after = invoke("feedback", "Too close for me.", "--as", "ana")
    assert after.exit_code == 0, after.output
    assert "wants a larger gap" in after.output
    again = invoke("drive", WISH, "--planner", answers, "--as", "ana")
    assert "wants a larger gap" in again.output, "what was said is part of the next drive's history"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["drive", "  "], "The wish is empty"),
        (["drive", "go", "--scenario", "overtak"], "Did you mean overtake?"),
        (["drive", "go", "--planner", "onbord"], "Did you mean 'onboard'?"),
        (["drive", "go", "--limits", "none"], "Use one of: default, lampilot"),
        (["drive", "go", "--setting", "five-shot"], "few-shot or zero-shot"),
        (["drive", "go", "--scenario", "left_overtake_s0"], "--data DIR"),
        (["drive", "go", "--seed", "-1"], "--seed"),
        (["drive"], "Missing argument"),
        (["replay", "absent.mcap"], "There is no recording at absent.mcap"),
        (["show", "page", "absent.mcap"], "There is no recording at absent.mcap"),
        (["feedback", " ", "--as", "ana"], "The feedback is empty"),
        (["feedback", "fine"], "--as"),
        (["show", "apis", "is_safe_entr"], "Did you mean is_safe_enter?"),
        (["show", "scenarios", "--find", "moon"], "No scenario matches"),
        (["show", "scenarios", "--data", "absent"], "absent"),
        (["dirve"], "No such command"),
    ],
)
def test_bad_input_is_told_in_words(arguments: list[str], says: str) -> None:
    result = invoke(*arguments)
    assert result.exit_code == 2, result.output
    assert says in " ".join(result.output.replace("│", " ").split())
    assert "Traceback" not in result.output


def test_tracebacks_are_for_those_who_ask(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CHAUFFEUR_DEBUG", "1")
    assert isinstance(invoke("drive", "go", "--scenario", "overtak").exception, ScenarioError)


def test_a_fault_of_ours_can_be_reported(capsys: pytest.CaptureFixture[str]) -> None:
    show_crash(ValueError, ValueError("[red]oops[/]\x1b[2J"), None)
    message = capsys.readouterr().err
    assert "Chauffeur itself failed: ValueError: [red]oops[/][2J" in message
    assert "CHAUFFEUR_DEBUG=1" in message


def test_a_planner_that_is_down_is_a_failure_not_bad_input(answers: str) -> None:
    result = invoke("drive", "Something nobody has answered.", "--planner", answers)
    assert result.exit_code == 1
    assert "holds no answer" in result.output
    assert "Traceback" not in result.output


def test_ctrl_c_is_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("chauffeur.driving.scenarios.suiting", stop)
    assert invoke("drive", "go").exit_code == 130


def test_scenarios_and_apis_are_listed() -> None:
    listed = invoke("show", "scenarios").output
    assert "intersection" in listed
    assert "--data DIR" in listed
    assert "set_target_speed(target_speed: float)" in invoke("show", "apis").output
    one = invoke("show", "apis", "set_target_speed").output
    assert "m/s" in one
    assert "example" in one


def test_official_samples_are_listed_too(lampilot_data: Path) -> None:
    result = invoke("show", "scenarios", "--data", str(lampilot_data / "DbLv1-dev"), "--find", "pull_over")
    assert result.exit_code == 0, result.output
    assert "pull_over_s0" in result.output


def test_doctor_names_what_is_missing_and_how_to_get_it() -> None:
    result = invoke("doctor")
    assert result.exit_code == 0, result.output
    core, extras = installed_parts()
    assert all(part.installed for part in core)
    assert {"town", "models", "speech"} <= set(extras)
    assert not {"dev", "docs"} & set(extras)
    flat = "".join(result.output.split())
    for extra, parts in extras.items():
        if any(part.installed is None for part in parts):
            assert "".join(install_command(extra).split()) in flat, extra


def test_doctor_never_shows_a_key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "sk-very-secret")
    output = invoke("doctor").output
    assert "sk-very-secret" not in output
    assert "OPENAI_API_KEY" in output


def test_a_broken_core_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("chauffeur.cli.doctor._installed", lambda name: None if name == "mcap" else "1.0")
    result = invoke("doctor")
    assert result.exit_code == 1
    assert "Driving cannot work without mcap" in result.output


def test_every_own_error_has_an_exit_code() -> None:
    from chauffeur.cli.failures import exit_code

    kinds = ChauffeurError.__subclasses__()
    assert {exit_code(kind.__new__(kind)) for kind in kinds} == {1, 2}
    assert exit_code(PlannerError("down")) == 1
