"""Fig. 17 as a picture: time over forward passes, ViLaD against its twin, one panel a task and size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

WIDE, HIGH, LEFT, TOP, COLUMNS = 250, 170, 44, 34, 4
MOST = 160
INK = {"twin": "#b3452f", "twin, KV": "#e08d3c", "ViLaD": "#2f6db3"}


def drawn(rows: Sequence[dict[str, Any]]) -> str:
    """An SVG of the rows of `vilad_speed.measured`: lines of ViLaD (prefix cache) over passes, the twin's as level."""
    many = len(rows)
    across, down = min(COLUMNS, many), math.ceil(many / COLUMNS)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{across * WIDE + 10}" height="{down * HIGH + 40}" '
        'font-family="sans-serif" font-size="10">',
        f'<rect width="{across * WIDE + 10}" height="{down * HIGH + 40}" fill="white"/>',
    ]
    for place, (name, ink) in enumerate(INK.items()):
        told = f"{name}, prefix cache" if name == "ViLaD" else name
        parts.append(f'<text x="{10 + 130 * place}" y="16" fill="{ink}" font-weight="bold">{told}</text>')
    parts.append('<text x="420" y="16" fill="#555">CPU ms of one thread over forward passes (log)</text>')
    for i, row in enumerate(rows):
        parts += _panel(row, (i % COLUMNS) * WIDE, 20 + (i // COLUMNS) * HIGH)
    return "\n".join([*parts, "</svg>"]) + "\n"


def _panel(row: dict[str, Any], x0: float, y0: float) -> list[str]:
    first, slots = float(row["one pass"]), max(2, int(row["decided"]))
    further = max(1e-6, (float(row["a pass a decision"]) - first) / (slots - 1))
    most_passes = min(MOST, slots)
    values = [first, first + further * (most_passes - 1), float(row["twin"]), float(row["twin, KV"])]
    low, high = math.log10(min(values) * 0.8), math.log10(max(values) * 1.25)
    wide, tall = WIDE - LEFT - 12, HIGH - TOP - 26

    def at(passes: float, ms: float) -> tuple[float, float]:
        right = math.log(passes) / math.log(most_passes)
        return x0 + LEFT + right * wide, y0 + TOP + (high - math.log10(ms)) / (high - low) * tall

    head = f"{row['task']}, {row['size']}, prompt {row['prompt']}"
    parts = [
        f'<text x="{x0 + LEFT}" y="{y0 + TOP - 8}">{head}</text>',
        f'<rect x="{x0 + LEFT}" y="{y0 + TOP}" width="{wide}" height="{tall}" fill="none" stroke="#ccc"/>',
    ]
    for name in ("twin", "twin, KV"):
        (x, y), (right, _) = at(1, float(row[name])), at(most_passes, float(row[name]))
        parts.append(
            f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{right:.1f}" y2="{y:.1f}" stroke="{INK[name]}" stroke-width="2"/>'
        )
        where = f'x="{x0 + LEFT - 4}" y="{y + 3:.1f}" text-anchor="end"'
        if name == "twin, KV":  # within the panel: the two are often close
            where = f'x="{x0 + LEFT + 4}" y="{y + 11:.1f}"'
        parts.append(f'<text {where} fill="{INK[name]}">{float(row[name]):.0f}</text>')
    points = " ".join("{:.1f},{:.1f}".format(*at(n, first + further * (n - 1))) for n in range(1, most_passes + 1))
    parts.append(f'<polyline points="{points}" fill="none" stroke="{INK["ViLaD"]}" stroke-width="2"/>')
    parts.append(f'<text x="{x0 + LEFT - 4}" y="{at(1, first)[1] + 3:.1f}" text-anchor="end">{first:.0f}</text>')
    ticks = sorted({1, 4, most_passes})
    for passes in ticks:
        parts.append(
            f'<text x="{at(passes, first)[0]:.1f}" y="{y0 + TOP + tall + 12}" text-anchor="middle">{passes}</text>'
        )
    return parts
