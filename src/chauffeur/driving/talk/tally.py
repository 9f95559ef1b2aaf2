"""What control did in a drive, counted for its end: changes of the shield, bounds, fallbacks, punctuality."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from chauffeur.concept import Intervention
from chauffeur.driving.live.messages import FallbackLevel, Report
from chauffeur.driving.live.supervisor import Runtime


@dataclass(slots=True)
class Tally:
    """Filled from control's reports, one a control period.

    Attributes:
        changes: What the shield changed.
        clipped: Control periods in which a set-point was held within a bound, by the bound.
        levels: Control periods on each fallback level.
        figures: Punctuality as control told it at the end; None where it could not.
        last: The newest report.
        lost_reports: Reports that were never heard.
        trouble: Last words of a control process that died.
    """

    changes: list[Intervention] = field(default_factory=list[Intervention])
    clipped: Counter[str] = field(default_factory=Counter[str])
    levels: Counter[FallbackLevel] = field(default_factory=Counter[FallbackLevel])
    figures: Mapping[str, Any] | None = None
    last: Report | None = None
    lost_reports: int = 0
    trouble: str = ""

    def add(self, report: Report) -> None:
        """Count one control period."""
        self.changes += report.interventions
        self.clipped.update(report.clipped)
        self.levels[report.level] += 1
        self.last = report

    def end(self, runtime: Runtime, *, died: bool) -> None:
        """Ask for what is known only at the end, while the runtime's files are there."""
        self.figures, self.lost_reports = runtime.figures(), runtime.lost_reports
        if died:
            self.trouble = _last_words(runtime)


def _last_words(runtime: Runtime) -> str:
    """The last line control has left in its log."""
    try:
        lines = (runtime.folder / "control.log").read_text(errors="replace").strip().splitlines()
    except OSError:
        return ""
    return lines[-1] if lines else ""
