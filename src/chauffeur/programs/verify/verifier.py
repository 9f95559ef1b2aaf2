"""Verification of a whole program: from its text to what it can ask for, how its loops end, and what it never does."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import lru_cache

from chauffeur.programs.catalogue import apis_of
from chauffeur.programs.errors import ProgramSyntaxError
from chauffeur.programs.nodes import all_nodes
from chauffeur.programs.rewrite import main_function, parse, unix_lines
from chauffeur.programs.verify.circumstances import ANYWHERE, Circumstances
from chauffeur.programs.verify.expressions import TooIntricateError
from chauffeur.programs.verify.interpret import Interpreter
from chauffeur.programs.verify.record import Record
from chauffeur.programs.verify.report import Argument, CallSite, LoopReport, Verification, VerificationNote
from chauffeur.programs.verify.state import WISHES
from chauffeur.programs.verify.values import TOP


@lru_cache(maxsize=256)
def verify(source: str, library: str = "", where: Circumstances = ANYWHERE) -> Verification:
    """Find out, without running it, what a program of the language can do. A program verified before is remembered.

    Sound for programs that the static gate accepts: whatever a driving API is given while the program runs is in the
    reported set of that call, no reported line is ever reached, and no loop said to yield or to end goes on for ever
    within a control period. Programs that the gate refuses may get a report, but no promise.

    Args:
        source: Program text.
        library: Helper functions it may call with `yield from`.
        where: The road and the ego on it when the program begins.

    Raises:
        ProgramSyntaxError: One of the texts is no program, or there is no main function.
    """
    program, helpers = parse(unix_lines(source)), parse(unix_lines(library), "library")
    main = main_function(program)
    if main is None:
        raise ProgramSyntaxError("The program has no main function.")
    in_library = frozenset(map(id, all_nodes(helpers)))
    try:
        interpreter = Interpreter(helpers, program, where)
        interpreter.run(main)
    except (TooIntricateError, RecursionError) as error:
        why = str(error) if isinstance(error, TooIntricateError) else "the program is nested too deeply"
        return _unverified((helpers, program), in_library, why)
    record = interpreter.record
    unreached = list(_unreached(program.body, record, "the program fails before"))
    lines = sorted({line for _, statements, _ in unreached for line in _lines(statements)})
    return Verification(
        calls=record.calls(in_library),
        loops=record.loops(in_library),
        notes=tuple(sorted((*_never(unreached), *_wishes(record, in_library)), key=lambda note: note.line)),
        unreachable=tuple(lines),
    )


def _unverified(trees: Sequence[ast.Module], in_library: frozenset[int], why: str) -> Verification:
    """What can be said of a program that was not followed to its end: it may call whatever its text names."""
    calls: list[CallSite] = []
    loops: list[LoopReport] = []
    for tree in trees:
        for node in all_nodes(tree):
            if isinstance(node, ast.Name) and node.id in apis_of("town"):
                arguments = tuple(Argument(param.name, TOP) for param in apis_of("town")[node.id].params)
                calls.append(CallSite(node.id, node.lineno, node.col_offset, arguments, True, id(node) in in_library))
            elif isinstance(node, ast.For | ast.While):
                loops.append(LoopReport(node.lineno, "unknown", None, why, id(node) in in_library))
    return Verification(tuple(calls), tuple(loops), complete=False, problem=why)


# What is never reached ---------------------------------------------------------------------------------------------

_Unreached = tuple[ast.stmt, Sequence[ast.stmt], str]
"""(first statement, the rest of its block with it, why)."""


def _unreached(block: Sequence[ast.stmt], record: Record, why: str) -> Iterator[_Unreached]:
    """The first statement of every stretch that is not reached; `why` holds for the block's own first statement."""
    for index, statement in enumerate(block):
        if id(statement) not in record.visited:
            yield statement, block[index:], why
            return
        yield from _unreached_inside(statement, record)
        why = _why_not_after(statement)


def _unreached_inside(statement: ast.stmt, record: Record) -> Iterator[_Unreached]:
    match statement:
        case ast.FunctionDef(body=body, name=name):
            yield from _unreached(body, record, f"{name} is never called")
        case ast.If(body=body, orelse=orelse):
            yield from _unreached(body, record, f"the condition in line {statement.lineno} is never true here")
            yield from _unreached(orelse, record, f"the condition in line {statement.lineno} is always true here")
        case ast.While(body=body, orelse=orelse):
            yield from _unreached(body, record, f"the condition in line {statement.lineno} is never true here")
            yield from _unreached(orelse, record, f"the loop in line {statement.lineno} never ends by its condition")
        case ast.For(body=body, orelse=orelse):
            yield from _unreached(body, record, f"the loop in line {statement.lineno} has nothing to walk")
            yield from _unreached(orelse, record, f"the loop in line {statement.lineno} is always left before")
        case ast.Try(body=body, handlers=handlers, orelse=orelse, finalbody=finalbody):
            yield from _unreached(body, record, "it is not reached")
            for handler in handlers:
                yield from _unreached(handler.body, record, "it is not reached")
            yield from _unreached(orelse, record, f"the block in line {statement.lineno} is always left before")
            yield from _unreached(finalbody, record, "it is not reached")
        case _:
            pass


def _why_not_after(statement: ast.stmt) -> str:
    line = statement.lineno
    match statement:
        case ast.Return() | ast.Raise():
            return f"the function is left in line {line}"
        case ast.Break() | ast.Continue():
            return f"the pass through the loop ends in line {line}"
        case ast.While() | ast.For():
            return f"the loop in line {line} never comes to an end"
        case ast.Expr(value=ast.YieldFrom()):
            return f"what is called in line {line} never comes to an end"
        case ast.If() | ast.Try():
            return f"every way through line {line} leads elsewhere"
        case _:
            return f"line {line} never comes to an end"


def _lines(statements: Sequence[ast.stmt]) -> Iterator[int]:
    for statement in statements:
        for node in ast.walk(statement):
            if isinstance(node, ast.stmt):
                yield node.lineno


def _never(unreached: Sequence[_Unreached]) -> Iterator[VerificationNote]:
    for first, statements, why in unreached:
        wishes = [
            node
            for statement in statements
            for node in ast.walk(statement)
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in WISHES
        ]
        if wishes:
            for call in wishes:
                assert isinstance(call.func, ast.Name)
                yield VerificationNote(call.lineno, "unreachable", f"The wish {call.func.id} is never reached: {why}.")
        else:
            yield VerificationNote(first.lineno, "unreachable", f"This is never reached: {why}.", wish=False)


# Wishes that come to nothing ---------------------------------------------------------------------------------------


def _wishes(record: Record, in_library: frozenset[int]) -> Iterator[VerificationNote]:
    for place in record.unmet():
        node = record.node(place)
        others = sorted({record.node(other).lineno for other in record.replaced_by[place]})
        by = " or ".join(f"line {line}" for line in others)
        yield VerificationNote(
            node.lineno,
            "overwritten",
            f"The wish {record.name(place)} never takes effect: {by} wishes otherwise before the next yield.",
            in_library=id(node) in in_library,
        )
    for place, before in record.opposed.items():
        if before:
            node = record.node(place)
            lines = " or ".join(f"line {record.node(other).lineno}" for other in sorted(before))
            yield VerificationNote(
                node.lineno,
                "both-sides",
                f"Two lanes are wished in one control period: {lines} wishes one to the other side.",
                in_library=id(node) in in_library,
            )
