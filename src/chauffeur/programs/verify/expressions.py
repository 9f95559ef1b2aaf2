"""What an expression of a program can come to, and what its evaluation changes."""

from __future__ import annotations

import ast
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Final, NamedTuple, NoReturn

from chauffeur.programs.catalogue import apis_of
from chauffeur.programs.verify import arithmetic
from chauffeur.programs.verify.circumstances import Circumstances
from chauffeur.programs.verify.compare import compared
from chauffeur.programs.verify.frames import CallFrame
from chauffeur.programs.verify.iteration import Walked, range_of
from chauffeur.programs.verify.record import Record
from chauffeur.programs.verify.scopes import FunctionNode, Scopes
from chauffeur.programs.verify.state import State, joined, widened
from chauffeur.programs.verify.values import (
    ANY_TEXT,
    CALLABLE,
    FALSE,
    FUNCTION,
    INT,
    NONE,
    NOTHING,
    NUMERIC,
    OBJECT,
    TEXT,
    TOP,
    TRUE,
    TUPLE,
    UNKNOWN,
    Value,
    constant,
    fresh,
    join_all,
    may_be_false,
    may_be_true,
    number,
    where_false,
    where_true,
)

MAX_STEPS: Final = 20_000
"""Nodes looked at before the analysis gives up; an intricate program of two hundred lines takes three thousand."""

_ANY_INTEGER: Final = number(-math.inf, math.inf, INT)


MATH_MODULE: Final = Value(OBJECT | FUNCTION, callees=frozenset({("module", "math")}))
"""The module `math`."""


class TooIntricateError(Exception):
    """The analysis gives up."""


class DeadEndError(Exception):
    """No way leads past this point."""


class Branch(NamedTuple):
    """How a test can come out: the states behind it, and its value."""

    true: State | None
    false: State | None
    value: Value


class Loop:
    """A loop that is being walked.

    Attributes:
        breaks, continues: States at its `break` and `continue`.
        grown: Places whose objects may grow while it runs; None for all.
        exits: What may have ended it other than its own test: yields, raised errors, calls that are not followed.
    """

    __slots__ = ("breaks", "continues", "exits", "grown")

    def __init__(self) -> None:
        self.breaks: list[State] = []
        self.continues: list[State] = []
        self.grown: set[int] | None = set()
        self.exits = 0


class Expressions(ABC):
    """Evaluates expressions in a present state. Calls of the program's own functions are the subclass's.

    Attributes:
        state: The present point.
        record: Where findings go, in the last pass through everything around.
    """

    def __init__(self, scopes: Scopes, module: CallFrame, where: Circumstances) -> None:
        self.state = State({})
        self.record = Record()
        self.frame = module
        self.scopes = scopes
        self.where = where
        self.recording = True
        self.is_open = False
        self.loops: list[Loop] = []
        self.errors: list[State | None] = []
        self.guards = 0
        self._steps = 0
        self._settled: dict[tuple[int, int], tuple[State, State]] = {}
        self._frames: dict[tuple[int, ...], CallFrame] = {}
        self._handlers: dict[type[ast.expr], Callable[[Any], Value]] = {
            ast.Constant: lambda node: constant(node.value),
            ast.Name: self._name,
            ast.BinOp: self._binary,
            ast.UnaryOp: self._unary,
            ast.BoolOp: self._both_or_either,
            ast.Compare: self._compare,
            ast.IfExp: self._conditional,
            ast.NamedExpr: self._walrus,
            ast.Call: self.call,
            ast.Attribute: self._attribute,
            ast.Subscript: self._subscript,
            ast.Slice: self._parts,
            ast.Starred: self._parts,
            ast.JoinedStr: self._text,
            ast.FormattedValue: self._text,
            ast.Tuple: self._tuple,
            ast.List: self._container,
            ast.Set: self._container,
            ast.Dict: self._container,
            ast.ListComp: self._comprehension,
            ast.SetComp: self._comprehension,
            ast.GeneratorExp: self._comprehension,
            ast.DictComp: self._comprehension,
            ast.Lambda: self._lambda,
            ast.Yield: self._yield,
            ast.YieldFrom: lambda node: self.eval(node.value),
        }

    @abstractmethod
    def call(self, node: ast.Call) -> Value:
        """The result of a call."""

    @abstractmethod
    def returns_apart(self, node: ast.Call) -> tuple[State | None, State | None] | None:
        """The states in which the call just made returned true, and false; None where it was not followed."""

    @abstractmethod
    def let_loose(self, function: FunctionNode) -> None:
        """A function may be called from anywhere, with anything."""

    def eval(self, node: ast.expr) -> Value:
        """The value of an expression. Raises DeadEndError, TooIntricateError."""
        self._steps += 1
        if self._steps > MAX_STEPS:
            raise TooIntricateError("the program takes too many steps to follow")
        handler = self._handlers.get(type(node))
        if handler is None:
            raise TooIntricateError(f"line {node.lineno} has what the language does not know")
        return handler(node)

    def dead_end(self) -> NoReturn:
        """Nothing leads on from here."""
        raise DeadEndError

    # Variables -------------------------------------------------------------------------------------------------

    def store(self, name: str, value: Value) -> None:
        """Bind a name."""
        place = self.frame.place(name)
        if isinstance(place, tuple):
            self.state.bind(place, value)
            self.note_error()

    def note_error(self) -> None:
        """The present state is one an error may be raised in."""
        for index, known in enumerate(self.errors):
            self.errors[index] = joined(known, self.state)

    def _name(self, node: ast.Name) -> Value:
        place = self.frame.place(node.id)
        if place is None:
            return self._outer_name(node)
        if isinstance(place, CallFrame):
            for function in place.scope.functions.get(node.id, ()):
                self.let_loose(function)
            return TOP
        value = self.state.variables.get(place, TOP)
        if not value.callees:
            return value
        own = [callee for callee in value.callees if callee[0] == "own"]
        for callee in own:  # held as a value, it may be called anywhere
            self.let_loose(callee[1])
        for callee in value.callees:
            if callee[0] == "api":
                self._loose_api(node, callee[1])
        return value._replace(callees=(value.callees - frozenset(own)) | {UNKNOWN}) if own else value

    def _outer_name(self, node: ast.Name) -> Value:
        if node.id in apis_of("town"):
            self._loose_api(node, node.id)
            return Value(FUNCTION, callees=frozenset({("api", node.id)}))
        return Value(FUNCTION, callees=frozenset({("builtin", node.id)}))

    def _loose_api(self, node: ast.Name, name: str) -> None:
        """A driving API held as a value: whoever calls it may give it anything."""
        if self.recording:
            self.record.call(
                node, name, dict.fromkeys((param.name for param in apis_of("town")[name].params), TOP), guarded=True
            )

    def _walrus(self, node: ast.NamedExpr) -> Value:
        value = self.eval(node.value)
        assert isinstance(node.target, ast.Name)
        self.store(node.target.id, value)
        return value

    # Operators -------------------------------------------------------------------------------------------------

    def _binary(self, node: ast.BinOp) -> Value:
        left, right = self.eval(node.left), self.eval(node.right)
        if left.bits == OBJECT == right.bits:  # two lists make a third
            return fresh(id(node))
        return arithmetic.binary(node.op, left, right)

    def _unary(self, node: ast.UnaryOp) -> Value:
        value = self.eval(node.operand)
        if isinstance(node.op, ast.Not):
            return Value((FALSE if may_be_true(value) else 0) | (TRUE if may_be_false(value) else 0))
        if not value.bits & NUMERIC:
            return TOP
        if isinstance(node.op, ast.USub):
            return arithmetic.negative(value)
        return arithmetic.as_number(value) if isinstance(node.op, ast.UAdd) else _ANY_INTEGER

    def _both_or_either(self, node: ast.BoolOp) -> Value:
        stops = isinstance(node.op, ast.Or)
        results: list[Value] = []
        states: list[State | None] = []
        for index, operand in enumerate(node.values):
            try:
                if index == len(node.values) - 1:
                    results.append(self.eval(operand))
                    states.append(self.state)
                    break
                true, false, value = self.branch(operand)
            except DeadEndError:
                if not states:
                    raise
                break
            out, on = (true, false) if stops else (false, true)
            if out is not None:
                results.append(where_true(value) if stops else where_false(value))
                states.append(out)
            if on is None:
                break
            self.state = on
        return self._meet(results, states)

    def _conditional(self, node: ast.IfExp) -> Value:
        true, false, _ = self.branch(node.test)
        results: list[Value] = []
        states: list[State | None] = []
        for state, expression in ((true, node.body), (false, node.orelse)):
            if state is not None:
                self.state = state
                try:
                    results.append(self.eval(expression))
                except DeadEndError:
                    continue
                states.append(self.state)
        return self._meet(results, states)

    def _meet(self, results: list[Value], states: list[State | None]) -> Value:
        state = joined(*states)
        if state is None:
            self.dead_end()
        self.state = state
        return join_all(results)

    def _compare(self, node: ast.Compare) -> Value:
        if len(node.ops) > 1:
            true, false, value = self.branch(node)
            return self._meet([value], [true, false])
        left = self.eval(node.left)
        holds, fails = compared(node.ops[0], left, self.eval(node.comparators[0]))
        return Value((TRUE if holds else 0) | (FALSE if fails else 0))

    def branch(self, node: ast.expr) -> Branch:
        """Both ways a test can come out, with what each says of the variables. Raises as `eval`.

        The present state is given away.
        """
        if isinstance(node, ast.BoolOp):
            return self._branch_both_or_either(node)
        if isinstance(node, ast.Compare):
            return self._branch_compare(node)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            true, false, _ = self.branch(node.operand)
            return Branch(false, true, Value((TRUE if false else 0) | (FALSE if true else 0)))
        value = self.eval(node)
        if isinstance(node, ast.Call):
            apart = self.returns_apart(node)
            if apart is not None:
                return Branch(*apart, value)
        true = self.state.copy() if may_be_true(value) else None
        false = self.state if may_be_false(value) else None
        if true is not None:
            true = self._learn(true, node, value, where_true(value))
            if true is not None and true.facts and isinstance(node, ast.Name):
                place = self.frame.place(node.id)
                if isinstance(place, tuple):
                    true.believe(place)
            if true is not None and isinstance(node, ast.Call):
                true = self._learn_from_call(true, node)
        if false is not None:
            false = self._learn(false, node, value, where_false(value))
        return Branch(true, false, value)

    def _branch_both_or_either(self, node: ast.BoolOp) -> Branch:
        stops = isinstance(node.op, ast.Or)
        outs: list[State | None] = []
        values: list[Value] = []
        on: State | None = None
        for index, operand in enumerate(node.values):
            try:
                true, false, value = self.branch(operand)
            except DeadEndError:
                if index == 0:
                    raise
                on = None
                break
            out, on = (true, false) if stops else (false, true)
            outs.append(out)
            last = index == len(node.values) - 1
            values.append(value if last else where_true(value) if stops else where_false(value))
            if on is None:
                break
            self.state = on
        left = joined(*outs)
        return Branch(left, on, join_all(values)) if stops else Branch(on, left, join_all(values))

    def _branch_compare(self, node: ast.Compare) -> Branch:
        left_node, left = node.left, self.eval(node.left)
        falses: list[State | None] = []
        true: State | None = None
        for op, right_node in zip(node.ops, node.comparators, strict=True):
            right = self.eval(right_node)
            holds, fails = compared(op, left, right)
            true = None
            if fails is not None:
                out = self.state.copy() if holds is not None else self.state
                out = self._learn(out, left_node, left, fails[0])
                falses.append(None if out is None else self._learn(out, right_node, right, fails[1]))
            if holds is not None:
                true = self._learn(self.state, left_node, left, holds[0])
                true = None if true is None else self._learn(true, right_node, right, holds[1])
            if true is None or holds is None:
                break
            self.state, left_node, left = true, right_node, holds[1]
        false = joined(*falses)
        return Branch(true, false, Value((TRUE if true else 0) | (FALSE if false else 0)))

    def _learn(self, state: State, node: ast.expr, before: Value, after: Value) -> State | None:
        """A state in which an expression that was `before` is known to be `after`; None if it can be nothing."""
        if after is before:
            return state
        if not after.bits:
            return None
        target = node.target if isinstance(node, ast.NamedExpr) else node
        if isinstance(target, ast.Name):
            place = self.frame.place(target.id)
            if isinstance(place, tuple) and state.variables.get(place) == before:
                state.variables[place] = after
        return state

    def store_test(self, name: str, test: ast.expr) -> None:
        """Bind a name to how a test comes out, and keep in mind what is not None if it comes out true."""
        before = {key for key, value in self.state.variables.items() if value.bits & NONE}
        true, false, value = self.branch(test)
        about = () if true is None else (key for key in before if not true.variables.get(key, TOP).bits & NONE)
        about = frozenset(about)
        self._meet([value], [true, false])
        self.store(name, value)
        place = self.frame.place(name)
        if about and isinstance(place, tuple) and place not in about:
            self.state.facts[place] = about

    def _learn_from_call(self, state: State, node: ast.Call) -> State | None:
        """`is_safe_enter` is false for None."""
        if not (isinstance(node.func, ast.Name) and node.func.id == "is_safe_enter"):
            return state
        given = node.args[0] if node.args else next((k.value for k in node.keywords if k.arg == "lane"), None)
        target = given.target if isinstance(given, ast.NamedExpr) else given
        if not isinstance(target, ast.Name):
            return state
        place = self.frame.place(target.id)
        value = state.variables.get(place) if isinstance(place, tuple) else None
        if value is None or not value.bits & NONE:
            return state
        return self._learn(state, target, value, value._replace(bits=value.bits & ~NONE))

    # Things that hold others -----------------------------------------------------------------------------------

    def _parts(self, node: ast.expr) -> Value:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.expr):
                self.eval(child)
        return TOP

    def _text(self, node: ast.expr) -> Value:
        self._parts(node)
        return ANY_TEXT

    def _tuple(self, node: ast.Tuple) -> Value:
        values = [self.eval(element) for element in node.elts]
        starred = any(isinstance(element, ast.Starred) for element in node.elts)
        return Value(TUPLE, items=None if starred else tuple(value._replace(origin=None) for value in values))

    def _container(self, node: ast.expr) -> Value:
        self._parts(node)
        return fresh(id(node))

    def _attribute(self, node: ast.Attribute) -> Value:
        owner = self.eval(node.value)
        if owner == MATH_MODULE:
            return self.of_math(node.attr)
        return TOP

    def of_math(self, name: str) -> Value:
        """What `math` has under a name."""
        found = arithmetic.math_constant(name)
        return Value(FUNCTION, callees=frozenset({("math", name)})) if found is None else found

    def _subscript(self, node: ast.Subscript) -> Value:
        owner = self.eval(node.value)
        index = self.eval(node.slice)
        if owner.bits == TUPLE and owner.items and index.bits == INT and index.lo == index.hi:
            place = int(index.lo)
            if -len(owner.items) <= place < len(owner.items):
                return owner.items[place]
        return TOP

    def begin_function(self, node: FunctionNode) -> None:
        """What the definition of a function evaluates. Raises TooIntricateError for annotations that call something."""
        for default in (*node.args.defaults, *node.args.kw_defaults):
            if default is not None:
                self.eval(default)
        if isinstance(node, ast.FunctionDef):
            arguments = (
                *node.args.posonlyargs,
                *node.args.args,
                *node.args.kwonlyargs,
                node.args.vararg,
                node.args.kwarg,
            )
            for argument in arguments:
                self.no_call_in(None if argument is None else argument.annotation)
            self.no_call_in(node.returns)

    def no_call_in(self, annotation: ast.expr | None) -> None:
        """Annotations are taken as words."""
        if annotation is not None and any(isinstance(node, ast.Call) for node in ast.walk(annotation)):
            raise TooIntricateError(f"line {annotation.lineno} calls something in an annotation")

    def _lambda(self, node: ast.Lambda) -> Value:
        self.begin_function(node)
        self.let_loose(node)
        return CALLABLE

    def _comprehension(self, node: ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp) -> Value:
        outer = self.frame
        inner = self.frame_for(
            (id(node), outer.number), lambda number_: CallFrame(number_, self.scopes.of(node), outer)
        )
        try:
            self._clause(node, 0, inner, outer)
        finally:
            self.frame = outer
        return fresh(id(node))

    def _clause(
        self,
        node: ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp,
        index: int,
        inner: CallFrame,
        outer: CallFrame,
    ) -> None:
        if index == len(node.generators):
            for element in (node.key, node.value) if isinstance(node, ast.DictComp) else (node.elt,):
                self.eval(element)
            return
        clause = node.generators[index]
        self.frame = inner if index else outer
        walked = self.walked(clause.iter)
        self.frame = inner
        if walked.most == 0:
            return

        def once() -> None:
            self.frame = inner
            self.assign(clause.target, walked.element)
            skipped: list[State | None] = []
            for test in clause.ifs:
                true, false, _ = self.branch(test)
                skipped.append(false)
                if true is None:
                    self.state = self._state_of(joined(*skipped))
                    return
                self.state = true
            try:
                self._clause(node, index + 1, inner, outer)
                skipped.append(self.state)
            except DeadEndError:
                pass
            self.frame = inner
            self.state = self._state_of(joined(*skipped))

        self._repeat((id(clause), inner.number), once)

    def _state_of(self, state: State | None) -> State:
        if state is None:
            self.dead_end()
        return state

    def _repeat(self, loop: tuple[int, int], once: Callable[[], None]) -> None:
        """Do something any number of times."""
        entry = self.state

        def one_pass(head: State) -> State | None:
            self.state = head.copy()
            try:
                once()
            except DeadEndError:
                return None
            return self.state

        head = self.settled(loop, entry, one_pass)
        back = one_pass(head)
        self.state = self._state_of(joined(entry, back))

    def settled(self, loop: tuple[int, int], entry: State, one_pass: Callable[[State], State | None]) -> State:
        """What holds before every pass, the first one from `entry` included. Nothing is recorded meanwhile.

        Loops in loops are come to again and again before anything is recorded. Then what held the last time is good
        enough where it covers this time, and a good beginning where it does not: otherwise the work would be
        multiplied with every level.
        """
        recording, self.recording = self.recording, False
        errors = list(self.errors)
        head, known = entry, self._settled.get(loop)
        if known is not None:
            old_entry, old_head = known
            if entry.same(old_entry) or (not recording and _covers(old_entry, entry)):
                self.recording = recording
                return old_head
            head = entry if recording else self._state_of(joined(entry, old_head))
        try:
            while True:  # ends: a value can be widened only so often
                new = joined(entry, one_pass(head))
                assert new is not None
                grown = self._state_of(joined(head, new))
                if grown.same(head):
                    self._settled[loop] = entry, new
                    return new
                head = widened(head, grown)
        finally:
            self.recording = recording
            self.errors = errors

    # Yields --------------------------------------------------------------------------------------------------

    def _yield(self, node: ast.Yield) -> Value:
        if node.value is not None:
            self.eval(node.value)
        if self.recording:
            self.record.took_effect(self.state.pending)
        self.state.yielded()
        for loop in self.loops:
            loop.exits += 1
        self.note_error()
        return NOTHING

    def grow(self, owner: Value) -> None:
        if not owner.bits & OBJECT:
            return
        for loop in self.loops:
            loop.grown = None if loop.grown is None or owner.refs is None else loop.grown | owner.refs

    # Walking and unpacking -------------------------------------------------------------------------------------

    def walked(self, node: ast.expr) -> Walked:
        """What a `for` over an expression sees."""
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and self.frame.place(node.func.id) is None:
            name, plain = node.func.id, not any(isinstance(one, ast.Starred) for one in node.args)
            if name == "range" and plain and not node.keywords and 1 <= len(node.args) <= 3:
                return range_of([self.eval(argument) for argument in node.args])
        if isinstance(node, ast.List | ast.Tuple) and not any(isinstance(one, ast.Starred) for one in node.elts):
            values = [self.eval(element)._replace(origin=None) for element in node.elts]
            return Walked(join_all(values), len(values), len(values), frozenset(), True)
        value = self.eval(node)
        if value.bits == TUPLE and value.items is not None:
            return Walked(join_all(list(value.items)), len(value.items), len(value.items), frozenset(), True)
        return Walked(ANY_TEXT if value.bits == TEXT else TOP, 0, None, value.refs, True)

    def assign(self, target: ast.expr, value: Value) -> None:
        """Bind a target."""
        if isinstance(target, ast.Name):
            self.store(target.id, value)
        elif isinstance(target, ast.Tuple | ast.List):
            starred = any(isinstance(element, ast.Starred) for element in target.elts)
            fits = value.bits == TUPLE and value.items is not None and len(value.items) == len(target.elts)
            items = value.items if fits and not starred and value.items is not None else (TOP,) * len(target.elts)
            for element, item in zip(target.elts, items, strict=True):
                self.assign(element, item)
        elif isinstance(target, ast.Starred):
            self.assign(target.value, TOP)
        elif isinstance(target, ast.Subscript):
            owner = self.eval(target.value)
            self.eval(target.slice)
            self.grow(owner)
        else:
            raise TooIntricateError(f"line {target.lineno} assigns to what the language does not know")

    def frame_for(self, key: tuple[int, ...], make: Callable[[int], CallFrame]) -> CallFrame:
        """The one frame for an activation in one place."""
        frame = self._frames.get(key)
        if frame is None:
            frame = self._frames[key] = make(len(self._frames) + 1)
        return frame


def _covers(state: State, other: State) -> bool:
    """Whether a state holds everything that another does."""
    both = joined(state, other)
    return both is not None and both.same(state)
