"""A report's tables as LaTeX, for `\\input` into a paper: booktabs rules, everything escaped."""

from __future__ import annotations

from chauffeur.bench.report.model import BenchReport, Cell, Column, ReportLine, ReportTable
from chauffeur.bench.report.tables import number, said

_SPECIAL = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "$": r"\$",
    "&": r"\&",
    "#": r"\#",
    "%": r"\%",
    "_": r"\_",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"\textquotedbl{}",
    "\N{MINUS SIGN}": r"$-$",
    "\N{SUPERSCRIPT TWO}": r"$^2$",
}
_ARROWS = {"higher": r" $\uparrow$", "lower": r" $\downarrow$", "": ""}


def render_latex(report: BenchReport) -> str:
    """Every table of the report as a `table` environment, in one file."""
    head = (
        "% Made by chauffeur report. Needs \\usepackage{booktabs,graphicx} and \\usepackage[T1]{fontenc}.\n"
        f"% {_comment(report.title)}; {_comment(report.subtitle)}.\n"
    )
    return head + "\n".join(_table(table, report) for table in report.tables)


def escape(text: str) -> str:
    """Text that LaTeX sets as it is, on one line; signs outside Latin-1 become `?`, which no engine trips over."""
    flat = " ".join(text.split())
    return "".join(_SPECIAL.get(sign, sign if ord(sign) < 0x100 and sign.isprintable() else "?") for sign in flat)


def _comment(text: str) -> str:
    return " ".join(text.split()).encode("ascii", "replace").decode()


def _table(table: ReportTable, report: BenchReport) -> str:
    columns = table.columns
    header = " & ".join([escape(table.first), *(escape(c.title) + _ARROWS[c.better] for c in columns)])
    units = " & ".join(["", *(escape(c.unit) for c in columns)])
    body: list[str] = []
    for place, group in enumerate(table.groups):
        if place:
            body.append(r"\midrule")
        if group.heading:
            body.append(rf"\multicolumn{{{len(columns) + 1}}}{{l}}{{\emph{{{escape(group.heading)}}}}} \\")
        body.extend(_line(line, columns) for line in group.lines)
    notes = [f"Ruler {report.ruler}.", *table.notes]
    caption = " ".join(escape(text) for text in (table.caption + ".", *notes))
    return "\n".join(
        (
            r"\begin{table}[t]",
            rf"\caption{{{caption}}}",
            rf"\label{{tab:chauffeur-{table.id}}}",
            r"\centering\setlength{\tabcolsep}{4pt}",
            r"\resizebox{\textwidth}{!}{%",
            rf"\begin{{tabular}}{{l{'r' * len(columns)}}}",
            r"\toprule",
            rf"{header} \\",
            *([rf"{units} \\"] if any(c.unit for c in columns) else []),
            r"\midrule",
            *body,
            r"\bottomrule",
            r"\end{tabular}}",
            r"\end{table}",
            "",
        )
    )


def _line(line: ReportLine, columns: tuple[Column, ...]) -> str:
    name = escape(said(line.name, line.labels))
    if line.published:
        name = rf"\textit{{{name}}} (paper)"
    return " & ".join([name, *(_cell(cell, column) for cell, column in zip(line.cells, columns, strict=True))]) + r" \\"


def _cell(cell: Cell, column: Column) -> str:
    text = escape(cell.text)
    if cell.ends is not None:
        low, high = (escape(number(end, column.digits)) for end in cell.ends)
        text += rf" {{\scriptsize [{low}, {high}]}}"
    return text
