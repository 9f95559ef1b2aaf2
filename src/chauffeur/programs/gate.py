"""The static gate: reads a program and says what the language does not allow, before anything runs.

Its findings are written for the model that has to repair the program. It is a courtesy and a filter, not the security
boundary: that is the sandbox, which holds without it.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from chauffeur.programs.calls import CallChecks
from chauffeur.programs.catalogue import Vocabulary, apis_of
from chauffeur.programs.errors import ProgramSyntaxError
from chauffeur.programs.findings import Finding
from chauffeur.programs.lazy import lazy_findings
from chauffeur.programs.loops import loop_findings
from chauffeur.programs.lower import SEARCHES
from chauffeur.programs.nodes import all_nodes
from chauffeur.programs.rewrite import (
    bindings,
    binds,
    bound_names,
    called_name,
    generator_names,
    is_generator,
    main_function,
    own_nodes,
    parse,
    takes_nothing,
    top_level_generators,
    top_level_names,
    unix_lines,
)
from chauffeur.programs.syntax_checks import misplaced
from chauffeur.programs.words import (
    ALLOWED_NODES,
    ATTRIBUTE_REMEDIES,
    BUILTINS,
    MATH_NAMES,
    METHODS,
    NODE_REASONS,
    did_you_mean,
)

_MAX_FINDINGS: Final = 20
"""More do not help a model to repair a program."""

_MAX_COLLECTED: Final = 200
"""Beyond it the text is no honest attempt, and looking for similar names in it would take seconds."""


@dataclass(frozen=True, slots=True)
class GateReport:
    """What the gate thinks of a program.

    Attributes:
        findings: Everything found, errors and warnings, in line order.
        main: Name of the main function, None when there is none.
    """

    findings: tuple[Finding, ...]
    main: str | None

    @property
    def errors(self) -> tuple[Finding, ...]:
        """Findings that refuse the program."""
        return tuple(finding for finding in self.findings if finding.severity == "error")

    @property
    def passed(self) -> bool:
        """Whether the program may run."""
        return not self.errors


def check_source(source: str, library: str = "", vocabulary: Vocabulary = "road") -> GateReport:
    """Judge a program text. Never raises and never runs it. The verdict of a text judged before is remembered.

    Args:
        source: Program text.
        library: Helper functions the program may call with `yield from`; judged like the program.
        vocabulary: Which driving APIs there are where it is to drive.
    """
    return _judged(source, library, vocabulary)


@lru_cache(maxsize=512)
def _judged(source: str, library: str, vocabulary: Vocabulary) -> GateReport:
    text = unix_lines(source)
    try:
        tree = parse(text)
    except ProgramSyntaxError as error:
        return GateReport((Finding(error.line, "syntax", error.message, error.hint),), None)
    try:
        helpers, refused = _judged_library(library, vocabulary)
    except ProgramSyntaxError as error:
        return GateReport((Finding(None, "library", error.message, error.hint),), None)
    main = main_function(tree)
    findings = [*refused, *misplaced(text, tree)]
    findings += _Gate(tree, helpers, vocabulary).run()
    findings += _main_findings(tree, main)
    findings += loop_findings(tree)
    findings += lazy_findings(tree)
    unique = {(f.line, f.code, f.reason): f for f in findings}
    ordered = sorted(unique.values(), key=lambda finding: (finding.line or 0, finding.code))
    return GateReport(tuple(ordered[:_MAX_FINDINGS]), None if main is None else main.name)


@lru_cache(maxsize=64)
def _judged_library(library: str, vocabulary: Vocabulary) -> tuple[ast.Module, tuple[Finding, ...]]:
    """A library's tree and what refuses it. Raises ProgramSyntaxError."""
    text = unix_lines(library)
    helpers = parse(text, "library")
    return helpers, tuple(_library_findings(text, helpers, vocabulary))


def _library_findings(text: str, helpers: ast.Module, vocabulary: Vocabulary) -> list[Finding]:
    """What refuses a library: whatever refuses a program, and top-level names that a program could not do without."""
    found: list[Finding] = []
    for node in helpers.body:
        if not isinstance(node, ast.FunctionDef | ast.Import | ast.ImportFrom):
            found.append(Finding(node.lineno, "library", "a library holds functions only", "move it into a function"))
    for name in sorted(top_level_names(helpers) & BUILTINS):
        found.append(Finding(None, "library", f"{name} is a built-in function", "rename it"))
    found += misplaced(text, helpers)
    found += _Gate(helpers, ast.Module([], []), vocabulary).run() + loop_findings(helpers) + lazy_findings(helpers)
    return [
        Finding(None, "library", f"line {one.line or 1} of the library: {one.reason}", one.remedy)
        for one in found
        if one.severity == "error"
    ]


def _main_findings(tree: ast.Module, main: ast.FunctionDef | None) -> list[Finding]:
    if main is not None:
        return []
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    if not functions:
        return [
            Finding(
                None, "no-main", "the program defines no function", "write one generator function without parameters"
            )
        ]
    last = functions[-1]
    if is_generator(last) and not takes_nothing(last):
        return [
            Finding(
                last.lineno,
                "no-main",
                f"the main function {last.name} needs arguments",
                "a main function takes none; get the ego with get_ego_vehicle()",
            )
        ]
    return [
        Finding(
            last.lineno,
            "no-main",
            f"{last.name} never yields, so the car would never be driven",
            "yield autopilot() once per control period, e.g. `while True: yield autopilot()`",
        )
    ]


class _Gate:
    """One walk over a program's tree."""

    def __init__(self, tree: ast.Module, helpers: ast.Module, vocabulary: Vocabulary) -> None:
        self._tree = tree
        self._apis = apis_of(vocabulary)
        self._findings: list[Finding] = []
        self._bound = bound_names(tree)
        defined = self._bound | top_level_names(helpers)
        self._known = defined | self._apis.keys() | BUILTINS
        self._math = {"math"} | _aliases_of_math(tree)
        self._offered = top_level_generators(helpers)
        self._generators = generator_names(tree) | self._offered
        self._calls = CallChecks(tree, defined)

    def run(self) -> list[Finding]:
        delegated = {id(node.value) for node in all_nodes(self._tree) if isinstance(node, ast.YieldFrom)}
        called_by_delegation: set[int] = set()
        for node in all_nodes(self._tree):
            self._check_allowed(node)
            if isinstance(node, ast.Name):
                self._check_name(node)
            elif isinstance(node, ast.Attribute):
                self._check_attribute(node)
            elif isinstance(node, ast.Call):
                self._findings += self._calls.check(node)
                if id(node) in delegated:
                    called_by_delegation.add(id(node.func))
            elif isinstance(node, ast.Compare):
                self._findings += self._calls.check_comparison(node)
            elif isinstance(node, ast.Subscript | ast.BinOp):
                self._findings += self._calls.check_handle_use(node)
            elif isinstance(node, ast.Import | ast.ImportFrom):
                self._check_import(node)
            elif isinstance(node, ast.Constant):
                self._check_constant(node)
            elif isinstance(node, ast.YieldFrom):
                self._check_delegation(node)
            elif isinstance(node, ast.FunctionDef) and node.decorator_list:
                self._add(node, "not-allowed", "decorators are not part of the language", "leave them out")
        self._check_bindings()
        self._check_hidden_helpers()
        self._check_generator_uses(called_by_delegation)
        self._check_top_level()
        return self._findings

    def _add(self, node: ast.AST, code: str, reason: str, remedy: str) -> None:
        if len(self._findings) < _MAX_COLLECTED:
            self._findings.append(Finding(getattr(node, "lineno", None), code, reason, remedy))

    def _check_allowed(self, node: ast.AST) -> None:
        if isinstance(node, ALLOWED_NODES):
            return
        name = type(node).__name__
        reason, remedy = NODE_REASONS.get(type(node), (f"{name} is not part of the language", "leave it out"))
        if hasattr(node, "lineno"):  # parts of a refused statement have no line of their own
            self._add(node, "not-allowed", reason, remedy)

    def _check_name(self, node: ast.Name) -> None:
        if node.id.startswith("__"):
            self._add(node, "reserved", f"the name {node.id[:40]} is reserved", "use another name")
        elif isinstance(node.ctx, ast.Load) and node.id not in self._known:
            self._add(node, "unknown-name", f"{node.id[:60]} is not defined", self._remedy_for(node.id))

    def _remedy_for(self, name: str) -> str:
        if len(self._findings) >= _MAX_COLLECTED:
            return ""
        if name in {"open", "exec", "eval", "compile", "input", "globals", "locals", "getattr", "setattr", "vars"}:
            return "programs cannot reach files, the interpreter or other objects; use only the driving APIs"
        if name == "math":
            return "write `import math` first"
        return did_you_mean(name, self._known)

    def _check_attribute(self, node: ast.Attribute) -> None:
        attr = node.attr
        if attr.startswith("_"):
            self._add(node, "attribute", f"the attribute {attr[:40]} is private", "use only the driving APIs")
            return
        if isinstance(node.value, ast.Name) and node.value.id in self._math:
            if attr not in MATH_NAMES:
                self._add(node, "attribute", f"math has no {attr[:40]}", did_you_mean(attr, MATH_NAMES))
            return
        if isinstance(node.ctx, ast.Load) and attr in METHODS:
            return
        remedy = ATTRIBUTE_REMEDIES.get(attr, "vehicles and lanes have no attributes; use the driving APIs")
        if attr in self._apis:
            remedy = f"write {attr}(...)"
        self._add(node, "attribute", f"nothing here has an attribute {attr[:40]}", remedy)

    def _check_import(self, node: ast.Import | ast.ImportFrom) -> None:
        names = [alias.name for alias in node.names]
        modules = names if isinstance(node, ast.Import) else [node.module or ""]
        for module in modules:
            if module != "math":
                self._add(
                    node,
                    "import",
                    f"{module[:40] or 'a relative module'} cannot be imported",
                    "only math can be imported; the driving APIs are there without an import",
                )
                return
        if isinstance(node, ast.ImportFrom):
            for name in names:
                if name not in MATH_NAMES:
                    self._add(node, "import", f"math has no {name[:40]}", did_you_mean(name, MATH_NAMES))

    def _check_constant(self, node: ast.Constant) -> None:
        value = node.value
        if isinstance(value, str) and value.startswith(("veh:", "lane:")):
            self._add(
                node,
                "handle",
                "vehicles and lanes cannot be written down",
                "get them from get_ego_vehicle(), detect_front_vehicle_in() or get_lane_of()",
            )
        elif isinstance(value, bytes | complex):
            self._add(
                node, "not-allowed", f"{type(value).__name__} values are not part of the language", "leave it out"
            )

    def _check_delegation(self, node: ast.YieldFrom) -> None:
        value = node.value
        if isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.func.id in self._generators:
            return
        self._add(
            node,
            "yield-from",
            "`yield from` takes only a direct call of a generator function of this program or of the library",
            "write `yield from helper(...)`, or `yield autopilot()` inside a loop",
        )

    def _check_bindings(self) -> None:
        for node, name in bindings(self._tree):
            if name.startswith("__"):
                self._add(node, "reserved", f"the name {name[:40]} is reserved", "use another name")
            elif name in self._apis:
                self._add(node, "shadow", f"{name} is a driving API and cannot be redefined", "use another name")
            elif name in SEARCHES:
                self._add(node, "shadow", f"{name} is a built-in function and cannot be redefined", "rename it")
            elif name in self._generators and not (isinstance(node, ast.FunctionDef) and is_generator(node)):
                self._add(
                    node, "shadow", f"{name} is also the name of a generator function", "use another name for one"
                )

    def _check_hidden_helpers(self) -> None:
        """A function named like a helper hides it; one that then delegates to that name only calls itself."""
        for node in self._tree.body:
            if not isinstance(node, ast.FunctionDef) or node.name not in self._offered:
                continue
            own = list(own_nodes(node))
            if any(node.name in binds(inner) for inner in own):
                continue
            for inner in own:
                if isinstance(inner, ast.YieldFrom) and called_name(inner.value) == node.name:
                    self._add(
                        inner,
                        "shadow",
                        f"this {node.name} hides the library's function of that name and only calls itself",
                        "give your own function another name",
                    )

    def _check_generator_uses(self, called_by_delegation: set[int]) -> None:
        for node in all_nodes(self._tree):
            if not isinstance(node, ast.Name) or not isinstance(node.ctx, ast.Load):
                continue
            if node.id in self._generators and id(node) not in called_by_delegation:
                self._add(
                    node,
                    "generator-use",
                    f"{node.id} is a generator function; it can only be called as `yield from {node.id}(...)`",
                    f"write `yield from {node.id}(...)`; the main function is called for you",
                )

    def _check_top_level(self) -> None:
        early: list[ast.AST] = []
        for node in self._tree.body:
            if isinstance(node, ast.FunctionDef):
                early += [default for default in (*node.args.defaults, *node.args.kw_defaults) if default is not None]
            elif not isinstance(node, ast.AsyncFunctionDef | ast.ClassDef):
                early.append(node)
        for node in early:
            for inner in ast.walk(node):
                if isinstance(inner, ast.Call) and isinstance(inner.func, ast.Name) and inner.func.id in self._apis:
                    self._add(
                        inner,
                        "top-level",
                        f"{inner.func.id} is called outside a function, before the drive begins",
                        "move it into the main function",
                    )
        for node in all_nodes(self._tree):
            if isinstance(node, ast.Lambda) and any(
                isinstance(inner, ast.Yield | ast.YieldFrom) for inner in ast.walk(node.body)
            ):
                self._add(node, "not-allowed", "a lambda cannot yield", "use a function")
            if isinstance(node, ast.JoinedStr) and any(
                isinstance(inner, ast.Yield | ast.YieldFrom) for inner in ast.walk(node)
            ):
                self._add(node, "not-allowed", "a yield cannot stand inside an f-string", "assign it to a name first")


def _aliases_of_math(tree: ast.Module) -> set[str]:
    return {
        alias.asname or alias.name
        for node in all_nodes(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
        if alias.name == "math"
    }
