"""A data set of nine questions in NuPlanQA's format, one a subtask, with nuPlan's layout of pictures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from PIL import Image

from chauffeur.bench.nuplanqa.frames import CAMERAS
from chauffeur.bench.nuplanqa.questions import PREAMBLE, SUBTASKS, VqaItem

WORDS = {
    "Traffic Light": ("What do the lights show?", ("Red.", "Yellow.", "Green.", "There is none.")),
    "Weather/Lighting Conditions": ("What is the weather like?", ("Clear.", "Foggy.", "Rainy.", "Snowy.")),
    "Road Type/Conditions": ("How many lanes are there?", ("One.", "Two.", "Three.", "Four.")),
    "Surrounding Objects": ("Who is on the left?", ("A cyclist.", "A bus.", "A truck.", "Nobody.")),
    "Traffic Flow": ("How dense is traffic?", ("Empty.", "Light.", "Dense.", "Standing.")),
    "Key Objects": ("What matters most?", ("The lead car.", "A walker.", "The lamp.", "Nothing.")),
    "Ego-Vehicle Maneuver": ("What does the ego do?", ("It waits.", "It turns.", "It brakes.", "It speeds up.")),
    "Situation Assessment": ("What is going on?", ("A queue.", "A free road.", "A merge.", "A crossing.")),
    "Action Recommendation": ("What should it do?", ("Stop.", "Keep on.", "Slow down.", "Change lanes.")),
}


def questions() -> list[VqaItem]:
    """One a subtask; the right letter goes round."""
    return [
        VqaItem(
            id="",
            token=f"{place:016x}",
            previous=f"{place - 1:016x}" if place % 3 else "",
            subtask=subtask,
            split="test",
            preamble=PREAMBLE,
            speeds_mps=(5.3, 4.7, 4.0, 3.5, 2.8),
            steering_deg=(0.0, -0.1, 0.2, 0.4, 0.2),
            question=WORDS[subtask][0],
            options=WORDS[subtask][1],
            answer=place % 4,
        )
        for place, subtask in enumerate(SUBTASKS)
    ]


def write_set(folder: Path) -> Path:
    """Questions, metadata and pictures; the file of the questions."""
    items = questions()
    metadata: dict[str, Any] = {}
    for number, item in enumerate(items):
        cams = {}
        for camera in CAMERAS:
            path = f"part_0/{item.token}_{camera}.jpg"
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            Image.new("RGB", (32, 18), (20 * number, 90, 90)).save(folder / path)
            cams[camera] = {"data_path": path}
        metadata[item.token] = {"cams": cams, "prev": item.previous, "scenario": f"kind {number % 2}"}
    (folder / "metadata.json").write_text(json.dumps(metadata))
    path = folder / "questions.json"
    path.write_text(json.dumps([item.json() for item in items]))
    return path
