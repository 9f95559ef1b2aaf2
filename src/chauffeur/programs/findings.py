"""What a check of a program found, in words that help to repair it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing found.

    Attributes:
        line: Program line (1-based), None when it concerns the whole text.
        code: Short stable name of the rule.
        reason: What is wrong.
        remedy: What would be right.
        severity: An error refuses the program, a warning does not.
    """

    line: int | None
    code: str
    reason: str
    remedy: str
    severity: Literal["error", "warning"] = "error"

    def __str__(self) -> str:
        where = "" if self.line is None else f"line {self.line}: "
        return f"{where}{self.reason}; {self.remedy}" if self.remedy else f"{where}{self.reason}"
