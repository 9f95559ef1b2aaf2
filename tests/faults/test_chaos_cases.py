"""The suite's cases: all follows from number and seed."""

from __future__ import annotations

from itertools import pairwise

import pytest

from chauffeur.bench.chaos.cases import BY_NAME, KINDS, deck_size, draw, kind_of
from chauffeur.bench.chaos.model import FAULTS
from chauffeur.bench.chaos.runner import A_DRIVE, ChaosConfig, ChaosRun, compose
from chauffeur.bench.chaos.vandal import DEEDS
from chauffeur.concept import ConfigError


def test_a_case_follows_from_its_number_and_the_seed() -> None:
    assert draw(5, 0) == draw(5, 0)
    assert draw(5, 0) != draw(5, 1)
    assert draw(5, 0).seed != draw(5 + deck_size(), 0).seed


def test_every_kind_comes_up_in_a_round_and_only_at_its_stages() -> None:
    kinds = [kind_of(number) for number in range(deck_size())]
    assert set(kinds) == set(KINDS)
    for number in range(0, deck_size(), 9):
        case = draw(number, 3)
        assert case.kind is kinds[number]
        assert case.stage in case.kind.stages
        assert 1 <= len(case.wishes) <= 3
        assert case.stage != "junction" or case.road == "crossing"


def test_every_fault_of_model_and_memory_is_known_to_who_does_it() -> None:
    for kind in KINDS:
        if kind.family == "model":
            assert kind.name.removeprefix("model-") in {*FAULTS, "late"}
        elif kind.family == "memory" and kind.cost == "light":
            assert kind.name in DEEDS


def test_what_ends_a_drive_comes_last_and_surroundings_are_not_mixed() -> None:
    kinds = [kind_of(number) for number in range(2 * deck_size())]
    numbers = compose(range(len(kinds)), kinds)
    costs = [kinds[number].cost for number in numbers]
    assert costs[-1] == "fatal" and costs.count("fatal") == 1
    assert all(0 < costs.count(cost) <= most for cost, most in A_DRIVE.items())
    assert costs[-2] == "outage"
    assert ("heavy", "heavy") not in set(pairwise(costs))  # what was started anew gets the time to be ready
    assert {kinds[number].surroundings for number in numbers} == {"plain"}
    rest = [number for number in range(len(kinds)) if kinds[number].surroundings == "jumping-clock"]
    assert {kinds[number].name for number in compose(rest, kinds)} == {"wall-clock-jumps"}


def test_an_unknown_kind_and_a_folder_of_another_run_are_refused(tmp_path) -> None:
    with pytest.raises(ConfigError, match="no-such"):
        ChaosRun(tmp_path / "a", ChaosConfig(3, kinds=("no-such",)))
    ChaosRun(tmp_path / "b", ChaosConfig(3, kinds=("model-cut",)))
    ChaosRun(tmp_path / "b", ChaosConfig(9, kinds=("model-cut",)))  # more of the same
    with pytest.raises(ConfigError, match="another configuration"):
        ChaosRun(tmp_path / "b", ChaosConfig(3, first=1, kinds=("model-cut",)))
    assert ChaosConfig(kinds=("model-cut",)).draw(4).kind is BY_NAME["model-cut"]
