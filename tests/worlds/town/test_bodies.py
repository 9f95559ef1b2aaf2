"""Bodies of the traffic: the rear axle follows the front bumper, whatever heading SUMO tells."""

from __future__ import annotations

import itertools
import math

import pytest

from chauffeur.worlds.town.bodies import AXLE, Trails

LENGTH_M = 8.0


def test_a_heading_that_leaps_turns_the_body_by_and_by() -> None:
    """A truck comes out of a bend: SUMO's heading leaps by 40 degrees while the front goes straight on."""
    trails, headings = Trails(), [math.radians(40.0)]
    for i in range(60):
        told = math.radians(40.0) if i < 2 else 0.0
        headings.append(trails.heading_rad("v1", 0.5 * i, 0.0, LENGTH_M, told))
        trails.seen()
    turned = [abs(after - before) for before, after in itertools.pairwise(headings)]
    assert max(turned) < 0.5 / (AXLE * LENGTH_M)
    # A tractrix: tan(half the angle) falls by exp(-way / axle).
    way = 0.5 * 59
    expected = 2.0 * math.atan(math.tan(math.radians(20.0)) * math.exp(-way / (AXLE * LENGTH_M)))
    assert headings[-1] == pytest.approx(expected, abs=0.005)


def test_who_stands_keeps_its_heading_and_who_is_put_in_takes_what_it_is_told() -> None:
    trails = Trails()
    for told in (1.0, 0.0, 0.3):
        assert trails.heading_rad("v1", 5.0, 5.0, LENGTH_M, told) == pytest.approx(1.0)
        trails.seen()
    assert trails.heading_rad("v1", 90.0, 5.0, LENGTH_M, 0.3) == 0.3, "it was put in elsewhere"
    trails.seen()
    trails.seen()
    assert trails.heading_rad("v1", 90.5, 5.0, LENGTH_M, 2.0) == 2.0, "it was out of sight"
