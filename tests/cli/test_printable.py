"""Whatever a planner, a program, a server or a file says, the terminal shows it as text and does nothing of it."""

from __future__ import annotations

import ast
import io
import json
import logging
import re
import sys
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

import pytest
from rich.table import Table
from rich.text import Text

from chauffeur import cli
from chauffeur.cli import failures
from chauffeur.cli.console import Screen, columns, echo, path_text, plain, stderr, stdout
from chauffeur.cli.printable import PrintableFormatter, printable
from chauffeur.cli.show import FullTeller, Teller
from chauffeur.concept import (
    NOBODY,
    ApiCall,
    Causes,
    ChauffeurError,
    Command,
    Context,
    Feedback,
    Frame,
    History,
    HistoryItem,
    Instruction,
    Intervention,
    Metric,
    Observation,
    Plan,
    Program,
    Scenario,
    Setpoints,
    Situation,
    Thoughts,
    Trip,
    VehicleState,
    Verdict,
)
from chauffeur.driving.events import DriveEvent
from chauffeur.driving.recording import RecordedTrip
from roads import a_road

EVIL = (
    "<\x1b[2J\x1b]0;title\x07\x1b]8;;http://evil\x1b\\\x1bP+q\x9b31m\x90q\x08\x0c\r\x00\x7f"
    "\u202e\u200b\u2066\ufeff\u2028\ud800[red]E[/red][link=http://evil]F[/link][/]:warning:>"
)
SHOWN = "[red]E[/red][link=http://evil]F[/link][/]:warning:>"
OURS = re.compile(r"\x1b\[[0-9;]*m|\x1b\[\?25[lh]|\x1b\[[0-9]*[AK]|\r")
"""Colours, and the moves of a line that rewrites itself."""


def harmless(output: str) -> None:
    left = OURS.sub("", output)
    hidden = [c for c in left if c != "\n" and not c.isprintable()]
    assert not hidden, (hidden, left)
    output.encode()
    assert not re.search(r"\x1b\[[0-9;]*m[^\x1b]*E\x1b", output.replace("[red]E", "")), "the markup had its way"


def strings(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where in a value free text stands; closed sets of words are none."""
    if is_dataclass(value):
        hints = get_type_hints(type(value))
        for field in fields(value):
            hint = hints[field.name]
            if get_origin(hint) is Literal or any(get_origin(one) is Literal for one in get_args(hint)):
                continue
            yield from strings(getattr(value, field.name), (*path, field.name))
    elif isinstance(value, tuple):
        for index, item in enumerate(value):
            yield from strings(item, (*path, index))
    elif isinstance(value, str):
        yield path


def put(value: Any, path: tuple[Any, ...], text: str) -> Any:
    if not path:
        return text
    step, *rest = path
    if isinstance(value, tuple):
        return (*value[:step], put(value[step], tuple(rest), text), *value[step + 1 :])
    return replace(value, **{step: put(getattr(value, step), tuple(rest), text)})


def a_drive() -> RecordedTrip:
    """A trip with text in every field that has any."""
    here = Situation("highway", 25.0, 31.3, 3, 1, True, None, None, ("left",), (("rain", "no"),))
    car = VehicleState(0, "car", 0.0, 4.0, 0.0, 20.0, 5.0, 2.0, "a-b:1")
    shot = Observation(0.0, 0, "highway", car, (), (), a_road(()), None, 12.0, False, False)
    command = Command(0.1, 0.0)
    verdicts = (
        Verdict("format-v1", True, "fine", 3, "none"),
        Verdict("verify-v1", False, "too fast", 2, "slower"),
    )
    frame = Frame(
        shot, Setpoints(), command, command, "running", 1, ("Overtaking.",), (ApiCall("say", "'x'", "None"),),
        (Intervention("gap-v1", "too close", command, Command(-1.0, 0.0)),),
    )  # fmt: skip
    trip = Trip(
        id="9f2c",
        instruction=Instruction("Faster", NOBODY.__class__("ana"), "text"),
        context=Context("Three lanes.", here),
        history=History((HistoryItem("1", "2026", "Go", "C", "w", "x", "R", "P", (("v", 0.1),), (Feedback("f"),)),)),
        plan=Plan(Thoughts("I overtake."), Program("def f():\n    yield  # x\n"), intent="overtake",
                  settings=(("v_mps", 0.1),), planner="third-party", model="model"),
        verdicts=verdicts,
        outcome="collision",
        causes=Causes(detail="it broke"),
        metrics=(Metric("a-v1", 0.3, "m"),),
        duration_s=0.1,
        scenario="cruise",
        seed=7,
        said=((0.1, "hello"),),
        record=(("chauffeur", "0.1"), ("scenario_sha256", "ab")),
    )  # fmt: skip
    scenario = Scenario("cruise", "highway", {}, 7, {}, "wish", "title")
    return RecordedTrip(trip, (frame,), scenario)


DRIVE = a_drive()
PLACES = list(strings(DRIVE))


def tell(drive: RecordedTrip, *, terminal: bool, screen: type[Teller] = Teller) -> str:
    out = io.StringIO()
    console = Screen(file=out, force_terminal=terminal, width=300, color_system="truecolor")
    trip = drive.trip
    with screen(console) as teller:
        teller.begin(drive.scenario, trip.seed)
        for event in (
            DriveEvent("wish", value=trip.instruction), DriveEvent("context", value=trip.context),
            DriveEvent("history", value=trip.history), DriveEvent("plan", value=trip.plan),
            DriveEvent("plan", value=replace(trip.plan, refusal=trip.plan.thoughts.text)),
            DriveEvent("verdicts", value=trip.verdicts), DriveEvent("trouble", text=trip.causes.detail),
        ):  # fmt: skip
            teller.tell(event)
        teller.writing(trip.plan.thoughts.text, 1)
        for frame in drive.frames:
            teller.tell(DriveEvent("period", value=frame))
        teller.end(drive)
        teller.wrote([Path(trip.id.replace("/", "_").replace("\0", ""))])
    return out.getvalue()


def test_fields_of_every_letter_are_tried() -> None:
    told = {path[:2] for path in PLACES}
    assert len(PLACES) > 40
    assert {("trip", name) for name in ("instruction", "context", "history", "plan", "verdicts", "causes")} <= told
    assert ("trip", "plan", "intent") in PLACES
    assert ("frames", 0, "said", 0) in PLACES


@pytest.mark.parametrize("screen", [Teller, FullTeller])
@pytest.mark.parametrize("terminal", [True, False])
def test_no_field_of_a_drive_reaches_the_terminal_as_anything_but_text(terminal: bool, screen: type[Teller]) -> None:
    seen = 0
    for path in PLACES:
        try:
            output = tell(put(DRIVE, path, EVIL), terminal=terminal, screen=screen)
        except (ValueError, KeyError) as error:  # a field that must be a number, a time or a path
            pytest.fail(f"{path}: {error!r}")
        harmless(output)
        seen += SHOWN in OURS.sub("", output)
    assert seen >= 12, "most of it is shown"


def test_an_intent_is_shown_and_does_nothing() -> None:
    output = tell(put(DRIVE, ("trip", "plan", "intent"), EVIL), terminal=True, screen=FullTeller)
    assert SHOWN in output
    assert "\x1b[2J" not in output
    assert "\x1b]" not in output


def test_whatever_way_a_text_takes_through_rich(capsys: pytest.CaptureFixture[str]) -> None:
    table = Table(EVIL, title=EVIL, caption=EVIL)
    table.add_row(EVIL)
    for make in (stdout, stderr):
        console = make()
        console.print(
            EVIL, plain(EVIL), Text(EVIL), table, columns([(EVIL, EVIL)]), path_text(Path(EVIL.replace("\0", "")))
        )
        console.rule(EVIL)
        console.print_json(json.dumps({"a": EVIL}), ensure_ascii=False)
    echo(EVIL)
    failures.show_error(ChauffeurError(EVIL, hint=EVIL))
    failures.show_crash(ValueError, ValueError(EVIL), sys.exc_info()[2])  # type: ignore[arg-type]
    out, err = capsys.readouterr()
    harmless(out)
    harmless(err)
    assert out.count("[red]E[/red]") >= 8
    assert err.count("[red]E[/red]") >= 9


def test_a_log_line_is_text_too() -> None:
    record = logging.LogRecord("x", logging.WARNING, "f", 1, "%s does not take %r", (EVIL, EVIL), None)
    harmless(PrintableFormatter().format(record))


@pytest.mark.parametrize("text", ["Überholt – 快点 👍", "two\nlines\tand a tab", "", "5 m/s² ✓ ≠ “so”"])
def test_what_is_fit_to_print_stays(text: str) -> None:
    assert printable(text) == text


def test_every_character_is_printable_afterwards() -> None:
    kept = printable("".join(map(chr, range(sys.maxunicode + 1))))
    kept.encode()
    assert not [c for c in kept if c not in "\n\t" and re.match(r"[\x00-\x1f\x7f-\x9f\u200b-\u200f\u2028-\u202e]", c)]


def test_commands_print_through_the_console_alone() -> None:
    """Another way out would be one around `printable`."""
    for path in sorted(Path(cli.__file__).parent.glob("*.py")):
        if path.name == "console.py":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call):
                continue
            called = ast.unparse(node.func)
            assert called not in {"print", "Console", "sys.stdout.write", "sys.stderr.write", "Text.from_markup",
                                  "Text.from_ansi", "typer.secho"}, f"{path.name}:{node.lineno}"  # fmt: skip
            if called == "typer.echo":
                assert ast.unparse(node.args[0]) == "f'chauffeur {__version__}'", f"{path.name}:{node.lineno}"
            if called == "TextColumn":
                assert "markup=False" in ast.unparse(node), f"{path.name}:{node.lineno}"
