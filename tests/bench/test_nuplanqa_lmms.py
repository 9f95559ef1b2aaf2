"""The lmms-eval task's functions, called as lmms-eval calls them."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest
from nuplanqa_data import write_set

FOLDER = Path(__file__).resolve().parents[2] / "examples" / "lmms_eval_nuplanqa"


def test_rows_pictures_and_scores(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_set(tmp_path)
    monkeypatch.setenv("NUPLANQA_DATA", str(tmp_path))
    spec = importlib.util.spec_from_file_location("lmms_utils", FOLDER / "utils.py")
    assert spec is not None and spec.loader is not None
    utils = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(utils)
    called = set(re.findall(r"!function utils\.(\w+)", (FOLDER / "nuplanqa.yaml").read_text()))
    assert called == {"dataset", "doc_to_visual", "doc_to_text", "process_results", "accuracy"}
    assert all(callable(getattr(utils, name)) for name in called)
    rows = utils.rows()
    assert len(rows) == 9 and [image.size for image in utils.doc_to_visual(rows[0])] == [(32, 18)] * 6
    assert "CAM_B0 (rear), now" in utils.doc_to_text(rows[0]) and "(d)" in utils.doc_to_text(rows[0])
    right = utils.process_results(rows[1], ["(b) because"])
    wrong = utils.process_results(rows[1], ["I cannot say."])
    assert (right["nuplanqa_accuracy"], wrong["nuplanqa_accuracy"]) == (1.0, 0.0)
    assert utils.accuracy([1.0, 0.0]) == 0.5
