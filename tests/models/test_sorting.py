"""Training the sorters: their sentences, the same files from the same seed, and what a writer left out shows."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from chauffeur.bench.personalization.sayings import feedback, wishes
from chauffeur.cli.main import app
from chauffeur.concept import DataError
from chauffeur.concept.data import DATA_VARIABLE
from chauffeur.language.text_classifier import load_sorter
from chauffeur.language.tokens import tokens_of
from chauffeur.language.weather import SAID_WEATHERS
from chauffeur.memory import remarks
from chauffeur.models.sorting import pipeline
from chauffeur.models.sorting import sentences as tables
from chauffeur.models.sorting.sentences import Sentence, kinds_of, sentences
from chauffeur.models.sorting.tables import WRITER, drawn
from chauffeur.models.sorting.training import SortingRecipe, by_writer, right, train, write
from chauffeur.models.sorting.weather import TEST_WRITERS, weather_sentences
from chauffeur.planners.onboard import town_intents
from chauffeur.planners.talk2drive import hints

KINDS = ("fast", "slow")
SHORT = SortingRecipe(epochs=8)


def said(text: str, kind: str, writer: str = "a") -> Sentence:
    return Sentence(text, kind, KINDS, writer, kind)


MADE_UP = tuple(
    said(f"{start} {word} {end}", kind, writer)
    for writer, start in (("a", "that was"), ("b", "it felt"), ("c", "we went"))
    for kind, words in (("fast", ("quick", "speedy", "hasty")), ("slow", ("sluggish", "lazy", "tardy")))
    for word in words
    for end in ("today", "again", "to me")
)


@pytest.mark.parametrize("name", ["wishes", "remarks", "town", "weather"])
def test_the_tables_are_whole_and_every_kind_is_in_them(name: tables.Name) -> None:
    found = sentences(name)
    assert {one.kind for one in found} == set(kinds_of(name))
    assert len({one.writer for one in found}) > 4
    assert all(one.text == " ".join(one.text.split()) and len(one.text) < 300 for one in found)
    worlds = [(one.among, one.text.lower()) for one in found]
    assert len(set(worlds)) == len(worlds), "no sentence comes twice"


def test_no_sentence_is_one_that_figures_are_reported_on() -> None:
    def bare(text: str) -> tuple[str, ...]:
        return tuple(token for token in tokens_of(text) if token.isalnum())

    tables_reported = (*wishes()["test"].values(), *feedback()["test"].values())
    reported = {bare(text) for texts in tables_reported for text in texts}
    for name in pipeline.NAMES:
        assert not sum(bare(one.text) in reported for one in sentences(name))


def test_a_line_that_is_none_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "sorters").mkdir()
    (tmp_path / "sorters" / "wishes.tsv").write_text("highway/pass/I\tGo past.\ta\nhighway/park.exit/I\tPark.\ta\n")
    monkeypatch.setenv(DATA_VARIABLE, str(tmp_path))
    with pytest.raises(DataError, match=r"Line 2 of wishes\.tsv"):
        sentences("wishes")


def test_tables_of_the_on_board_model_say_wishes_outright() -> None:
    found = drawn(0)
    assert found == drawn(0)
    assert found != drawn(1)
    assert {one.writer for one in found} == {WRITER}
    assert all(one.kind in one.among for one in found)
    assert {"pass", "stay", "else", "none", "go"} <= {one.kind for one in found}


def test_the_same_seed_gives_the_same_sorter(tmp_path: Path) -> None:
    for name in ("one", "two"):
        write(train(MADE_UP, KINDS, SHORT), tmp_path / f"{name}.npz")
    write(train(MADE_UP, KINDS, replace(SHORT, seed=1)), tmp_path / "other.npz")
    one, two, other = (hashlib.sha256((tmp_path / f"{n}.npz").read_bytes()).digest() for n in ("one", "two", "other"))
    assert one == two != other


def test_it_learns_and_is_measured_on_writers_it_never_saw() -> None:
    sorter = train(MADE_UP, KINDS, SHORT)
    assert right(sorter, MADE_UP).all()
    assert by_writer(MADE_UP, KINDS, SHORT).mean() > 0.9
    lost = (*MADE_UP, *(said(f"zzz{number}", "fast", "d") for number in range(3)))
    assert by_writer(lost, KINDS, SHORT)[-3:].sum() in (0, 3)  # words nobody else uses: one guess for all


def test_what_cannot_be_is_not_learned_against() -> None:
    bound = tuple(replace(one, among=("fast",)) for one in MADE_UP if one.kind == "fast")
    sorter = train((*bound, *(one for one in MADE_UP if one.kind == "slow")), KINDS, SHORT)
    assert next(iter(sorter.shares("that was tardy today"))) == "slow"


def test_what_ships_is_of_these_kinds() -> None:
    assert load_sorter(remarks.WEIGHTS).kinds == tuple(kinds_of("remarks"))
    assert load_sorter(hints.WEIGHTS).kinds == tuple(kinds_of("wishes"))
    assert load_sorter(town_intents.WEIGHTS).kinds == tuple(kinds_of("town"))
    some = sentences("remarks")[::40]
    assert np.mean(right(load_sorter(remarks.WEIGHTS), some)) > 0.95


def test_the_command_writes_sorters_and_their_card(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    names: tuple[tables.Name, ...] = ("wishes", "remarks", "town", "weather")
    some = {name: sentences(name)[::150] for name in names}

    def few(seed: int, without: Collection[str] = ()) -> tuple[Sentence, ...]:
        return tuple(one for one in some["weather"] if seed == 0 and one.writer not in without)

    def quick(do: Callable[..., Any]) -> Callable[..., Any]:
        return lambda some, kinds, recipe, *told: do(some, kinds, replace(recipe, epochs=2), *told)

    monkeypatch.setattr(pipeline, "train", quick(train))
    monkeypatch.setattr(pipeline, "by_writer", quick(by_writer))
    monkeypatch.setattr(pipeline, "sentences", some.__getitem__)
    monkeypatch.setattr(pipeline, "weather_sentences", few)
    monkeypatch.setattr(pipeline, "drawn", lambda seed: drawn(seed)[::200])
    result = CliRunner().invoke(app, ["model", "train", "sorters", "--out", str(tmp_path / "made"), "--measured"])
    assert result.exit_code == 0, result.output
    card = (tmp_path / "made" / "CARD.md").read_text()
    assert "when their writer was left out" in card
    assert "| too_fast/bit |" in card and "only looks so" in card
    for name in ("wishes", "town", "weather"):
        assert load_sorter(tmp_path / "made" / f"{name}.npz").kinds == tuple(kinds_of(name))


def test_what_is_learned_of_the_weather_leaves_writers_out() -> None:
    found = weather_sentences(0, TEST_WRITERS)
    assert {one.kind for one in found} == set(SAID_WEATHERS)
    texts = {one.text for one in found}
    assert not any(one.text in texts for one in sentences("weather") if one.writer in TEST_WRITERS)
