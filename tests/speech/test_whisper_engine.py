"""The local Whisper engine: a real CTranslate2 model goes through the real library. No weights that understand speech
are here, so how well Whisper hears is not tested; that the engine loads, decodes, judges and refuses is."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from chauffeur.concept import DataError
from chauffeur.speech.whisper import WhisperRecogniser, prompt_for, transcript

SOUND = np.random.default_rng(0).integers(-3000, 3000, size=16000).astype(np.int16)
AFTER = len(prompt_for("open")) + 4
"""Tokens before the answer: the mark of the prompt, a blank and its letters, the marks of the answer."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("ctranslate2", reason="needs the extra `speech`")
    pytest.importorskip("faster_whisper", reason="needs the extra `speech`")
    import tiny_whisper

    at = tmp_path_factory.mktemp("models") / "parrot"
    return tiny_whisper.make(at, "Please.Stop!", AFTER, np.random.default_rng(0))


def test_a_model_in_a_folder_is_loaded_and_asked(folder: Path) -> None:
    engine = WhisperRecogniser(folder, threads=1)
    assert engine.name == "whisper/parrot" and not engine.remote
    before = SOUND.copy()
    found = engine.recognise(SOUND)
    assert found.text == "Please.Stop!"
    assert found.confidence is not None and found.confidence > 0.9 and not found.to_confirm
    assert engine.recognise(SOUND) == found
    assert np.array_equal(SOUND, before)


def test_a_model_that_hesitates_has_to_be_confirmed(tmp_path: Path) -> None:
    pytest.importorskip("faster_whisper", reason="needs the extra `speech`")
    import tiny_whisper

    folder = tiny_whisper.make(tmp_path / "shy", "Please.Stop!", AFTER, np.random.default_rng(0), sure=0.95)
    found = WhisperRecogniser(folder, threads=1).recognise(SOUND)
    assert found.text == "Please.Stop!" and found.to_confirm
    assert found.confidence is not None and found.confidence < 0.6


def test_it_opens_no_connection_and_writes_no_file(folder: Path, tmp_path: Path) -> None:
    program = (
        "import sys, numpy as np\n"
        "from pathlib import Path\n"
        "from chauffeur.speech.whisper import WhisperRecogniser\n"
        "bad = []\n"
        "def see(event, args):\n"
        "    if event in ('socket.connect', 'socket.getaddrinfo'): bad.append(event)\n"
        "    if event == 'open' and isinstance(args[1], str) and set(args[1]) & set('wax+'): bad.append(args[0])\n"
        "sys.addaudithook(see)\n"
        f"engine = WhisperRecogniser(Path({str(folder)!r}), threads=1)\n"
        "print(engine.recognise(np.full(16000, 99, np.int16)).text, bad)\n"
    )
    environ = {**os.environ, "TMPDIR": str(tmp_path), "HOME": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env=environ, check=True)
    assert done.stdout.strip() == "Please.Stop! []"
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize("missing", ["model.bin", "config.json", "tokenizer.json"])
def test_a_folder_without_a_part_is_refused_before_anything_is_fetched(tmp_path: Path, missing: str) -> None:
    for name in {"model.bin", "config.json", "tokenizer.json"} - {missing}:
        (tmp_path / name).write_text("{}")
    with pytest.raises(DataError, match=missing):
        WhisperRecogniser(tmp_path)
    with pytest.raises(DataError, match="not a Whisper model"):
        WhisperRecogniser(tmp_path / "nowhere")


def test_a_broken_model_is_refused_in_words(folder: Path, tmp_path: Path) -> None:
    for file in folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes()[:-50_000] if file.suffix == ".bin" else file.read_bytes())
    with pytest.raises(DataError, match="cannot be loaded"):
        WhisperRecogniser(tmp_path)
    (tmp_path / "model.bin").write_bytes(b"no model")
    with pytest.raises(DataError, match="cannot be loaded"):
        WhisperRecogniser(tmp_path)


def test_segments_become_one_wish_as_sure_as_its_least_sure_part() -> None:
    found = transcript([(" Command, slow down", -0.1, 0.0), (" to 60.", -0.7, 0.0)])
    assert found.text == "Command, slow down to 60." and found.to_confirm
    assert found.confidence == pytest.approx(np.exp(-0.7))
    assert not transcript([("Command, slow down.", -0.05, 0.0)]).to_confirm


def test_silence_is_not_a_wish() -> None:
    assert transcript([(" Thank you.", -1.4, 0.9)]).text == ""
    assert transcript([]).reason and transcript([("  ", -0.1, 0.0)]).reason
    assert transcript([(" Stop.", -0.2, 0.9)]).text == "Stop."
