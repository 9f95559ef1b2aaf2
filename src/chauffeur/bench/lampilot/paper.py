"""Published results on LaMPilot-Bench (paper survey, Tab. IV), for reference beside ours.

They were measured by the paper's authors on 98 items (110 for the rows with human feedback), not on the items of a run
here. Columns: collision %, completion %, TTC, SV, TE and driving score in points.
"""

from __future__ import annotations

PaperRow = tuple[str, str, float, float, float, float, float, float]

TABLE_IV: tuple[PaperRow, ...] = (
    ("IDM", "-", 0.0, 20.4, 92.8, 80.9, 71.0, 17.3),
    ("MOBIL", "-", 0.0, 15.3, 82.8, 85.9, 46.7, 11.7),
    ("Human driver", "-", 0.0, 98.0, 93.4, 86.3, 81.3, 84.6),
    ("Llama 2", "0-shot", 0.0, 20.4, 92.8, 81.4, 68.9, 17.3),
    ("PaLM 2", "0-shot", 3.1, 35.7, 78.6, 76.5, 78.8, 12.8),
    ("ChatGPT", "0-shot", 1.0, 40.8, 83.9, 75.5, 74.0, 27.8),
    ("GPT-4", "0-shot", 4.1, 72.4, 61.3, 70.5, 74.0, 28.5),
    ("GPT-4 Turbo", "0-shot", 3.1, 74.5, 73.2, 70.1, 73.9, 39.1),
    ("Llama 2", "3-shot", 1.0, 63.3, 68.3, 71.4, 73.8, 39.6),
    ("PaLM 2", "3-shot", 3.1, 71.4, 73.4, 69.7, 72.0, 36.6),
    ("ChatGPT", "3-shot", 4.1, 83.7, 70.9, 73.7, 77.7, 41.2),
    ("GPT-4", "3-shot", 1.0, 84.7, 69.4, 72.0, 76.7, 55.9),
    ("GPT-4 Turbo", "3-shot", 1.0, 80.6, 69.1, 71.5, 74.9, 52.6),
    ("Llama 2", "human feedback", 0.9, 32.7, 83.9, 74.6, 74.6, 21.4),
    ("PaLM 2", "human feedback", 0.0, 45.5, 81.1, 74.4, 77.6, 35.6),
    ("ChatGPT", "human feedback", 0.9, 80.9, 70.2, 71.7, 77.5, 54.2),
    ("GPT-4", "human feedback", 0.9, 92.7, 67.6, 72.2, 76.8, 64.0),
    ("GPT-4 Turbo", "human feedback", 0.9, 87.3, 74.1, 73.4, 75.5, 60.5),
)


def items_behind(setting: str) -> int:
    """How many items a published row of this learning setting was measured on."""
    return 110 if setting == "human feedback" else 98
