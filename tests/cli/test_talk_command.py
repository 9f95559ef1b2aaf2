"""`chauffeur talk`: what can be typed, what is shown, how it ends."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console
from terminal import WITHIN_S
from typer.testing import CliRunner

from chauffeur.cli.main import app
from chauffeur.cli.talk_screen import TalkScreen
from chauffeur.cli.talk_typed import HELP, read_line
from chauffeur.driving.talk.messages import (
    Answered,
    Conversation,
    Ended,
    Evaluate,
    Hand,
    HeardWords,
    HowWasIt,
    Listening,
    MemoryOrder,
    MemoryState,
    Note,
    Say,
    Scene,
    SessionState,
    ShownBody,
    StageTimes,
    TakeOver,
    VerdictShown,
)
from chauffeur.memory import VaultMemory
from chauffeur.safety.audit import verify

COMMAND = [sys.executable, "-c", "from chauffeur.cli.main import run; run()", "talk"]
FAST = ("--time-scale", "3")
EGO = ShownBody(0, "car", 0.0, 0.0, 0.0, 5.0, 2.0, 25.0)
SCENE = Scene(12.0, EGO, (), 0.0, 0.0, 31.0, 20.0, 1.5, "a-b:1", 1, "follow", "w1", 3, "", False, 0)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("slow down", Say("slow down")),
        ("  Stop ", Say("Stop")),  # the session reads emergency words
        ("!too fast", Evaluate("too fast")),
        ("evaluate, that was good", Evaluate("that was good")),
        ("Evaluate: fine", Evaluate("fine")),
        ("take over", TakeOver(True)),
        ("give back", TakeOver(False)),
        ("me", MemoryOrder("show")),
        ("me forget", MemoryOrder("forget_last")),
        ("me erase", MemoryOrder("erase")),
        ("me erase sure", MemoryOrder("erase", sure=True)),
        ("me retention 30", MemoryOrder("retention", 30.0)),
        ("me retention forever", MemoryOrder("retention")),
        ("me privacy on", MemoryOrder("private")),
        ("me public", MemoryOrder("public")),
        ("faster", Say("faster")),
        ("help", None),
        ("", None),
    ],
)
def test_lines_mean_what_the_help_says(line: str, told: object) -> None:
    assert read_line(line, taken_over=False) == told


def test_keys_are_keys_only_at_the_wheel() -> None:
    assert read_line("Left", taken_over=True) == Hand("left")
    assert read_line("left", taken_over=False) == Say("left")
    assert "unknown" in str(read_line("me fly", taken_over=False))
    assert len(HELP) > 5


def test_a_place_that_other_processes_cannot_follow_is_refused_before_anything_moves() -> None:
    result = CliRunner().invoke(app, ["talk", "Turn left.", "--scenario", "open-road"])
    assert result.exit_code == 2
    assert "cannot be driven in real time" in result.output
    assert "--scenario open-road" in result.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--scenario", "nowhere"), "Unknown scenario 'nowhere'"),
        (("--engine", "telepathy"), "Unknown speech engine 'telepathy'"),
        (("--duration", "0"), "--duration"),
    ],
)
def test_what_cannot_be_had_is_said_at_once(arguments: tuple[str, ...], said: str) -> None:
    result = CliRunner().invoke(app, ["talk", *arguments])
    assert result.exit_code == 2
    assert said in result.output


@pytest.mark.parametrize(
    ("memory", "said"),
    [("vaults", "Unknown memory 'vaults'"), ("chroma", "[chroma]")],
)
def test_a_memory_that_cannot_be_had_is_said_at_once(memory: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "chromadb", None)
    monkeypatch.setenv("CHAUFFEUR_MEMORY", memory)
    result = CliRunner().invoke(app, ["talk", "--as", "ana"])
    assert result.exit_code == 2
    assert said in " ".join(result.output.split())


def test_help_has_examples() -> None:
    result = CliRunner().invoke(app, ["talk", "--help"])
    assert result.exit_code == 0
    assert "chauffeur talk --as ana" in result.output


# The screen -----------------------------------------------------------------------------------------------------------


def shown(*said: object, terminal: bool = False) -> str:
    console = Console(record=True, width=110, force_terminal=terminal, file=open(os.devnull, "w"))  # noqa: SIM115, PTH123
    with TalkScreen(console) as screen:
        for each in said:
            screen.tell(each)  # pyright: ignore[reportArgumentType]
        screen.refresh("slow do" if terminal else None)
    return " ".join(console.export_text().split())


def test_a_conversation_is_told_once_and_in_order() -> None:
    asked = Conversation("w1", "Slow [red]down[/].", spoken=True)
    planned = Conversation(
        "w1", "Slow [red]down[/].", True, "planned", thoughts="I go slower.", policy="program", source="def drive():\n",
        recalled=("2026-11-01: “Slower.”",),
    )  # fmt: skip
    driven = Conversation(
        "w1", "Slow [red]down[/].", True, "closed", "finished", thoughts="I go slower.", policy="program",
        source="def drive():\n", recalled=planned.recalled, said=("Slowing [b]down[/b].\x1b[2J",),
        verdicts=(VerdictShown("format-v1", True, ""), VerdictShown("alignment-v1", False, "It says left.", True)),
        opinion="too fast", remembered="remembered as trip 0123", stages=StageTimes(0.2, 0.1, 0.03, 0.05, 0.1, 0.48),
        result="done",
    )  # fmt: skip
    text = shown(
        SessionState("overtake", "Two lanes", 3, "onboard", "grammar/1", False, "ana", "simulated", 0.1, ("slow",)),
        Listening("idle"), SCENE, asked, planned, planned, driven, driven, HowWasIt("w1", "Slow."),
        Ended("stopped", "The car stands."),
    )  # fmt: skip
    told = [
        "simulated", "the sound stays on this machine", "Memory of ana", "“Slow [red]down[/].” (spoken)", "2026-11-01",
        "I go slower.", "def drive():", "✓ format-v1", "≠ alignment-v1 It says left.", "“Slowing [b]down[/b].",
        "0.48 s from your words to the changed set-point: waiting 0.20, recognising 0.10, planning 0.03",
        "done", "“too fast”", "remembered as trip 0123", "how was it?", "The car stands. (simulated drive)",
    ]  # fmt: skip
    places = [text.index(words) for words in told]
    assert places == sorted(places), text
    assert text.count("I go slower.") == 1 and "\x1b" not in text


def test_a_question_stands_until_it_is_answered_and_trouble_is_marked() -> None:
    heard = HeardWords("heard", "speed up", "command", "grammar/1", 0.9, True, "", 0.6)
    before = shown(Listening("idle"), SCENE, heard, terminal=True)
    assert "Did you mean: “speed up”?" in before and "› slow do" in before
    after = shown(Listening("idle"), SCENE, heard, Answered("heard"), terminal=True)
    assert "Did you mean" not in after.rpartition("meant?")[2]
    private = MemoryState("ana", True, 90.0, 2, ())
    failed, unplugged = Note("It failed.", trouble=True), Listening("off", why="Unplugged.")
    text = shown(Listening("idle"), SCENE, private, failed, unplugged, terminal=True)
    for words in ("PRIVATE: nothing is kept", "trouble", "It failed.", "Unplugged.", "not listening"):
        assert words in text
    plain = MemoryState("ana", False, 90.0, 2, (), "chroma", encrypted=False)
    assert shown(SCENE, plain, plain).count("Kept in the memory “chroma”; the car does not encrypt it.") == 1
    unheard = shown(HeardWords("no_hotword", "", "", "grammar/1", None, False, "Not for the car.", 0.8))
    assert "Not for the car." in unheard


# The command ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def answers(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A planner that needs no model."""
    path = tmp_path_factory.mktemp("answers") / "answers.jsonl"
    program = 'def drive():\n    say("Holding.")\n    for _ in range(10):\n        yield autopilot()\n'
    plan = {"thoughts": {"text": "The lane is good."}, "policy": {"kind": "program", "source": program}}
    path.write_text(json.dumps({"version": 1, "instruction": "Hold the lane.", "plan": plan}))
    return f"replay/{path}"


def test_lines_of_a_pipe_are_driven_one_after_the_other(answers: str, tmp_path: Path) -> None:
    log = tmp_path / "talk.jsonl"
    done = subprocess.run(
        [*COMMAND, *FAST, "--as", "ana", "--planner", answers, "--audit", str(log)],
        input="Hold the lane.\n!that was good\nme private\n\nstop\n", capture_output=True, text=True,
        timeout=WITHIN_S, check=False,
    )  # fmt: skip
    said = " ".join(done.stdout.split())
    told = (
        "“Hold the lane.”", "The lane is good.", "✓ format-v1", "“Holding.”", "done", "“that was good”",
        "with your opinion", "Privacy mode is on", "holds your words", "The car stands", "audit head",
    )  # fmt: skip
    for words in told:
        assert words in said, (words, done.stdout, done.stderr)
    assert "\x1b" not in done.stdout, "no colour and no moving cursor in a pipe"
    assert done.returncode == 0
    assert verify(log).ok
    ((trip,),) = (json.loads(VaultMemory().export("ana"))["trips"],)  # pyright: ignore
    assert [each["text"] for each in trip["feedback"]] == ["that was good"]


@pytest.mark.slow
def test_a_line_waits_until_the_wish_before_it_is_done(tmp_path: Path) -> None:
    pytest.importorskip("libsumo", reason="needs the extra `town`")
    log = tmp_path / "talk.jsonl"
    command = [*COMMAND, "--scenario", "town", "--time-scale", "8", "--no-realtime", "--audit", str(log)]
    lines = "Take me to the station.\nWhy are we standing?\nquit\nTurn left.\n"
    done = subprocess.run(
        command, input=lines, capture_output=True, text=True, timeout=WITHIN_S, check=False,
    )  # fmt: skip
    said = " ".join(done.stdout.split())
    assert "Here we are: station" in said, done.stdout
    assert said.index("Here we are: station") < said.index("w2 asked"), "the question, too, in its turn"
    assert "w2 done" in said, "an answered question is done"
    assert "You end the session" in said
    assert "Not asked: “Turn left.”" in said or "“Turn left.” is not asked" in said


def test_a_wish_that_was_cut_short_was_not_driven() -> None:
    command = [*COMMAND, *FAST, "Park in the nearest free spot.", "--duration", "3"]
    cut = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=WITHIN_S, check=False
    )
    assert "The time of this drive is over" in cut.stdout, cut.stdout
    assert "“Park in the nearest free spot.” not done" in " ".join(cut.stdout.split())
    assert cut.returncode == 1, "the wish was not driven to its end"


@pytest.mark.server
def test_the_page_drives_the_same_session(answers: str) -> None:
    client = pytest.importorskip("websockets.sync.client", reason="needs the extra `page`")
    process = subprocess.Popen(
        [*COMMAND, *FAST, "--planner", answers, "--page", "--engine", "none"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env=os.environ | {"BROWSER": "true", "DISPLAY": ""},
    )  # fmt: skip
    assert process.stdout is not None
    with process.stdout as screen:
        line = next(line for line in screen if "The cabin page: " in line)
        url = line.split()[-1] if line.rstrip().endswith("/") else next(screen).strip()
        address = url.replace("http", "ws", 1) + "talk"
        with client.connect(address, origin=url.rsplit("/", 2)[0]) as socket:
            kinds: set[str] = set()

            def hear(kind: str, **fields: object) -> dict[str, object]:
                while True:
                    message = json.loads(socket.recv(timeout=WITHIN_S))
                    kinds.add(message["kind"])
                    if message["kind"] == kind and all(message[name] == value for name, value in fields.items()):
                        return message

            hear("session", vehicle="simulated")
            hear("scene")
            socket.send(json.dumps({"kind": "say", "text": "Hold the lane."}))
            told = hear("conversation", outcome="finished")
            assert told["thoughts"] == "The lane is good." and told["said"] == ["Holding."]
            socket.send(json.dumps({"kind": "button", "button": "command", "held": True}))
            assert "Nobody listens" in str(hear("note", trouble=True)["text"])
            socket.send(json.dumps({"kind": "stop"}))
            hear("ended", outcome="stopped")
            assert {"road", "listening", "note"} <= kinds
        assert "(simulated drive)" in screen.read(), "the terminal was told the same"
    assert process.wait(WITHIN_S) == 0
