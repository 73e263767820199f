"""What is known of raters: their checks, repeats and times, and what screening makes of them."""

from collections.abc import Sequence
from typing import Any, NamedTuple

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
from webapp.services import collected, studies, trial_table
from webapp.services.counting import COUNTING, statistics_frame

CHECK_COLUMNS = ("participant", "part", "trial", "kind", "passed")
REPEAT_COLUMNS = ("participant", "trial", "of", "clip", "instrument", "score", "first", "second")
TIMING_COLUMNS = ("participant", "part", "trial", "kind", "seconds", "watched")

_KEY = ["participant", "trial", "clip"]
_CHECKING = ("training", "gold", "instructed")
_OF_SCORES = ("variance", "z_score", "kurtosis", "bias", "inconsistency", "correlation")


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


def _checks(session: Session, study: Study, rows: pd.DataFrame, part: str | None) -> pd.DataFrame:
    spec = studies.spec_of(study)
    places = session.execute(
        select(Participant.number, Trial.position, Trial.check_place)
        .join(Participant, Trial.participant_id == Participant.id)
        .where(Participant.study_id == study.id, Trial.check_place.is_not(None), Trial.answered_at.is_not(None))
        .order_by(Participant.number, Trial.position)
    )
    known = {(number + 1, position): place for number, position, place in places}
    checking = rows if part is None else rows[rows["part"] == part]
    checking = checking[checking["kind"].isin(_CHECKING)]
    verdicts: dict[tuple[object, ...], bool | None] = {}
    found = []
    pages: dict[tuple[int, int], list[_Answer]] = {}
    about: dict[tuple[int, int], tuple[str, str]] = {}
    columns = ["participant", "trial", "part", "kind", "instrument", "item", "word", "keyed"]
    for participant, position, name, kind, *answer in checking[columns].itertuples(index=False, name=None):
        pages.setdefault((participant, position), []).append(_Answer(*answer))
        about[participant, position] = (name, kind)
    for key in sorted(pages):
        name, kind = about[key]
        page = (name, kind, known.get(key), tuple(pages[key]))
        if page not in verdicts:
            accept = accepted(spec.part(name), kind, known.get(key))
            verdicts[page] = all(passes(accept, one) for one in _by_place(pages[key])) if accept else None
        if (passed := verdicts[page]) is not None:
            found.append((key[0], name, key[1], kind, passed))
    return pd.DataFrame(found, columns=list(CHECK_COLUMNS)).astype({"passed": bool})


class _Answer(NamedTuple):
    """An answer on a page; `word` is missing unless it is about a word."""

    instrument: str
    item: str
    word: Any
    keyed: Any


def _by_place(answers: Sequence[_Answer]) -> list[dict[str, dict[str, object]]]:
    """Return the answers of a trial as known answers name them: for each word, if it asks about words."""
    words = sorted({one.word for one in answers if not pd.isna(one.word)})
    places: list[dict[str, dict[str, object]]] = []
    for word in words or [None]:
        about: dict[str, dict[str, object]] = {}
        for instrument, item, own, keyed in answers:
            if pd.isna(own) or own == word:
                single = isinstance(keyed, tuple) and len(keyed) == 1
                about.setdefault(instrument, {})[item] = keyed[0] if single else keyed
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


def repeats_among(session: Session, study: Study, rows: pd.DataFrame, part: str | None) -> pd.DataFrame:
    """Return what `repeats` does, from all answers of the study."""
    spec = studies.spec_of(study)
    query = (
        select(Participant.number, Trial.position, Trial.repeats)
        .join(Participant, Trial.participant_id == Participant.id)
        .where(Participant.study_id == study.id, Trial.repeats.is_not(None))
    )
    originals = {(number + 1, place): of for number, place, of in session.execute(query) if of is not None}
    again = {*originals, *((participant, of) for (participant, _), of in originals.items())}
    keys = zip(rows["participant"].tolist(), rows["trial"].tolist(), strict=True)
    rows = rows[[key in again for key in keys]] if originals else rows.iloc[:0]
    frame = statistics_frame(spec, rows, part, kinds=(*COUNTING, "repeat"))
    known: dict[tuple[int, int, int, str], float] = {}
    # Two parts may each ask an instrument that has the same score.
    pages = rows.drop_duplicates(["participant", "trial"])[["participant", "trial", "part"]]
    parts = {(participant, trial): str(name) for participant, trial, name in pages.itertuples(index=False)}
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
    return _timing(trial_table.trials(session, slug), part)


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


def screenings(session: Session, study: Study, rows: pd.DataFrame, parts: Sequence[str]) -> dict[str, ScreeningReport]:
    """Screen the raters of some parts, by their names, from all answers of the study."""
    made = session.execute(
        select(Participant.number, Decision.gate, Decision.reason)
        .join(Participant, Decision.participant_id == Participant.id)
        .where(Participant.study_id == study.id)
    )
    decisions: dict[str | int, tuple[Gate, str]] = {number + 1: (_gate(gate), reason) for number, gate, reason in made}
    screening_rules = studies.spec_of(study).screening
    return {name: screen(screening_rules, _evidence(session, study, rows, name), decisions=decisions) for name in parts}


def _evidence(session: Session, study: Study, every: pd.DataFrame, name: str) -> ScreeningData:
    """Return what the raters of a part are screened by: the tables that the study's rules look at."""
    spec = studies.spec_of(study)

    def asked(*rules: str) -> bool:
        return any(getattr(spec.screening, rule) is not None for rule in rules)

    rows = every[(every["part"] == name) & every["kind"].isin(COUNTING)]
    tables: dict[str, pd.DataFrame] = {}
    if asked(*_OF_SCORES):
        tables["scores"] = _scores(spec, rows, name)
    if asked("repeats"):
        tables["repeats"] = repeats_among(session, study, every, name)
    if asked("gold", "instructed"):
        known = _checks(session, study, every, name)
        tables["checks"] = known[known["kind"].isin(["gold", "instructed"])]
    if asked("watched", "seconds"):
        times = _timing(trial_table.trials(session, study.slug), name)
        tables["timing"] = times[times["kind"].isin(COUNTING)].rename(columns={"watched": "share"})
    if asked("straight_lining"):
        tables["answers"] = _page_answers(rows)
        tables["ranges"] = _ranges(spec, rows)
    return ScreeningData(**tables, raters=tuple(every.loc[every["part"] == name, "participant"].unique().tolist()))


def _gate(name: str) -> Gate:
    for gate in GATES:
        if gate == name:
            return gate
    raise DataError(f"A decision names the gate {name!r}; there are {', '.join(GATES)}.")


def _scores(spec: StudySpec, rows: pd.DataFrame, part: str) -> pd.DataFrame:
    """Return all numbers of a part, one in each row; those about a word have the word's number at the stimulus."""
    columns = ["participant", "trial", "stimulus", "condition", "score", "value"]
    wide = score_trials(spec, complete(check_responses(spec, statistics_frame(spec, rows, part))))
    names = [name for one in map(spec.instrument, spec.instrument_names) for name in numbers_of(one) if name in wide]
    long = wide.melt(id_vars=columns[:4], value_vars=list(dict.fromkeys(names)), var_name="score", value_name="value")
    spoken = []
    by_word = rows[rows["word"].notna()].astype({"stimulus": object, "condition": object})
    for key, own in by_word.groupby(["instrument", "participant", "trial", "word"], observed=True, sort=False):
        instrument, participant, trial, word = key
        answers = dict(zip(own["item"], own["keyed"], strict=True))
        about = (participant, trial, f"{own['stimulus'].iloc[0]}#{word}", own["condition"].iloc[0])
        spoken += [(*about, *one) for one in _word_numbers(spec.instrument(str(instrument)), answers)]
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


def _page_answers(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the answers as they stood on the page; those about each clip are items of their own."""
    own = _numeric(rows)
    return pd.DataFrame(
        {
            "participant": own["participant"],
            "trial": own["trial"],
            "instrument": own["instrument"].astype(object),
            "item": own["item"].astype(str) + "-" + own["clip"].astype(str),
            "value": own["raw"].astype(int),
        }
    )


def _numeric(rows: pd.DataFrame) -> pd.DataFrame:
    return rows[rows["word"].isna() & rows["raw"].map(lambda raw: isinstance(raw, int)).astype(bool)]


def _ranges(spec: StudySpec, rows: pd.DataFrame) -> pd.DataFrame:
    """Return the ranges of items that may make a straight line; most words of a sentence are rightly alike."""
    asked = _numeric(rows)[["instrument", "item", "clip"]].drop_duplicates().astype({"instrument": str, "item": str})
    found = []
    for name, item_id, clip in sorted(asked.itertuples(index=False), key=str):
        item = next(item for item in spec.instrument(name).items if item.id == item_id)
        if item.numeric and not isinstance(item, ChoiceItem):
            found.append((name, f"{item_id}-{clip}", min(item.values), max(item.values)))
    return pd.DataFrame(found, columns=["instrument", "item", "low", "high"])
