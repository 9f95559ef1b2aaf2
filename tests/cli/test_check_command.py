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
        (("math:sin",), "has no class 'sin'"),
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
