"""One descriptor per kind of world, chosen by the observation's own word for itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from chauffeur.concept import Context, Observation, ScenarioError
from chauffeur.describe.highway import describe_highway
from chauffeur.describe.intersection import describe_intersection
from chauffeur.describe.parking import describe_parking
from chauffeur.describe.town import describe_town
from chauffeur.describe.track import describe_track

DESCRIPTORS: Mapping[str, Callable[[Observation], Context]] = {
    "highway": describe_highway,
    "intersection": describe_intersection,
    "parking": describe_parking,
    "track": describe_track,
    "town": describe_town,
}


def describe(observation: Observation) -> Context:
    """C of an observation: the driving context in words for the model and as values for the checks.

    Raises:
        ScenarioError: No descriptor knows this kind of world, or the ego is on no lane.
    """
    descriptor = DESCRIPTORS.get(observation.kind)
    if descriptor is None:
        raise ScenarioError(
            f"No situation descriptor knows a world of kind {observation.kind!r}.",
            hint=f"Known kinds: {', '.join(sorted(DESCRIPTORS))}.",
        )
    return descriptor(observation)
