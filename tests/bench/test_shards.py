"""Shards cover a run once, and merged they are the run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from chauffeur.bench.kernel.merge import made_of, merge_shards
from chauffeur.bench.kernel.shards import WHOLE, Shard
from chauffeur.bench.kernel.store import RowStore
from chauffeur.cli.main import app
from chauffeur.concept import ConfigError, DataError
from chauffeur.worlds.highway.dblv1 import Dataset
from small_run import benchmark, finish, make_data, make_run, outcome, recorded

SLURM = {"SLURM_ARRAY_TASK_ID": "7", "SLURM_ARRAY_TASK_MIN": "1", "SLURM_ARRAY_TASK_COUNT": "4"}


@pytest.mark.parametrize("count", [1, 2, 3, 8, 100])
def test_every_item_has_one_shard(count: int) -> None:
    shards = [Shard(n, count) for n in range(1, count + 1)]
    sizes = [0] * count
    for item in (f"left_overtake_s{s}_c{c}" for s in range(50) for c in range(8)):
        owners = [shard.number for shard in shards if shard.owns(item)]
        assert len(owners) == 1
        sizes[owners[0] - 1] += 1
    assert max(sizes) - min(sizes) < 60 + 5 * (count == 1), "about the same share each"


def test_which_shard_is_whose_never_changes() -> None:
    """Machines with different versions must agree: the hash is part of the contract."""
    found = [next(n for n in range(1, 9) if Shard(n, 8).owns(f"turn_left_s{i}_c0")) for i in range(8)]
    assert found == [8, 4, 4, 3, 3, 6, 8, 3]


@pytest.mark.parametrize(
    ("text", "environ", "expected"),
    [
        ("3/8", {}, Shard(3, 8)),
        (" 1/1 ", {}, WHOLE),
        ("auto", SLURM | {"SLURM_ARRAY_TASK_ID": "4"}, Shard(4, 4)),
        ("auto", {"SLURM_ARRAY_TASK_ID": "0", "SLURM_ARRAY_TASK_MIN": "0", "SLURM_ARRAY_TASK_COUNT": "4"}, Shard(1, 4)),
        ("auto", SLURM | {"SLURM_ARRAY_TASK_STEP": "2"}, Shard(4, 4)),
        ("auto/16", SLURM, Shard(7, 16)),
        ("auto/5", {"JOB_COMPLETION_INDEX": "0"}, Shard(1, 5)),
        ("auto/5", {"JOB_COMPLETION_INDEX": "4"}, Shard(5, 5)),
    ],
)
def test_shards_are_read_from_words_and_schedulers(text: str, environ: dict[str, str], expected: Shard) -> None:
    assert Shard.parse(text, environ) == expected


@pytest.mark.parametrize(
    ("text", "environ"),
    [
        ("0/4", {}),
        ("5/4", {}),
        ("1/0", {}),
        ("third", {}),
        ("auto", {}),
        ("auto", {"JOB_COMPLETION_INDEX": "1"}),
        ("auto/2", {"JOB_COMPLETION_INDEX": "2"}),
        ("auto", SLURM),
        ("auto", SLURM | {"SLURM_ARRAY_TASK_ID": "x"}),
    ],
)
def test_what_is_no_shard_is_said(text: str, environ: dict[str, str]) -> None:
    with pytest.raises(ConfigError) as caught:
        Shard.parse(text, environ)
    assert "--shard" in caught.value.hint


def test_folders_sort_by_number() -> None:
    assert [Shard(n, 12).folder for n in (2, 10)] == ["shard-02-of-12", "shard-10-of-12"]


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return make_data(tmp_path_factory.mktemp("shards") / "data", seeds=(17, 18, 21, 22))


@pytest.fixture(scope="module")
def spec(tmp_path_factory: pytest.TempPathFactory) -> str:
    return recorded(tmp_path_factory.mktemp("shards") / "answers.jsonl")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, dataset: Dataset, spec: str) -> Path:
    folder = tmp_path_factory.mktemp("shards") / "whole"
    finish(make_run(folder, dataset, spec))
    return folder


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory, dataset: Dataset, spec: str) -> list[Path]:
    folder = tmp_path_factory.mktemp("shards") / "parts"
    found: list[Path] = []
    for number in (1, 2, 3):
        run = make_run(folder / str(number), dataset, spec, shard=Shard(number, 3))
        finish(run)
        found.append(run.folder)
    return found


def _merge(out: Path, folders: list[Path], dataset: Dataset, spec: str) -> None:
    name, options = made_of(folders[0])
    merge_shards(out, folders, benchmark(dataset, spec), {"name": name, "options": dict(options)})


@pytest.mark.slow
def test_merged_shards_are_the_unsharded_run(
    tmp_path: Path, dataset: Dataset, spec: str, whole: Path, parts: list[Path]
) -> None:
    _merge(tmp_path / "merged", list(reversed(parts)), dataset, spec)
    assert outcome(tmp_path / "merged") == outcome(whole)
    for name in ("plan.json", "provenance.json"):
        assert (tmp_path / "merged" / name).read_bytes() == (whole / name).read_bytes()
    for name, key in (("contexts", "sample"), ("generate", "item"), ("rollout", "key")):
        merged, one = (RowStore(folder / f"{name}.jsonl", key).rows for folder in (tmp_path / "merged", whole))
        assert merged == one
    before = (tmp_path / "merged" / "rollout.jsonl").read_bytes()
    _merge(tmp_path / "merged", parts, dataset, spec)
    assert (tmp_path / "merged" / "rollout.jsonl").read_bytes() == before, "merging again adds nothing"


@pytest.mark.slow
def test_a_merged_run_goes_on_and_is_scored_like_any_other(
    tmp_path: Path, dataset: Dataset, spec: str, whole: Path, parts: list[Path]
) -> None:
    merged = tmp_path / "merged"
    done = CliRunner().invoke(app, ["bench", "merge", str(merged), *map(str, parts), "-o", "metrics=paper"])
    assert done.exit_code == 0, done.output
    assert "20 items of 3 shards" in done.output and "lampilot-paper-v1" in done.output
    assert outcome(merged) != outcome(whole)
    assert finish(make_run(merged, dataset, spec)) == outcome(whole), "the unsharded command finds nothing to do"
    again = CliRunner().invoke(app, ["bench", "merge", str(whole), str(whole)])
    assert again.exit_code == 0 and outcome(merged) == outcome(whole)


@pytest.mark.slow
def test_what_is_not_one_whole_run_is_not_merged(
    tmp_path: Path, dataset: Dataset, spec: str, whole: Path, parts: list[Path]
) -> None:
    out = tmp_path / "out"
    with pytest.raises(ConfigError, match="missing 2"):
        _merge(out, [parts[0], parts[2]], dataset, spec)
    with pytest.raises(ConfigError, match="twice 1"):
        _merge(out, [*parts, parts[0]], dataset, spec)
    with pytest.raises(ConfigError, match="number of shards"):
        _merge(out, [*parts[:2], whole], dataset, spec)
    with pytest.raises(DataError, match=r"plan\.json"):
        _merge(out, [tmp_path / "nowhere"], dataset, spec)

    other = make_run(tmp_path / "other", dataset, spec, items=12, shard=Shard(3, 3))
    with pytest.raises(ConfigError, match="config, planned differ"):
        _merge(out, [*parts[:2], other.folder], dataset, spec)

    begun = make_run(tmp_path / "begun", dataset, spec, shard=Shard(3, 3))
    with pytest.raises(DataError, match="begun is not finished"):
        _merge(out, [*parts[:2], begun.folder], dataset, spec)

    spoiled = tmp_path / "spoiled"
    spoiled.mkdir()
    for path in parts[2].iterdir():
        (spoiled / path.name).write_bytes(path.read_bytes())
    lines = (spoiled / "rollout.jsonl").read_bytes().splitlines(keepends=True)
    (spoiled / "rollout.jsonl").write_bytes(b"".join([lines[0][:40] + b"#" + lines[0][41:], *lines[1:]]))
    with pytest.raises(DataError, match="spoiled is not finished"):
        _merge(out, [*parts[:2], spoiled], dataset, spec)
    assert not (out / "results.jsonl").exists()


@pytest.mark.slow
def test_the_command_gives_each_shard_its_folder(tmp_path: Path, dataset: Dataset, spec: str) -> None:
    arguments = ["bench", "lampilot", "--data", str(dataset.path), "--planner", spec, "--out", str(tmp_path / "run")]
    arguments += ["--items", "3", "--workers", "1"]
    slurm = {"SLURM_ARRAY_TASK_ID": "11", "SLURM_ARRAY_TASK_MIN": "10", "SLURM_ARRAY_TASK_COUNT": "2"}
    for number in (1, 2):
        slurm["SLURM_ARRAY_TASK_ID"] = str(9 + number)
        done = CliRunner().invoke(app, [*arguments, "--shard", "auto"], env=slurm)
        assert done.exit_code == 0, done.output
        assert f"shard {number}/2" in done.output
    folders = sorted((tmp_path / "run").glob("shard-*"))
    assert [folder.name for folder in folders] == ["shard-1-of-2", "shard-2-of-2"]
    assert sum(len(json.loads((folder / "plan.json").read_text())["items"]) for folder in folders) == 3
    merged = CliRunner().invoke(app, ["bench", "merge", str(tmp_path / "run"), *map(str, folders)])
    assert merged.exit_code == 0, merged.output
    rows = [json.loads(line) for line in (tmp_path / "run" / "results.jsonl").read_text().splitlines()]
    assert len(rows) == 3
    bad = CliRunner().invoke(app, [*arguments, "--shard", "4/2"])
    assert bad.exit_code == 2


def test_a_run_of_an_earlier_version_is_refused_and_taken_over(tmp_path: Path, dataset: Dataset, spec: str) -> None:
    """Its plan does not say how the benchmark was made; else it is the same, and the same command goes on with it."""
    shard, whole = Shard(1, 1), tmp_path / "run"
    run = make_run(whole, dataset, spec, shard=shard, items=2)
    rows = finish(run)
    plan = json.loads((whole / "plan.json").read_text())
    del plan["made"]
    (whole / "plan.json").write_text(json.dumps(plan))
    refused = CliRunner().invoke(app, ["bench", "merge", str(tmp_path / "out"), str(whole)])
    assert refused.exit_code == 2 and "takes over what its shards have done" in " ".join(refused.output.split())
    assert finish(make_run(whole, dataset, spec, items=2)) == rows


def test_shards_of_any_benchmark_are_merged(tmp_path: Path) -> None:
    command = ["bench", "faithfulness", "--items", "2", "--workers", "1", "--out"]
    for shard in ("1/2", "2/2"):
        assert CliRunner().invoke(app, [*command, str(tmp_path / "run"), "--shard", shard]).exit_code == 0
    merged = CliRunner().invoke(app, ["bench", "merge", str(tmp_path / "out"), *map(str, (tmp_path / "run").iterdir())])
    assert merged.exit_code == 0, merged.output
    assert CliRunner().invoke(app, [*command, str(tmp_path / "whole")]).exit_code == 0
    assert outcome(tmp_path / "out") == outcome(tmp_path / "whole")
    changed = CliRunner().invoke(
        app, ["bench", "merge", str(tmp_path / "out"), str(tmp_path / "whole"), "-o", "items=3"]
    )
    assert changed.exit_code == 2 and "have changed" in " ".join(changed.output.split())
