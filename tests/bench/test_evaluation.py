"""One planner on all benchmarks that it can take: what is run, what is not and why, the card, and two of them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import pytest
from coached_data import server_module

from chauffeur.bench.evaluation.card import ScoreCard, read_card
from chauffeur.bench.evaluation.compare import CardComparison, compare_cards
from chauffeur.bench.evaluation.parts import Evaluated, part_of, planned_parts
from chauffeur.bench.evaluation.run import Evaluation
from chauffeur.bench.kernel.benchmark import GROUP
from chauffeur.bench.kernel.budget import SpendingBudget
from chauffeur.bench.kernel.metrics import TableSpec, share
from chauffeur.bench.kernel.run import Effort
from chauffeur.concept import ConfigError, DataError, Plan, PlannerError, Program, Thoughts
from chauffeur.concept.registry import plugin_names
from small_run import LEFT, Inline, make_data, quiet

ITEMS = 6
IN_THIS_PROCESS = Effort(workers=1, engine=Inline)


class Left:
    """Changes to the left lane, whatever is asked."""

    id, model = "left", "left-v1"

    async def plan(self, request: Any) -> Plan:
        return Plan(Thoughts("Left."), Program(LEFT.format(patience=1)), planner=self.id, model=self.model)


class Silent:
    id, model = "silent", "silent-v1"

    async def plan(self, request: Any) -> Plan:
        raise PlannerError("It is gone.")


def no_watch(*_: Any) -> AbstractContextManager[Any]:
    return nullcontext(quiet)


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("evaluation") / "data"
    make_data(folder)
    return folder


def evaluated(folder: Path, data: Path, who: Any = None, items: int = ITEMS, **effort: Any) -> ScoreCard:
    options = {"lampilot": {"data": str(data), "items": items}}
    evaluation = Evaluation(Evaluated.of(who or Left()), folder, "quick", options, ["lampilot"])
    return evaluation.run(no_watch, replace(IN_THIS_PROCESS, **effort))


@pytest.fixture(scope="module")
def card(tmp_path_factory: pytest.TempPathFactory, data: Path) -> Path:
    folder = tmp_path_factory.mktemp("card")
    evaluated(folder, data)
    return folder


def test_a_card_has_figures_with_judge_paper_and_what_they_are_of(card: Path) -> None:
    found = read_card(card)
    (entry,) = found.ran
    assert (entry.name, entry.state, entry.items, entry.planned) == ("lampilot", "done", ITEMS, ITEMS)
    assert "Shared:" in entry.judge and "simulated" in entry.evidence and entry.config["data_sha256"]
    score, completion = entry.figures
    assert [(one.name, one.table, one.value) for one in score.paper] == [("GPT-4, 3-shot", "Tab. IV", 55.9)]
    assert completion.found.value is not None and 0.0 <= completion.found.value <= 1.0
    assert found.versions["chauffeur"] and found.planner == "left" and "planner" not in entry.config
    stored = json.loads((card / "card.json").read_text())
    assert stored["schema"] == "chauffeur-score-card-1"
    text = (card / "card.md").read_text()
    assert "lampilot: driving score, pt ↑" in text and "Tab. IV: GPT-4, 3-shot." in text
    rows = [row for row in found.rows if row["state"] == "done"]
    assert [row["figure"] for row in rows] == ["driving score", "completion"] and rows[0]["paper"] == [55.9]


def test_going_on_asks_and_drives_nothing_twice(card: Path, data: Path) -> None:
    class Gone(Left):
        async def plan(self, request: Any) -> Plan:
            if "left" in request.instruction.text.lower().split("change")[0]:
                raise AssertionError("asked again")
            return await super().plan(request)

    before = (card / "lampilot" / "rollout.jsonl").read_bytes()
    again = evaluated(card, data, Gone())
    assert again.ran[0].figures == read_card(card).ran[0].figures
    assert (card / "lampilot" / "rollout.jsonl").read_bytes() == before


def test_a_folder_holds_one_planner_and_profile(card: Path, data: Path) -> None:
    class Other(Left):
        id = "other"

    with pytest.raises(ConfigError, match="score card of left"):
        evaluated(card, data, Other())
    with pytest.raises(ConfigError, match="score card of quick"):
        Evaluation(Evaluated.of(Left()), card, "full")


def test_what_a_planner_cannot_take_is_named_with_reason_and_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("LAMPILOT", "NUPLANQA", "OPENLOOP"):
        monkeypatch.delenv(f"CHAUFFEUR_{name}", raising=False)
    monkeypatch.setattr(
        "chauffeur.bench.evaluation.parts.find_spec", lambda name: None if name == "libsumo" else object()
    )
    parts = {one.name: one for one in planned_parts(Evaluated.of("keyword"), "quick", {})}
    assert set(parts) == set(plugin_names(GROUP))
    assert parts["passengers"].benchmark is not None and parts["hostile"].benchmark is not None
    for name, why, remedy in (
        ("faithfulness", "asks no planner", ""),
        ("lampilot", "folder of data", "-o lampilot.data=FOLDER"),
        ("openloop", "asks for words; keyword answers no questions", "openai/"),
        ("motion", "It drives gains; asked in the scenario track-lane-change, keyword wrote programs", "vlm"),
        ("instructions", "wrote nothing that can be driven", "talk2drive"),
        ("leaderboard", "needs libsumo", "pip install"),
    ):
        assert parts[name].benchmark is None
        assert why in parts[name].why and remedy in parts[name].remedy, parts[name]


def test_a_planner_without_a_name_is_not_asked_in_workers() -> None:
    parts = {one.name: one for one in planned_parts(Evaluated.of(Left()), "quick", {})}
    assert "by name" in parts["leaderboard"].why and "module:Class" in parts["leaderboard"].remedy
    assert parts["passengers"].benchmark is not None


def test_planners_of_other_policies_take_other_benchmarks() -> None:
    gains = {one.name for one in planned_parts(Evaluated.of("gains"), "quick", {}) if one.benchmark is not None}
    vilad = {one.name for one in planned_parts(Evaluated.of("vilad"), "quick", {}) if one.benchmark is not None}
    assert gains == {"motion", "motion-passengers"} and vilad == {"instructions"}


def test_a_planner_that_answers_nowhere_is_an_error_before_anything_is_run(tmp_path: Path) -> None:
    with pytest.raises(PlannerError, match="It is gone"):
        Evaluation(Evaluated.of(Silent()), tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("profile", "options", "words"),
    [("huge", {}, "no profile 'huge'"), ("quick", {"lampliot": {}}, "no benchmark 'lampliot'")],
)
def test_what_is_mistyped_is_named(tmp_path: Path, profile: Any, options: Any, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        Evaluation(Evaluated.of(Left()), tmp_path, profile, options)


def test_what_is_left_out_now_stays_on_the_card(card: Path, data: Path, tmp_path: Path) -> None:
    before = read_card(card).ran
    other = Evaluation(Evaluated.of(Left()), card, "quick", {}, ["faithfulness"]).run(no_watch, IN_THIS_PROCESS)
    assert other.ran == before
    asked_for = Evaluation(Evaluated.of(Left()), card, "quick", {"lampilot": {"data": str(tmp_path)}}, ["lampilot"])
    (entry,) = [one for one in asked_for.card.entries if one.name == "lampilot"]
    assert (entry.state, bool(entry.why), entry.figures) == ("not run", True, ()), "another run has not been made"


def test_an_interrupt_keeps_what_is_finished(tmp_path: Path, data: Path) -> None:
    def stop(*_: Any) -> None:
        raise KeyboardInterrupt

    options = {"lampilot": {"data": str(data), "items": ITEMS}}
    first = Evaluation(Evaluated.of(Left()), tmp_path, "quick", options, ["lampilot"])
    with pytest.raises(KeyboardInterrupt):
        first.run(lambda *_: nullcontext(stop), IN_THIS_PROCESS)
    states = {one.name: one.state for one in read_card(tmp_path).entries}
    assert states["lampilot"] == "partial"
    assert evaluated(tmp_path, data).ran[0].state == "done"


def test_a_benchmark_that_fails_is_named_and_stops_no_other(tmp_path: Path, data: Path) -> None:
    class Dumb(Left):
        asked = 0

        async def plan(self, request: Any) -> Plan:
            type(self).asked += 1
            if self.asked > 4:  # after what it is asked to know what it writes
                raise PlannerError("Gone.", retryable=False)
            return await super().plan(request)

    found = evaluated(tmp_path, data, Dumb())
    (entry,) = [one for one in found.entries if one.name == "lampilot"]
    assert entry.state in ("failed", "partial") and not entry.figures[2:]
    assert "Gone." in entry.why


class Asked:
    """A benchmark of somebody else's, which says nothing of score cards."""

    id = "asked-v1"
    asks = "plans"
    row = dict
    config: ClassVar = {"data_sha256": "0"}
    tables = (TableSpec("Answers", (share("asked-answered-v1", "answered", lambda row: row["answered"]),)),)

    def items(self) -> Any:
        return (NamedItem("a"), NamedItem("b"))

    async def request(self, item: Any, desk: Any) -> Any:
        from chauffeur.concept import Instruction, SystemMessage
        from chauffeur.driving.planning import screened_request
        from chauffeur.driving.scenarios import find

        return screened_request(Instruction("Left."), await desk.context(find("cruise")), SystemMessage(""))

    def job(self, item: Any, answer: Any) -> None:
        return None

    def rows(self, outcome: Any) -> Any:
        return ({"answered": outcome.answer is not None},)


class NamedItem:
    def __init__(self, name: str) -> None:
        self.id = name


def test_a_benchmark_that_says_nothing_of_cards_has_its_first_measure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("chauffeur.bench.evaluation.parts.plugin_names", lambda group: ("asked",))
    monkeypatch.setattr("chauffeur.bench.evaluation.parts.load_plugin", lambda group, name: Asked)
    found = Evaluation(Evaluated.of(Left()), tmp_path).run(no_watch, IN_THIS_PROCESS)
    (entry,) = found.entries
    assert [(one.metric, one.found.value) for one in entry.figures] == [("asked-answered-v1", 1.0)]
    assert entry.judge == "Not told by the benchmark."


# Two cards ---------------------------------------------------------------------------------------------------------


def test_two_cards_of_the_same_run_differ_by_nothing(card: Path, tmp_path: Path, data: Path) -> None:
    evaluated(tmp_path, data)
    found = compare_cards(card, tmp_path)
    assert not found.refused and len(found.changes) == 2
    assert all(one.difference.value == 0.0 and not one.sure for one in found.changes)


def test_another_planner_is_compared_item_by_item(tmp_path: Path) -> None:
    class Stays(Left):
        id = "stays"

        async def plan(self, request: Any) -> Plan:
            if "lane" in request.instruction.text:
                return await super().plan(request)
            source = "def go():\n    while True:\n        yield autopilot()\n"
            return Plan(Thoughts("Stay."), Program(source), planner=self.id, model=self.model)

    data = tmp_path / "data"
    make_data(data, tuple(range(17, 31)))  # as many scenes as an interval needs
    evaluated(tmp_path / "left", data, Left(), 20)
    evaluated(tmp_path / "stays", data, Stays(), 20)
    found = compare_cards(tmp_path / "left", tmp_path / "stays")
    (change,) = [one for one in found.changes if one.old.title == "completion"]
    assert change.difference.value is not None and change.difference.value < 0.0
    assert change.difference.low is not None, "paired, from the rows of both runs"
    assert any("Planners: left (left-v1) and stays" in note for note in found.notes)


def _changed(card: Path, folder: Path, change: Any) -> CardComparison:
    stored = json.loads((card / "card.json").read_text())
    for entry in stored["entries"]:
        change(entry)
    folder.joinpath("card.json").write_text(json.dumps(stored))
    return compare_cards(card, folder)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda entry: entry["config"].update(data_sha256="f" * 64), "data_sha256"),
        (lambda entry: entry["config"].update(items=98), "items 6 and 98"),
        (lambda entry: entry.update(bench=entry["bench"] and "lampilot-bench-v9"), "Versions differ"),
        (lambda entry: entry.update(state="partial", items=2), "partial (2 of 6 items)"),
        (lambda entry: entry.update(planned=9), "6 and 9 items"),
    ],
)
def test_what_is_unlike_is_not_compared_and_said(card: Path, tmp_path: Path, change: Any, why: str) -> None:
    found = _changed(card, tmp_path, change)
    assert not found.changes
    assert [(name, why in said) for name, said in found.refused] == [("lampilot", True)]


def test_more_items_are_another_run(card: Path, tmp_path: Path, data: Path) -> None:
    evaluated(tmp_path, data, items=5)
    assert "items 6 and 5" in compare_cards(card, tmp_path).refused[0][1]


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{}", '{"schema": "chauffeur-score-card-9"}', '{"schema": "chauffeur-score-card-1"}', "[" * 9999],
)
def test_a_file_that_is_no_card_is_said_to_be_none(tmp_path: Path, content: str) -> None:
    (tmp_path / "card.json").write_text(content)
    with pytest.raises(DataError):
        read_card(tmp_path)
    with pytest.raises(DataError, match="no score card at"):
        read_card(tmp_path / "nowhere")


def test_every_built_in_headline_names_a_printed_row_that_is_there() -> None:
    from chauffeur.bench.kernel.report import published_lines

    cited = 0
    for name in plugin_names(GROUP):
        part = part_of(name)
        for one in () if part is None else part.headlines:
            assert one.measure in one.table.measures
            if one.paper:
                names = {line.name for line in published_lines(one.table, ())}
                assert set(one.paper) <= names, (name, names)
                cited += 1
    assert cited >= 9


# An endpoint -------------------------------------------------------------------------------------------------------

MODEL = server_module()


@pytest.fixture
def server() -> Iterator[Any]:
    running = MODEL.ModelServer()
    yield running
    running.close()


@pytest.mark.server
def test_a_served_model_is_evaluated_within_one_budget(tmp_path: Path, data: Path, server: Any) -> None:
    server.script(MODEL.whole(f"Thoughts: Left.\n\n```python{LEFT.format(patience=1)}```\n"))
    who = Evaluated.of("openai/m", server.url, attempts=1, stream=False, cache=False)
    options = {"lampilot": {"data": str(data), "items": ITEMS}}
    evaluation = Evaluation(who, tmp_path, "quick", options, ["lampilot"])
    found = evaluation.run(no_watch, replace(IN_THIS_PROCESS, budget=SpendingBudget(max_requests=2), concurrency=1))
    (entry,) = [one for one in found.entries if one.name == "lampilot"]
    assert (found.planner, entry.state) == ("openai/m", "partial")
    again = Evaluation(who, tmp_path, "quick", options, ["lampilot"]).run(no_watch, IN_THIS_PROCESS)
    assert [one.state for one in again.ran] == ["done"]
