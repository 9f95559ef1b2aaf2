"""Programs like a given one: other numbers, same language."""

from __future__ import annotations

import ast

import pytest

from chauffeur.programs import check_source
from chauffeur.programs.variants import perturbed

PROGRAM = """def follow():
    # Ü: letters that take two bytes do not shift what is replaced.
    ego = get_ego_vehicle(); set_desired_time_headway(1.4)
    speeds = [20.0, 25.5]
    waited = 0
    while True:
        gap = 40 * get_speed_of(ego) ** 0.5 / 12
        if waited > 30 and gap < 55.0:
            set_target_speed(speeds[1] + 2.5)
        waited = waited + 1
        yield autopilot()
"""


def numbers(text: str) -> list[object]:
    constants = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.Constant) and not isinstance(n.value, str)]
    return [n.value for n in sorted(constants, key=lambda n: (n.lineno, n.col_offset))]


def test_the_program_comes_first_and_all_variants_differ_and_pass_the_gate() -> None:
    texts = perturbed(PROGRAM, 16, seed=3)
    assert texts[0] == PROGRAM
    assert len(texts) == len(set(texts)) == 16
    assert all(check_source(text).passed for text in texts)


def test_only_quantities_change_and_counts_stay_counts() -> None:
    for text in perturbed(PROGRAM, 16, seed=3):
        assert [type(n) for n in numbers(text)] == [type(n) for n in numbers(PROGRAM)]
        assert "speeds[1]" in text
        assert "** 0.5" in text
        assert "waited = 0" in text
        assert "waited + 1" in text
        assert "Ü" in text


def test_every_quantity_changes_somewhere_by_about_the_spread() -> None:
    columns = list(zip(*(numbers(text) for text in perturbed(PROGRAM, 64, seed=1, spread=0.1)), strict=True))
    changed = [set(column) for column in columns if len(set(column)) > 1]
    assert len(changed) == 8  # headway, two speeds, 40, 12, 30, 55.0, 2.5
    for column in columns:
        assert all(0.6 * abs(column[0]) <= abs(value) <= 1.6 * abs(column[0]) for value in column)


def test_the_same_seed_gives_the_same_texts_and_fewer_are_the_first_of_them() -> None:
    assert perturbed(PROGRAM, 12, seed=5)[:4] == perturbed(PROGRAM, 4, seed=5)
    assert perturbed(PROGRAM, 4, seed=5) != perturbed(PROGRAM, 4, seed=6)


@pytest.mark.parametrize(
    "source",
    [
        "def wait():\n    while True:\n        yield autopilot()\n",
        "def broken(:\n    yield 3.5\n",
    ],
)
def test_a_text_without_numbers_or_not_of_the_language_stays_alone(source: str) -> None:
    assert perturbed(source, 8, seed=0) == [source]


def test_no_more_texts_than_asked() -> None:
    assert perturbed(PROGRAM, 1, seed=0) == [PROGRAM]
