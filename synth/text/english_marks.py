"""What the tokens of English prosodic words contribute to appraisal."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from synth.text.lexicon import english_phrases, high_words, polarities, word_lists
from synth.text.marks import HIGH, KEY_FACT, Mark, Role
from synth.text.scanning import normal
from synth.text.sentence import TextWord

_TOKEN = re.compile(r"\d[\d.,:]*\w*|[^\W\d_]+(?:['-][^\W\d_]+)*")
_CLAUSE_END = re.compile(r"[,.;:!?()\[\]\"…—–。，！？；：]")
_SENTENCE_END = re.compile(r"[.!?…:。！？：]")
_ADJECTIVAL = re.compile(r"\w{3,}(?:ful|less|ous|able|ible|ical|ish|wards?)")
_LONGEST_PHRASE = max(map(len, english_phrases()))
_BE = frozenset(["am", "is", "are", "was", "were", "be", "been", "being", "isn't", "aren't", "wasn't", "weren't"])


@dataclass(frozen=True, slots=True)
class _Token:
    written: str
    text: str
    word: int
    clause: int
    opens_sentence: bool


def english_marks(words: Sequence[TextWord], text: str) -> list[Mark]:
    """Return the marks of prosodic words, token by token.

    Parameters
    ----------
    words : sequence of TextWord
        Prosodic words of an English text.
    text : str
        The text.

    Returns
    -------
    list of Mark
        In order; words of which nothing is left (symbols) have none.
    """
    tokens = list(_tokens(words, normal(text)))
    phrases = dict(_phrases(tokens))
    return [phrases.get(place) or _mark(tokens, place) for place in range(len(tokens))]


def _tokens(words: Sequence[TextWord], text: str) -> Iterator[_Token]:
    breaks = word_lists("en")["clause_breaks"]
    clause, end, opens = 0, 0, True
    capitals_tell = any(character.islower() for character in text)
    for index, word in enumerate(words):
        for found in _TOKEN.finditer(text, word.start, word.end):
            gap, plain = text[end : found.start()], found[0].casefold()
            if _CLAUSE_END.search(gap) or plain in breaks:
                clause += 1
            opens = opens or not capitals_tell or _SENTENCE_END.search(gap) is not None
            yield _Token(found[0], plain, index, clause, opens)
            end, opens = found.end(), False


def _phrases(tokens: Sequence[_Token]) -> Iterator[tuple[int, Mark]]:
    """Yield the place and mark of each token that belongs to a phrase: the last has what the phrase contributes."""
    known = english_phrases()
    place = 0
    while place < len(tokens):
        for length in range(min(_LONGEST_PHRASE, len(tokens) - place), 0, -1):
            found = tokens[place : place + length]
            key = tuple(token.text for token in found)
            if key in known and found[0].clause == found[-1].clause:
                P, A = known[key]
                for step, token in enumerate(found):
                    last = step == length - 1
                    yield (
                        place + step,
                        Mark(token.text, token.word, token.clause, P=P if last else 0, A=A if last else 0.0),
                    )
                place += length - 1
                break
        place += 1


def _mark(tokens: Sequence[_Token], place: int) -> Mark:
    token = tokens[place]
    plain = Mark(token.text, token.word, token.clause)
    if token.text[0].isdigit() or _is_name(token):
        return replace(plain, A=KEY_FACT)
    acting = _acting(tokens, place, plain)
    if acting is not None or token.text in word_lists("en")["function"]:
        return acting or plain
    P, A = _appraisal(token.text)
    if A < KEY_FACT and _is_key_fact(tokens, place, appraises=P != 0):
        A = KEY_FACT
    return replace(plain, P=P, A=A, graded=_can_have_degrees(token.text))


def _acting(tokens: Sequence[_Token], place: int, plain: Mark) -> Mark | None:
    """Return the mark of a token that acts on those after it; None for others."""
    text, lists = plain.text, word_lists("en")
    if text in lists["negation"]:
        return replace(plain, role=_negation_role(tokens, place))
    if text in lists["lesser"]:
        return replace(plain, role=Role.LESSER, A=HIGH if text == "least" else KEY_FACT)
    if text in lists["degree"] and _is_degree(tokens, place):
        return replace(plain, role=Role.DEGREE, A=HIGH, graded=True)
    if text in lists["comparative"]:
        return replace(plain, role=Role.DEGREE, P=_appraisal(text)[0], A=KEY_FACT, graded=True)
    return None


def _is_name(token: _Token) -> bool:
    """Tell whether a capital letter makes the token a name: not at the start of a sentence, and not "I"."""
    return (
        token.written[0].isupper()
        and not token.opens_sentence
        and not token.text.startswith("i'")
        and token.text != "i"
    )


def _negation_role(tokens: Sequence[_Token], place: int) -> Role:
    lists = word_lists("en")
    before, after = _neighbour(tokens, place, -1), _neighbour(tokens, place, 1)
    if tokens[place].text.endswith("n't") and after in lists["question_subjects"]:
        return Role.PLAIN
    if tokens[place].text in lists["incomparable"] and after is not None and _is_comparative(after):
        return Role.PLAIN
    opens = before in {None, "please"}
    inverted = tokens[place].text == "never" and after in lists["function"]
    if opens and tokens[place].text in lists["prohibition"] and not inverted:
        return Role.PROHIBITION
    opened_by_do = before == "do" and _neighbour(tokens, place, -2) in {None, "please"}
    return Role.PROHIBITION if tokens[place].text == "not" and opened_by_do else Role.NEGATION


def _is_comparative(text: str) -> bool:
    return text in word_lists("en")["comparative"] or _compared_stem(text, "er") is not None


def _is_degree(tokens: Sequence[_Token], place: int) -> bool:
    after = _neighbour(tokens, place, 1)
    if tokens[place].text in word_lists("en")["degree_only_before_graded"]:
        return after is not None and _can_have_degrees(after)
    return True


def _neighbour(tokens: Sequence[_Token], place: int, step: int) -> str | None:
    """Return the text of a token some steps away in the same clause, or None."""
    other = place + step
    if 0 <= other < len(tokens) and tokens[other].clause == tokens[place].clause:
        return tokens[other].text
    return None


def _appraisal(text: str) -> tuple[int, float]:
    """Return P and A of a token by itself: of a comparative or superlative, the P of its stem."""
    known = polarities("en")
    if text in known:
        P = known[text]
        high = text in high_words("en") or text in word_lists("en")["superlative"] or _compared_stem(text, "est")
        return P, HIGH if high else KEY_FACT if _compared_stem(text, "er") else 0.0
    for ending, A in (("est", HIGH), ("er", KEY_FACT)):
        stem = _compared_stem(text, ending)
        if stem is not None:
            return known.get(stem, 0), A
    stem = next((stem for stem in _adverb_stems(text) if stem in known), None)
    if stem is not None:
        return known[stem], HIGH if stem in high_words("en") else 0.0
    if "-" in text:
        parts = [_appraisal(part) for part in text.split("-") if part]
        return next((P for P, _ in reversed(parts) if P), 0), max((A for _, A in parts), default=0.0)
    return 0, HIGH if text in high_words("en") else 0.0


def _compared_stem(text: str, ending: str) -> str | None:
    """Return the adjective that a word with -er or -est comes from; None if there is none."""
    if not text.endswith(ending) or len(text) - len(ending) < 2:
        return None
    lists = word_lists("en")
    bare = text.removesuffix(ending)
    stems = [bare, f"{bare}e"]
    if bare.endswith("i"):
        stems.append(f"{bare[:-1]}y")
    if bare[-1] == bare[-2]:
        stems.append(bare[:-1])
    adjectives = lists["gradable"] | lists["commendatory"] | lists["derogatory"]
    return next((stem for stem in stems if stem in adjectives), None)


def _adverb_stems(text: str) -> tuple[str, ...]:
    if not text.endswith("ly"):
        return ()
    bare = text.removesuffix("ly")
    return (bare, f"{bare}le", f"{bare[:-1]}y" if bare.endswith("i") else f"{bare}l")


def _can_have_degrees(text: str) -> bool:
    lists = word_lists("en")
    return (
        text in lists["gradable"]
        or text in lists["adjectives"]
        or _ADJECTIVAL.fullmatch(text) is not None
        or (text.endswith("ly") and text not in lists["function"])
        or _appraisal(text) != (0, 0.0)
    )


def _is_key_fact(tokens: Sequence[_Token], place: int, *, appraises: bool) -> bool:
    """Tell whether a token carries content: nouns and verbs, but not those that say little by themselves."""
    text, lists = tokens[place].text, word_lists("en")
    if appraises:
        return text not in lists["attitude_verbs"] and (
            _closes_noun_phrase(tokens, place) or _has_object(tokens, place)
        )
    if text in lists["light_verbs"]:
        return _follows_modal(tokens, place)
    return not (text in lists["generic_nouns"] or text in lists["attitude_verbs"] or _can_have_degrees(text))


def _closes_noun_phrase(tokens: Sequence[_Token], place: int) -> bool:
    """Tell a noun that appraises ("your patience", "the long delay") from an adjective ("is kind", "the kind man")."""
    lists = word_lists("en")
    text, after = tokens[place].text, _neighbour(tokens, place, 1)
    if text in lists["gradable"] or _ADJECTIVAL.fullmatch(text) or (after and after not in lists["function"]):
        return False
    step = -1
    while (before := _neighbour(tokens, place, step)) is not None:
        if before in lists["phrase_openers"]:
            return True
        if before in lists["function"] or not _can_have_degrees(before):
            return False
        step -= 1
    return False


def _has_object(tokens: Sequence[_Token], place: int) -> bool:
    """Tell whether a token that appraises is a verb with an object ("destroyed the pier")."""
    before, after = _neighbour(tokens, place, -1), _neighbour(tokens, place, 1)
    return after in word_lists("en")["objects"] and before not in _BE


def _follows_modal(tokens: Sequence[_Token], place: int) -> bool:
    """Tell whether the token says what one can do: "you can see", but not the question "can you see"."""
    return _neighbour(tokens, place, -1) in word_lists("en")["modal"] and _neighbour(tokens, place, -2) is not None
