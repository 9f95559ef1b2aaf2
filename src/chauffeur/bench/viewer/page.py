"""The viewer's page: one HTML file with its style and script inside, served live or exported with all that it shows.

What the page asks for is told by keys (`rows ID`, `sample ID 3`). A server answers them; an exported file holds the
answers, the large ones compressed, and asks nobody.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
from collections.abc import Sequence
from importlib import resources
from itertools import combinations
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.report.build import LEAST_PICKED, PICKED_IN_ALL, Progress, untold
from chauffeur.bench.report.gallery import PICKED
from chauffeur.bench.report.pairs import ALL_PAIRS_UP_TO
from chauffeur.bench.viewer.content import Content
from chauffeur.driving.files import publish
from chauffeur.hmi.document import asset, content_hash, fill
from chauffeur.hmi.page import embed_json, page_assets

_STYLES: Final = ("scene.css", "trip.css", "panels.css")
"""Of the trip page, whose look the viewer shares."""
_SCRIPTS: Final = ("dom", "source", "tables", "list", "sample", "view")


def render_view() -> str:
    """The page as a server gives it: it asks for everything."""
    return _filled("", "; connect-src 'self'")


def inline_sources() -> tuple[str, ...]:
    """Hashes of all styles and scripts in the page, those of the drives that it shows among them."""
    return tuple(content_hash(text) for text in (*_assets(), *page_assets()))


def write_view(
    path: Path,
    content: Content,
    runs: Sequence[str],
    trips: Sequence[str],
    drives: int | Sequence[tuple[str, int]] | None,
    tell: Progress = untold,
) -> Path:
    """Write runs and trips as one self-contained file; it appears whole or not at all.

    Args:
        path: The `.html` file; its folder is made if need be.
        content: What is shown.
        runs: Ids of runs.
        trips: Ids of trips.
        drives: Drives of each run that are shown, of rows that are not as they should be, spread over groups and
            endings; None shares a page's worth among the runs. Or the very rows, as (run, place).
        tell: Is told how far it is.

    Raises:
        DataError: A run or trip cannot be read, or the file cannot be written.
        ConfigError: See Content.report.
    """
    index = content.index()
    answers: dict[str, Any] = {"index": index | {"folders": []}}
    packs: dict[str, Any] = {}
    benches: dict[str, list[str]] = {}
    for line in index["runs"]:
        if line["id"] in runs:
            benches.setdefault(str(line.get("bench")), []).append(line["id"])
    for name in ("runs", "trips"):
        answers["index"][name] = [line for line in index[name] if line["id"] in (*runs, *trips)]
    shown = "+".join(runs) if len(benches) == 1 else ""
    answers["opens"] = "#/" if trips or not shown else f"#/runs/{shown}"
    for number, name in enumerate(runs):
        tell("reading runs", number, len(runs))
        answers[f"report {name}"] = content.report(name)
        rows = content.rows(name)
        packs[f"rows {name}"] = rows
        packs[f"samples {name}"] = [content.sample(name, place) for place in range(len(rows["rows"]))]
    for alike in benches.values():
        ordered = [name for name in runs if name in alike]
        pairs = combinations(ordered, 2) if len(ordered) <= ALL_PAIRS_UP_TO else ()
        for names in {*pairs, tuple(ordered)}:
            key = "+".join(names)
            answers[f"report {key}"] = content.report(key)
            packs[f"matches {key}"] = content.matches(key)
    if drives is None or isinstance(drives, int):
        shared = min(PICKED, max(LEAST_PICKED, PICKED_IN_ALL // max(1, len(runs))))
        each = shared if drives is None else drives
        drives = [(name, place) for name in runs for place in content.chosen(name, each)]
    for number, (name, place) in enumerate(drives):
        tell("showing drives", number, len(drives))
        packs[f"drive {name} {place}"] = content.drive(name, place)
    for number, name in enumerate(trips):
        tell("reading trips", number, len(trips))
        packs[f"trip {name}"] = content.trip(name)
    blocks = [f'<script type="application/json" id="answers">{embed_json(answers)}</script>']
    blocks += [
        f'<script type="text/plain" data-pack="{html.escape(key)}">{_packed(value)}</script>'
        for key, value in packs.items()
    ]
    return publish(path, _filled("\n".join(blocks), "").encode(), "page")


def _packed(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":")).encode("utf-8", "replace")
    return base64.b64encode(gzip.compress(text, mtime=0)).decode()


def _assets() -> tuple[str, str]:
    style = "\n".join((*map(asset, _STYLES), _own("view.css")))
    script = "\n".join(_own(f"{name}.js") for name in _SCRIPTS)
    return style, f"(() => {{\n'use strict';\n{script}\n}})();"


def _own(name: str) -> str:
    return resources.files("chauffeur.bench.viewer").joinpath("assets", name).read_text(encoding="utf-8")


def _filled(data: str, more: str) -> str:
    style, script = _assets()
    styles, scripts = (
        f"{content_hash(own)} {content_hash(drive)}" for own, drive in zip((style, script), page_assets(), strict=True)
    )
    policy = f"default-src 'none'; img-src data:; style-src {styles}; script-src {scripts}{more}"
    return fill(_own("view.html"), {"policy": html.escape(policy), "style": style, "script": script, "data": data})
