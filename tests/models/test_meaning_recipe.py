"""Weights of several stages become one network."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from chauffeur.concept import DataError

torch = pytest.importorskip("torch")

from chauffeur.models.meaning.recipe import CONFIG, WEIGHTS, mean_of  # noqa: E402


def stage(folder: Path, value: float, size: int = 3) -> Path:
    folder.mkdir()
    torch.save({"out.bias": torch.full((size,), value).half(), "step": torch.tensor(int(value))}, folder / WEIGHTS)
    (folder / CONFIG).write_text(json.dumps({"seed": int(value)}))
    return folder


def test_the_mean_of_stages_is_weighted_and_says_of_what_it_is(tmp_path: Path) -> None:
    first, last = stage(tmp_path / "first", 1.0), stage(tmp_path / "last", 5.0)
    mean_of({first: 0.25, last: 0.75}, tmp_path / "mean")
    held = torch.load(tmp_path / "mean" / WEIGHTS, weights_only=True)
    assert held["out.bias"].tolist() == [4.0, 4.0, 4.0]
    assert held["out.bias"].dtype == torch.float16
    assert int(held["step"]) == 5
    about = json.loads((tmp_path / "mean" / CONFIG).read_text())
    assert about == {"seed": 5, "mean_of": [["first", 0.25], ["last", 0.75]]}


def test_stages_of_other_shapes_or_shares_have_no_mean(tmp_path: Path) -> None:
    first, other = stage(tmp_path / "first", 1.0), stage(tmp_path / "other", 2.0, size=4)
    for stages in ({first: 0.5, other: 0.5}, {first: 0.5}):
        with pytest.raises(DataError, match="same parameters"):
            mean_of(stages, tmp_path / "mean")
    assert not (tmp_path / "mean").exists()
