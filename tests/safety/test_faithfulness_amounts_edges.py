"""What texts claim of speeds, gaps and times, claim by claim in full, and what is held against a program for it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from faithfulness_programs import HIGHWAY

from chauffeur.language.quantities import Quantity
from chauffeur.safety.faithfulness import judge, read_facts
from chauffeur.safety.faithfulness.claim import Claim
from chauffeur.safety.faithfulness.claims import claims_of

KEEPS_30_M = """
def drive():
    ego = get_ego_vehicle()
    front = detect_front_vehicle_in(get_lane_of(ego))
    while True:
        set_target_speed(get_speed_of(front) + 0.5 * (get_distance_between_vehicles(front, ego) - 30.0))
        yield autopilot()
"""


def mps(value: float) -> Quantity:
    return Quantity(value, "speed", f"{value:g} m/s")


def metres(value: float) -> Quantity:
    return Quantity(value, "distance", f"{value:g} m")


def seconds(value: float, said: str = "") -> Quantity:
    return Quantity(value, "time", said or f"{value:g} s")


SPEED = Claim("speed", "", 0.0)
GAP = Claim("gap", "", 0.0)
WAIT = Claim("wait", "", 0.0)


@pytest.mark.parametrize(
    ("text", "claimed"),
    [
        # By a share, or to one.
        ("I cut the speed by 20 %.", replace(SPEED, sign=-1, quantities=(Quantity(0.2, "share", "20 %"),))),
        ("The speed becomes 80 %.", replace(SPEED, quantities=(Quantity(0.8, "share", "80 %"),))),
        # By the limit.
        ("I match the limit.", replace(SPEED, at_limit=True)),
        ("I go 5 m/s above the allowed speed.", replace(SPEED, sign=1, at_limit=True, quantities=(mps(5),))),
        ("I go 5 m/s below the permitted speed.", replace(SPEED, sign=-1, at_limit=True, quantities=(mps(5),))),
        # A bound is no direction, and nothing that is denied.
        ("We do not drive faster than 20 m/s.", replace(SPEED, quantities=(mps(20),))),
        ("We do not exceed 20 m/s.", replace(SPEED, quantities=(mps(20),))),
        # A step is not where the speed is to get, whatever stands behind it.
        ("The target is 5 m/s higher.", replace(SPEED, quantities=(mps(5),))),
        ("The target is 5 m/s higher today.", replace(SPEED, quantities=(mps(5),))),
        ("The target is 5 m/s higher at 30 m/s.", replace(SPEED, exact=True, quantities=(mps(5), mps(30)))),
        # Compared with others it is not the own speed that changes.
        ("Faster than the truck at 30 m/s.", replace(SPEED, quantities=(mps(30),))),
        ("I take the car faster than 20 m/s.", replace(SPEED, sign=1, quantities=(mps(20),))),
        ("I go faster than 20 m/s on the long way beside others.", replace(SPEED, sign=1, quantities=(mps(20),))),
        ("I brake for no longer than the car ahead.", replace(SPEED, sign=-1)),
        ("I get slower than the truck by braking.", replace(SPEED, sign=-1)),
        ("I brake for traffic.", replace(SPEED, sign=-1)),
        # How hard it brakes is not yet which way the speed goes.
        ("With a deceleration of 2 m/s2 I get slower.", replace(SPEED, sign=-1)),
        # One word for faster and one for slower: neither.
        ("I brake faster at 20 m/s.", replace(SPEED, quantities=(mps(20),))),
        ("I ease off.", replace(SPEED, sign=-1)),
        ("I speed up.", replace(SPEED, sign=1)),
        # Gaps.
        ("I hang back.", replace(GAP, sign=1)),
        ("I close up.", replace(GAP, sign=-1)),
        ("I leave 30 m.", replace(GAP, firm=False, quantities=(metres(30),))),
        ("I open the gap to the default 30 m.", replace(GAP, sign=1, quantities=(metres(30),))),
        ("I widen the usual gap.", replace(GAP, sign=1)),
        ("The headway grows to 2 s.", replace(GAP, sign=1, quantities=(seconds(2),))),
        ("In 5 s the gap grows to 30 m.", replace(GAP, sign=1, quantities=(metres(30),))),
        ("I open the gap to 30 m within 5 s.", replace(GAP, sign=1, quantities=(metres(30),))),
        # Times.
        ("I wait 2 minutes.", replace(WAIT, quantities=(seconds(120, "2 minutes"),))),
        ("I wait two and a half minutes.", replace(WAIT, quantities=(seconds(150, "two and a half minutes"),))),
    ],
)
def test_a_claim_in_full(text: str, claimed: Claim) -> None:
    assert claims_of(text)[0] == replace(claimed, sentence=text)


@pytest.mark.parametrize(
    "text",
    [
        "Going left slows others less than staying here.",
        "I brake no longer than the car ahead.",
        "I brake faster.",
    ],
)
def test_the_own_speed_is_not_spoken_of(text: str) -> None:
    assert not [claim for claim in claims_of(text) if claim.matter in ("speed", "gap")]


@pytest.mark.parametrize("text", ["Within 5 s I close the gap to 30 m.", "I close the gap to 30 m within 5 s."])
def test_by_when_a_gap_is_reached_is_no_gap_wherever_it_stands(text: str) -> None:
    assert judge(text, read_facts(KEEPS_30_M), HIGHWAY).aligned
    (mismatch,) = judge(text.replace("30", "20"), read_facts(KEEPS_30_M), HIGHWAY).mismatches
    assert (mismatch.kind, mismatch.instead) == ("wrong-number", "it has 30 m, not 20 m")
