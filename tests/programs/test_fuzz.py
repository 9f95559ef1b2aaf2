"""Mixed and mutated programs: whatever comes out, the host stays whole and says what was wrong."""

from __future__ import annotations

import random
import time

import pytest
from benign import BENIGN
from hostile import HOSTILE
from straight_road import StraightRoad, start_cars

from chauffeur.programs import ProgramExecutor, ProgramFaultError, Sandbox, check_source

PROGRAMS = 200
TICK_BOUND_S = 0.25
SOURCES = [*BENIGN.values(), *(h.source for h in HOSTILE if len(h.source) < 2000)]
TOKENS = (
    *("yield ", "while True:", "say", "(", ")", "[", "]", "None", "3", "'veh:1'", "lambda x: ", "any(", " for x in "),
    *("autopilot()", "get_lane_of(", "ego", "=", ".", ",", "10 ** 9", "*", "yield from ", "\n    ", "\n"),
)


def mutated(rng: random.Random) -> str:
    """Lines of two programs spliced, then a few characters or tokens changed."""
    one, other = (rng.choice(SOURCES).split("\n") for _ in range(2))
    cut, start = rng.randrange(len(one) + 1), rng.randrange(len(other) + 1)
    text = "\n".join(one[:cut] + other[start:])
    for _ in range(rng.randrange(4)):
        at = rng.randrange(len(text) + 1)
        if rng.random() < 0.5:
            text = text[:at] + rng.choice(TOKENS) + text[at:]
        else:
            text = text[:at] + text[at + rng.randrange(6) :]
    return text


@pytest.mark.parametrize("seed", range(4))
def test_mutants_are_contained(seed: int) -> None:
    rng = random.Random(seed)
    with Sandbox() as sandbox, ProgramExecutor(sandbox=sandbox, gate=False) as executor:
        for _ in range(PROGRAMS // 4):
            source = mutated(rng)
            check_source(source)
            road = StraightRoad()
            executor.start(source, road)
            for _ in range(2):
                before = time.perf_counter()
                result = executor.tick()
                assert time.perf_counter() - before < TICK_BOUND_S, source
                assert result.error is None or isinstance(result.error, ProgramFaultError)
            assert road.cars == start_cars()
