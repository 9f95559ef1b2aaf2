"""Walks the statements of a program over sets of values instead of values."""

from __future__ import annotations

import ast
import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Final

from chauffeur.programs.errors import ProgramSyntaxError
from chauffeur.programs.nodes import all_nodes
from chauffeur.programs.verify import arithmetic
from chauffeur.programs.verify.calls import Calls
from chauffeur.programs.verify.circumstances import Circumstances
from chauffeur.programs.verify.expressions import MATH_MODULE, DeadEndError, Loop, TooIntricateError
from chauffeur.programs.verify.frames import MODULE, CallFrame
from chauffeur.programs.verify.iteration import Walked
from chauffeur.programs.verify.report import LoopVerdict
from chauffeur.programs.verify.scopes import FunctionNode, Scope, Scopes
from chauffeur.programs.verify.state import State, joined
from chauffeur.programs.verify.values import (
    FLOAT,
    FUNCTION,
    INT,
    NONE,
    NOTHING,
    OBJECT,
    TOP,
    TUPLE,
    Callee,
    Key,
    Value,
    constant,
    join,
    may_be_false,
    may_be_true,
)

_MAX_CALLS: Final = 10
"""Calls of own functions inside each other that are followed; deeper ones are taken as calls of anything."""
_MAX_COUNTED: Final = 1e9
"""Beyond it a step of a counter could be lost in rounding."""
_LEAST_STEP: Final = 1e-6

_Sides = tuple[State | None, State | None]


class Interpreter(Calls):
    """One analysis of one program."""

    def __init__(self, library: ast.Module, program: ast.Module, where: Circumstances) -> None:
        scopes = Scopes((library, program))
        super().__init__(scopes, CallFrame(MODULE, scopes.module, None), where)
        self._module = self.frame
        self._texts = (library, program)
        self._calls: list[FunctionNode] = []
        self._returns: list[tuple[Value, State]] = []
        self._loop: Loop | None = None
        self._loose: list[FunctionNode] = []
        self._waiting: list[FunctionNode] = []
        self._returned: tuple[int, list[tuple[Value, State]]] | None = None
        self._last: tuple[ast.Call, FunctionNode, int, list[tuple[Value, State]]] | None = None
        self._alive = True
        self._statements: dict[type[ast.stmt], Callable[[Any], None]] = {
            ast.Expr: self._expression,
            ast.Assign: self._assign_statement,
            ast.AugAssign: self._augmented,
            ast.AnnAssign: self._annotated,
            ast.If: self._if,
            ast.For: self._for,
            ast.While: self._while,
            ast.Break: self._break,
            ast.Continue: self._continue,
            ast.Return: self._return,
            ast.FunctionDef: self._define,
            ast.Try: self._try,
            ast.Raise: self._raise,
            ast.Assert: self._assert,
            ast.Import: self._import,
            ast.ImportFrom: self._import_from,
            ast.Pass: self._pass_by,
            ast.Global: self._pass_by,
            ast.Nonlocal: self._pass_by,
        }

    def run(self, main: ast.FunctionDef) -> None:
        """Walk the texts' top levels, the main function, and every function that may be called from anywhere.

        Raises:
            TooIntricateError: The analysis gives up.
            ProgramSyntaxError: A `break` or `continue` stands outside a loop.
        """
        for text in self._texts:
            self._block(text.body)
        if not self._alive:
            return
        module = self.state.copy()
        call = ast.Call(func=ast.Name(main.name, ast.Load()), args=[], keywords=[])
        ast.copy_location(call, main)
        try:
            self.call_own(call, ("own", main, self._module), [], {})
            self.record.took_effect(self.state.pending)
        except DeadEndError:
            pass
        module.forget(self.scopes.shared)
        while self._waiting:
            self._run_loose(self._waiting.pop(), module)

    # Functions -------------------------------------------------------------------------------------------------

    def let_loose(self, function: FunctionNode) -> None:
        """A function may be called from anywhere, with anything: walked once, for all such calls."""
        if function not in self._loose:
            self._loose.append(function)
            self._waiting.append(function)

    def _run_loose(self, function: FunctionNode, module: State) -> None:
        self.state, self._alive, self.is_open, self.recording = module.copy(), True, True, True
        self.state.first = False
        self.errors.clear()
        self.loops.clear()
        self.guards = 1  # its callers may catch its errors
        parent = self._open_frame(self.scopes.of(function).parent)
        with contextlib.suppress(DeadEndError):
            self._activate((id(function), parent.number), function, parent, None, {})

    def _open_frame(self, scope: Scope | None) -> CallFrame:
        if scope is None or scope is self.scopes.module:
            return self._module
        parent = self._open_frame(scope.parent)
        return self.frame_for((-1, id(scope)), lambda number: CallFrame(number, scope, parent, is_open=True))

    def call_own(
        self, node: ast.Call, callee: Callee, arguments: list[Value], keywords: dict[str, Value] | None
    ) -> Value:
        """Walk the called function's body right here, with these arguments."""
        function: FunctionNode = callee[1]
        self._last = None
        if function in self._calls or len(self._calls) >= _MAX_CALLS:
            self.let_loose(function)
            self.call_unknown()
            return TOP
        key = (id(node), self.frame.number, id(function))
        value = self._activate(key, function, callee[2], None if keywords is None else arguments, keywords or {})
        if self._returned is not None:
            self._last = node, function, *self._returned
        return value

    def returns_apart(self, node: ast.Call) -> tuple[State | None, State | None] | None:
        """As declared; also, an argument is not None where the parameter it became never is."""
        if self._last is None or self._last[0] is not node:
            return None
        _, function, number, returned = self._last
        same = list(self._passed_on(node, function))
        sides: list[State | None] = []
        for may_be in (may_be_true, may_be_false):
            state = joined(*(one for value, one in returned if may_be(value)))
            if state is not None:
                for place, parameter in same:
                    given, held = state.variables.get(place), state.variables.get((number, parameter))
                    if given is not None and held is not None and given.bits & NONE and not held.bits & NONE:
                        state.variables[place] = given._replace(bits=given.bits & ~NONE)
                _drop_frame(state, number)
            sides.append(state)
        return sides[0], sides[1]

    def forget_returns(self) -> None:
        """As declared."""
        self._last = None

    def _passed_on(self, node: ast.Call, function: FunctionNode) -> Iterator[tuple[Key, str]]:
        """Variables given to parameters that nobody binds anew, on neither side."""
        if any(isinstance(inner, ast.NamedExpr | ast.Starred) for one in node.args for inner in ast.walk(one)):
            return
        bound = self.scopes.stored_in(function)
        for argument, parameter in zip(node.args, function.args.args, strict=False):
            if isinstance(argument, ast.Name) and not {argument.id, parameter.arg} & self.scopes.shared:
                place = self.frame.place(argument.id)
                if isinstance(place, tuple) and parameter.arg not in bound:
                    yield place, parameter.arg

    def _activate(
        self,
        key: tuple[int, ...],
        function: FunctionNode,
        parent: CallFrame,
        arguments: list[Value] | None,
        keywords: dict[str, Value],
    ) -> Value:
        frame = self.frame_for(key, lambda number: CallFrame(number, self.scopes.of(function), parent))
        kept = self.frame, self._returns, self._loop
        self.frame, self._returns, self._loop = frame, [], None
        self._calls.append(function)
        try:
            self._bind_parameters(function.args, arguments, keywords)
            if isinstance(function, ast.Lambda):
                self._returns.append((self.eval(function.body), self.state))
            else:
                self._block(function.body)
                if self._alive:
                    self._returns.append((NOTHING, self.state))
            returned, self._alive = self._returns, True
        except DeadEndError:
            returned, self._alive = self._returns, True
        finally:
            self._calls.pop()
            self.frame, self._returns, self._loop = kept
        state = joined(*(one for _, one in returned))
        if state is None:
            self.dead_end()
        _drop_frame(state, frame.number)
        self.state = state
        self._returned = frame.number, returned
        result = returned[0][0]
        for value, _ in returned[1:]:
            result = join(result, value)
        return result

    def _bind_parameters(
        self, declared: ast.arguments, arguments: list[Value] | None, keywords: dict[str, Value]
    ) -> None:
        places = [*declared.posonlyargs, *declared.args]
        defaults = [None] * (len(places) - len(declared.defaults)) + list(declared.defaults)
        pairs = [*zip(places, defaults, strict=True), *zip(declared.kwonlyargs, declared.kw_defaults, strict=True)]
        for index, (parameter, default) in enumerate(pairs):
            value = TOP
            if arguments is not None:
                if index < len(arguments) and index < len(places):
                    value = arguments[index]
                elif parameter.arg in keywords:
                    value = keywords[parameter.arg]
                elif default is not None:
                    value = _default(default)
            self.store(parameter.arg, value)
        if declared.vararg is not None:
            self.store(declared.vararg.arg, Value(TUPLE, items=None))
        if declared.kwarg is not None:
            self.store(declared.kwarg.arg, Value(OBJECT, refs=frozenset({id(declared.kwarg)})))

    # Blocks ----------------------------------------------------------------------------------------------------

    def _block(self, statements: Sequence[ast.stmt]) -> None:
        for statement in statements:
            if not self._alive:
                return
            if self.recording:
                self.record.visited.add(id(statement))
            handler = self._statements.get(type(statement))
            if handler is None:
                raise TooIntricateError(f"line {statement.lineno} has what the language does not know")
            try:
                handler(statement)
            except DeadEndError:
                self._alive = False

    def _go(self, state: State | None) -> None:
        self._alive = state is not None
        if state is not None:
            self.state = state

    def _from(self, state: State | None, statements: Sequence[ast.stmt]) -> State | None:
        """The end of a block that begins in a state."""
        self._go(state)
        self._block(statements)
        return self.state if self._alive else None

    def _expression(self, node: ast.Expr) -> None:
        self.eval(node.value)

    def _pass_by(self, node: ast.stmt) -> None:
        """Nothing happens here."""

    def _assign_statement(self, node: ast.Assign) -> None:
        if isinstance(node.value, ast.Lambda) and len(node.targets) == 1 and isinstance(node.targets[0], ast.Name):
            self.begin_function(node.value)
            self.store(node.targets[0].id, self._function_value(node.value))
            return
        if isinstance(node.value, ast.BoolOp | ast.Compare) and isinstance(node.targets[0], ast.Name):
            self.store_test(node.targets[0].id, node.value)
            for target in node.targets[1:]:
                self.assign(target, TOP)
            return
        value = self.eval(node.value)
        for target in node.targets:
            self.assign(target, value)

    def _annotated(self, node: ast.AnnAssign) -> None:
        self.no_call_in(node.annotation)
        if node.value is not None:
            self.assign(node.target, self.eval(node.value))

    def _augmented(self, node: ast.AugAssign) -> None:
        if not isinstance(node.target, ast.Name):
            self.eval(node.value)
            self.assign(node.target, TOP)
            return
        place = self.frame.place(node.target.id)
        before = self.state.variables.get(place, TOP) if isinstance(place, tuple) else TOP
        value = arithmetic.binary(node.op, before, self.eval(node.value))
        if before.bits & OBJECT:  # a list is lengthened where it is
            for loop in self.loops:
                loop.grown = None
        self.store(node.target.id, value)

    def _if(self, node: ast.If) -> None:
        true, false, _ = self.branch(node.test)
        end = self._from(true, node.body) if true is not None else None
        other = self._from(false, node.orelse) if false is not None else None
        self._go(joined(end, other))

    def _define(self, node: ast.FunctionDef) -> None:
        self.begin_function(node)
        self.store(node.name, self._function_value(node))

    def _function_value(self, node: FunctionNode) -> Value:
        return Value(FUNCTION, callees=frozenset({("own", node, self.frame)}))

    def _return(self, node: ast.Return) -> None:
        value = NOTHING if node.value is None else self.eval(node.value)
        self._returns.append((value, self.state))
        self._alive = False

    def _break(self, _: ast.Break) -> None:
        self._the_loop().breaks.append(self.state)
        self._alive = False

    def _continue(self, _: ast.Continue) -> None:
        self._the_loop().continues.append(self.state)
        self._alive = False

    def _the_loop(self) -> Loop:
        """The loop a statement stands in, which only the static gate makes sure of."""
        if self._loop is None:
            raise ProgramSyntaxError("A `break` or `continue` stands outside a loop.")
        return self._loop

    def _raise(self, node: ast.Raise) -> None:
        if node.exc is not None:
            self.eval(node.exc)
        self._count_exit()
        self._alive = False

    def _assert(self, node: ast.Assert) -> None:
        true, false, _ = self.branch(node.test)
        if false is not None:
            self._count_exit()
            if node.msg is not None:
                self.state = false
                self.eval(node.msg)
        self._go(true)

    def _count_exit(self) -> None:
        for loop in self.loops:
            loop.exits += 1

    def _import(self, node: ast.Import) -> None:
        for alias in node.names:
            self.store(alias.asname or alias.name, MATH_MODULE)

    def _import_from(self, node: ast.ImportFrom) -> None:
        for alias in node.names:
            self.store(alias.asname or alias.name, self.of_math(alias.name))

    def _try(self, node: ast.Try) -> None:
        """Handlers begin with everything an error in the body can leave behind; `finally` follows every way out."""
        if not node.finalbody:
            self._guarded(node)
            return
        loop, returns = self._loop, self._returns
        kept = ([], []) if loop is None else (loop.breaks, loop.continues)
        if loop is not None:
            loop.breaks, loop.continues = [], []
        self._returns = []
        self.errors.append(self.state.copy())
        self._guarded(node)
        errors = self.errors.pop()
        end = self.state if self._alive else None
        inner_returns, self._returns = self._returns, returns
        inner = ([], []) if loop is None else (loop.breaks, loop.continues)
        if loop is not None:
            loop.breaks, loop.continues = kept
        self._from(errors, node.finalbody)  # and on goes the error
        for states, outer in zip(inner, kept, strict=True):
            for state in states:
                after = self._from(state, node.finalbody)
                if after is not None:
                    outer.append(after)
        for value, state in inner_returns:
            after = self._from(state, node.finalbody)
            if after is not None:
                self._returns.append((value, after))
        self._go(None if end is None else self._from(end, node.finalbody))

    def _guarded(self, node: ast.Try) -> None:
        self.errors.append(self.state.copy())
        self.guards += bool(node.handlers)
        self._block(node.body)
        self.guards -= bool(node.handlers)
        errors = self.errors.pop()
        ends = [self.state if self._alive else None]
        if ends[0] is not None:
            ends[0] = self._from(ends[0], node.orelse)
        for handler in node.handlers:
            self._go(None if errors is None else errors.copy())
            with contextlib.suppress(DeadEndError):
                if handler.type is not None:
                    self.eval(handler.type)
                if handler.name is not None:
                    self.store(handler.name, Value(OBJECT, refs=None))
                self._block(handler.body)
                ends.append(self.state if self._alive else None)
        self._go(joined(*ends))

    # Loops -----------------------------------------------------------------------------------------------------

    def _while(self, node: ast.While) -> None:
        def enter() -> _Sides:
            try:
                true, false, _ = self.branch(node.test)
            except DeadEndError:
                return None, None
            return true, false

        self._walk_loop(node, enter, None)

    def _for(self, node: ast.For) -> None:
        walked = self.walked(node.iter)

        def enter() -> _Sides:
            out = self.state.copy()
            if walked.most == 0:
                return None, out
            try:
                self.assign(node.target, walked.element)
            except DeadEndError:
                return None, out
            return self.state, out

        self._walk_loop(node, enter, walked)

    def _walk_loop(self, node: ast.For | ast.While, enter: Callable[[], _Sides], walked: Walked | None) -> None:
        entry, loop, outer = self.state, Loop(), self._loop
        self._loop = loop
        self.loops.append(loop)
        begun = len(self._returns)

        def one_pass(head: State) -> State | None:
            loop.breaks, loop.continues = [], []
            self.state = self._head(node, head)
            into, _ = enter()
            end = self._from(into, node.body) if into is not None else None
            return joined(end, *loop.continues)

        try:
            head = self.settled((id(node), self.frame.number), entry, one_pass)
            del self._returns[begun:]
            loop.grown, loop.exits = set(), 0
            back = one_pass(head)
        finally:
            self.loops.pop()
            self._loop = outer
        out = joined(
            None if walked is not None and walked.fewest > 0 else self._left(entry, enter), self._left(back, enter)
        )
        if self.recording:
            left = out is not None or bool(loop.breaks) or len(self._returns) > begun
            self.record.loop(node, *self._verdict(node, loop, entry, head, back, walked, left=left))
        end = self._from(out, node.orelse) if out is not None else None
        after = joined(end, *loop.breaks)
        if after is not None:
            after.idle -= {id(node)}
        self._go(after)

    def _head(self, node: ast.For | ast.While, head: State) -> State:
        """The state a pass begins with: what the loop changes is counted from here."""
        state, place, number = head.copy(), id(node), self.frame.number
        state.idle |= {place}
        stored = self.scopes.stored_in(node)
        for key, value in head.variables.items():
            counted = key[0] == number and key[1] in stored and value.bits & (INT | FLOAT)
            if counted:
                state.variables[key] = value._replace(origin=(place, key, 0.0, 0.0))
            elif value.origin is not None and value.origin[0] == place:
                state.variables[key] = value._replace(origin=None)
        return state

    def _left(self, state: State | None, enter: Callable[[], _Sides]) -> State | None:
        """What holds where a loop's own test ends it."""
        if state is None:
            return None
        recording, self.recording = self.recording, False
        self.state = state.copy()
        out = enter()[1]
        self.recording = recording
        return out

    def _verdict(
        self,
        node: ast.For | ast.While,
        loop: Loop,
        entry: State,
        head: State,
        back: State | None,
        walked: Walked | None,
        *,
        left: bool,
    ) -> tuple[LoopVerdict, int | None, str]:
        if back is None:
            return "bounded", 1, "its first pass is its last"
        passes, reason = _counted(id(node), entry, head, back)
        if walked is not None and walked.most is not None and (passes is None or walked.most <= passes):
            passes, reason = walked.most, f"it has {walked.most} passes at most"
        if id(node) not in back.idle:
            return "yields", passes, "every pass yields"
        if passes is not None:
            return "bounded", passes, reason
        grown = loop.grown
        steady = grown is not None and (
            not grown or (walked is not None and walked.refs is not None and grown.isdisjoint(walked.refs))
        )
        if walked is not None and walked.finite and steady:
            return "bounded", None, "it ends with what it walks"
        if not left and not loop.exits:
            return "endless", None, "it never yields, and nothing but an error ends it"
        if walked is not None and walked.finite:
            return "unknown", None, "what it walks may grow meanwhile, and a pass can go by without a yield"
        return "unknown", None, "a pass can go by without a yield, and no counter shows that it ends"


def _counted(place: int, entry: State, head: State, back: State) -> tuple[int | None, str]:
    """Bound of a loop's passes: by a variable that every pass moves on, and that is never beyond a bound before one."""
    best: tuple[int | None, str] = None, ""
    for key, value in back.variables.items():
        origin, held, first = value.origin, head.variables.get(key), entry.variables.get(key)
        if origin is None or origin[:2] != (place, key) or held is None or first is None:
            continue
        if held.bits & ~(INT | FLOAT) or max(abs(held.lo), abs(held.hi)) > _MAX_COUNTED:
            continue
        if origin[2] >= _LEAST_STEP:
            passes = math.floor((held.hi - first.lo) / origin[2] * (1 + 1e-6)) + 1
        elif origin[3] <= -_LEAST_STEP:
            passes = math.floor((first.hi - held.lo) / -origin[3] * (1 + 1e-6)) + 1
        else:
            continue
        if best[0] is None or passes < best[0]:
            best = passes, f"{key[1]} moves on in every pass, so that it has {passes} passes at most"
    return best


def _drop_frame(state: State, number: int) -> None:
    """A function has returned: its variables are no more."""
    for place in [place for place in state.variables if place[0] == number]:
        del state.variables[place]


def _default(node: ast.expr) -> Value:
    if isinstance(node, ast.Constant):
        return constant(node.value)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
        return arithmetic.negative(constant(node.operand.value))
    return TOP


def nodes_of(tree: ast.Module) -> frozenset[int]:
    """All nodes of a text, by `id`."""
    return frozenset(map(id, all_nodes(tree)))
