"""One self-contained HTML page that plays a recorded trip: no build step, no server, no request to anywhere.

Three doors keep what people and models wrote inert: the trip travels as JSON in a data block with every `<` escaped,
the script sets text only through `textContent`, and a content security policy admits nothing but the page's own
style and script, by hash.
"""

from __future__ import annotations

import html
import json
from pathlib import Path
from typing import Any

from chauffeur.driving.files import publish
from chauffeur.driving.recording import RecordedTrip
from chauffeur.hmi.document import asset, content_hash, fill, printable
from chauffeur.hmi.payload import page_payload

_STYLES = ("scene.css", "trip.css", "panels.css")
_SCRIPTS = ("panels.js", "drawer.js", "stage.js", "charts.js", "player.js")


_OUTCOME = {"outcome": "label", "sign": "sign", "tone": "tone", "account": "account"}
"""Slots of the headline, and what fills them."""


def write_page(path: Path, recorded: RecordedTrip) -> Path:
    """Write the page of a trip; the file appears whole or not at all.

    Args:
        path: The `.html` file; its folder is made if need be.
        recorded: The trip.

    Raises:
        DataError: The file cannot be written.
    """
    return publish(path, render_page(recorded).encode(), "page")


def render_page(recorded: RecordedTrip, *, embedded: bool = False) -> str:
    """The page of a trip as text; an `embedded` one leaves out the name, which the page around it says."""
    payload = page_payload(recorded)
    style, script = page_assets()
    policy = f"default-src 'none'; img-src data:; style-src {content_hash(style)}; script-src {content_hash(script)}"
    return fill(
        asset("trip.html"),
        {
            "policy": html.escape(policy),
            "title": html.escape(f"“{printable(payload['wish'])}” – {payload['outcome']['label']}"),
            "wish": html.escape(printable(payload["wish"])),
            **{name: html.escape(printable(payload["outcome"][of])) for name, of in _OUTCOME.items()},
            "simulated": html.escape(payload["simulated"]),
            "look": "embedded" if embedded else "",
            "style": style,
            "script": script,
            "data": embed_json(payload),
        },
    )


def page_assets() -> tuple[str, str]:
    """Style and script of every trip's page."""
    script = "\n".join(asset(name) for name in _SCRIPTS)
    return "\n".join(asset(name) for name in _STYLES), f"(() => {{\n'use strict';\n{script}\n}})();"


def embed_json(value: Any) -> str:
    """JSON that cannot end the script element it stands in, nor begin another."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    # Lone surrogates are legal in a string and not in UTF-8.
    return text.encode("utf-8", "replace").decode()
