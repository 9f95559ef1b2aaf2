"""A picture of how a decision forms: a row a step, a column a decision, easy first; the rows appear one by one."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Final

from chauffeur.planners.vilad.template import MASK, ActionTemplate
from chauffeur.planners.vilad.unmasking import UnmaskingStep

_CELL, _HIGH, _LEFT, _TOP = 74, 44, 74, 84
_SECONDS: Final = 0.8
"""A step of the animation."""
_FADES: Final = 0.3
"""Seconds in which a row appears."""


def unmasking_svg(
    template: ActionTemplate, steps: Sequence[UnmaskingStep], wish: str, names: Sequence[str], *, animated: bool = True
) -> str:
    """The SVG.

    Args:
        template: What was decided.
        steps: How, as `unmasking` gives it.
        wish: The words it was for.
        names: Of the candidates, the first of them "no spot".
        animated: Whether rows appear one after the other; without, all are there at once.
    """
    width = _LEFT + _CELL * len(template.slots) + 20
    height = _TOP + _HIGH * (len(steps) + 1) + 44
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}" '
        'font-family="sans-serif" font-size="13">',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
        f'<text x="20" y="30" font-size="17" font-weight="bold" fill="#1b2733">{escape(wish)}</text>',
        '<text x="20" y="50" fill="#5b6873">Masked diffusion: each row is a pass of the network; dark green is decided '
        "in that pass, with its confidence.</text>",
    ]
    for column, slot in enumerate(template.slots):
        x = _LEFT + _CELL * column + _CELL / 2
        out.append(f'<text x="{x}" y="{_TOP - 8}" text-anchor="middle" fill="#5b6873">{escape(slot.name)}</text>')
    rows = [template.canvas, *(step.row for step in steps)]
    for number, row in enumerate(rows):
        y = _TOP + _HIGH * number
        step = steps[number - 1] if number else None
        out.append("<g>")
        if animated and number:  # hidden by the animation alone: where none runs, in print or in a PNG, all is there
            begin = number * _SECONDS
            out.append(
                f'<animate attributeName="opacity" values="0;0;1" keyTimes="0;{begin / (begin + _FADES):.3f};1" '
                f'dur="{begin + _FADES:.1f}s" fill="freeze"/>'
            )
        label = f"pass {number}" if number else "start"
        out.append(f'<text x="20" y="{y + 26}" fill="#5b6873">{label}</text>')
        for column, slot in enumerate(template.slots):
            place = template.places[slot.name]
            out.append(_cell(template, column, y, int(row[place]), place, step, names))
        out.append("</g>")
    out.append(
        f'<text x="20" y="{height - 14}" fill="#5b6873">{len(steps)} passes for {len(template.slots)} decisions; '
        "words of the fixed pattern are left out. Simulated.</text></svg>"
    )
    return "\n".join(out) + "\n"


def _cell(
    template: ActionTemplate,
    column: int,
    y: int,
    token: int,
    place: int,
    step: UnmaskingStep | None,
    names: Sequence[str],
) -> str:
    x = _LEFT + _CELL * column
    new = step is not None and place in step.fixed
    if token == MASK:
        said, fill, ink = "?", "#e3e8ec", "#5b6873"
    else:
        said = template.words[token] if token < template.size else names[token - template.size]
        fill, ink = ("#1d7f55", "#ffffff") if new else ("#d8efe4", "#1b2733")
    sure = f"{100 * float(step.confidence[place]):.0f}%" if new and step is not None else ""
    middle, line = x + _CELL / 2, y + (21 if sure else 26)
    more = f'<text x="{middle}" y="{y + 35}" text-anchor="middle" font-size="10" fill="{ink}">{sure}</text>'
    return (
        f'<rect x="{x + 2}" y="{y + 3}" width="{_CELL - 4}" height="{_HIGH - 6}" rx="5" fill="{fill}"/>'
        f'<text x="{middle}" y="{line}" text-anchor="middle" font-size="12" fill="{ink}">{escape(said)}</text>'
        + (more if sure else "")
    )
