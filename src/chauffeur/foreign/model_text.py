"""A model's answer, taken out of what the model wrote: its reasoning left out, up to the end of its turn.

Every reader of a reply, whatever it looks for, reads the answer that is found here. Reasoning is told in every spelling
that servers and chat templates leave in a text: `<think>` and its kin with attributes, in any case and any brackets,
`[THINK]`, harmony's channels with their tokens or without, blocks fenced as thinking, whole messages as JSON. It may
stand anywhere:

- what stands between an opening and a closing mark is reasoning;
- a closing mark alone ends a reasoning that the chat template began: all before it is reasoning;
- an opening mark alone begins a reasoning that never ended: the reply is unfinished, and has no answer.

A control token of a chat template ends the turn, and so does a line that begins another speaker's turn behind an
answer: what follows is a conversation that the model made up. In comments and strings of a fenced program, marks are
text.

Nothing here raises, and all of it is linear in the length of the text.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import Any, Final, cast

from chauffeur.foreign.fences import FENCE, marks_on_own_lines

MAX_REPLY_CHARS: Final = 200_000
"""Longest reply read, reasoning included; a model that babbles must cost no time."""

_NAMES: Final = (
    r"think(?:ing)?|thoughts?|reason(?:ing)?(?:_content)?|reflect(?:ion|ing)?|scratch[_-]?pad|analysis|rationale"
    r"|(?:inner|internal)[_ -]?(?:monologue|thoughts?|voice|reasoning)|chain[_ -]of[_ -]thoughts?|cot"
    r"|deliberat(?:e|ion)|(?:thought|thinking)[_ -]process|draft|plan(?:ning)?|brainstorm(?:ing)?"
    r"|internal|hidden|monologue|musings?|self[_ -]?(?:reflection|talk)|details"
)
# <think>, </seed:think>, <|end_of_thought|>, <|thinking_end|>, ◁/think▷, &lt;thinking effort="high"&gt;
_TAG: Final = (
    r"(?P<tag>(?:&lt;|\\?<|[◁＜〈⟨])\s?\\?[|｜]?\s?(?P<end>/|end_?(?:of_?)?)?\s?(?:(?:begin|start)_?(?:of_?)?)?"
    rf"(?:[a-z]{{1,12}}[:_]|ant)?(?P<about>{_NAMES})(?P<tail>_?(?:end|begin|start))?"
    rf"(?P<more>\s[\w:-]{{1,30}}=[^<>▷\n]{{0,200}})?"
    r"(?P<empty>/)?\s?\\?[|｜]?\\?(?:>|&gt;|[▷＞〉⟩]))"
    r"|(?P<square>\[(?P<shut>/|end[ _](?:of[ _])?)?(?:(?:begin|start)[ _](?:of[ _])?)?(?:think|thinking|reasoning)\])"
)
# <|channel|>analysis<|message|> of gpt-oss, <|channel>thought and <channel|> of Gemma
_CHANNEL: Final = (
    r"(?P<left><channel\|>)|(?P<channel><\|channel\|?>\s{0,3}(?P<role>\w{1,20})[^<\n]{0,60}(?:<\|message\|>)?)"
)
# <|im_end|>, <\|im\_start\|>, <｜end▁of▁sentence｜>, <|im_end where it is cut
_CONTROL: Final = (
    r"(?P<token>(?:&lt;|\\u003c|\\?<)\s?\\?[|｜]\s?/?(?P<name>[\w▁ .:\\-]{1,40})\s?\\?[|｜]\s?\\?(?:>|&gt;|\\u003e)"
    r"|<\|im_(?:start|end)|\\?</?s>|\\?</?(?:start_of_turn|end_of_turn|end_of_utterance|eos|bos)>|<\|turn>|<turn\|>"
    r"|\[/?INST\]|<</?SYS>>)"
)
_ASKERS: Final = r"human|user|passenger|customer|driver|instruction|input|question|q|wish"
# At the beginning of a line: "### Human:", "User:", "**Assistant:**"; "user" alone, where a server takes tokens out; a
# block of our own prompts
_SPEAKER: Final = (
    r"^[ \t]{0,3}(?:\#{2,6}[ \t]{0,3}|\*\*|\[)?"
    rf"(?:(?P<asker>{_ASKERS})|(?P<answerer>assistant|AI|response))"
    r"(?:\*\*|\])?[ \t]{0,3}:(?:\*\*)?"
    r"|^(?:(?P<asks>user)|(?P<answers>assistant|model))[ \t]*$|(?P<quoted>^<data name=\")"
)
_MARK: Final = re.compile("|".join((_TAG, _CHANNEL, _CONTROL, _SPEAKER, f"(?P<fence>{FENCE})")), re.I | re.M)
_NEUTRAL: Final = re.compile(r"box|python|message|constrain|tool|vision|image|ref|quad|solution|response|answer", re.I)
"""Control tokens that stand around parts of an answer."""
_BEGINS: Final = re.compile(r"start|begin|assistant|bos|header|model|sep|inst|<s>|sys|\|turn", re.I)
"""Control tokens that may stand in front of an answer."""
_ROLE: Final = re.compile(r"\s{0,3}(assistant|model|user|human|system|tool)\b:?", re.I)
_ANSWERER: Final = re.compile(
    _SPEAKER.replace(f"(?P<asker>{_ASKERS})", "(?!)").replace("(?P<asks>user)", "(?!)"), re.I | re.M
)
_ANSWERING: Final = re.compile(r"^[ \t]*(?:`{3}|~{3}|def |import |REFUSE)|[{]|\[\s{0,9}[\[(]", re.M)
"""How a program, an object, a matrix, waypoints or a refusal begins."""
_PLAIN: Final = (
    # harmony and Granite, their tokens taken out by a server
    (re.compile(r"\A\s*(?:assistant)?analysis(?=[A-Z\"'(])"), re.compile(r"assistant\s?final(?=\s?\S)")),
    (
        re.compile(r"\A\s*Here(?:'s|’s| is) my thought process:", re.I),
        re.compile(r"Here(?:'s|’s| is) my response:", re.I),
    ),
    (re.compile(r"\A\s*Thinking\.\.\.\s"), re.compile(r"\.\.\.\s?done thinking\.?")),  # Ollama's command line
)
_DETAILS: Final = "detai"
_MESSAGE: Final = frozenset(
    {"role", "content", "reasoning", "reasoning_content", "reasoning_details", "thinking", "refusal", "tool_calls"}
)


@dataclass(frozen=True, slots=True)
class ModelText:
    """A model's text, split.

    Attributes:
        answer: Its answer; empty where it never came to one.
        cut: Whether the answer broke off: at a limit, or the reasoning never ended.
        unfinished: Whether the reasoning never ended.
    """

    answer: str
    cut: bool = False
    unfinished: bool = False


def read_model_text(text: str, *, cut: bool = False) -> ModelText:
    """The answer in a reply.

    Args:
        text: As it came.
        cut: Whether it ended at a limit instead of by the model's own will.
    """
    text = _content(text[:MAX_REPLY_CHARS]).replace("\r\n", "\n").replace("\r", "\n").replace("\ufeff", "")
    for begins, ends in _PLAIN:
        if begins.match(text):
            end = ends.search(text)
            if end is None:
                return ModelText("", cut=True, unfinished=True)
            text = text[end.end() :]
    scan = _Scan(marks_on_own_lines(text))
    scan.run()
    if scan.thinking:
        return ModelText("", cut=True, unfinished=True)
    return ModelText("".join(scan.kept), cut=cut and not scan.over)


def answer_in(text: str) -> str:
    """The answer in a reply, for readers whose answers cannot be cut in a way that matters."""
    return read_model_text(text).answer


def _content(text: str) -> str:
    """The content of a whole message given as JSON, as some gateways hand it on; the text itself otherwise."""
    if not text.lstrip().startswith("{") or '"content"' not in text:
        return text
    try:
        found: Any = json.loads(text)
    except (ValueError, RecursionError):
        return text
    if not isinstance(found, dict) or not _MESSAGE.issuperset(cast("dict[str, Any]", found)):
        return text
    content: Any = cast("dict[str, Any]", found)["content"]
    return content if isinstance(content, str) else ""


class _Scan:
    """One walk over the marks of a text."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.kept: list[str] = []
        self.thinking: list[str] = []
        """Names of the marks that are open, the outermost first."""
        self.over = False
        self._from = 0
        self._fence = ""
        self._blocks = 0
        self._spoken = False
        """True if anything but blanks was kept."""
        self._lasts: dict[re.Pattern[str], int] = {}

    def run(self) -> None:
        for mark in _MARK.finditer(self.text):
            if mark.start() >= self._from or self.thinking:
                self._take(mark)
            if self.over:
                return
        if not self.thinking:
            self._keep(len(self.text))

    def _keep(self, end: int) -> None:
        piece = self.text[self._from : end]
        self.kept.append(piece)
        self._from = end
        self._spoken = self._spoken or (not piece.isspace() and bool(piece))

    def _take(self, mark: re.Match[str]) -> None:
        if mark["fence"] is not None:
            self._at_fence(mark)
        elif self._is_said(mark):
            return
        elif mark["tag"] is not None:
            self._at_tag(mark, _family(mark["about"]))
        elif mark["square"] is not None:
            self._at_mark(mark, "square", ends=mark["shut"] is not None)
        elif mark["left"] is not None:
            self._at_mark(mark, "channel", ends=True)
        elif mark["channel"] is not None:
            spoken = mark["role"].lower() in ("final", "answer", "response", "text")
            self._at_mark(mark, "channel", ends=spoken)
        elif mark["token"] is not None:
            self._at_token(mark)
        elif not self.thinking and not self._fence:
            self._at_speaker(mark)

    def _is_said(self, mark: re.Match[str]) -> bool:
        """True if a mark is only spoken of: in a code span, or in a comment or string of a fenced program."""
        before, behind = self.text[: mark.start()][-2:], self.text[mark.end() : mark.end() + 1]
        if before.endswith("`") and before != "``" and behind == "`":
            return True
        if not self._fence or self.thinking:
            return False
        line = self.text[self.text.rfind("\n", 0, mark.start()) + 1 : mark.start()]
        return "#" in line or line.count('"') % 2 == 1 or line.count("'") % 2 == 1

    def _at_fence(self, mark: re.Match[str]) -> None:
        marks, label = mark["marks"], mark["label"].lower()
        if self.thinking:
            if self.thinking == [marks] and not label:
                self.thinking.clear()
                self._from = mark.end()
        elif self._fence:
            if marks.startswith(self._fence) and not label:
                self._fence = ""
                self._blocks += 1
        elif label and re.fullmatch(_NAMES, label):
            self._begin(mark, marks)
        else:
            self._fence = marks

    def _at_tag(self, mark: re.Match[str], about: str) -> None:
        ends = mark["end"] is not None or (mark["tail"] or "").lower().endswith("end")
        plain = about == _DETAILS and (about not in self.thinking if ends else "reasoning" not in (mark["more"] or ""))
        if mark["empty"] is None and not plain:
            self._at_mark(mark, about, ends=ends)

    def _at_mark(self, mark: re.Match[str], about: str, *, ends: bool) -> None:
        if not ends:
            if not self.thinking:
                self._begin(mark, about)
            elif about not in self.thinking:  # a second one of the same name is a slip or a mention
                self.thinking.append(about)
            return
        if not self.thinking:
            self.kept.clear()
            self._fence, self._blocks, self._spoken = "", 0, False
        elif about in self.thinking:
            del self.thinking[self.thinking.index(about) :]
        else:
            self.thinking.clear()
        if not self.thinking:
            self._from = mark.end()

    def _begin(self, mark: re.Match[str], about: str) -> None:
        self._keep(mark.start())
        self.thinking.append(about)

    def _at_token(self, mark: re.Match[str]) -> None:
        name = mark["name"] or mark["token"]
        role = _ROLE.match(self.text, mark.end())
        own = role is None or role[1].lower() in ("assistant", "model")
        if self.thinking:
            # Harmony ends its reasoning's message, not its turn.
            self.over = not ("channel" in self.thinking and (name in ("end", "message") or (name == "start" and own)))
            return
        self._keep(mark.start())
        if _NEUTRAL.search(name):
            self._from = mark.end()
        elif self._spoken or self._fence or not (own and _BEGINS.search(name)):
            self.over = True
        else:
            self._from = mark.end() if role is None else role.end()

    def _at_speaker(self, mark: re.Match[str]) -> None:
        """Another speaker's turn ends the answer, unless the model repeats what it was asked before it answers."""
        answerer = mark["answerer"] or mark["answers"]
        if not self._spoken and not self.text[self._from : mark.start()].strip():
            self._from = mark.end() if answerer else self._from
        elif self._blocks or (
            not answerer and (self._last(_ANSWERER) >= mark.end() or self._last(_ANSWERING) < mark.end())
        ):
            self._keep(mark.start())
            self.over = True

    def _last(self, pattern: re.Pattern[str]) -> int:
        """Start of the last match; -1 if there is none."""
        if pattern not in self._lasts:
            self._lasts[pattern] = max((found.start() for found in pattern.finditer(self.text)), default=-1)
        return self._lasts[pattern]


def _family(name: str) -> str:
    """One name for the spellings of a tag: models open `<think>` and close `</thinking>`."""
    return name.lower()[:5]
