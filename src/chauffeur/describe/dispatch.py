"""One descriptor per kind of world, chosen by the snapshot's own word for itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from chauffeur.concept import Context, ScenarioError, Snapshot
from chauffeur.describe.highway import describe_highway
from chauffeur.describe.intersection import describe_intersection
from chauffeur.describe.parking import describe_parking

DESCRIPTORS: Mapping[str, Callable[[Snapshot], Context]] = {
    "highway": describe_highway,
    "intersection": describe_intersection,
    "parking": describe_parking,
}


def describe(snapshot: Snapshot) -> Context:
    """C of a snapshot: the driving context in words for the model and as values for the checks.

    Raises:
        ScenarioError: No descriptor knows this kind of world, or the ego is on no lane.
    """
    descriptor = DESCRIPTORS.get(snapshot.kind)
    if descriptor is None:
        raise ScenarioError(
            f"No situation descriptor knows a world of kind {snapshot.kind!r}.",
            hint=f"Known kinds: {', '.join(sorted(DESCRIPTORS))}.",
        )
    return descriptor(snapshot)
