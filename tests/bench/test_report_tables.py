"""What the tables say: the numbers of the rows, nothing that cannot be known, and every label beside its figures."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from report_folders import HOSTILE, mixed, outcome, signals, write_run

from chauffeur.bench.lampilot.report import comparison_lines, family_lines, summarise
from chauffeur.bench.report.build import Choices, build_report
from chauffeur.bench.report.model import SIMULATED, BenchReport, Cell
from chauffeur.bench.report.runs import load_run
from chauffeur.bench.report.text import render_markdown


def _report(*folders: Path, metrics: str = "", gallery: int = 2) -> BenchReport:
    return build_report(list(folders), Choices(metrics, gallery=gallery), lambda what, done, total: None)


def _cell(report: BenchReport, table: str, line: str, column: str) -> Cell:
    found = report.table(table)
    assert found is not None
    place = [c.key for c in found.columns].index(column)
    return next(ln.cells[place] for group in found.groups for ln in group.lines if ln.name == line)


def _value(cell: Cell) -> float:
    assert cell.interval is not None and cell.interval.value is not None
    return cell.interval.value


@pytest.fixture
def two(tmp_path: Path) -> tuple[Path, Path]:
    """Run B does what A does, and one scene more."""
    drives = mixed(24)
    better = [list(scene) for scene in drives]
    better[1] = [outcome(), outcome()]
    return write_run(tmp_path / "a", drives, planner="a"), write_run(tmp_path / "b", better, planner="b")


def test_scores_are_the_summarys(two: tuple[Path, Path]) -> None:
    report = _report(two[0])
    summary = summarise("a", load_run(two[0]).rows)
    assert _value(_cell(report, "scores", "a", "completion")) == pytest.approx(100 * summary.completion)
    assert _value(_cell(report, "scores", "a", "collision")) == pytest.approx(100 * summary.collision)
    assert summary.ttc is not None
    assert _value(_cell(report, "scores", "a", "ttc")) == pytest.approx(summary.ttc)
    score = _cell(report, "scores", "a", "driving_score")
    assert _value(score) == pytest.approx(summary.driving_score)
    assert score.ends is not None and score.ends[0] < _value(score) < score.ends[1]
    assert _cell(report, "scores", "a", "items").text == "48"


def test_the_papers_ruler_has_its_own_aggregate_and_stands_apart_from_the_papers_rows(two: tuple[Path, Path]) -> None:
    origin, paper = _report(two[0]), _report(two[0], metrics="paper")
    assert (
        _value(_cell(origin, "scores", "a", "driving_score")) < 0 < _value(_cell(paper, "scores", "a", "driving_score"))
    )
    human = ("scores", "Human driver", "driving_score")
    assert _cell(origin, *human).text == "84.6"
    scores = paper.table("scores")
    assert scores is not None
    assert not any(line.published for group in scores.groups for line in group.lines)
    assert _cell(paper, "published", *human[1:]).text == "84.6"
    assert paper.headlines[-1].text.endswith("compare with nothing here.")
    rows = load_run(two[0]).rows
    assert len(comparison_lines("a", rows)[1]) == 1 + 18
    rescored = [row | {"metrics": "lampilot-paper-v1"} for row in rows]
    assert len(comparison_lines("a", rescored)[1]) == 1
    with pytest.raises(ValueError, match="one ruler"):
        comparison_lines("a", [*rows, *rescored])


def test_tables_of_the_terminal_can_carry_intervals(two: tuple[Path, Path]) -> None:
    rows = load_run(two[0]).rows
    plain, with_intervals = family_lines(rows)[1][-1], family_lines(rows, draws=200)[1][-1]
    assert plain[0] == with_intervals[0] == "all"
    assert re.fullmatch(r"50\.0", plain[3])
    assert re.fullmatch(r"50\.0 \[\d\d\.\d, \d\d\.\d\]", with_intervals[3])


def test_a_pair_says_what_flipped(two: tuple[Path, Path]) -> None:
    report = _report(*two)
    pair = "A: a; B: b"
    assert [_cell(report, "pairs", pair, key).text for key in ("both", "only_first", "only_second", "neither")] == [
        "24",
        "0",
        "2",
        "22",
    ]
    assert _cell(report, "pairs", pair, "mcnemar").text == "0.500"
    by_scene = _cell(report, "pairs", pair, "by_scene")
    assert (by_scene.text, by_scene.note) == ("1", "0 v 1 scenes")
    assert _value(_cell(report, "pairs", pair, "completion")) == pytest.approx(100 * 2 / 48)
    (flips,) = report.flips
    (flip,) = flips.flips
    assert (flip.sample, flip.gained, flip.lost, flips.left_out) == ("task1_s1", 2, 0, 0)
    assert (flip.first, flip.second) == ("not done after 20.0\u00a0s", "done as asked after 20.0\u00a0s")
    assert not any("against" in line.subject for line in report.headlines), "runs are compared by table"


def test_equal_runs_differ_in_nothing(tmp_path: Path) -> None:
    report = _report(*(write_run(tmp_path / name, mixed(), planner=name) for name in "ab"))
    assert report.flips == ()
    assert _cell(report, "pairs", "A: a; B: b", "driving_score").text == "0.0"


def test_with_many_runs_only_pairs_with_the_first_are_shown(tmp_path: Path) -> None:
    report = _report(*(write_run(tmp_path / name, mixed(), planner=name) for name in "abcde"), gallery=0)
    pairs = report.table("pairs")
    assert pairs is not None
    assert [line.name for line in pairs.groups[0].lines] == [f"A: a; B: {name}" for name in "bcde"]


def test_nothing_done_is_no_mean(tmp_path: Path) -> None:
    report = _report(write_run(tmp_path / "run", [[outcome("timeout")] for _ in range(12)]))
    assert _cell(report, "scores", "onboard", "completion").text == "0.0"
    assert _cell(report, "scores", "onboard", "ttc").text == "n/a"
    assert _cell(report, "scores", "onboard", "driving_score").text == "0.0"
    assert "0 of 12 items" in report.headlines[0].text


def test_one_item_has_no_interval(tmp_path: Path) -> None:
    report = _report(write_run(tmp_path / "run", [[outcome()]]))
    assert _cell(report, "scores", "onboard", "completion").ends is None
    assert "interval" not in report.headlines[0].text
    assert report.galleries[0].failed == 0


def test_runs_without_a_common_item_are_not_compared(tmp_path: Path) -> None:
    a = write_run(tmp_path / "a", mixed(), planner="a")
    b = write_run(tmp_path / "b", mixed(), planner="b", data="e" * 64, command="Stop.")
    report = _report(a, b)
    assert report.table("pairs") is None
    assert "0 are in all" in report.warnings[0] and "no pair is shown" in report.warnings[0]
    assert _cell(report, "scores", "a", "items").text == "24"


def test_runs_over_different_items_also_stand_over_their_own(tmp_path: Path) -> None:
    a = write_run(tmp_path / "a", mixed(24), planner="a")
    b = write_run(tmp_path / "b", mixed(12), planner="b")
    report = _report(a, b)
    assert _cell(report, "scores", "a", "items").text == "24"
    assert _cell(report, "own", "a", "items").text == "48"
    assert "a 48, b 24" in report.warnings[0]


def test_what_is_beside_the_scores(tmp_path: Path) -> None:
    drives = [
        [outcome(signals=signals(ttc_lane_s=None, stop_speed_mps=0.2))] * 3,
        [outcome(signals=signals(ttc_lane_s=1.5, stop_speed_mps=4.0))],
        [outcome("collision", signals=signals(crashed=True, fault="struck"))],
        [outcome("refused")],
    ]
    report = _report(write_run(tmp_path / "run", drives))
    median = _cell(report, "beside", "onboard", "lane_ttc")
    assert (median.text, median.note) == ("2.8", "2 of 5 drives had a conflict")
    assert _cell(report, "beside", "onboard", "lane_ttc_close").note == "1 of 5"
    assert (_cell(report, "beside", "onboard", "stop").text, _cell(report, "beside", "onboard", "stop").note) == (
        "75.0",
        "3 of 4",
    )
    assert [_cell(report, "beside", "onboard", key).text for key in ("ego", "struck", "road_end")] == ["0", "1", "0"]


def test_what_an_earlier_version_did_not_record_is_not_known(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", mixed())
    rows = load_run(folder).rows
    gone = ("lane_ttc_s", "stop", "fault")
    from report_folders import write_lines

    write_lines(folder / "results.jsonl", [{k: v for k, v in row.items() if k not in gone} for row in rows])
    table = _report(folder).table("beside")
    assert table is not None
    assert {cell.text for cell in table.groups[0].lines[0].cells} == {"n/a"}
    assert table.notes


def test_endings_and_causes_are_counted_apart(tmp_path: Path) -> None:
    drives = [[outcome("failure", policy_failed=True, fallback_used=True)], [outcome("not_driven")], [outcome()]]
    report = _report(write_run(tmp_path / "run", drives))
    counts = {
        key: _cell(report, "outcomes", "onboard", key).text
        for key in ("success", "failure", "not_driven", "policy_failed", "infra_failed", "fallback_used")
    }
    assert set(counts.values()) == {"1"}
    assert any("1 of 3 items failed because of endpoint" in warning for warning in report.warnings)


def test_costs(tmp_path: Path) -> None:
    drives = [[outcome(), outcome()] for _ in range(4)]
    report = _report(write_run(tmp_path / "run", drives, row={"cost_usd": 0.002}))
    texts = [_cell(report, "cost", "onboard", key).text for key in ("p50", "p95", "prompt", "completion", "usd_k")]
    assert texts == ["1 s", "1.5 s", "100", "10", "2.00"]
    baseline = {"latency_s": None, "prompt_tokens": None, "completion_tokens": None, "cost_usd": None}
    unknown = _report(write_run(tmp_path / "idm", drives, planner="idm", row=baseline))
    table = unknown.table("cost")
    assert table is not None
    assert {cell.text for cell in table.groups[0].lines[0].cells} == {"n/a"}


def test_every_line_has_a_cell_for_every_column(two: tuple[Path, Path]) -> None:
    for report in (_report(*two), _report(two[0], metrics="paper")):
        for table in report.tables:
            for group in table.groups:
                assert all(len(line.cells) == len(table.columns) for line in group.lines), table.id
            assert all(column.meaning for column in table.columns), table.id


def _everywhere(labels: tuple[str, ...], tmp_path: Path) -> BenchReport:
    a = write_run(tmp_path / "a", mixed(), planner="a", labels=labels)
    b = write_run(tmp_path / "b", [[outcome(), outcome()] for _ in range(12)], planner="b")
    return _report(a, b)


def test_labels_and_simulated_drives_stand_at_every_result(tmp_path: Path) -> None:
    label = "rehearsal K=32: foresees the simulator's traffic"
    report = _everywhere((label,), tmp_path)
    for table in report.tables:
        for group in table.groups:
            for line in group.lines:
                if line.name == "a" or "A: a" in line.name:
                    assert label in line.labels, table.id
        assert SIMULATED in table.caption or not table.simulated
    text = render_markdown(report)
    for line in text.splitlines():
        if re.match(r"(\| )?(a|A: a; B: b)( \[|\s*\|| \\\[)", line):
            assert "rehearsal K=32" in line
    assert text.count(SIMULATED) >= len([table for table in report.tables if table.simulated])
    for headline in report.headlines:
        if re.search(r"\ba\b", headline.subject):
            assert label in headline.subject
    assert label in report.summary
    assert label in report.flips[0].first


def _markdown_rows(text: str) -> list[list[str]]:
    """Cells of table lines, split at bars that are not escaped."""
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    return [re.split(r"(?<!\\)\|", line)[1:-1] for line in lines]


def test_markdown_tables_stay_tables_whatever_was_written(tmp_path: Path) -> None:
    folders = [
        write_run(tmp_path / name, drives, planner=name + HOSTILE, command=HOSTILE, labels=(HOSTILE,))
        for name, drives in (("a", mixed()), ("b", [[outcome(), outcome()] for _ in range(12)]))
    ]
    text = render_markdown(_report(*folders))
    width = 0
    for cells in _markdown_rows(text):
        if set(cells[0].strip()) == {"-"}:
            assert len(cells) == width
        width = len(cells)
    assert "<img" not in text.replace("\\<", "")
    text.encode("utf-8")


def test_the_choice_of_failures_is_spread(tmp_path: Path) -> None:
    from chauffeur.bench.report.failures import choose_failures

    kinds: list[dict[str, Any]] = [
        outcome("timeout"),
        outcome("collision"),
        outcome("not_driven"),
        outcome("failure"),
    ]
    run = load_run(
        write_run(tmp_path / "run", [[kinds[scene // 3 % 4]] * 4 for scene in range(36)], families=("x", "y", "z"))
    )
    chosen = choose_failures(run.rows, 12)
    assert [row["family"] for row in chosen[:3]] == ["x", "y", "z"]
    assert len({row["sample"] for row in chosen}) == 12
    for family in "xyz":
        own = [row["outcome"] for row in chosen if row["family"] == family]
        assert own == ["collision", "failure", "timeout", "not_driven"] or set(own[:3]) == {
            "collision",
            "failure",
            "timeout",
        }
    assert choose_failures(run.rows, 12) == chosen
    assert len(choose_failures(run.rows, 10_000)) == len(run.rows)
    assert choose_failures(run.rows, 0) == []
