"""Where faces lie in the space of pleasure, arousal and dominance: error against the input, words, ellipses."""

from functools import partial

import pandas as pd

from evaluation.instruments import ChoiceItem
from evaluation.report.analysis import StudyReport
from evaluation.report.block import Block, attempt, stacked
from evaluation.report.ratings import Unavailable
from evaluation.report.section import NOTHING, Section, label
from evaluation.responses import DIMENSIONS, INPUT_COLUMNS, asked_about_clips, pad_instruments, several, statistical
from evaluation.statistics import wording
from evaluation.statistics.confusion import Confusion, confusion
from evaluation.statistics.ellipse import Ellipse, ellipse
from evaluation.statistics.emotion_words import NearestWords, nearest_words
from evaluation.statistics.pad_space import DimensionComparison, compare_pad
from evaluation.statistics.result import Result

COVERAGES = (0.5, 0.95)


def pad_results(report: StudyReport) -> Block | None:
    """Return bias and error of the evaluated PAD, the nearest words and the ellipses; None without evaluated PAD."""
    if not pad_instruments(report.spec) or report.pad_by_stimulus.empty:
        return None
    sections: list[Section] = []
    frames: dict[str, pd.DataFrame] = {}
    for made in (_errors(report), _nearest(report), _ellipses(report)):
        if made is not None:
            section, frame = made
            sections.append(section)
            frames[section.name] = frame
    return Block(tuple(sections), frames)


def _errors(report: StudyReport) -> tuple[Section, pd.DataFrame] | None:
    known = report.pad_by_stimulus.dropna(subset=[*INPUT_COLUMNS, *DIMENSIONS])
    if known.empty:
        return None
    found = attempt(lambda: compare_pad(known[list(INPUT_COLUMNS)].to_numpy(), known[list(DIMENSIONS)].to_numpy()))
    title = "Error of the evaluated PAD"
    header = ("Dimension", "Stimuli", "Bias", "95% CI", "RMSE", "MAE", "Slope", "95% CI ", "Intercept")
    if isinstance(found, Unavailable):
        return Section("pad_error", title, header, 1, (), (found.reason,)), pd.DataFrame(columns=["name"])
    notes = (
        "Evaluated less input PAD over the stimuli. A slope far from 1 shows a difference of scale, r cannot show one.",
        f"Mean distance of input and evaluated PAD: {wording.number(found.mean_distance)}.",
        *found.flags,
        *(flag for one in found.dimensions for flag in one.flags),
    )
    rows = tuple(_error(one) for one in found.dimensions)
    frame = found.to_frame().assign(mean_distance=found.mean_distance, common_slope=found.common_slope)
    return Section("pad_error", title, header, 1, rows, tuple(dict.fromkeys(notes))), frame


def _error(found: DimensionComparison) -> tuple[str, ...]:
    line = found.line
    slope_ci = None if line is None else line.slope_ci
    return (
        found.name,
        str(found.n),
        wording.number(found.bias),
        f"{wording.number(found.bias_ci[0])} to {wording.number(found.bias_ci[1])}",
        wording.number(found.rmse),
        wording.number(found.mae),
        NOTHING if line is None else wording.number(line.slope),
        NOTHING if slope_ci is None else f"{wording.number(slope_ci[0])} to {wording.number(slope_ci[1])}",
        NOTHING if line is None else wording.number(line.intercept),
    )


def _nearest(report: StudyReport) -> tuple[Section, pd.DataFrame]:
    table = report.pad_by_stimulus
    found = attempt(lambda: nearest_words(table[list(DIMENSIONS)].to_numpy()))
    header = ("Stimulus", "Nearest word", "Distance")
    title = "Nearest emotion words"
    if not isinstance(found, NearestWords):
        return Section("nearest_words", title, header, 2, (), (found.reason,)), pd.DataFrame(columns=["stimulus"])
    rows = tuple(
        (label(report.spec.stimulus(stimulus).label), " or ".join(words), wording.number(float(distance)))
        for stimulus, words, distance in zip(table["stimulus"], found.nearest, found.distance, strict=True)
    )
    frame = pd.DataFrame(
        {
            "stimulus": table["stimulus"],
            "word": [" or ".join(words) for words in found.nearest],
            "distance": found.distance,
        }
    )
    note = (
        "The word of Jia et al. (2013), Table 8, whose input PAD is nearest to the evaluated PAD (Euclidean distance). "
        "Raters keep away from the ends of the scale, which draws all faces towards words near the middle."
    )
    return Section("nearest_words", title, header, 2, rows, (note, *found.flags)), frame


def _ellipses(report: StudyReport) -> tuple[Section, pd.DataFrame]:
    rated = dict(list(report.scores.dropna(subset=list(DIMENSIONS)).groupby("stimulus", sort=False)))
    frames, rows, notes = [], [], []
    for stimulus in report.pad_by_stimulus["stimulus"]:
        own = rated[stimulus]
        for coverage in COVERAGES:
            points = own[list(DIMENSIONS)].to_numpy()
            found = attempt(partial(ellipse, points, coverage=coverage, category=str(stimulus)))
            if not isinstance(found, Ellipse):
                notes.append(found.reason)
                continue
            frames.append(found.to_frame().assign(stimulus=stimulus, coverage=coverage))
            rows.append(
                (
                    label(report.spec.stimulus(str(stimulus)).label),
                    f"{100 * coverage:g} %",
                    *(wording.number(float(value)) for value in found.centre),
                    " × ".join(wording.number(float(value)) for value in found.half_axes),
                    wording.share(found.share_inside),
                )
            )
    header = ("Stimulus", "Coverage", *DIMENSIONS, "Half axes", "Ratings inside")
    note = (
        "Ellipsoids that hold half and 95 % of a normal distribution with the mean and covariance of the ratings of "
        "all conditions together."
    )
    section = Section(
        "pad_ellipsoids", "Ellipsoids of the ratings", header, 2, tuple(rows), tuple(dict.fromkeys([note, *notes]))
    )
    return section, pd.concat(frames, ignore_index=True) if frames else pd.DataFrame(columns=["stimulus"])


def intended_words(report: StudyReport) -> Block | None:
    """Return how often raters chose the word that was intended; None if no question offers the stimuli's words.

    The intended answer of a stimulus is the option of a single choice that has the stimulus's label or id.
    """
    sections, frames, sentences = [], {}, []
    for instrument in asked_about_clips(report.spec):
        for item in statistical(instrument):
            if not isinstance(item, ChoiceItem) or several(item):
                continue
            options = {option.value: label(option.label) for option in item.options}
            places = {name.casefold(): value for value, name in options.items()}
            intended = {
                one.id: places[name.casefold()]
                for one in report.spec.stimuli
                for name in (one.id, label(one.label))
                if name.casefold() in places
            }
            own = report.answers[
                (report.answers["instrument"] == instrument.name) & (report.answers["item"] == item.id)
            ]
            own = own[own["stimulus"].isin(list(intended))]
            if own.empty or len(intended) < 2:
                continue
            question = f"{instrument.name}_{item.id}"
            words = [options[intended[stimulus]] for stimulus in own["stimulus"]]
            chosen = [options[value] for value in own["keyed"]]
            found = attempt(partial(confusion, words, chosen, labels=list(options.values())))
            section = _confused(question, found)
            sections.append(section)
            frames[section.name] = stacked({question: found}, "question")
            if isinstance(found, Confusion):
                frames[f"confusion_{question}_counts"] = found.matrix().reset_index()
                sentences.append(f"Intended and chosen words ({instrument.name}.{item.id}): {found.apa()}")
    return Block(tuple(sections), frames, tuple(sentences)) if sections else None


def _confused(question: str, found: Result | Unavailable) -> Section:
    name, title = f"confusion_{question}", "Intended and chosen words"
    header = ("Word", "Intended", "Chosen", "Recall", "Precision", "F1", "Hu")
    if not isinstance(found, Confusion):
        reason = found.reason if isinstance(found, Unavailable) else ""
        return Section(name, title, header, 1, (), (reason,))
    rows = tuple(
        (
            word,
            str(int(found.counts[place].sum())),
            str(int(found.counts[:, place].sum())),
            *(_share(values[place]) for values in (found.recall, found.precision, found.f1, found.hu)),
        )
        for place, word in enumerate(found.labels)
    )
    note = (
        "Hu: the unbiased hit rate of Wagner (1993), recall times precision. The counts are in the file of that name."
    )
    return Section(name, title, header, 1, rows, (found.apa(), note, *found.flags))


def _share(value: float) -> str:
    return NOTHING if pd.isna(value) else wording.share(float(value))
