"""What the lmms-eval task calls: Chauffeur's loader, reader of answers and blind baseline, so that figures agree."""

from __future__ import annotations

import io
import os
from functools import lru_cache
from pathlib import Path
from typing import Any

from chauffeur.bench.nuplanqa.blind import blind_guesses
from chauffeur.bench.nuplanqa.choice import read_choice
from chauffeur.bench.nuplanqa.frames import FrameSource
from chauffeur.bench.nuplanqa.metadata import find_metadata, load_metadata
from chauffeur.bench.nuplanqa.questions import LETTERS, load_questions
from chauffeur.bench.pictures import read_picture


def rows() -> list[dict[str, Any]]:
    """One row a question, with the blind baseline's guess."""
    items = load_questions(_folder() / "questions.json").items
    guesses = blind_guesses(items) or [None] * len(items)
    return [
        {
            "id": item.id,
            "token": item.token,
            "subtask": item.subtask,
            "question": item.text(),
            "options": list(item.options),
            "answer": item.letter,
            "blind": None if guess is None else LETTERS[guess],
        }
        for item, guess in zip(items, guesses, strict=True)
    ]


def dataset(**_: Any) -> Any:
    """The test split for lmms-eval."""
    from datasets import Dataset, DatasetDict

    return DatasetDict({"test": Dataset.from_list(rows())})


def doc_to_visual(doc: dict[str, Any]) -> list[Any]:
    """Pictures, oldest first, in the order of the cameras."""
    from PIL import Image

    return [Image.open(io.BytesIO(read_picture(frame.path, 448))) for frame in _frames().paths(doc["token"])]


def doc_to_text(doc: dict[str, Any]) -> str:
    """The question, with what each picture is."""
    captions = "; ".join(frame.caption for frame in _frames().paths(doc["token"]))
    return f"Pictures, in this order: {captions}.\n\n{doc['question']}\n\nAnswer with the letter of the right option."


def process_results(doc: dict[str, Any], results: list[str]) -> dict[str, float]:
    """1 for the right letter, 0 for another or none; the same for the blind baseline's guess."""
    index = read_choice(results[0], doc["options"]).index
    right = index is not None and LETTERS[index] == doc["answer"]
    return {"nuplanqa_accuracy": float(right), "nuplanqa_blind": float(doc["blind"] == doc["answer"])}


def accuracy(values: list[float]) -> float:
    """Mean."""
    return sum(values) / len(values) if values else 0.0


def _folder() -> Path:
    return Path(os.environ["NUPLANQA_DATA"])


@lru_cache(maxsize=1)
def _frames() -> FrameSource:
    found = find_metadata(_folder())
    if found is None:
        raise FileNotFoundError(f"no metadata in {_folder()}")
    return FrameSource(Path(os.environ.get("NUPLANQA_IMAGES", _folder())), load_metadata(found))
