"""Reports of runs of any benchmark: the numbers of the rows, what is not whole refused, and what runs share."""

from __future__ import annotations

import csv
import importlib
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from chauffeur.bench.kernel.metrics import missed
from chauffeur.bench.kernel.report import ResultTable, fill, value_text
from chauffeur.bench.kernel.run import BenchRun, Effort
from chauffeur.bench.lampilot.report import SCORE_TABLE, TABLES
from chauffeur.bench.report.build import Choices, build_report, read_runs
from chauffeur.bench.report.gallery import choose
from chauffeur.bench.report.model import SIMULATED, BenchReport
from chauffeur.bench.report.runs import benchmark_kind, load_run, load_runs, on_common_items, specs_of
from chauffeur.bench.report.text import render_markdown
from chauffeur.cli.main import app
from chauffeur.concept import ConfigError, DataError
from chauffeur.driving.judge.metrics import driving_score
from report_folders import HOSTILE, mixed, outcome, read_lines, signals, write_lines, write_run
from small_run import Inline, quiet

PAPER = "lampilot-paper-v1"


def _report(*folders: Path, metrics: str = "", gallery: int = 2) -> BenchReport:
    return build_report(list(folders), Choices(metrics, gallery=gallery), lambda what, done, total: None)


def _figure(table: ResultTable, line: str, column: str) -> str:
    place = [measure.title for measure in table.spec.measures].index(column)
    found = next(one for one in table.lines if line in (one.name, f"{one.group}: {one.name}"))
    return " ".join(value_text(found, place, table.spec.measures[place])).strip()


@pytest.fixture
def two(tmp_path: Path) -> tuple[Path, Path]:
    """Run B does what A does, and one scene more."""
    drives = mixed(24)
    better = [list(scene) for scene in drives]
    better[1] = [outcome(), outcome()]
    return write_run(tmp_path / "a", drives, planner="a"), write_run(tmp_path / "b", better, planner="b")


def test_figures_are_those_of_the_rows(two: tuple[Path, Path]) -> None:
    scores, families, ended, beside, cost = _report(two[0]).tables
    assert _figure(scores, "a", "Completion") == "50.0 [29.2, 70.8]"
    assert _figure(scores, "a", "Collision") == "16.67 [4.17, 33.33]"
    assert _figure(scores, "a", "Driving score") == "-39.9 [-126.9, 37.1]"
    assert _figure(scores, "Human driver", "Driving score") == "84.6"
    assert [line.name for line in families.lines] == ["distance", "routing", "all"]
    assert (_figure(ended, "a", "Crashed"), _figure(ended, "a", "Declined")) == ("4", "4")
    assert (_figure(beside, "a", "Lane-aware TTC, median"), _figure(beside, "a", "Own fault")) == ("4.0", "4")
    assert (_figure(cost, "a", "Latency, p95"), _figure(cost, "a", "Tokens in")) == ("1500.00", "100")
    assert _figure(cost, "a", "Cost") == "n/a"


def test_the_papers_ruler_has_its_own_aggregate_and_no_printed_rows(two: tuple[Path, Path]) -> None:
    table = _report(two[0], metrics="paper").tables[0]
    assert float(_figure(table, "a", "Driving score").split()[0]) > 0.0
    assert not any(line.published for line in table.lines)


def test_the_printed_rows_follow_from_their_columns() -> None:
    # All rows but two follow from their own printed columns, within the rounding of a rate that is weighed 500-fold.
    printed = json.loads((Path(__file__).parents[2] / "data" / "lampilot" / "table4.json").read_text())["rows"]
    assert len(printed) == 18
    for row in printed:
        collision, completion, ttc, sv, te, published = row["values"]
        if row["name"] not in ("Human driver", "GPT-4, human feedback"):
            mean = 0.5 * ttc + 0.3 * sv + 0.2 * te
            assert driving_score(completion / 100, mean, collision / 100) == pytest.approx(published, abs=0.85)


def test_a_pair_says_what_flipped(two: tuple[Path, Path]) -> None:
    report = _report(*two)
    (pair,) = report.pairs
    assert [_figure(pair, f"counted in {run} only", "Completion") for run in "AB"] == ["0", "2"]
    assert _figure(pair, "McNemar p, by item", "Completion") == "0.500"
    assert _figure(pair, "sign test p, by sample", "Completion") == "1"
    assert _figure(pair, "B − A", "Completion").startswith("4.2 [")
    assert _figure(pair, "McNemar p, by item", "Driving score") == ""
    ((flip,),) = (flips.flips for flips in report.flips)
    assert (flip.cluster, flip.group, flip.gained, flip.lost) == ("task1_s1", "routing", 2, 0)


def test_equal_runs_differ_in_nothing_and_many_are_compared_with_the_first(tmp_path: Path) -> None:
    report = _report(*(write_run(tmp_path / name, mixed(), planner=name) for name in "abcde"), gallery=0)
    assert [table.spec.title for table in report.pairs] == [f"A: a; B: {name}" for name in "bcde"]
    assert report.flips == () and _figure(report.pairs[0], "B − A", "Driving score") == "0.0"


def test_nothing_done_is_no_mean(tmp_path: Path) -> None:
    scores = _report(write_run(tmp_path / "run", [[outcome("timeout")] for _ in range(12)])).tables[0]
    assert (_figure(scores, "onboard", "Completion"), _figure(scores, "onboard", "TTC")) == ("0.0 [0.0, 26.5]", "n/a")


def test_stops_and_faults_are_those_of_the_drives(tmp_path: Path) -> None:
    stopped, rolled = (outcome(signals=signals(stop_speed_mps=speed)) for speed in (0.5, 5.0))
    beside = _report(write_run(tmp_path / "run", [[stopped], [rolled], [rolled], [outcome("collision")]])).tables[3]
    assert _figure(beside, "onboard", "Stopped at the sign").startswith("33.3")
    assert _figure(beside, "onboard", "Own fault") == "1"


def test_what_was_written_stays_text_in_markdown_and_labels_are_said(tmp_path: Path) -> None:
    text = render_markdown(
        _report(write_run(tmp_path / "run", mixed(), labels=("critic: evaluator",), command=HOSTILE))
    )
    assert not re.search(r"(?<!\\)<", text)
    assert "onboard \\[critic: evaluator\\]" in text
    assert text.count(SIMULATED) >= len(TABLES)
    assert "Judge: LaMPilot's evaluators" in text


def test_a_choice_of_failures_is_spread_and_the_same_every_time(tmp_path: Path) -> None:
    rows = load_run(write_run(tmp_path / "run", mixed(24))).rows
    wrong = [row for row in rows if missed(SCORE_TABLE.measures, row)]
    chosen = choose(rows, SCORE_TABLE, "family", 6)
    assert chosen == choose(rows, SCORE_TABLE, "family", 6)
    assert len({row["sample"] for row in chosen}) == 6
    assert len({row["outcome"] for row in chosen}) == 5, "failures of the machine come last"
    assert len(choose(rows, SCORE_TABLE, "family", 10_000)) == len(wrong) == 24
    assert choose(rows, SCORE_TABLE, "family", 0) == []


def test_rows_stand_in_the_plans_order_and_runs_have_names_of_their_own(tmp_path: Path) -> None:
    folders = [write_run(tmp_path / name / "run", mixed(), labels=("l",)) for name in "ab"]
    rows = read_lines(folders[0] / "results.jsonl")
    write_lines(folders[0] / "results.jsonl", rows[::-1])
    assert [row["item"] for row in load_run(folders[0]).rows] == [row["item"] for row in rows]
    assert [run.name for run in load_runs(folders)] == ["onboard (a/run)", "onboard (b/run)"]
    model = write_run(tmp_path / "m", mixed(), planner="openai/m", setting="zero-shot")
    assert load_run(model).said == "openai/m (zero-shot)"


def test_runs_over_other_items_are_cut_to_what_they_share(tmp_path: Path) -> None:
    a, b = write_run(tmp_path / "a", mixed(12)), write_run(tmp_path / "b", mixed(16), planner="b")
    cut, note = on_common_items(load_runs([a, b]))
    assert [len(run.rows) for run in cut] == [24, 24] and "24 rows are in all" in note
    assert any("All tables are over these" in one for one in _report(a, b).notices)
    other = write_run(tmp_path / "c", mixed(12), data="e" * 64, command="Another.")
    report = _report(a, other)
    assert report.pairs == () and any("No row compares" in one for one in report.notices)


Damage = Callable[[Path], None]


def _edit(**more: Any) -> Damage:
    def damage(folder: Path) -> None:
        rows = read_lines(folder / "results.jsonl")
        write_lines(folder / "results.jsonl", [rows[0] | more, *rows[1:]])

    return damage


def _write(name: str, text: str | None) -> Damage:
    def damage(folder: Path) -> None:
        (folder / name).unlink() if text is None else (folder / name).write_text(text)

    return damage


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (_write("plan.json", None), "not a run folder"),
        (_write("plan.json", "["), "not JSON"),
        (_write("plan.json", '{"items": []}'), "plans no items"),
        (_write("results.jsonl", None), "is not finished"),
        (_write("results.jsonl", ""), "holds no row"),
        (_write("results.jsonl", "{"), "line 1, is no row"),
        (_edit(item="foreign"), "never planned"),
        (_edit(metrics=PAPER), "mixes several rulers"),
    ],
)
def test_what_is_not_whole_is_refused_in_words(tmp_path: Path, damage: Damage, says: str) -> None:
    folder = write_run(tmp_path / "run", mixed())
    damage(folder)
    with pytest.raises(DataError, match=says):
        load_run(folder)


def test_rows_that_lack_a_column_are_named(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", mixed())
    rows = read_lines(folder / "results.jsonl")
    write_lines(folder / "results.jsonl", [{k: v for k, v in row.items() if k != "success"} for row in rows])
    with pytest.raises(DataError, match="lack 'success'"):
        _report(folder)


def test_rulers_never_mix_and_another_takes_the_signals(tmp_path: Path) -> None:
    origin = write_run(tmp_path / "o", mixed())
    paper = write_run(tmp_path / "p", mixed(), ruler=PAPER, planner="p")
    with pytest.raises(ConfigError, match="different rulers"):
        read_runs([origin, paper])
    runs, _ = read_runs([origin, paper], "paper")
    assert [row["score"] for row in runs[0].rows] == [row["score"] for row in runs[1].rows]
    write_lines(origin / "rollout.jsonl", [])
    with pytest.raises(DataError, match="kept no signals"):
        read_runs([origin], "paper")


def test_every_installed_benchmark_is_found_by_the_id_of_its_runs() -> None:
    ids = ("lampilot-bench-v2", "hostile-v1", "nuplanqa-v1", "personalization-v3", "motion-v1", "motion-passengers-v1",
           "openloop-v2", "leaderboard-1.0-v1")  # fmt: skip
    for name in ids:
        kind = benchmark_kind(name)
        assert kind.id == name and kind.judge and specs_of(kind)
    assert benchmark_kind("right-of-way-v1") is None


# The command ----------------------------------------------------------------------------------------------------------


def _command(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["report", *map(str, arguments)])
    return result.exit_code, " ".join(result.output.split())


def test_one_run_is_reported_inside_it_and_several_beside_them(tmp_path: Path) -> None:
    runs = [write_run(tmp_path / name, mixed(), planner=name) for name in "ab"]
    code, said = _command(runs[0])
    assert code == 0, said
    assert sorted(path.name for path in (runs[0] / "report").iterdir()) == ["report.csv", "report.html", "report.md"]
    assert "Judge:" in said and "Scores" in said
    figures = list(csv.DictReader((runs[0] / "report" / "report.csv").open()))
    assert {"lampilot-completion-v1", "lampilot-driving-score-v1"} <= {row["metric"] for row in figures}
    assert _command(*runs, "--out", tmp_path / "here", "--metrics", "paper")[0] == 0
    assert PAPER in (tmp_path / "here" / "report.md").read_text()


def test_of_a_benchmark_that_is_not_installed_the_stored_tables_are_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples"))
    right_of_way = importlib.import_module("right_of_way")
    folder = tmp_path / "run"
    BenchRun(folder, right_of_way.RightOfWay(), right_of_way.Polite()).run(quiet, Effort(engine=Inline))
    code, said = _command(folder)
    assert code == 0, said
    text = (folder / "report" / "report.md").read_text()
    assert "| 3 | 100.0 [29.2, 100.0] |" in text and "those that the runs stored" in text
    code, said = _command(folder, write_run(tmp_path / "lampilot", mixed()))
    assert code == 2 and "right-of-way-v1" in said, "they cannot be compared"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["nowhere"], "No such run folder"),
        (["run", "--metrics", "inches"], "Unknown ruler 'inches'"),
        (["run", "run"], "given twice"),
        (["run", "other", "--inspect", "x.eval"], "holds one run"),
        (["run", "other"], "different rulers"),
        (["run", "--data", "nowhere"], "No such data folder"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(tmp_path: Path, arguments: list[str], said: str) -> None:
    write_run(tmp_path / "run", mixed())
    write_run(tmp_path / "other", mixed(), ruler=PAPER)
    before = sorted(tmp_path.rglob("*"))
    spelled = [word if word.startswith("-") or word in ("inches", "x.eval") else tmp_path / word for word in arguments]
    code, output = _command(*spelled)
    assert code == 2
    assert said in output and "Hint:" in output
    assert sorted(tmp_path.rglob("*")) == before


def test_a_table_of_no_rows_has_no_lines() -> None:
    assert fill(SCORE_TABLE, []).lines == ()
