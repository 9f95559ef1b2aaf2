"""A driving API: the time gap to a vehicle, which a program would otherwise divide itself and stumble at standstill.

    [project.entry-points."chauffeur.apis"]
    time-gap = "time_gap:TIME_GAP"

The answer is a pure function of the present instant. The gate and the verifier know its signature, a language model
reads it in its prompt, and what it answers is checked before a program sees it.
"""

from chauffeur.programs import Api, Param

LONGEST_S = 60.0
"""Answer at standstill, or where the vehicle is farther away than this, s."""


def time_gap(perception, vehicle):
    """Return the time until the ego is where a vehicle is now, s; 0 where it is not ahead."""
    ahead_m = perception.distance_along(0, vehicle)  # 0 is the ego
    speed_mps = perception.vehicle(0).speed_mps
    return min(max(ahead_m, 0.0) / max(speed_mps, 0.1), LONGEST_S)


TIME_GAP = Api(
    "get_time_gap_to",
    "Time until the ego is where a vehicle ahead is now.",
    "number",
    "gap = get_time_gap_to(front)",
    result=f"s, 0 when the vehicle is not ahead, at most {LONGEST_S:g}",
    params=(Param("veh", "vehicle", "a vehicle"),),
    answer=time_gap,
)
