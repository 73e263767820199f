"""What a trial asks: its instruments as they stand on the page, and the answers read from its form."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from evaluation.annotation.discussion import DISCUSSION
from evaluation.errors import AnswerError
from evaluation.instruments import Answer, ChoiceItem, Instrument, Item
from evaluation.instruments.display import Display, arrange, keyed
from evaluation.seeding import bit_generator
from evaluation.study import StudySpec
from evaluation.study_parts import InstrumentUse
from webapp.errors import ConflictError
from webapp.models import Participant, Trial


@dataclass(frozen=True)
class Asked:
    """An instrument on a page.

    Attributes
    ----------
    instrument : Instrument
        With the items of this very trial (one for each clip or word where it asks so).
    display : Display
        The order of its items, and those whose poles changed sides.
    """

    instrument: Instrument
    display: Display

    @property
    def items(self) -> tuple[Item, ...]:
        """The items in the order of the page."""
        by_id = {item.id: item for item in self.instrument.items}
        return tuple(by_id[name] for name in self.display.order)


@dataclass(frozen=True)
class Submission:
    """The answers to one instrument: as they stood on the page, how that was laid out, and keyed."""

    raw: Mapping[str, Answer]
    display: Mapping[str, object]
    answers: Mapping[str, Answer]


@dataclass
class _Read:
    submissions: dict[str, Submission] = field(default_factory=dict)
    problems: dict[str, str] = field(default_factory=dict)


class AnswersRefusedError(ConflictError):
    """Some answers are missing or out of range; `problems` maps field names to what is wrong."""

    def __init__(self, problems: Mapping[str, str]) -> None:
        super().__init__("Some questions have no answer yet")
        self.problems = dict(problems)


def field_name(instrument: str, item: str) -> str:
    """Return the form field of an instrument's item."""
    return f"{instrument}.{item}"


def asked(spec: StudySpec, participant: Participant, trial: Trial) -> tuple[Asked, ...]:
    """Return what a trial asks, in the order of the page; the same whenever it is asked for."""
    words = tuple(trial.stimulus.words or ()) if trial.stimulus is not None else ()
    found = []
    for use in _uses(spec, trial):
        instrument = spec.instrument(use.use).expanded(clips=max(1, len(trial.stimuli)), words=words)
        bits = bit_generator(spec.seed, spec.slug, "display", use.use, participant.number, trial.position)
        found.append(Asked(instrument, arrange(instrument, shuffle=use.shuffle, flip=use.flip, bits=bits)))
    if discusses(spec, trial):
        found.append(Asked(DISCUSSION, Display(tuple(item.id for item in DISCUSSION.items), frozenset())))
    return tuple(found)


def discusses(spec: StudySpec, trial: Trial) -> bool:
    """Tell whether a trial belongs to an annotation by consensus, where raters may give their reasons."""
    annotation = spec.part(trial.part).annotation
    return annotation is not None and annotation.mode == "consensus" and trial.round_id is not None


def _uses(spec: StudySpec, trial: Trial) -> Sequence[InstrumentUse]:
    # Questions without a clip stand as in the file: an instructed one names what is to be seen on the page.
    return spec.part(trial.part).instruments if trial.instrument is None else [InstrumentUse(use=trial.instrument)]


def read_form(asks: Sequence[Asked], form: Mapping[str, Sequence[str]]) -> dict[str, Submission]:
    """Read and check the answers of a trial.

    Parameters
    ----------
    asks : sequence of Asked
        What the trial asks.
    form : mapping
        Field name (see `field_name`) to the values as sent, one for each ticked box of a multiple choice.

    Returns
    -------
    dict
        Instrument name to the answers. What is optional and was left out is not there.

    Raises
    ------
    AnswersRefusedError
        With one entry for each item that is missing or out of range. A missing answer is never replaced.
    """
    read = _Read()
    for ask in asks:
        name = ask.instrument.name
        shown: dict[str, Answer] = {}
        for item in ask.items:
            sent = form.get(field_name(name, item.id), ())
            try:
                answer = ask.instrument.validate_item(item, list(sent) if _several(item) else next(iter(sent), None))
            except AnswerError as error:
                read.problems[field_name(name, item.id)] = str(error)
                continue
            if answer is not None:
                shown[item.id] = answer
        if shown:
            answers = keyed(ask.instrument, ask.display, shown)
            read.submissions[name] = Submission(shown, ask.display.to_dict(), answers)
    if read.problems:
        raise AnswersRefusedError(read.problems)
    return read.submissions


def _several(item: Item) -> bool:
    return isinstance(item, ChoiceItem) and item.multiple
