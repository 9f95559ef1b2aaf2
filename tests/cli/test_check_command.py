"""`chauffeur check world`: a world of one's own against the contract."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from chauffeur.cli.main import app

EXAMPLES = Path(__file__).parents[2] / "examples"

BAD = """
from one_lane import OneLane as _OneLane


class Runaway(_OneLane):
    def step(self, command, dt_s=0.1):
        super().step(command, dt_s)
        return command
"""


def checked(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["check", "world", *words])
    return result.exit_code, result.output


def test_the_example_keeps_the_contract(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(EXAMPLES)
    monkeypatch.syspath_prepend(str(EXAMPLES))
    code, said = checked("one_lane")
    assert (code, said.splitlines()[-1]) == (0, "12 of 12 checks keep the contract.")


def test_what_breaks_it_is_said_and_the_exit_code_is_1(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "runaway_world.py").write_text(BAD, encoding="utf-8")
    monkeypatch.syspath_prepend(str(EXAMPLES))
    monkeypatch.syspath_prepend(str(tmp_path))
    code, said = checked("runaway_world:Runaway")
    assert code == 1
    assert "fails  commands" in said
    assert "was applied as Command(acceleration_mps2=1000.0" in " ".join(said.split())
    assert said.splitlines()[-1] == "11 of 12 checks keep the contract."


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("no_such_module",), "cannot be loaded"),
        (("math:cosine",), "has no 'cosine'"),
        (("math:pi",), "is a float, and makes no world"),
        (("math",), "has 0 worlds"),
        (("highway", "--scenario", "moon"), "Unknown scenario 'moon'"),
        (("highway", "--config", "{"), "no JSON"),
        (("highway", "--config", "[]"), "no JSON object"),
    ],
)
def test_what_cannot_be_checked_is_refused_in_words(words: tuple[str, ...], says: str) -> None:
    code, said = checked(*words)
    assert code == 2
    assert says in " ".join(said.split())


RUDE = """
from dataclasses import replace
from chauffeur.concept import Plan, Program, Thoughts


class Rude:
    id, model = "rude", ""

    async def plan(self, request):
        if "?" in request.instruction.text:
            raise KeyError("?")
        return Plan(Thoughts(""), Program("not a program"), planner="somebody", model="else")
"""
DEAF = """
from speed_profile import EXAMPLE, SpeedProfileExecutor
from chauffeur.concept import Command


class Deaf(SpeedProfileExecutor):
    def step(self, observation, held=None):
        return Command(2.0, 0.0)
"""


def kit(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["check", *words])
    return result.exit_code, " ".join(result.output.split())


@pytest.fixture
def somebodys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "rude_planner.py").write_text(RUDE, encoding="utf-8")
    (tmp_path / "deaf_executor.py").write_text(DEAF, encoding="utf-8")
    monkeypatch.syspath_prepend(str(EXAMPLES))
    monkeypatch.syspath_prepend(str(tmp_path))


FORMS = """
from chauffeur.concept import Plan, Thoughts
from one_lane import OneLane
from right_of_way import RightOfWay
from speed_profile import SpeedProfile, SpeedProfileExecutor


class Plain:
    id = model = "plain"

    async def plan(self, request):
        return Plan(Thoughts("No."), None, refusal="No.", planner=self.id, model=self.model)


class Needy(Plain):
    def __init__(self, town):
        self.town = town


class Choosy(Plain):
    @classmethod
    def from_spec(cls, argument, *, speed_mps=25.0):
        float(argument)
        return cls()


def factory():
    return Plain()


def broken():
    raise OSError("no weights here")


def executor(world):
    return SpeedProfileExecutor(world)


executor.fault = SpeedProfileExecutor.fault
instance, benchmark = Plain(), RightOfWay()


def world():
    return OneLane()


def profile():
    return SpeedProfile((20.0,), 3.0)

"""
POLICY = ("--policy", "speed_profile:EXAMPLE")


@pytest.fixture
def forms(somebodys: None, tmp_path: Path) -> None:
    (tmp_path / "forms.py").write_text(FORMS, encoding="utf-8")


@pytest.mark.parametrize(
    "words",
    [
        ("planner", "forms:Plain"),
        ("planner", "forms:instance"),
        ("planner", "forms:factory"),
        ("planner", "forms:Choosy/3"),
        ("executor", "forms:executor", *POLICY),
        ("executor", "forms:executor", "--policy", "forms:profile"),
        ("world", "forms:world"),
        ("benchmark", "forms:benchmark"),
    ],
)
def test_what_is_to_be_checked_may_be_a_class_an_instance_or_a_factory(forms: None, words: tuple[str, ...]) -> None:
    code, said = kit(*words)
    assert code == 0, said


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("planner", "forms:Choosy/fast"), "could not be made: ValueError"),
        (("planner", "forms:Choosy/3", "--base-url", "http://x"), "It takes: speed_mps"),
        (("planner", "forms:Plain/3"), "takes no argument"),
        (("planner", "forms:Needy"), "It takes: town"),
        (("planner", "forms:broken"), "no weights here"),
        (("planner", "forms:POLICY"), "has no 'POLICY'"),
        (("planner", "math:pi"), "is a float, and makes no planner"),
        (("executor", "math:pi", *POLICY), "is a float, and makes no executor"),
        (("executor", "forms:executor", "--policy", "math:pi"), "is a float, and makes no policy"),
        (("world", "forms:benchmark"), "makes no world"),
        (("benchmark", "forms:benchmark", "-o", "a=1"), "takes no options"),
        (("benchmark", "right_of_way:RightOfWay", "-o", "a=1"), "unexpected keyword argument 'a'"),
    ],
)
def test_what_cannot_be_made_is_told_in_words(forms: None, words: tuple[str, ...], says: str) -> None:
    code, said = kit(*words)
    assert code == 2, said
    assert says in said


@pytest.mark.parametrize(
    "words",
    [
        ("planner", "keyword"),
        ("planner", "lookout:Lookout"),
        ("executor", "speed_profile:SpeedProfileExecutor", "--policy", "speed_profile:EXAMPLE"),
        ("benchmark", "right_of_way:RightOfWay"),
    ],
)
def test_what_is_ours_keeps_its_contract(somebodys: None, words: tuple[str, ...]) -> None:
    code, said = kit(*words)
    assert code == 0, said
    assert "fails" not in said


def test_a_planner_that_breaks_the_contract_is_told_how(somebodys: None) -> None:
    code, said = kit("planner", "rude_planner:Rude")
    assert code == 1
    for fault in (
        "Its `model` is ''",
        "the plan is signed 'somebody', 'else'",
        "the policy is none",
        "raised KeyError",
    ):
        assert fault in said


def test_an_executor_that_does_not_hear_limits_is_told_so(somebodys: None) -> None:
    code, said = kit("executor", "deaf_executor:Deaf", "--policy", "deaf_executor:EXAMPLE")
    assert code == 1
    assert "fails is held back" in said
    assert "3 of 4 checks" in said


def test_what_is_not_there_to_be_checked_is_said(somebodys: None) -> None:
    assert "has no 'Nobody'" in kit("planner", "rude_planner:Nobody")[1]
    assert "cannot be loaded" in kit("executor", "nowhere:X", "--policy", "nowhere:Y")[1]
