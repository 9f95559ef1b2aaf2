"""The contract of worlds as tests: a world's tests inherit them, and say how one is made and where it is tried."""

from __future__ import annotations

import pytest

from chauffeur.concept import Scenario
from chauffeur.worlds.base import World
from chauffeur.worlds.conformance import CHECKS, MakeWorld


class WorldContract:
    """Heirs give the fixture `tried`; `known` are checks whose findings are told where they are set."""

    known: tuple[str, ...] = ()

    @pytest.fixture
    def tried(self) -> tuple[MakeWorld, Scenario]:
        raise NotImplementedError

    @pytest.mark.parametrize("check", CHECKS)
    def test_contract(self, tried: tuple[MakeWorld, Scenario], check: str) -> None:
        found = list(CHECKS[check](*tried))
        assert bool(found) == (check in self.known), found

    def test_protocol(self, tried: tuple[MakeWorld, Scenario]) -> None:
        make, scenario = tried
        world = make()
        first = world.reset(scenario)
        assert isinstance(world, World)
        assert world.observe() is first, "an instant is looked at once"
