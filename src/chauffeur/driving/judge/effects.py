"""What a program did in a recorded drive, as faithfulness compares it with what was said."""

from __future__ import annotations

import math
from typing import Final

from chauffeur.concept import Observation
from chauffeur.driving.episode import Episode
from chauffeur.safety.faithfulness import Effect

_MEAN_TICKS: Final = 10
"""Control periods of the last second."""


def effect_of(episode: Episode) -> Effect:
    """What happened in a drive of which at least one frame was recorded."""
    shots = [*(frame.observation for frame in episode.frames), episode.final]
    first, last = shots[0], shots[-1]
    speeds = [shot.ego.speed_mps for shot in shots]
    # Lanes of another stretch of road have places of their own; on the roads here they run on side by side.
    places = [lane.index for shot in shots if (lane := shot.road.get(shot.ego.lane)) is not None] or [0]
    ending = speeds[-1 - _MEAN_TICKS :]
    return Effect(
        lanes_moved=places[-1] - places[0],
        leftmost=min(places) - places[0],
        rightmost=max(places) - places[0],
        speeds_mps=(speeds[0], sum(ending) / len(ending)),
        extremes_mps=(min(speeds), max(speeds)),
        gaps_m=_gaps(first, last),
        turned=round(_turn_rad(first.ego.heading_rad, last.ego.heading_rad) / (math.pi / 2.0)),
        failed=episode.causes.policy_failed or episode.causes.infra_failed,
        cut=(episode.success and episode.frames[-1].program == "running") or last.ego.crashed or last.off_road,
    )


def _gaps(first: Observation, last: Observation) -> tuple[float | None, float | None]:
    """Way along the ego to the vehicle that is ahead at first, then and at the end."""
    if first.front is None:
        return None, None
    ahead = first.front.vehicle
    return _along(first, ahead), _along(last, ahead)


def _along(shot: Observation, vehicle: int) -> float | None:
    ego = shot.ego
    for other in shot.others:
        if other.id == vehicle:
            dx, dy = other.x_m - ego.x_m, other.y_m - ego.y_m
            return dx * math.cos(ego.heading_rad) + dy * math.sin(ego.heading_rad)
    return None


def _turn_rad(first: float, last: float) -> float:
    """Angle turned, -pi to pi, to the right positive."""
    return math.remainder(first - last, 2.0 * math.pi)
