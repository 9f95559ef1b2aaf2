"""Each thing that can be wrong with an audit log has a code: one table of logs, and what is found in them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

import pytest
from audit_logs import KEY, OTHER_KEY, chain, fields, look
from golden_sentences import compare

from chauffeur.concept import DataError
from chauffeur.safety.audit import Kind
from chauffeur.safety.audit.entries import NO_RECORD, canonical, seal
from chauffeur.safety.audit.findings import SENTENCES, Code, LineCode, TextCode
from chauffeur.safety.audit.keys import key_name
from chauffeur.safety.audit.texts import REFERENCES, hide

Record = tuple[Kind, dict[str, Any]]
OPENED: Record = ("opened", {"format": 1, "key": ""})
UNDER_KEY: Record = ("opened", {"format": 1, "key": key_name(KEY)})
WISH: Record = ("wish", {})
PLAN: Record = ("plan", {})
CLOSED: Record = ("closed", {})
REDACTION: Record = ("redaction", {})
LOG = chain(OPENED, WISH, PLAN, ("verdict", {"passed": True}), CLOSED)
SEALED = chain(UNDER_KEY, WISH, CLOSED, key=KEY)
REFERENCE, VALUE = hide({"wish": "faster"}, private=False, key=None, make_salt=bytes)
SAID = chain(OPENED, ("wish", {REFERENCES: REFERENCE}), CLOSED)
ERASED = {"wish": {"redacted": True}}


def changed(line: bytes, **changes: Any) -> bytes:
    return canonical(fields(line) | changes) + b"\n"


def with_texts(texts: Mapping[str, Any]) -> list[bytes]:
    return [SAID[0], changed(SAID[1], texts=texts), SAID[2]]


def announced(*records: object, named: object = ...) -> list[bytes]:
    last, named = fields(SAID[-1]), [*records] if named is ... else named
    line, _ = seal(3, last["hash"], "redaction", last["time"], {"records": named}, {}, None)
    return [*with_texts(ERASED), line]


def bare(line: bytes) -> list[bytes]:
    return [LOG[0], line + b"\n", *LOG[2:]]


FIELDS = {"body": {}, "hash": "h", "kind": "wish", "prev": "p", "seq": 0, "time": "t"}
FORGED = changed(LOG[4], body={"forged": 1})
OTHER = chain(OPENED, ("wish", {"other": 1}), PLAN)

Findings = list[tuple[int | None, Code]]
CASES: dict[str, tuple[list[bytes], Mapping[str, Any], Findings]] = {
    "as written": (LOG, {}, []),
    "as written, under a key": (SEALED, {"key": KEY}, []),
    "as written, with its texts": (with_texts(VALUE), {}, []),
    "empty": ([], {}, [(None, "empty")]),
    "torn only": ([b"torn"], {}, [(None, "empty")]),
    "no JSON": (bare(b"junk"), {}, [(2, "not_json")]),
    "no line": (bare(b""), {}, [(2, "not_json")]),
    "no UTF-8": (bare(b"\xff"), {}, [(2, "not_json")]),
    "a list": (bare(b"[]"), {}, [(2, "not_json")]),
    "deep": (bare(b"[" * 100_000), {}, [(2, "not_json")]),
    "no fields": (bare(b"{}"), {}, [(2, "not_fields")]),
    "a field less": (bare(canonical(FIELDS).replace(b'"hash":"h",', b"")), {}, [(2, "not_fields")]),
    "a field more": (bare(canonical(FIELDS | {"more": 1})), {}, [(2, "not_fields")]),
    "a space": (bare(canonical(FIELDS) + b" "), {}, [(2, "not_canonical")]),
    "a return": (bare(canonical(FIELDS) + b"\r"), {}, [(2, "not_canonical")]),
    "another order": (
        bare(canonical(FIELDS).replace(b'"body":{},', b"")[:-1] + b',"body":{}}'), {}, [(2, "not_canonical")],
    ),
    "other escapes": (bare(canonical(FIELDS | {"time": "Ü"}).replace(b"00dc", b"00DC")), {}, [(2, "not_canonical")]),
    "letters": (bare(canonical(FIELDS | {"time": "Ü"}).replace(b"\\u00dc", "Ü".encode())), {}, [(2, "not_canonical")]),
    "twice": (bare(canonical(FIELDS).replace(b'"seq":', b'"seq":9,"seq":')), {}, [(2, "not_canonical")]),
    "NaN": (bare(canonical(FIELDS | {"seq": 7}).replace(b"7", b"NaN")), {}, [(2, "not_canonical")]),
    "-Infinity": (bare(canonical(FIELDS | {"seq": 7}).replace(b"7", b"-Infinity")), {}, [(2, "not_canonical")]),
    **{
        f"{name} {value!r}": (bare(canonical(FIELDS | {name: value})), {}, [(2, "not_typed")])
        for name, value in (
            ("seq", True), ("seq", -1), ("seq", 1 << 63), ("seq", 1.0), ("seq", "0"), ("kind", "plans"), ("body", []),
            ("texts", []), ("texts", {"a": "b"}), ("texts", {"a": {}, "b": 1}), ("time", 1), ("prev", None),
            ("hash", 2), ("mac", 3),
        )
    },
    "no record at first": ([b"{}\n", *LOG[1:]], {}, [(1, "not_fields")]),
    "tied again behind one": ([LOG[0], b"[]\n", LOG[2], LOG[4]], {}, [(2, "not_json"), (4, "missing")]),
    "no beginning": (LOG[1:], {}, [(1, "begin_missing")]),
    "begins at 1": ([seal(1, NO_RECORD, "opened", "", {}, {}, None)[0]], {}, [(1, "begin_missing")]),
    "begins behind another": ([seal(0, "f" * 64, "opened", "", {}, {}, None)[0]], {}, [(1, "begin_missing")]),
    "begins with a wish": ([seal(0, NO_RECORD, "wish", "", {}, {}, None)[0]], {}, [(1, "begin_missing")]),
    "one removed": ([LOG[0], *LOG[2:]], {}, [(2, "missing")]),
    "three removed": ([LOG[0], LOG[4]], {}, [(2, "missing")]),
    "repeated": ([*LOG[:2], LOG[1], *LOG[2:]], {}, [(3, "out_of_place")]),
    "exchanged": (
        [LOG[0], LOG[2], LOG[1], *LOG[3:]], {}, [(2, "missing"), (3, "out_of_place"), (4, "missing")],
    ),
    "of another chain": ([*LOG[:2], OTHER[2], *LOG[3:]], {}, [(3, "exchanged"), (4, "exchanged")]),
    "changed": ([*LOG[:3], changed(LOG[3], body={"passed": False}), LOG[4]], {}, [(4, "changed")]),
    "changed at first, to a newer format": (
        [changed(LOG[0], body={"format": 3, "key": ""}), *LOG[1:]], {}, [(1, "changed")],
    ),
    "changed with its hash": (
        [LOG[0], seal(1, fields(LOG[0])["hash"], "wish", "", {"x": 1}, {}, None)[0], *LOG[2:]], {}, [(3, "exchanged")],
    ),
    "no such head": (LOG, {"head": "e" * 64}, [(None, "head_absent")]),
    "a head that a forged record states": (
        # Else a log with anything in it would pass whose last record only states the hash.
        [*LOG[:4], FORGED], {"head": fields(FORGED)["hash"]}, [(5, "changed"), (None, "head_absent")],
    ),
    "cut off before the head": (LOG[:3], {"head": fields(LOG[4])["hash"]}, [(None, "head_absent")]),
    "cut off without a head": (LOG[:3], {}, []),  # the chain does not know how long it should be: docs/audit.md
    "a key for none": (LOG, {"key": KEY}, [(1, "no_key")]),
    "another key": (SEALED, {"key": OTHER_KEY}, [(1, "other_key")]),
    "sealed with another key": (
        chain(UNDER_KEY, WISH, key=OTHER_KEY), {"key": KEY}, [(1, "seal_wrong"), (2, "seal_wrong")],
    ),
    "sealed with half a letter": (
        [changed(SEALED[0], mac="\ud800"), *SEALED[1:]], {"key": KEY}, [(1, "changed"), (1, "seal_wrong")],
    ),
    "sealed with another key, none given": (chain(UNDER_KEY, WISH, key=OTHER_KEY), {}, []),
    "without seals": (chain(UNDER_KEY, WISH), {"key": KEY}, [(1, "seal_missing"), (2, "seal_missing")]),
    "without seals, no key given": (chain(UNDER_KEY, WISH), {}, [(1, "seal_missing"), (2, "seal_missing")]),
    "with seals of no key": (chain(OPENED, WISH, key=KEY), {}, [(1, "seal_added"), (2, "seal_added")]),
    "no beginning, under a key": (SEALED[1:], {"key": KEY}, [(1, "begin_missing")]),
    "no beginning, under another key": (
        SEALED[1:], {"key": OTHER_KEY}, [(1, "begin_missing"), (1, "seal_wrong"), (2, "seal_wrong")],
    ),
    "a text more": (with_texts({**VALUE, "more": {}}), {}, [(2, "text_added")]),
    "a text less": (with_texts({}), {}, [(2, "text_removed")]),
    "another text": (with_texts({"wish": VALUE["wish"] | {"text": "slower"}}), {}, [(2, "text_changed")]),
    "all of it": (
        [LOG[0], changed(chain(OPENED, ("wish", {REFERENCES: {"a": {}, "b": {}}}))[1], texts={"c": {}, "a": {}})],
        {}, [(2, "text_added"), (2, "text_changed"), (2, "text_removed")],
    ),
    "erased and not said": (with_texts(ERASED), {}, [(2, "erased_unsaid")]),
    "erased and said": (announced(1), {}, []),
    "erased and said of another": (announced(2), {}, [(2, "erased_unsaid")]),
    "erased and said of texts": (announced("1", [1], None), {}, [(2, "erased_unsaid")]),
    **{f"erased and said of {named!r}": (announced(named=named), {}, [(2, "erased_unsaid")])  # found by fuzzing
       for named in (None, 3, 0.5, True, {}, "abc", [[1]], ["1"])},
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_what_is_found(case: str) -> None:
    lines, given, expected = CASES[case]
    found = look(b"".join(lines), **given)
    assert [(one.line, one.code) for one in found.findings] == expected
    assert found.ok is (not expected)


def test_every_code_has_a_sentence() -> None:
    codes = {code for group in get_args(Code) for code in (get_args(group) or (group,))}
    assert codes == set(SENTENCES) >= {*get_args(LineCode), *get_args(TextCode)}
    found = {case: look(b"".join(lines), **given).findings for case, (lines, given, _) in CASES.items()}
    first = {one.code: case for case, findings in reversed(found.items()) for one in findings}
    compare("audit: findings", {case: found[case] for case in sorted({*first.values()})})


def test_a_hundred_findings_are_kept() -> None:
    for junk, kept, more in ((99, 99, 0), (100, 100, 0), (101, 100, 1), (500, 100, 400)):
        found = look(LOG[0] + b"junk\n" * junk)
        assert (len(found.findings), found.more_findings) == (kept, more)


@pytest.mark.parametrize(
    ("content", "said"),
    [(b"Dear diary\n", "is not an audit log"), (chain(("opened", {"format": 3}))[0], "reads up to 2")],
)
def test_what_is_no_log_that_can_be_read_is_refused(content: bytes, said: str) -> None:
    with pytest.raises(DataError, match=said):
        look(content)


@pytest.mark.parametrize("first", [("opened", {"format": 0}), ("opened", {"format": "3"}), ("wish", {"format": 3})])
def test_only_an_opening_record_says_the_format(first: Record) -> None:
    assert look(chain(first)[0]).records == 1


GAP: Record = ("gap", {"lost": {"actuation": 3, "wish": 2}})
FIGURES: dict[str, tuple[bytes, Mapping[str, Any]]] = {
    "whole": (b"".join(chain(OPENED, GAP, WISH, GAP, CLOSED)), {
        "records": 5, "kinds": {"opened": 1, "gap": 2, "wish": 1, "closed": 1}, "torn_bytes": 0, "redacted": 0,
        "withheld": 0, "lost": 10, "closed": True, "key": "none", "after_head": None, "format": 1, "unclosed": 0,
    }),
    "torn": (b"".join(LOG) + b"torn", {"torn_bytes": 4, "closed": False, "records": 5}),
    "empty": (b"", {"records": 0, "head": NO_RECORD, "closed": False, "key": "none"}),
    "erased behind its end": (b"".join(chain(OPENED, CLOSED, REDACTION)), {"closed": True}),
    "erased before its end": (b"".join(chain(OPENED, WISH, REDACTION)), {"closed": False}),
    "gone on with": (b"".join(chain(OPENED, CLOSED, WISH)), {"closed": False, "unclosed": 0}),
    "gone on with after a crash": (b"".join(chain(OPENED, WISH, OPENED, CLOSED)), {"closed": True, "unclosed": 1}),
    "erased": (b"".join(announced(1)), {"redacted": 1, "closed": True}),
    "under a key": (b"".join(SEALED), {"key": "unchecked", "head": fields(SEALED[-1])["hash"]}),
    "no beginning, under a key": (b"".join(SEALED[1:]), {"key": "unchecked"}),
    **{f"lost {lost!r}": (b"".join(chain(OPENED, ("gap", {"lost": lost}))), {"lost": counted}) for lost, counted in
       (({}, 0), ({"wish": "2", "plan": 1}, 1))},
    **{f"lost {lost!r}": (b"".join(chain(OPENED, ("gap", {"lost": lost}))), {"lost": 0}) for lost in ([3], None, 7)},
    "lost nothing said": (b"".join(chain(OPENED, ("gap", {}))), {"lost": 0}),
}  # fmt: skip


@pytest.mark.parametrize("case", FIGURES)
def test_what_is_counted(case: str) -> None:
    content, expected = FIGURES[case]
    found = look(content)
    assert {name: getattr(found, name) for name in expected} == expected


def test_records_behind_the_head_are_counted() -> None:
    heads = [fields(line)["hash"] for line in LOG]
    assert [look(b"".join(LOG), head=head).after_head for head in heads] == [4, 3, 2, 1, 0]


def test_what_is_said_of_the_key() -> None:
    assert [look(b"".join(lines), key=KEY).key for lines in (SEALED, LOG)] == ["checked", "none"]
