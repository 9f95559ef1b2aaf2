"""Compares the claims of an explanation with its program, and with what then happened."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from chauffeur.concept import Faithfulness, Mismatch
from chauffeur.safety.faithfulness.claims import LANES, Claim
from chauffeur.safety.faithfulness.comparison import Comparison, faster, moving, turning
from chauffeur.safety.faithfulness.driven import driven_mismatches
from chauffeur.safety.faithfulness.facts import Effect, Facts, FactSurroundings


def judge(
    text: str, facts: Facts, surroundings: FactSurroundings | None = None, effects: Sequence[Effect] = ()
) -> Faithfulness:
    """Compare a text with what its program does.

    Args:
        text: The thoughts R.
        facts: What reading finds in P.
        surroundings: Where the ego is; without it a plain target speed is neither faster nor slower.
        effects: What P did on copies of the scene, where it was run. They speak where reading is at a loss.
    """
    if not facts.readable:
        return Faithfulness(True, 1.0, (), 0)
    case = _Case(text, facts, surroundings or FactSurroundings(), effects)
    return _weighed(case, case.mismatches())


def judge_drive(text: str, facts: Facts, surroundings: FactSurroundings, effect: Effect) -> Faithfulness:
    """Compare a text with what happened when its program drove.

    What reading the program finds by itself counts only where the drive shows it too.

    Args:
        text: The thoughts R.
        facts: What reading finds in P.
        surroundings: Where the ego was when the drive began.
        effect: What happened.
    """
    read = judge(text, facts, surroundings)
    resolved = judge(text, facts, surroundings, [effect])
    case = Comparison(text, facts, surroundings, [effect])
    seen = [] if effect.failed else list(driven_mismatches(case, effect))
    about = {(one.kind, one.sentence) for one in (*read.mismatches, *seen)}
    return _weighed(case, [*(one for one in resolved.mismatches if (one.kind, one.sentence) not in about), *seen])


def _weighed(case: Comparison, mismatches: Iterable[Mismatch]) -> Faithfulness:
    found = tuple(dict.fromkeys(mismatches))
    told = sum(claim.firm for claim in case.claims)
    held = max(0, told - len(found))
    score = 1.0 if not found else held / (held + 2.0 * len(found))
    return Faithfulness(not found, score, found, told)


class _Case(Comparison):
    """All comparisons of one text with one program."""

    def mismatches(self) -> Iterator[Mismatch]:
        for claim in self.claims:
            if claim.firm:
                yield from self._held(claim)
            elif not claim.denied and not self._outweighed(claim):
                yield from (one for one in self._held(claim) if one.kind in ("wrong-side", "wrong-sign"))
        yield from self._order()
        yield from self._unclaimed()

    def _held(self, claim: Claim) -> Iterator[Mismatch]:
        match claim.matter:
            case "lane" | "overtake" | "back" | "pull over":
                yield from self._lane(claim)
            case "turn":
                yield from self._turn(claim)
            case "stop":
                yield from self._stop(claim)
            case "speed":
                yield from self._speed(claim)
            case "gap":
                yield from self._gap(claim)
            case "check":
                yield from self._check(claim)
            case "number":
                yield from self._number(claim)
            case "stay":
                yield from self._stay(claim)
            case "go":
                pass

    def _outweighed(self, claim: Claim) -> bool:
        """True if something firm is said of the matter of a loose claim, or it is only an aside."""
        matters = LANES if claim.matter in LANES else {claim.matter}
        return claim.aside or any(one.firm and one.matter in ("stay", *matters) for one in self.claims)

    # Lanes, turns, stops ----------------------------------------------------------------------------------------------

    def _lane(self, claim: Claim) -> Iterator[Mismatch]:
        if claim.denied:
            yield from self._denied_lane(claim)
            return
        if not self.moves:
            if not (claim.matter == "back" and self.crossing) and not self.turns:
                yield Mismatch("not-done", claim.sentence, "it never changes lanes")
            return
        first = self.moves[0][1]
        known = all(deed.sides for _, deed in self.moves)
        out = frozenset(side for _, deed in self.moves if not deed.back for side in deed.sides) - {0}
        back = frozenset(side for _, deed in self.moves if deed.back for side in deed.sides) - {0}
        if not known and self.driven_sides:
            out, back, known = self.driven_sides, frozenset(), True
        sides = out | back
        if claim.matter == "back":
            if known and not back and not claim.sides & sides and len(sides) < 2:
                yield Mismatch("not-done", claim.sentence, "it never goes back to a lane it was in", first.line)
            elif claim.sides and back and not claim.sides & back:
                yield Mismatch("wrong-side", claim.sentence, f"it {moving(back)}", first.line)
            return
        if out and (claim.matter == "overtake" or "back" in self.told):
            sides = out
        told = claim.sides or (frozenset({1}) if claim.matter == "pull over" else claim.sides)
        if known and told and not told & sides:
            yield Mismatch("wrong-side", claim.sentence, f"it {moving(sides)}", first.line)
        elif known and claim.count:
            yield from self._lane_count(claim)

    def _lane_count(self, claim: Claim) -> Iterator[Mismatch]:
        moves = [deed for _, deed in self.moves if not claim.sides or deed.sides & claim.sides]
        most = sum(deed.times for deed in moves)
        if moves and all(0 < deed.times < 5 for deed in moves) and claim.count != most:
            lanes = "1 lane" if most == 1 else f"{most} lanes"
            yield Mismatch("wrong-number", claim.sentence, f"it crosses {lanes} at most", moves[0].line)

    def _denied_lane(self, claim: Claim) -> Iterator[Mismatch]:
        for _, deed in self.moves:
            wrong = deed.sides <= claim.sides if deed.sides and claim.sides else not self.firm & LANES
            if deed.back if claim.matter == "back" else wrong:
                yield Mismatch("not-claimed", claim.sentence, f"it {moving(deed.sides)}", deed.line)
                return

    def _turn(self, claim: Claim) -> Iterator[Mismatch]:
        done = frozenset(side for _, deed in self.turns for side in deed.sides)
        line = self.turns[0][1].line if self.turns else None
        if claim.denied:
            if claim.sides and claim.sides == done:
                yield Mismatch("not-claimed", claim.sentence, f"it {turning(done)}", line)
        elif not self.turns and not self.moves:
            yield Mismatch("not-done", claim.sentence, "it chooses no way over the intersection")
        elif claim.sides and done and not claim.sides & done:
            yield Mismatch("wrong-side", claim.sentence, f"it {turning(done)}", line)

    def _stop(self, claim: Claim) -> Iterator[Mismatch]:
        stops = [deed for _, deed in self.speeds if deed.stops]
        if claim.denied:
            if stops and not self.firm & {"stop", "pull over"}:
                yield Mismatch("not-claimed", claim.sentence, "it stops", stops[0].line)
        elif not stops and not self.crossing and not any(effect.stood for effect in self.effects):
            if all(deed.terms for _, deed in self.speeds):
                yield Mismatch("not-done", claim.sentence, "it never stops")
        elif stops and claim.lasting:
            last = max(place for place, deed in self.speeds if deed.stops)
            on = [deed for place, deed in self.speeds if place > last and any(t.offset > 1.0 for t in deed.terms)]
            yield from (
                Mismatch("not-claimed", claim.sentence, "it drives on afterwards", deed.line) for deed in on[:1]
            )

    # Speeds, gaps, numbers --------------------------------------------------------------------------------------------

    def _speed(self, claim: Claim) -> Iterator[Mismatch]:
        signs = self.numbers.signs() or self.driven_signs
        line = next((deed.line for _, deed in self.speeds), None)
        limits = [term for term in self.numbers.wanted() if term.base == "limit"]
        if claim.at_limit and limits:
            off = limits[0].offset
            if claim.sign * off < 0.0 or (not claim.sign and all(abs(term.offset) > 0.3 for term in limits)):
                kind = "wrong-sign" if claim.sign else "wrong-number"
                yield Mismatch(kind, claim.sentence, f"it drives at the limit {off:+.4g} m/s", line)
        elif not self.speeds:
            if (claim.sign or claim.at_limit) and not self.numbers.follows and not (self.crossing and self.turns):
                yield Mismatch("not-done", claim.sentence, "it sets no speed")
        elif claim.sign and not claim.at_limit and signs and not signs & {claim.sign, 0}:
            yield Mismatch("wrong-sign", claim.sentence, f"it drives {faster(signs)}", line)
        elif claim.sign and signs == {0} and not self.numbers.unknown_speed and not self._says_its_speed():
            yield Mismatch("not-done", claim.sentence, "it keeps its speed", line)

    def _says_its_speed(self) -> bool:
        said = [claim.quantity for claim in self.claims if claim.quantity is not None and claim.firm]
        return any(self.numbers.supports(one, exact=True) for one in said if one.dimension == "speed")

    def _gap(self, claim: Claim) -> Iterator[Mismatch]:
        if claim.denied:
            return
        headways = self.facts.of("headway")
        signs = self.numbers.gap_signs()
        if not headways and not self.numbers.follows:
            # A slower car leaves more room, and a faster one closes up.
            if claim.sign and -claim.sign not in self.numbers.signs():
                yield Mismatch("not-done", claim.sentence, "it does nothing about the gap")
        elif claim.sign and signs and not signs & {claim.sign, 0}:
            way = "a larger" if 1 in signs else "a smaller"
            yield Mismatch(
                "wrong-sign", claim.sentence, f"it wants {way} gap", headways[0][1].line if headways else None
            )

    def _number(self, claim: Claim) -> Iterator[Mismatch]:
        quantity = claim.quantity
        if quantity is None or self.numbers.supports(quantity, exact=claim.exact) or self._driven_at(quantity.value):
            return
        if quantity.dimension == "speed" and self.numbers.follows and not claim.exact:
            return  # it goes by the gap: a speed told is an example of what comes of that
        known = self.numbers.told(quantity.dimension)
        instead = f"it has {known}" if known else "it has no such number"
        yield Mismatch("wrong-number", claim.sentence, f"{instead}, not {quantity.said}")

    def _driven_at(self, speed_mps: float) -> bool:
        """True if the runs of a program whose numbers cannot be read ended at a speed that is told."""
        ends = [effect.speeds_mps[1] for effect in self.effects]
        return self.numbers.unknown_speed and any(abs(one - speed_mps) < 1.0 for one in ends)

    # Conditions, what is left alone or not mentioned, order -----------------------------------------------------------

    def _check(self, claim: Claim) -> Iterator[Mismatch]:
        if not claim.denied and not self.facts.asks_free:
            line = next((deed.line for _, deed in (*self.moves, *self.turns)), None)
            yield Mismatch("missing-condition", claim.sentence, "it never asks whether the way is free", line)

    def _stay(self, claim: Claim) -> Iterator[Mismatch]:
        about = claim.about or {"lane", "speed"}
        if "lane" in about and self.moves and not self.firm & (LANES | {"turn"}):
            deed = self.moves[0][1]
            yield Mismatch("not-claimed", claim.sentence, f"it {moving(deed.sides)}", deed.line)
        if "speed" in about and not self.firm & {"speed", "stop", "pull over", "overtake"}:
            yield from self._untold_speed(claim.sentence)
        if not claim.about and self.turns and not self.firm & (LANES | {"turn"}):
            deed = self.turns[0][1]
            yield Mismatch("not-claimed", claim.sentence, f"it {turning(deed.sides)}", deed.line)

    def _untold_speed(self, sentence: str = "") -> Iterator[Mismatch]:
        signs = self.numbers.signs()
        if signs and 0 not in signs and not self.numbers.follows:
            yield Mismatch("not-claimed", sentence, f"it drives {faster(signs)}", self.speeds[0][1].line)

    def _unclaimed(self) -> Iterator[Mismatch]:
        """Yield deeds of the program that the text does not mention."""
        told = self.told | self.mentions
        if self.unsure or not any(claim.firm for claim in self.claims):
            return
        if self.moves and not self.told & (LANES | {"turn"}):
            deed = self.moves[0][1]
            yield Mismatch("not-claimed", "", f"it {moving(deed.sides)}", deed.line)
        if self.turns and not told & (LANES | {"turn"}):
            deed = self.turns[0][1]
            yield Mismatch("not-claimed", "", f"it {turning(deed.sides)}", deed.line)
        stops = [deed for _, deed in self.speeds if deed.stops]
        if stops and not self.crossing and not told & {"stop", "pull over"}:
            yield Mismatch("not-claimed", "", "it stops", stops[0].line)
        backs = [deed for _, deed in self.moves if deed.back]
        named = {side for claim in self.claims if claim.matter in LANES and not claim.aside for side in claim.sides}
        if backs and "back" not in told and len(named) < 2 and told & LANES:
            yield Mismatch("not-claimed", "", "it goes back to its lane afterwards", backs[0].line)
        also = {"speed", "stop", "pull over", "overtake"} | (set() if self.alone else {"gap", "turn"})
        if not (self.told | ({"speed"} & self.mentions if not self.alone else set())) & also:
            yield from self._untold_speed()

    def _order(self) -> Iterator[Mismatch]:
        """Two things that the text tells in another order than the program does them."""
        timed = [claim for claim in self.claims if claim.firm and not claim.denied]
        for one in timed:
            for other in timed:
                if one.order >= other.order or one.matter == other.matter or not (one.told or other.told):
                    continue
                first, second = self._places(one), self._places(other)
                if first and second and min(first) > max(second):
                    line = self.facts.deeds[min(first)].line
                    yield Mismatch("wrong-order", other.sentence, "it does that first, and the other later", line)
                    return

    def _places(self, claim: Claim) -> list[int]:
        """Places in the program of the deeds that a claim tells."""
        match claim.matter:
            case "lane" | "pull over":
                return [p for p, deed in self.moves if not claim.sides or deed.sides & claim.sides]
            case "overtake" | "back":
                return [p for p, deed in self.moves if deed.back is (claim.matter == "back")]
            case "stop":
                return [p for p, deed in self.speeds if deed.stops]
            case "gap":
                return [p for p, _ in self.facts.of("headway")]
            case "speed" if claim.sign:
                runs = [(p, deed) for p, deed in self.speeds if not deed.stops]
                return [p for p, deed in runs if any(self.numbers.sign(t) == claim.sign for t in deed.terms)]
            case "number" if claim.quantity is not None:
                return self.numbers.places(claim.quantity)
            case _:
                return []
