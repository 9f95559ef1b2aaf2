"""The shipped BEV-LLM: it loads without a name, is small, and sees what it is for in fresh pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("torch")
pytest.importorskip("transformers")
pytest.importorskip("moderngl")

from chauffeur.bench.nuplanqa.scenes.making import CONDITIONS
from chauffeur.bench.nuplanqa.scenes.staging import SKIES, stage
from chauffeur.camera import make_renderer
from chauffeur.describe.vision import CameraDescriptor
from chauffeur.models.bev_llm.recipe import WEIGHTS
from chauffeur.models.bev_llm.seeing import BevLlmReader
from chauffeur.planners.registry import make_answerer


def test_it_needs_no_name_and_little_room() -> None:
    assert make_answerer("bev-llm").id == "bev-llm/shipped"
    assert sum(path.stat().st_size for path in WEIGHTS.iterdir()) < 8_000_000
    assert "imulated" in (WEIGHTS / "MODEL_CARD.md").read_text(encoding="utf-8")


def test_it_sees_weather_in_pictures_it_has_never_seen() -> None:
    renderer, reader = make_renderer(), BevLlmReader()
    try:
        looks = CameraDescriptor(reader, renderer)
        now = stage("0" * 16, np.random.default_rng(99)).now
        said = [replace(looks, conditions=CONDITIONS[sky]).look(now).sky for sky in SKIES]
    finally:
        renderer.close()
    assert sum(one == sky for one, sky in zip(said, SKIES, strict=True)) >= 5
