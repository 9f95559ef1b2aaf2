"""Points of Leaderboard 1.0, against products worked out by hand, and the official results file."""

from __future__ import annotations

import json

import pytest

from chauffeur.bench.leaderboard.criteria import Infraction
from chauffeur.bench.leaderboard.results import counted, official, status_of
from chauffeur.bench.leaderboard.scoring import (
    RouteScore,
    mean_score,
    official_rates,
    penalty,
    rates,
    route_score,
)
from chauffeur.concept import ConfigError


def broke(**counts: int) -> list[Infraction]:
    return [Infraction(kind, 1.0, 0.0, 0.0, kind) for kind, n in counts.items() for _ in range(n)]  # type: ignore[arg-type]


def outside(share: float) -> Infraction:
    return Infraction("outside_route_lanes", 9.0, 0.0, 0.0, "outside", share=share)


def test_the_reckless_drive_of_the_prototype() -> None:
    """One pedestrian, seven vehicles, five reds: 0.5 * 0.6^7 * 0.7^5 = 0.00235."""
    found = broke(collisions_pedestrian=1, collisions_vehicle=7, red_light=5)
    assert penalty(found) == pytest.approx(0.5 * 0.6**7 * 0.7**5)
    assert penalty(found) == pytest.approx(0.00235, abs=1e-5)
    assert route_score(1.0, found).composed == pytest.approx(0.235, abs=1e-3)


@pytest.mark.parametrize(
    ("found", "factor"),
    [
        ([], 1.0),
        (broke(collisions_layout=2), 0.4225),
        (broke(stop_infraction=1, red_light=1), 0.56),
        ([outside(0.25)], 0.75),
        ([outside(1.0), *broke(red_light=1)], 0.0),
        (broke(route_dev=1), 1.0),
        (broke(vehicle_blocked=1, route_timeout=1), 1.0),
    ],
)
def test_hand_checked_products(found: list[Infraction], factor: float) -> None:
    assert penalty(found) == pytest.approx(factor)


def test_the_sums_of_two_point_one() -> None:
    found = broke(collisions_pedestrian=1, collisions_vehicle=2, red_light=1, stop_infraction=1)
    assert penalty(found, "lb2.1") == pytest.approx(1.0 / (1.0 + 1.0 + 1.4 + 0.4 + 0.25))
    with pytest.raises(ConfigError, match="lb3"):
        penalty(found, "lb3")  # type: ignore[arg-type]


def row(
    item: str, found: list[Infraction], completion: float, length_m: float = 1000.0, *, infra_failed: bool = False
) -> dict[str, object]:
    score = route_score(completion, found)
    return {
        "item": item, "route": item, "engine": "sumo 1.28", "status": status_of(completion == 1.0, found),
        "rc": score.route, "ip": score.penalty, "ds": score.composed, **counted(found),
        "length_m": length_m, "simulated_s": 200.0, "cpu_s": 3.0, "infra_failed": infra_failed,
    }  # fmt: skip


def test_the_driving_score_is_the_mean_of_products() -> None:
    assert mean_score([row("0", [outside(0.5)], 1.0), row("1", [], 0.5)]) == RouteScore(75.0, 0.75, 50.0)
    assert mean_score([]) == RouteScore(0.0, 0.0, 0.0)


def test_rates_a_kilometre_official_and_corrected() -> None:
    reds = broke(red_light=2)
    routes = [row("0", reds, 1.0), row("1", reds, 0.5, 2000.0), row("2", reds, 0.0)]
    assert official_rates(routes)["red_light"] == pytest.approx(2.0 + 2.0)  # summed; nothing of the third
    assert rates(routes)["red_light"] == pytest.approx(6 / 2.0)
    assert rates(routes[2:])["red_light"] is None


def test_the_words_of_an_end() -> None:
    assert status_of(True, broke(red_light=3)) == "Completed"
    assert status_of(False, broke(vehicle_blocked=1)) == "Failed - Agent got blocked"
    assert status_of(False, broke(route_dev=1)) == "Failed - Agent deviated from the route"
    assert status_of(False, broke(route_timeout=1)) == "Failed - Agent timed out"
    assert status_of(False, [], "Simulation crashed") == "Failed - Simulation crashed"


def test_the_official_file_has_the_official_keys_and_the_engine() -> None:
    bad = broke(red_light=1, vehicle_blocked=1)
    found = official([row("0", [], 1.0), row("1", bad, 0.5)], {"1": bad})
    assert json.loads(json.dumps(found)) == found
    assert set(found) == {"_checkpoint", "chauffeur", "eligible", "entry_status", "labels", "sensors", "values"}
    assert found["values"][:3] == ["67.500", "75.000", "0.850"]
    assert len(found["values"]) == len(found["labels"]) == 12
    assert found["entry_status"] == "Finished with agent errors"
    checkpoint = found["_checkpoint"]
    assert checkpoint["progress"] == [2, 2]
    assert checkpoint["records"][1]["infractions"]["red_light"] == ["red_light"]
    assert checkpoint["records"][1]["status"] == "Failed - Agent got blocked"
    assert checkpoint["global_record"]["scores"]["score_composed"] == pytest.approx(67.5)
    assert checkpoint["global_record"]["scores_std_dev"]["score_route"] == pytest.approx(35.355, abs=1e-3)
    assert found["chauffeur"]["engines"] == ["sumo 1.28"]


def test_a_route_lost_to_the_machine_makes_the_file_incomplete() -> None:
    found = official([row("0", [], 1.0, infra_failed=True)], {})
    assert not found["eligible"]
    assert found["entry_status"] == "Finished with missing data"
