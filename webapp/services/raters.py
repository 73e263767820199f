"""What is known of raters: their checks, repeats and times, and what screening makes of them."""

from collections.abc import Sequence

import pandas as pd
from sqlalchemy import select
from sqlalchemy.orm import Session

from evaluation.errors import DataError
from evaluation.instruments import ChoiceItem, Instrument
from evaluation.known_answers import accepted, passes
from evaluation.responses import check_responses, complete, numbers_of, score_trials
from evaluation.screening import ScreeningData, ScreeningReport, screen
from evaluation.screening.report import GATES, Gate
from evaluation.study import StudySpec
from webapp.models import Decision, Participant, Study, Trial
from webapp.services import collected, studies
from webapp.services.collected import Collected
from webapp.services.counting import COUNTING, statistics_frame

CHECK_COLUMNS = ("participant", "part", "trial", "kind", "passed")
REPEAT_COLUMNS = ("participant", "trial", "of", "clip", "instrument", "score", "first", "second")
TIMING_COLUMNS = ("participant", "part", "trial", "kind", "seconds", "watched")

_KEY = ["participant", "trial", "clip"]


def checks(session: Session, slug: str, part: str | None = None) -> pd.DataFrame:
    """Return whether each answered training trial, gold clip and instructed question was answered as known.

    Training without known answers is left out. In a check about several words each of them must have the answer.

    Returns
    -------
    pandas.DataFrame
        The columns `CHECK_COLUMNS`.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    study = studies.find(session, slug)
    return _checks(session, study, collected.read(session, study), part)


def _checks(session: Session, study: Study, rows: Sequence[Collected], part: str | None) -> pd.DataFrame:
    spec = studies.spec_of(study)
    places = session.execute(
        select(Participant.number, Trial.position, Trial.check_place)
        .join(Participant, Trial.participant_id == Participant.id)
        .where(Participant.study_id == study.id, Trial.check_place.is_not(None), Trial.answered_at.is_not(None))
        .order_by(Participant.number, Trial.position)
    )
    known = {(number + 1, position): place for number, position, place in places}
    given: dict[tuple[int, int], list[Collected]] = {key: [] for key in known}
    for one in rows:
        if (one.participant, one.trial) in given:
            given[one.participant, one.trial].append(one)
    found = []
    for (participant, position), own in given.items():
        if not own or (part is not None and own[0].part != part):
            continue
        accept = accepted(spec.part(own[0].part), own[0].kind, known[participant, position])
        if accept:
            passed = all(passes(accept, about) for about in _by_place(own))
            found.append((participant, own[0].part, position, own[0].kind, passed))
    return pd.DataFrame(found, columns=list(CHECK_COLUMNS)).astype({"passed": bool})


def _by_place(rows: Sequence[Collected]) -> list[dict[str, dict[str, object]]]:
    """Return the answers of a trial as known answers name them: for each word, if it asks about words."""
    words: list[int | None] = [*sorted({one.word for one in rows if one.word is not None})]
    places: list[dict[str, dict[str, object]]] = []
    for word in words or [None]:
        about: dict[str, dict[str, object]] = {}
        for one in rows:
            if one.word in (None, word):
                single = isinstance(one.keyed, tuple) and len(one.keyed) == 1
                about.setdefault(one.instrument, {})[one.item] = one.keyed[0] if single else one.keyed
        places.append(about)
    return places


def repeats(session: Session, slug: str, part: str | None = None) -> pd.DataFrame:
    """Return the numbers of each trial that came a second time, from both times.

    Returns
    -------
    pandas.DataFrame
        The columns `REPEAT_COLUMNS`: `trial` is the second, `of` the first time.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    study = studies.find(session, slug)
    return repeats_among(session, study, collected.read(session, study), part)


def repeats_among(session: Session, study: Study, rows: Sequence[Collected], part: str | None) -> pd.DataFrame:
    """Return what `repeats` does, from all answers of the study."""
    spec = studies.spec_of(study)
    query = (
        select(Participant.number, Trial.position, Trial.repeats)
        .join(Participant, Trial.participant_id == Participant.id)
        .where(Participant.study_id == study.id, Trial.repeats.is_not(None))
    )
    originals = {(number + 1, place): of for number, place, of in session.execute(query) if of is not None}
    frame = statistics_frame(spec, rows, part, kinds=(*COUNTING, "repeat"))
    known: dict[tuple[int, int, int, str], float] = {}
    # Two parts may each ask an instrument that has the same score.
    parts = {(one.participant, one.trial): one.part for one in rows}
    owners = {
        (own.name, name): use.use
        for own in spec.all_parts
        for use in own.instruments
        for name in numbers_of(spec.instrument(use.use))
    }
    names = {name for _, name in owners}
    scores = score_trials(spec, complete(check_responses(spec, frame)))
    for row in scores.to_dict("records"):
        participant, trial, clip = (int(row[key]) for key in _KEY)
        known.update({(participant, trial, clip, name): float(row[name]) for name in names if name in row})
    found = [
        (participant, trial, of, clip, owners[parts[participant, trial], score], score, first, second)
        for (participant, trial, clip, score), second in known.items()
        if (of := originals.get((participant, trial))) is not None
        and (first := known.get((participant, of, clip, score))) is not None
        and not pd.isna(first)
        and not pd.isna(second)
    ]
    return pd.DataFrame(found, columns=list(REPEAT_COLUMNS))


def timing(session: Session, slug: str, part: str | None = None) -> pd.DataFrame:
    """Return how long each answered trial was on the screen, and how much of its clips was played.

    Returns
    -------
    pandas.DataFrame
        The columns `TIMING_COLUMNS`; NaN where it is not known.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    return _timing(collected.trials(session, slug), part)


def _timing(trials: pd.DataFrame, part: str | None) -> pd.DataFrame:
    answered = trials[trials["state"] == "answered"]
    if part is not None:
        answered = answered[answered["part"] == part]
    return answered[list(TIMING_COLUMNS)].reset_index(drop=True)


def screening(session: Session, slug: str, part: str | None = None) -> ScreeningReport:
    """Screen the raters of a part by the study's rules and the experimenter's decisions.

    Parameters
    ----------
    part : str, optional
        Name of the part; left out, the first.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    study = studies.find(session, slug)
    spec = studies.spec_of(study)
    name = spec.all_parts[0].name if part is None else part
    return screenings(session, study, collected.read(session, study), [name])[name]


def screenings(
    session: Session, study: Study, rows: Sequence[Collected], parts: Sequence[str]
) -> dict[str, ScreeningReport]:
    """Screen the raters of some parts, by their names, from all answers of the study."""
    trials = collected.trials(session, study.slug)
    made = session.execute(
        select(Participant.number, Decision.gate, Decision.reason)
        .join(Participant, Decision.participant_id == Participant.id)
        .where(Participant.study_id == study.id)
    )
    decisions: dict[str | int, tuple[Gate, str]] = {number + 1: (_gate(gate), reason) for number, gate, reason in made}
    screening_rules = studies.spec_of(study).screening
    return {
        name: screen(screening_rules, _evidence(session, study, rows, _timing(trials, name), name), decisions=decisions)
        for name in parts
    }


def _evidence(
    session: Session, study: Study, every: Sequence[Collected], times: pd.DataFrame, name: str
) -> ScreeningData:
    """Return what the raters of a part are screened by."""
    spec = studies.spec_of(study)
    rows = [one for one in every if one.part == name and one.kind in COUNTING]
    known = _checks(session, study, every, name)
    return ScreeningData(
        scores=_scores(spec, rows, name),
        repeats=repeats_among(session, study, every, name),
        checks=known[known["kind"].isin(["gold", "instructed"])],
        timing=times[times["kind"].isin(COUNTING)].rename(columns={"watched": "share"}),
        answers=_page_answers(rows),
        ranges=_ranges(spec, rows),
    )


def _gate(name: str) -> Gate:
    for gate in GATES:
        if gate == name:
            return gate
    raise DataError(f"A decision names the gate {name!r}; there are {', '.join(GATES)}.")


def _scores(spec: StudySpec, rows: Sequence[Collected], part: str) -> pd.DataFrame:
    """Return all numbers of a part, one in each row; those about a word have the word's number at the stimulus."""
    columns = ["participant", "trial", "stimulus", "condition", "score", "value"]
    wide = score_trials(spec, complete(check_responses(spec, statistics_frame(spec, rows, part))))
    names = [name for one in map(spec.instrument, spec.instrument_names) for name in numbers_of(one) if name in wide]
    long = wide.melt(id_vars=columns[:4], value_vars=list(dict.fromkeys(names)), var_name="score", value_name="value")
    by_name = {name: spec.instrument(name) for name in {one.instrument for one in rows if one.word is not None}}
    words: dict[tuple[str, int, int, int], tuple[Collected, dict[str, object]]] = {}
    for one in rows:
        if one.word is not None:
            key = (one.instrument, one.participant, one.trial, one.word)
            words.setdefault(key, (one, {}))[1][one.item] = one.keyed
    spoken = [
        (one.participant, one.trial, f"{one.stimulus}#{one.word}", one.condition, score, value)
        for one, answers in words.values()
        for score, value in _word_numbers(by_name[one.instrument], answers)
    ]
    return pd.concat([long.dropna(subset=["value"])[columns], pd.DataFrame(spoken, columns=columns)], ignore_index=True)


def _word_numbers(instrument: Instrument, answers: dict[str, object]) -> list[tuple[str, float]]:
    if instrument.scores:
        numbers = {item: answer for item, answer in answers.items() if isinstance(answer, int)}
        return list(instrument.partial_scores(numbers).items())
    return [
        (f"{instrument.name}.{item.id}", float(answer))
        for item in instrument.items
        if item.numeric and isinstance(answer := answers.get(item.id), int)
    ]


def _page_answers(rows: Sequence[Collected]) -> pd.DataFrame:
    """Return the answers as they stood on the page; those about each clip are items of their own."""
    found = [
        (one.participant, one.trial, one.instrument, f"{one.item}-{one.clip}", one.raw)
        for one in rows
        if one.word is None and isinstance(one.raw, int)
    ]
    return pd.DataFrame(found, columns=["participant", "trial", "instrument", "item", "value"])


def _ranges(spec: StudySpec, rows: Sequence[Collected]) -> pd.DataFrame:
    """Return the ranges of items that may make a straight line; most words of a sentence are rightly alike."""
    instruments = {name: spec.instrument(name) for name in {one.instrument for one in rows if one.word is None}}
    asked = {(one.instrument, one.item, one.clip) for one in rows if one.word is None and isinstance(one.raw, int)}
    found = []
    for name, item_id, clip in sorted(asked, key=str):
        item = next(item for item in instruments[name].items if item.id == item_id)
        if item.numeric and not isinstance(item, ChoiceItem):
            found.append((name, f"{item_id}-{clip}", min(item.values), max(item.values)))
    return pd.DataFrame(found, columns=["instrument", "item", "low", "high"])
