"""Tables of results: whatever the width of the terminal, rows keep their names and no number is lost."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from chauffeur.cli.lab.tables import show_table

HEADER = ("planner", "success rate", "collision rate", "time efficiency", "speed variance", "driving score")
LINES = [
    ["onboard (our language model)", "81.2 %", "0.9 %", "61.25 points", "12.75", "52.31"],
    ["keyword", "40.0 %", "3.1 %", "70.50 points", "9.25", "31.07"],
    ["openai/a-model-with-a-name-that-is-long-enough-to-fold", "77.7 %", "1.5 %", "66.66 points", "11.11", "49.99"],
]


def shown(width: int) -> list[str]:
    console = Console(file=io.StringIO(), width=width)
    show_table(console, "A title", HEADER, LINES)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue().splitlines()


@pytest.mark.parametrize("width", [30, 44, 60, 80, 200])
def test_every_row_keeps_its_name_and_every_number(width: int) -> None:
    lines = shown(width)
    assert max(map(len, lines)) <= width
    for number in (cell for line in LINES for cell in line[1:]):
        (where,) = [line for line in lines if f" {number}" in line]
        assert not where.startswith(" "), f"{number} stands in a row without a name: {where!r}"
    for head in ("success", "collision", "efficiency", "variance", "driving"):
        assert any(head in line for line in lines)


def test_what_fits_is_one_table() -> None:
    lines = shown(200)
    assert lines[0].strip() == "A title"
    assert sum("keyword" in line for line in lines) == 1
    assert sum("keyword" in line for line in shown(60)) > 1
