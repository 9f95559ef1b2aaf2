"""Reads what a program does: its statements are followed once each, with values that are only partly known.

Functions are put in where they are called. Of a branch both ways are followed, of a loop one turn; what a statement
depends on (the tests around it, the loops before it that wait for something) goes with what it does.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Final

from chauffeur.programs.extract import parse_quietly
from chauffeur.programs.rewrite import main_function
from chauffeur.safety.faithfulness.evaluator import ExpressionEvaluator
from chauffeur.safety.faithfulness.facts import Facts
from chauffeur.safety.faithfulness.frames import MeaningFrame, count_of, joined, only_waits, settled, turns_of, under
from chauffeur.safety.faithfulness.notes import PERIOD_S, TooMuchError
from chauffeur.safety.faithfulness.values import NOTHING, Term, TracedValue, combined, either

_MAX_CHARS: Final = 100_000


@lru_cache(maxsize=64)
def read_facts(source: str, library: str = "") -> Facts:
    """What a program does, as far as reading tells; never raises on bad programs. One read before is remembered."""
    if len(source) + len(library) > _MAX_CHARS:
        return Facts(readable=False)
    helpers, program = parse_quietly(library), parse_quietly(source)
    if helpers is None or program is None:
        return Facts(readable=False)
    try:
        main = main_function(program)
        return Facts(readable=False) if main is None else _Tracer(helpers, program).facts(main.name)
    except (RecursionError, MemoryError, TooMuchError):
        return Facts(readable=False)


class _Tracer(ExpressionEvaluator):
    def __init__(self, library: ast.Module, program: ast.Module) -> None:
        super().__init__()
        self._foreign = {id(node) for node in ast.walk(library)}
        self._module = MeaningFrame({})
        for tree in (library, program):
            self._block(tree.body, self._module)

    def facts(self, main: str) -> Facts:
        found = self._module.names.get(main, NOTHING)
        for function in found.functions[:1]:
            self._call(function, (), {}, self._module, waits=True)
        return self._noted()

    def _block(self, body: Sequence[ast.stmt], frame: MeaningFrame) -> bool:
        """Follow statements; True when what comes after them is not reached from here."""
        for statement in body:
            self._count()
            if id(statement) not in self._foreign:
                self._line = statement.lineno
            if self._statement(statement, frame):
                return True
        return False

    def _statement(self, node: ast.stmt, frame: MeaningFrame) -> bool:
        match node:
            case ast.Expr(value=value):
                self._value(value, frame)
            case ast.Assign(targets=targets, value=value):
                self._assign(targets, value, frame)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._assign([target], value, frame)
            case ast.AugAssign(target=ast.Name(id=name), op=op, value=value):
                now = combined(frame.find(name) or NOTHING, op, self._value(value, frame))
                self._bind(name, either([frame.find(name) or NOTHING, now]), frame)
            case ast.FunctionDef(name=name):
                frame.names[name] = TracedValue(functions=(node,))
                self._homes[id(node)] = frame
            case ast.If():
                return self._if(node, frame)
            case ast.While():
                self._while(node, frame)
            case ast.For():
                self._for(node, frame)
            case ast.Return(value=value):
                result = NOTHING if value is None else self._value(value, frame)
                frame.returned.append(replace(result, tags=result.tags | frame.depends))
                return True
            case ast.Break():
                if self._way_out:
                    self._way_out[-1] |= frame.active
                return True
            case ast.Continue() | ast.Raise():
                return True
            case ast.Try(body=body, handlers=handlers, orelse=orelse, finalbody=final):
                done = self._block(body, frame)
                for handler in handlers:
                    self._block(handler.body, frame)
                self._block(orelse, frame)
                return self._block(final, frame) or (done and not handlers)
            case ast.With(body=body):
                return self._block(body, frame)
            case _:
                pass
        return False

    def _assign(self, targets: Sequence[ast.expr], value: ast.expr, frame: MeaningFrame) -> None:
        found = self._value(value, frame)
        for target in targets:
            self._store(target, found, frame)

    def _if(self, node: ast.If, frame: MeaningFrame) -> bool:
        test = self._value(node.test, frame)
        never, always = settled(node.test)
        before, at = dict(frame.names), self._at
        first = second = False
        with under(frame, test.tags):
            if not never:
                first = self._block(node.body, frame)
            after, moved = dict(frame.names), self._at
            frame.names, self._at = dict(before), at
            if not always:
                second = self._block(node.orelse, frame)
        if first and not second:
            names, self._at = [frame.names], self._at
        elif second and not first:
            names, self._at = [after], moved
        else:
            names, self._at = [after, frame.names], self._at | moved
        frame.names = joined(names)
        if first != second:
            frame.gates |= test.tags
        return first and second

    def _while(self, node: ast.While, frame: MeaningFrame) -> None:
        test = self._value(node.test, frame)
        times = count_of(node.test, lambda one: self._constants(one, frame))
        before, at = dict(frame.names), self._at
        self._repeats.append(0 if times is None else times)
        self._way_out.append(set())
        with under(frame, test.tags):
            self._block(node.body, frame)
        ways = self._way_out.pop()
        self._repeats.pop()
        frame.names = joined([before, frame.names])
        self._at = self._at | at
        again = self._value(node.test, frame)
        frame.gates |= test.tags | again.tags | ways
        self._block(node.orelse, frame)

    def _for(self, node: ast.For, frame: MeaningFrame) -> None:
        iterated = self._value(node.iter, frame)
        times = turns_of(node.iter, lambda one: self._constants(one, frame))
        if times is not None:
            self._spans.append(times * PERIOD_S)
        waits = times is not None and all(only_waits(statement) for statement in node.body)
        before, at = dict(frame.names), self._at
        member = either(iterated.items) if iterated.items else replace(iterated, terms=frozenset())
        self._store(node.target, member, frame)
        self._repeats.append(int(times) if times is not None else 1 if iterated.crossing else 0)
        self._way_out.append(set())
        self._block(node.body, frame)
        ways = self._way_out.pop()
        self._repeats.pop()
        if waits and times is not None:
            self._do("wait", frame, TracedValue(frozenset({Term("", 0.0, times * PERIOD_S)})))
        frame.names = joined([before, frame.names])
        self._at = self._at | at
        frame.gates |= ways
        self._block(node.orelse, frame)
