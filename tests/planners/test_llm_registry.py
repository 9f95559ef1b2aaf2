"""Planners by name."""

from __future__ import annotations

import asyncio
from importlib.metadata import EntryPoint, EntryPoints

import pytest

from chauffeur.concept import ConfigError, PlannerError
from chauffeur.planners import Planner, make_planner, planner_names
from chauffeur.planners.llm import LlmPlanner


def test_the_built_in_planners_use_the_same_door():
    assert {"keyword", "onboard", "openai", "replay", "meaning"} <= set(planner_names())


def test_openai_with_a_model_that_has_slashes(tmp_path):
    planner = make_planner("openai/meta-llama/Llama-3-8B", base_url="http://localhost:8000/v1", cache_dir=tmp_path)
    assert isinstance(planner, LlmPlanner) and isinstance(planner, Planner)
    assert (planner.id, planner.model) == ("openai/meta-llama/Llama-3-8B", "meta-llama/Llama-3-8B")


def test_an_unknown_planner_gets_a_suggestion():
    with pytest.raises(ConfigError, match="Did you mean 'openai'"):
        make_planner("opneai/gpt-4o")
    with pytest.raises(ConfigError, match="openai"):
        make_planner("zzz")


def test_an_unknown_option_gets_a_suggestion_and_the_list():
    with pytest.raises(ConfigError, match="Did you mean 'temperature'"):
        make_planner("openai/m", temprature=0.5)
    with pytest.raises(ConfigError, match="takes no options"):
        make_planner("replay/x.jsonl", temperature=0.5)


@pytest.mark.parametrize(
    "options", [{"temperature": 3.0}, {"max_tokens": 0}, {"timeout_s": 0.0}, {"attempts": 0}, {"base_url": "nonsense"}]
)
def test_settings_out_of_range_are_named(options):
    with pytest.raises(ConfigError):
        make_planner("openai/m", **options)


def test_openai_without_a_model_says_how_to_write_it():
    with pytest.raises(ConfigError, match="openai/gpt-4o"):
        make_planner("openai")


class Mine:
    """A third party's planner."""

    id = "mine"
    model = "mine-1"

    def __init__(self, argument: str, tone: str) -> None:
        self.argument, self.tone = argument, tone

    @classmethod
    def from_spec(cls, argument: str, *, tone: str = "kind") -> Mine:
        return cls(argument, tone)

    async def plan(self, request):
        raise PlannerError("not today")


class Nothing:
    from_spec = staticmethod(lambda argument: 5)


@pytest.fixture
def third_party(monkeypatch):
    def register(**points: str) -> None:
        found = EntryPoints(EntryPoint(name, value, "chauffeur.planners") for name, value in points.items())
        monkeypatch.setattr("chauffeur.concept.registry.entry_points", lambda group: found)

    return register


def test_a_third_party_plugs_in(third_party):
    third_party(mine=f"{__name__}:Mine")
    planner = make_planner("mine/a/b", tone="gruff")
    assert (planner.argument, planner.tone) == ("a/b", "gruff")
    with pytest.raises(PlannerError):
        asyncio.run(planner.plan(None))


def test_entry_points_that_are_no_planners_are_refused(third_party):
    third_party(
        broken="no.such.module:X", absent=f"{__name__}:Absent", five=f"{__name__}:Nothing", plain=f"{__name__}:pytest"
    )
    for name in ("broken", "absent", "five", "plain"):
        with pytest.raises(ConfigError, match=name):
            make_planner(name)
