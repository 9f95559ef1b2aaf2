"""A check: no plan is started while a person on foot is close to the vehicle.

    [project.entry-points."chauffeur.checks"]
    people-first = "people_first:check_people_first"

A check is a pure function that judges a plan and never edits it. It runs after the built-in ones before every drive,
in simulated and in real time; a verdict that did not pass stops the plan, and its words reach the person.
"""

import math

from chauffeur.concept import Verdict

CLEAR_M = 8.0
"""Least distance from the middle of the vehicle to a person on foot, m."""


def check_people_first(plan, observation, limits):
    """Refuse a policy while a pedestrian is nearer than `CLEAR_M`."""
    ego = observation.ego
    near = [math.hypot(one.x_m - ego.x_m, one.y_m - ego.y_m) for one in observation.others if one.kind == "pedestrian"]
    if plan.policy is None or min(near, default=math.inf) >= CLEAR_M:
        return Verdict("people-first-v1", True, "Nobody on foot is close.")
    reason = f"A person on foot is {min(near):.1f} m away; {CLEAR_M:.0f} m must be clear before a plan begins."
    return Verdict("people-first-v1", False, reason, remedy="Ask again once the way is clear.")
