"""Decoders and caches of the masked-diffusion network and its twin, on a small untrained network."""

# ruff: noqa: E402
from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("transformers")

from chauffeur.models.vilad.decoding import AdaptiveCached, PrefixCached, Refresh, Twin, Uncached
from chauffeur.models.vilad.network import SIZES, Vilad, ViladConfig
from chauffeur.planners.vilad.parking import TEMPLATE
from chauffeur.planners.vilad.unmasking import Unmasking, unmask, unmask_many

L, S, T = TEMPLATE.length, 9, 11


@pytest.fixture(scope="module")
def made() -> tuple[Any, Any, Any, Any]:
    torch.manual_seed(3)
    config = ViladConfig(SIZES["tiny"], 24, 27)
    model, twin = Vilad(config, TEMPLATE).eval(), Vilad(config.twin, TEMPLATE).eval()
    for one in (model, twin):  # untrained heads are nearly undecided: make them decide
        for parameter in one.parameters():
            parameter.data *= 2.0 if parameter.dim() > 1 else 1.0
    return model, twin, torch.randn(1, T, 24), torch.randn(1, S, 27).abs()


def test_written_out_layers_are_the_librarys(made: tuple[Any, Any, Any, Any]) -> None:
    model, twin, words, scene = made
    row = TEMPLATE.canvas.copy()
    row[1] = TEMPLATE.ids["near"]
    row[-2] = TEMPLATE.size + 4
    known = torch.ones((1, T), dtype=torch.bool)
    with torch.no_grad():
        theirs = model(words, known, scene, torch.from_numpy(row)[None])[0].numpy()
        causal = twin(words, known, scene, torch.from_numpy(row)[None])[0].numpy()
    assert np.allclose(Uncached(model, words, scene, L)(row), theirs, atol=2e-4)
    # The twin's logits at a place come from what stands before it.
    changed = row.copy()
    changed[9] = TEMPLATE.ids["far"]
    with torch.no_grad():
        other = twin(words, known, scene, torch.from_numpy(changed)[None])[0].numpy()
    assert np.allclose(causal[:10], other[:10], atol=1e-5)
    assert not np.allclose(causal[10:], other[10:], atol=1e-3)


def test_a_cache_refreshed_at_every_pass_is_none_bit_for_bit(made: tuple[Any, Any, Any, Any]) -> None:
    model, _, words, scene = made
    allowed, how = TEMPLATE.allowed(S), Unmasking(steps=7, tau=0.99)
    plain = Uncached(model, words, scene, L)
    wanted = unmask(plain, TEMPLATE.canvas, allowed, how)
    for cached in (
        PrefixCached(model, words, scene, L, interval=1),
        AdaptiveCached(model, words, scene, L, Refresh(1, 1, 0.25)),
    ):
        found = unmask(cached, TEMPLATE.canvas, allowed, how)
        assert found.row.tobytes() == wanted.row.tobytes()
        assert found.confidence.tobytes() == wanted.confidence.tobytes()
        assert cached.passes == plain.passes == wanted.passes
        assert cached.tokens == plain.tokens


def test_fused_kernels_are_the_written_out_layers_but_for_rounding(made: tuple[Any, Any, Any, Any]) -> None:
    model, twin, words, scene = made
    allowed = TEMPLATE.allowed(S)
    exact, fused = Uncached(model, words, scene, L), Uncached(model, words, scene, L)
    assert not exact.fused  # what an accelerator takes
    fused.fused = True
    assert np.allclose(fused(TEMPLATE.canvas), exact(TEMPLATE.canvas), atol=1e-4)
    for skip in (False, True):
        plain = Twin(twin, words, scene, L).decide(TEMPLATE, allowed, skip=skip)
        for cached in (False, True):
            other = Twin(twin, words, scene, L)
            other.fused = True
            found = other.decide(TEMPLATE, allowed, cached=cached, skip=skip)
            assert np.array_equal(found.row, plain.row)
            assert np.allclose(found.confidence, plain.confidence, atol=1e-4)


@pytest.mark.parametrize("fused", [False, True])
def test_a_network_keeps_its_precision_and_tells_float32(made: tuple[Any, Any, Any, Any], fused: bool) -> None:
    model, twin, words, scene = made
    low = deepcopy(model).bfloat16(), deepcopy(twin).bfloat16()
    exact = Uncached(model, words, scene, L)(TEMPLATE.canvas)
    for make in (Uncached, PrefixCached, AdaptiveCached):
        bound = make(low[0], words, scene, L)
        bound.fused = fused
        found = bound(TEMPLATE.canvas)
        assert found.dtype == np.float32
        assert np.abs(found - exact).mean() < 0.05 * np.abs(exact).mean()
        TEMPLATE.validate(unmask(bound, TEMPLATE.canvas, TEMPLATE.allowed(S), Unmasking(steps=4)).row, S)
    told = Twin(low[1], words, scene, L)
    told.fused = fused
    TEMPLATE.validate(told.decide(TEMPLATE, TEMPLATE.allowed(S)).row, S)


def test_passes_can_be_recorded_by_name(made: tuple[Any, Any, Any, Any]) -> None:
    _, twin, words, scene = made
    asked: list[tuple[Any, ...]] = []

    class Recorded(Twin):
        def run_pass(self, row: Any, compute: Any, *given: int) -> Any:
            asked.append((compute.__name__, *given))
            return super().run_pass(row, compute, *given)

    found = Recorded(twin, words, scene, L).decide(TEMPLATE, TEMPLATE.allowed(S))
    assert len(asked) == len(set(asked)) == found.passes == L  # each pass has a name of its own
    assert len({one[0] for one in asked}) == 2  # the prompt's, and those after it


def test_caches_compute_less_and_deviate_little(made: tuple[Any, Any, Any, Any]) -> None:
    model, _, words, scene = made
    row = TEMPLATE.canvas.copy()
    prefix, adaptive = PrefixCached(model, words, scene, L), AdaptiveCached(model, words, scene, L, Refresh(9, 9, 1.0))
    plain = Uncached(model, words, scene, L)
    for step, place in enumerate(np.flatnonzero(TEMPLATE.maskable)[:4]):
        exact, one, two = plain(row), prefix(row), adaptive(row)
        # All of the response computed anew is the prompt's cache and nothing else.
        assert np.allclose(one, two, atol=1e-4)
        if step == 0:
            assert np.array_equal(one, exact)
        row[place] = int(np.where(TEMPLATE.allowed(S)[place], exact[place], -1e9).argmax())
    assert prefix.tokens == T + S + L + 3 * L < plain.tokens == 4 * (T + S + L)
    partial = AdaptiveCached(model, words, scene, L, Refresh(9, 9, 0.25))
    partial(TEMPLATE.canvas)
    partial(row)
    assert partial.tokens == T + S + L + round(0.25 * L)


@pytest.mark.parametrize("skip", [False, True])
def test_the_twins_cache_changes_nothing(made: tuple[Any, Any, Any, Any], skip: bool) -> None:
    _, twin, words, scene = made
    allowed = TEMPLATE.allowed(S)
    cached = Twin(twin, words, scene, L).decide(TEMPLATE, allowed, cached=True, skip=skip)
    plain = Twin(twin, words, scene, L).decide(TEMPLATE, allowed, cached=False, skip=skip)
    TEMPLATE.validate(cached.row, S)
    assert np.array_equal(cached.row, plain.row)
    assert np.allclose(cached.confidence, plain.confidence, atol=1e-4)
    assert cached.passes == plain.passes == (int(TEMPLATE.maskable.sum()) if skip else L)
    if skip:
        fed = Twin(twin, words, scene, L).decide(TEMPLATE, allowed, skip=False)
        assert np.array_equal(fed.row, cached.row)


def test_a_batch_of_the_network_is_decided_as_one_by_one(made: tuple[Any, Any, Any, Any]) -> None:
    model, _, _, _ = made
    torch.manual_seed(9)
    words, scene = torch.randn(5, T, 24), torch.randn(5, S, 27).abs()
    known = torch.ones((5, T), dtype=torch.bool)
    how = Unmasking(steps=6, tau=0.9)
    allowed = np.repeat(TEMPLATE.allowed(S)[None], 5, axis=0)

    @torch.no_grad()
    def predict(rows: Any, which: Any) -> Any:
        return model(words[which], known[which], scene[which], torch.from_numpy(rows)).numpy()

    together = unmask_many(predict, np.repeat(TEMPLATE.canvas[None], 5, axis=0), allowed, how)
    for b, found in enumerate(together):
        alone = unmask(lambda row, b=b: predict(row[None], np.array([b]))[0], TEMPLATE.canvas, allowed[b], how)
        assert np.array_equal(found.row, alone.row)
        assert found.passes == alone.passes
