"""`chauffeur show speech`: what the car would hear in a recording, or from the microphone, and how long it took."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from chauffeur.cli.labels import NOT_HEARD

if TYPE_CHECKING:
    from rich.console import Console

    from chauffeur.speech import Heard, Recogniser


def hear(
    file: Annotated[Path | None, typer.Argument(metavar="FILE", help="A recording: WAV, or what ffmpeg reads.")] = None,
    *,
    engine: Annotated[
        str, typer.Option(help="`grammar` (offline, driving words only), `whisper/<folder>` or `endpoint/<model>`.")
    ] = "grammar",
    base_url: Annotated[str | None, typer.Option(metavar="URL", help="The endpoint; usually ends in /v1.")] = None,
    timeout: Annotated[float, typer.Option(metavar="S", help="For one answer of the endpoint.")] = 10.0,
    button: Annotated[
        str, typer.Option(metavar="WORD", help="As if the button was held: command or evaluate. No hotword is needed.")
    ] = "",
    microphone: Annotated[bool, typer.Option("--microphone", help="Listen to the microphone until Ctrl-C.")] = False,
    device: Annotated[str, typer.Option(metavar="NAME", help="Microphone: number or part of its name.")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object a line.")] = False,
) -> None:
    """Hear what was said to the car: its hotword, the words, how sure they are, and where the time went.

    The sound is erased once it has been heard. With an endpoint it leaves this machine.
    """
    from chauffeur.cli.console import stdout
    from chauffeur.cli.failures import FAILED
    from chauffeur.concept import ConfigError
    from chauffeur.speech import HOTWORDS, open_recogniser, read_recording

    if (file is None) != microphone:
        raise ConfigError("Give a recording, or --microphone.", hint="E.g. chauffeur show speech wish.wav")
    if button and button not in HOTWORDS:
        raise ConfigError(f"There is no button {button!r}.", hint=f"Known: {', '.join(HOTWORDS)}.")
    if button and microphone:
        raise ConfigError("A terminal has no button to hold.", hint="Say the hotword instead.")
    recording = None if file is None else read_recording(file)
    name, _, model = engine.strip().partition("/")
    recogniser = open_recogniser(name, model=model, base_url=base_url, timeout_s=timeout)
    console = stdout()
    if recording is None:
        found = _listen(recogniser, device)
    else:
        from chauffeur.speech import hear_recording

        held = "command" if button == "command" else "evaluate" if button else None
        found = iter(hear_recording(recording, recogniser, button=held))
    count = wishes = 0
    for heard in found:
        count += 1
        wishes += heard.status == "heard"
        console.print_json(json.dumps(_plain(heard)), indent=None) if as_json else _show(console, heard)
    if count == 0 and recording is not None:
        nothing = {"status": "nothing", "text": "", "engine": recogniser.name, "notes": list(recording.notes)}
        if as_json:
            console.print_json(json.dumps(nothing), indent=None)
        else:
            console.print("Nobody speaks in it.", style="yellow")
            for note in recording.notes:
                console.print(f"  {note}", style="dim", markup=False)
    if wishes == 0:
        if count and not button and not as_json:
            console.print("No button was held: say “command ...” to the car, or give --button command.", style="dim")
        raise typer.Exit(FAILED)


def _listen(recogniser: Recogniser, device: str) -> Iterator[Heard]:
    from chauffeur.cli.console import stderr
    from chauffeur.speech import Listener, Microphone

    # A terminal has no button; who chose a remote engine and the microphone gets both, and is told.
    listener = Listener(recogniser, open_microphone=True)
    where = "All that is said goes to the endpoint." if recogniser.remote else "The sound stays on this machine."
    with Microphone(int(device) if device.isdecimal() else device or None) as microphone:
        stderr().print(f"Listening; say “command ...”. {where} Ctrl-C ends it.", style="dim")
        try:
            for chunk in microphone:
                yield from listener.feed(chunk)
        except KeyboardInterrupt:
            listener.stop()


def _plain(heard: Heard) -> dict[str, Any]:
    """What was heard, for JSON; durations in s."""
    found = asdict(heard)
    found["timing"] = {name: round(value, 4) for name, value in found["timing"].items()}
    found["timing"]["after_speech_s"] = round(heard.timing.after_speech_s, 4)
    return found


def _show(console: Console, heard: Heard) -> None:
    from rich.text import Text

    from chauffeur.cli.console import columns, plain

    if heard.status == "heard":
        console.print(Text.assemble((f"{heard.hotword}: ", "bold"), plain(heard.text)))
    else:
        console.print(Text.assemble((f"{NOT_HEARD[heard.status]}: ", "yellow"), plain(heard.reason)))
    time = heard.timing
    rows: list[tuple[str, Text]] = [("engine", plain(heard.engine))]
    if heard.confidence is not None:
        rows.append(("confidence", Text(f"{heard.confidence:.2f}")))
    if heard.status == "heard":
        rows.append(("before driving", Text("ask the person" if heard.to_confirm else "nothing to ask")))
    rows.append(("speech", Text(f"{time.speech_s:.2f} s, found in {time.detect_s:.3f} s")))
    rows.append(
        (
            "after speech",
            Text(f"{time.after_speech_s:.2f} s: {time.wait_s:.2f} s waiting, {time.recognise_s:.3f} s recognising"),
        )
    )
    rows.extend(("note", plain(note)) for note in heard.notes)
    console.print(columns(rows))
