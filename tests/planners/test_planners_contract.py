"""The contract of a planner, kept by each that ships."""

from __future__ import annotations

import pytest

from chauffeur.concept import ConfigError, DataError
from chauffeur.driving.conformance import check_planner
from chauffeur.planners.base import Planner
from chauffeur.planners.registry import make_planner

VERSIONS = {
    "adversarial": "adversarial-v1", "keyword": "keyword-v1", "meaning": "meaning-v1", "onboard": "onboard-lm",
    "talk2drive": "onboard-lm",
}  # fmt: skip
"""Planners of roads that need neither a server nor a file, and how their versions begin."""


@pytest.mark.parametrize("name", VERSIONS)
class TestPlannerContract:
    """What holds for every planner."""

    def test_it_is_a_planner_under_its_name_and_version(self, name: str) -> None:
        planner = make_planner(name)
        assert isinstance(planner, Planner)
        assert planner.id == name and planner.model.startswith(VERSIONS[name])

    def test_a_variant_that_it_does_not_have_is_refused(self, name: str) -> None:
        with pytest.raises((ConfigError, DataError)):
            make_planner(f"{name}/no-such-variant")

    def test_every_check_passes(self, name: str) -> None:
        assert [fault for one in check_planner(make_planner(name)) for fault in one.faults] == []
