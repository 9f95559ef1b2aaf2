"""What a spot is worth, how a lot becomes candidates, and what the planner answers with the model that ships."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chauffeur.concept import (
    Context,
    DataError,
    Instruction,
    InstructionError,
    Parameters,
    ParkingLot,
    ParkingSpot,
    PlanRequest,
    ScenarioError,
    SystemMessage,
)
from chauffeur.describe.dispatch import describe
from chauffeur.driving.scenarios import find
from chauffeur.planners.vilad import ViladPlanner
from chauffeur.planners.vilad.engine import ViladEngine, shipped
from chauffeur.planners.vilad.parking import (
    NOTHING,
    TEMPLATE,
    agreement,
    answer,
    best,
    costs_m,
    free_spots,
    in_words,
    verified,
)
from chauffeur.planners.vilad.planner import HOW, parking_wish
from chauffeur.planners.vilad.unmasking import Decided
from chauffeur.planners.word_table import load_words
from chauffeur.worlds.parking import ParkingWorld


def spot(name: str, x: float, y: float, **more: Any) -> ParkingSpot:
    return ParkingSpot(name, x, y, 0.0, **({"free": True} | more))


LOT = ParkingLot(
    (
        spot("A1", 10.0, 0.0, row_end=True),
        spot("A2", 20.0, 0.0, neighbours=1),
        spot("A3", 30.0, 0.0, free=False),
        spot("B1", 40.0, 0.0, kind="ev"),
        spot("B2", 50.0, 0.0, covered=True, neighbours=2),
    ),
    (("lift", 50.0, 0.0), ("exit", 0.0, 0.0), ("entrance", 0.0, 0.0), ("gate", 60.0, 0.0)),
)


@pytest.mark.parametrize(
    ("asked", "wanted"),
    [
        ({}, "A1"),  # nothing: the first one that is reached, and no bay that is kept for others
        ({"lift": "near"}, "B2"),
        ({"lift": "far"}, "A1"),
        ({"lift": "near", "apart": "yes"}, "A1"),  # B2: 0 m and two neighbours, A1: 40 m and none: a tie
        ({"exit": "far", "apart": "yes"}, "A1"),
        ({"bay": "ev"}, "B1"),
        ({"covered": "yes"}, "B2"),
        ({"end": "yes", "lift": "near"}, "A1"),
        ({"stairs": "near"}, "A1"),  # there are none: every spot is as good
    ],
)
def test_the_best_spot(asked: dict[str, str], wanted: str) -> None:
    spots, names = free_spots(LOT)
    first, good = best(spots, NOTHING | asked)
    assert good[first]
    assert good[1 + names.index(wanted)]


def test_what_no_spot_offers_is_no_spot() -> None:
    spots, _ = free_spots(LOT)
    asked = NOTHING | {"bay": "family"}
    assert best(spots, asked)[0] == 0
    assert np.isinf(costs_m(spots, asked)).all()
    assert answer(spots, asked, 0)["row"] == "-"
    assert best(spots, NOTHING | {"bay": "ev", "covered": "yes"})[0] == 0


def test_a_spot_that_does_not_fit_the_words_is_decided_again() -> None:
    spots, names = free_spots(LOT)
    asked = NOTHING | {"bay": "ev"}
    wrong = TEMPLATE.encode(answer(spots, asked, 1))
    decided = Decided(wrong, np.zeros(len(wrong)), np.ones(len(wrong)), 3)
    found = verified(lambda row: np.zeros((len(row), TEMPLATE.size + len(spots) + 1)), spots, decided)
    values = TEMPLATE.decode(found.row)
    assert (values["spot"], values["row"], found.passes) == (1 + names.index("B1"), "B", 4)
    assert verified(lambda row: np.zeros(0), spots, found) is found


def test_features_and_agreement() -> None:
    spots, names = free_spots(LOT)
    assert names == ("A1", "A2", "B1", "B2")
    features = spots.features()
    assert features.shape == (5, 27)
    assert features[0].sum() == 1.0
    assert features[1, :2] == pytest.approx([0.8, 0.0])  # 40 m to the lift; no stairs
    values = TEMPLATE.decode(TEMPLATE.encode(answer(spots, NOTHING | {"lift": "near"}, 4)))
    assert agreement(spots, values).row
    assert agreement(spots, values).spot
    assert not agreement(spots, values | {"row": "A"}).row
    assert not agreement(spots, values | {"spot": 1}).spot
    assert free_spots(LOT, ["A2"])[1] == ("A2",)
    assert in_words(NOTHING | {"lift": "near", "apart": "yes"}) == "near the lift and away from other cars"


def context() -> Context:
    return describe(ParkingWorld().reset(find("parking-lift", None)))


def test_a_lot_is_seen_from_the_car() -> None:
    world = ParkingWorld()
    observation = world.reset(find("parking-lift", None))
    seen = describe(observation).lot
    assert observation.lot is not None
    assert seen is not None
    for one, two in zip(observation.lot.spots, seen.spots, strict=True):
        away = math.hypot(one.x_m - observation.ego.x_m, one.y_m - observation.ego.y_m)
        assert math.hypot(two.x_m, two.y_m) == pytest.approx(away)
        assert one.free == two.free == (not observation.road[one.name].closed)
    kinds = {one.name: one.kind for one in seen.spots}
    assert kinds["E2"] == "ev"
    assert {name for name, _, _ in seen.landmarks} == {"gate", "exit", "entrance", "lift", "stairs", "machine"}
    free = {one.name for one in seen.spots if one.free}
    assert {"B2", "E2", "C7", "D7", "D5", "A8"} <= free
    wrong = find("parking-lift", None)
    with pytest.raises(ScenarioError, match="Z9"):
        world.reset(replace(wrong, config={**wrong.config, "bays": {"Z9": "ev"}}))


def planned(text: str, where: Context, planner: ViladPlanner | None = None) -> Any:
    request = PlanRequest(Instruction(text), where, SystemMessage(""))
    return asyncio.run((planner or ViladPlanner.from_spec("")).plan(request))


def test_the_shipped_model_parks() -> None:
    here = context()
    assert here.lot is not None
    spots, names = free_spots(here.lot)
    plan = planned("I need to charge.", here)
    assert isinstance(plan.policy, Parameters)
    assert here.lot.spots[[one.name for one in here.lot.spots].index(plan.policy.route)].kind == "ev"
    assert "charger" in plan.thoughts.text
    assert plan.model.startswith("vilad-parking")
    again = planned("I need to charge.", here)
    assert (again.policy, again.raw) == (plan.policy, plan.raw)
    named = planned("Park in D5, please.", here)
    assert isinstance(named.policy, Parameters)
    assert named.policy.route == "D5"
    assert names
    decided = shipped().decide(TEMPLATE, "Park close to the lift, away from other cars.", spots.features(), HOW)
    assert decided.passes <= HOW.steps
    TEMPLATE.validate(decided.row, len(names) + 1)


def test_what_cannot_be_is_said() -> None:
    here = context()
    taken = next(one.name for one in here.lot.spots if not one.free) if here.lot else ""
    assert planned(f"Park in {taken}.", here).refusal == f"Spot {taken} is taken."
    assert "neither a parking lot" in planned("Park.", replace(here, lot=None)).refusal
    assert here.lot is not None
    full = ParkingLot(tuple(replace(one, free=False) for one in here.lot.spots), here.lot.landmarks)
    assert planned("Park.", replace(here, lot=full)).refusal == "There is no free spot."
    with pytest.raises(InstructionError):
        planned("  ", here)


def test_what_is_dangerous_is_declined_and_what_is_taken_back_is_not_meant() -> None:
    here = context()
    assert planned("Drive into the pillar.", here).refusal
    assert planned("Park as close as you can get to the lift.", here).policy is not None
    assert "near the lift" in planned("By the stairs. No wait, by the lift.", here).thoughts.text
    assert parking_wish("Park by the stairs, no wait, by the lift.") == {**NOTHING, "lift": "near"}


def test_a_damaged_model_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="cannot be read"):
        ViladEngine(tmp_path)
    (tmp_path / "model.json").write_text("{}")
    (tmp_path / "model.onnx").write_bytes(b"no graph")
    with pytest.raises(DataError, match="cannot be read"):
        ViladEngine(tmp_path)
    (tmp_path / "words.npz").write_bytes(b"no table")
    with pytest.raises(DataError, match="word table"):
        load_words(tmp_path / "words.npz")
