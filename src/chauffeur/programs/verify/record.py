"""What the analysis notes while it walks a program for the last time."""

from __future__ import annotations

import ast
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from chauffeur.programs.catalogue import apis_of
from chauffeur.programs.verify.report import Argument, CallSite, LoopReport, LoopVerdict
from chauffeur.programs.verify.state import NEVER, WISHES, Pending
from chauffeur.programs.verify.values import TOP, Value, join

_WORSE: Final[dict[LoopVerdict, int]] = {"yields": 0, "bounded": 1, "unknown": 2, "endless": 3}


@dataclass(slots=True)
class _Site:
    name: str
    arguments: dict[str, Value]
    guarded: bool


@dataclass(slots=True)
class _Loop:
    node: ast.For | ast.While
    verdict: LoopVerdict
    passes: int | None
    reason: str


@dataclass(slots=True)
class Record:
    """Notes by place (`id` of a node).

    Attributes:
        visited: Statements that may be reached.
        effective: Wishes that may hold at the end of a control period, or that something asks for.
        replaced_by: Wishes that may come after a wish before the period ends.
        opposed: Lane wishes that always meet one to the other side within the period: (place, places before).
    """

    visited: set[int] = field(default_factory=set[int])
    effective: set[int] = field(default_factory=set[int])
    replaced_by: dict[int, set[int]] = field(default_factory=dict[int, set[int]])
    opposed: dict[int, frozenset[int]] = field(default_factory=dict[int, frozenset[int]])
    _sites: dict[int, _Site] = field(default_factory=dict[int, _Site])
    _nodes: dict[int, ast.expr] = field(default_factory=dict[int, ast.expr])
    _loops: dict[int, _Loop] = field(default_factory=dict[int, _Loop])
    _sides: dict[int, int] = field(default_factory=dict[int, int])

    def node(self, place: int) -> ast.expr:
        """The node of a call."""
        return self._nodes[place]

    def name(self, place: int) -> str:
        """The API called at a place."""
        return self._sites[place].name

    def call(self, node: ast.expr, name: str, arguments: dict[str, Value], *, guarded: bool) -> None:
        """A driving API may be called with these arguments."""
        place = id(node)
        self._nodes[place] = node
        site = self._sites.get(place)
        if site is None:
            self._sites[place] = _Site(name, dict(arguments), guarded)
            return
        if site.name != name:  # a variable that may be one API or another: each keeps a place of its own
            other = hash((place, name))
            self._sites[other] = _Site(
                name, dict.fromkeys((param.name for param in apis_of("town")[name].params), TOP), True
            )
            self._nodes[other] = node
            return
        site.guarded = site.guarded and guarded
        for param, value in arguments.items():
            known = site.arguments.get(param)
            site.arguments[param] = value if known is None else join(known, value)

    def wish(self, node: ast.expr, name: str, side: int, before: frozenset[int], *, certain: bool) -> None:
        """A wish is made.

        Args:
            node: The call.
            name: API name.
            side: For a lane that is surely to the left (-1) or right (1); 0 for any other.
            before: Places of wishes of its kind that may have been made last in this period.
            certain: Whether its effect is known to be seen only where `effective` says.
        """
        place = id(node)
        if not certain:
            self.effective.add(place)
        for other in before - {NEVER}:
            self.replaced_by.setdefault(other, set()).add(place)
        if name != "set_target_lane":
            return
        self._sides[place] = side if self._sides.get(place, side) == side else 0
        against = bool(before) and NEVER not in before and all(self._sides.get(o, 0) == -side != 0 for o in before)
        if against and place not in self.opposed:
            self.opposed[place] = before
        elif not against:
            self.opposed[place] = frozenset()

    def took_effect(self, pending: Pending | Iterable[frozenset[int]]) -> None:
        """The control period ends with these wishes."""
        for places in pending:
            self.effective |= places

    def loop(self, node: ast.For | ast.While, verdict: LoopVerdict, passes: int | None, reason: str) -> None:
        """What was found out of a loop in one of the ways it is come to; the worst of all counts."""
        known = self._loops.get(id(node))
        if known is None:
            self._loops[id(node)] = _Loop(node, verdict, passes, reason)
            return
        most = None if known.passes is None or passes is None else max(known.passes, passes)
        if _WORSE[verdict] > _WORSE[known.verdict]:
            known.verdict, known.reason = verdict, reason
        known.passes = most

    def unmet(self) -> list[int]:
        """Wishes that never hold when a control period ends, and that nothing asks for."""
        wishes = [place for place, site in self._sites.items() if site.name in WISHES and place in self._nodes]
        return [place for place in wishes if place not in self.effective and place in self.replaced_by]

    def calls(self, library: frozenset[int]) -> tuple[CallSite, ...]:
        """All calls, in line order; `library` holds the nodes that are not the program's."""
        found: list[CallSite] = []
        for place, site in self._sites.items():
            node = self._nodes[place]
            order = {param.name: index for index, param in enumerate(apis_of("town")[site.name].params)}
            given = sorted(site.arguments.items(), key=lambda item: order.get(item[0], 0))
            arguments = tuple(Argument(name, value) for name, value in given)
            found.append(
                CallSite(site.name, node.lineno, node.col_offset, arguments, site.guarded, id(node) in library)
            )
        return tuple(sorted(found, key=lambda one: (one.in_library, one.line, one.column, one.name)))

    def loops(self, library: frozenset[int]) -> tuple[LoopReport, ...]:
        """All loops, in line order."""
        found = [
            LoopReport(one.node.lineno, one.verdict, one.passes, one.reason, id(one.node) in library)
            for one in self._loops.values()
        ]
        return tuple(sorted(found, key=lambda one: (one.in_library, one.line)))
