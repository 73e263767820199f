"""What must fit together in a study file: names, languages, cells, and the answers that checks accept."""

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel
from pydantic_core import InitErrorDetails, PydanticCustomError

from evaluation import instruments
from evaluation.errors import EvaluationError
from evaluation.instruments import Instrument
from evaluation.instruments.definition import DefinitionError
from evaluation.study_parts import Answers, Part, Translated

if TYPE_CHECKING:
    from evaluation.study import StudySpec

Place = tuple[str | int, ...]

_LIMITS = {
    **dict.fromkeys(("gold", "instructed", "watched", "straight_lining", "kurtosis"), (0.0, 1.0)),
    "correlation": (-1.0, 1.0),
}
"""Least and largest limit of the rules of screening; of the others, from 0 on."""


def inconsistencies(spec: "StudySpec") -> Iterator[InitErrorDetails]:
    """Yield what does not fit together, each with its place in the file.

    Parameters
    ----------
    spec : StudySpec
        A study whose fields are each valid.
    """
    yield from _repeated(spec)
    yield from _untranslated(spec, spec.languages)
    own, faults = _own_instruments(spec)
    yield from faults
    yield from _form(spec)
    yield from _screening(spec)
    yield from _completion(spec)
    if faults or not _has_parts(spec):
        return
    for place, part in _placed_parts(spec):
        known = {name: instruments.get(name) for name in instruments.names()} | own
        yield from _PartChecks(spec, part, place, known).problems()
    yield from _together(spec)


def issue(place: Place, message: str) -> InitErrorDetails:
    """Return a problem in pydantic's form."""
    # The message is passed as a value, since pydantic would take braces in it for fields of a template.
    return InitErrorDetails(type=PydanticCustomError("study", "{text}", {"text": message}), loc=place, input=None)


def _has_parts(spec: "StudySpec") -> bool:
    return spec.parts is not None or (spec.instruments is not None and spec.presentation is not None)


def _placed_parts(spec: "StudySpec") -> list[tuple[Place, Part]]:
    if spec.parts is None:
        return [((), spec.all_parts[0])]
    return [(("parts", place), part) for place, part in enumerate(spec.parts)]


def _form(spec: "StudySpec") -> Iterator[InitErrorDetails]:
    for field in ("instruments", "presentation"):
        if spec.parts is not None and getattr(spec, field) is not None:
            yield issue((field,), "a study with parts has this field in each part, not here.")
        if spec.parts is None and getattr(spec, field) is None:
            yield issue((field,), "this field is missing; right is to give it here, or `parts` that each have it.")


def _together(spec: "StudySpec") -> Iterator[InitErrorDetails]:
    """Yield what parts and quota do not allow each other: rounds that could never be complete."""
    parts = _placed_parts(spec)
    place, first = parts[0]
    if first.wait_days:
        yield issue((*place, "wait_days"), "there is no part before the first; leave this out.")
    annotated = [(place, part.annotation) for place, part in parts if part.annotation is not None]
    for place, annotation in annotated:
        if spec.quota is not None and spec.quota < annotation.raters:
            message = f"{annotation.raters} raters are needed in a round, but the quota is {spec.quota}."
            yield issue((*place, "annotation", "raters"), message)
        if len(annotated) > 1 and annotation.panel != "fixed":
            message = "several parts are annotated, by the same raters; right is `panel: fixed` in all of them."
            yield issue((*place, "annotation", "panel"), message)
        elif annotation.raters != annotated[0][1].raters:
            message = f"the same raters annotate all parts; right is {annotated[0][1].raters}, as in the first of them."
            yield issue((*place, "annotation", "raters"), message)


def _screening(spec: "StudySpec") -> Iterator[InitErrorDetails]:
    for rule in type(spec.screening).model_fields:
        threshold = getattr(spec.screening, rule)
        low, high = _LIMITS.get(rule, (0.0, math.inf))
        if threshold is not None and not low <= threshold.limit <= high:
            right = f"from {low:g} to {high:g}" if high < math.inf else f"of {low:g} or more"
            yield issue(
                ("screening", rule, "limit"), f"{threshold.limit:g} is no limit of {rule}; right is a number {right}."
            )


def _completion(spec: "StudySpec") -> Iterator[InitErrorDetails]:
    redirect = spec.completion.redirect or ""
    place = ("completion", "redirect")
    for name in re.findall(r"\{([^{}]*)\}", redirect):
        if name not in {"code", "panel_id"}:
            yield issue(place, f"{{{name}}} stands for nothing; right are {{code}} and {{panel_id}}.")
    if "{code}" in redirect and spec.completion.code is None:
        yield issue(place, "{code} stands for a code, but there is none; give `code`, or leave it out.")
    if "{panel_id}" in redirect and not spec.collect.panel_id:
        yield issue(place, "{panel_id} is not stored, since `collect` says so; leave it out, or collect it.")


def _repeated(spec: "StudySpec") -> Iterator[InitErrorDetails]:
    lists: dict[str, tuple[str | None, list[str]]] = {
        "languages": (None, list(spec.languages)),
        "conditions": ("name", [condition.name for condition in spec.conditions]),
        "stimuli": ("id", [stimulus.id for stimulus in spec.stimuli]),
        "parts": ("name", [part.name for part in spec.parts or ()]),
        "own_instruments": ("name", [definition.name for definition in spec.own_instruments]),
    }
    for field, (inside, values) in lists.items():
        for position, value in enumerate(values):
            if value in values[:position]:
                place: Place = (field, position) if inside is None else (field, position, inside)
                yield issue(place, f"{value!r} is here for the second time, but must be unique.")
    for position, definition in enumerate(spec.own_instruments):
        if definition.name in instruments.names():
            message = f"{definition.name!r} is the name of a bundled instrument; choose another."
            yield issue(("own_instruments", position, "name"), message)


def _untranslated(piece: BaseModel, languages: Sequence[str], place: Place = ()) -> Iterator[InitErrorDetails]:
    listed = ", ".join(languages)
    for where, texts in _translated(piece, place):
        for language in languages:
            if language not in texts:
                yield issue(where, f"the text in {language} is missing; the study's languages are {listed}.")
        for language in texts:
            if language not in languages:
                yield issue((*where, language), f"{language} is not one of the study's languages ({listed}).")


def _translated(value: Any, place: Place) -> Iterator[tuple[Place, Mapping[str, object]]]:
    """Walk through all fields that are marked as texts in the study's languages."""
    if isinstance(value, tuple):
        for position, one in enumerate(value):
            yield from _translated(one, (*place, position))
    if not isinstance(value, BaseModel):
        return
    for name, field in type(value).model_fields.items():
        inner = getattr(value, name)
        marked = any(isinstance(mark, Translated) for mark in _marks(field.annotation, field.metadata))
        if marked and isinstance(inner, Mapping):
            yield (*place, name), inner
        else:
            yield from _translated(inner, (*place, name))


def _marks(annotation: Any, metadata: Sequence[Any]) -> list[Any]:
    """Return the marks of a field, also those inside "or None"."""
    inside = [mark for part in getattr(annotation, "__args__", ()) for mark in getattr(part, "__metadata__", ())]
    return [*metadata, *inside]


def _own_instruments(spec: "StudySpec") -> tuple[dict[str, Instrument], list[InitErrorDetails]]:
    built: dict[str, Instrument] = {}
    faults = []
    for position, definition in enumerate(spec.own_instruments):
        try:
            built[definition.name] = definition.build()
        except DefinitionError as error:
            faults.append(issue(("own_instruments", position, *error.path), str(error)))
    return built, faults


class _PartChecks:
    """The checks of one part."""

    def __init__(self, spec: "StudySpec", part: Part, place: Place, known: Mapping[str, Instrument]) -> None:
        self.spec, self.part, self.place, self.known = spec, part, place, known

    def problems(self) -> Iterator[InitErrorDetails]:
        yield from self._names()
        yield from self._cells()
        yield from self._shown()
        yield from self._checks()
        yield from self._rounds()

    def _names(self) -> Iterator[InitErrorDetails]:
        lists: dict[str, list[str]] = {
            "instruments": [use.use for use in self.part.instruments],
            "before": list(self.part.before),
            "after": list(self.part.after),
        }
        for field, names in lists.items():
            for position, name in enumerate(names):
                place = (*self.place, field, position)
                if name not in self.known:
                    yield issue(place, f"there is no instrument {name!r}; there are {', '.join(self.known)}.")
                elif name in names[:position]:
                    yield issue(place, f"{name!r} is here for the second time, but must be unique.")
                else:
                    yield from self._languages(place, self.known[name])
                    if field != "instruments" and self.known[name].per != "trial":
                        message = f"{name} asks about each {self.known[name].per}, but here nothing is shown."
                        yield issue(place, message)
                    elif field != "instruments" and self.known[name].clips is not None:
                        yield issue(place, f"{name} compares clips, but here nothing is shown.")
        yield from self._scores(lists["instruments"])

    def _languages(self, place: Place, instrument: Instrument) -> Iterator[InitErrorDetails]:
        for language in self.spec.languages:
            if language not in instrument.languages:
                there = ", ".join(instrument.languages)
                yield issue(place, f"the instrument {instrument.name} has no text in {language}; it has {there}.")

    def _scores(self, names: list[str]) -> Iterator[InitErrorDetails]:
        owner: dict[str, str] = {}
        for position, name in enumerate(names):
            for score in self.known[name].scores if name in self.known else ():
                other = owner.setdefault(score.name, name)
                if other != name:
                    message = f"{name} and {other} both have a score {score.name}; one part can ask only one of them."
                    yield issue((*self.place, "instruments", position), message)

    def _cells(self) -> Iterator[InitErrorDetails]:
        chosen = self.part.presentation.cells
        if chosen is None:
            return
        place = (*self.place, "presentation", "cells")
        known = {
            "stimulus": [stimulus.id for stimulus in self.spec.stimuli],
            "condition": [condition.name for condition in self.spec.conditions],
        }
        for kind, names in known.items():
            used = [getattr(cell, kind) for cell in chosen]
            for position, name in enumerate(used):
                if name not in names:
                    message = f"there is no {kind} {name!r}; there are {', '.join(names)}."
                    yield issue((*place, position, kind), message)
            # What one part leaves out another may show; in a study of one part it would never be shown.
            for name in names if self.spec.parts is None else ():
                if name not in used:
                    yield issue(place, f"the {kind} {name!r} is in no cell, so it is never shown.")
        for position, cell in enumerate(chosen):
            if cell in chosen[:position]:
                yield issue((*place, position), "this cell is here for the second time.")

    def _shown(self) -> Iterator[InitErrorDetails]:
        together = self.part.presentation.together
        for position, use in enumerate(self.part.instruments):
            instrument = self.known.get(use.use)
            place = (*self.place, "instruments", position)
            if instrument is None:
                continue
            if instrument.clips is not None and together not in instrument.clips:
                right = " or ".join(instrument.clips)
                message = f"{use.use} needs `together: {right}` in the presentation; here it is {together}."
                yield issue(place, message)
            if instrument.per == "word" and together != "single":
                yield issue(place, f"{use.use} asks about the words of one clip; here several are shown together.")
            if instrument.per == "word":
                for number, stimulus in enumerate(self.spec.stimuli):
                    shown = stimulus.id in self._conditions()
                    if shown and not stimulus.words and not stimulus.clip.get("text"):
                        message = f"{use.use} needs the words of each sentence; give `words`, or a clip with a text."
                        yield issue(("stimuli", number), message)
        if together == "pairs" and max(self._conditions().values(), default=2) < 2:
            message = "no stimulus is there in two conditions, so there are no pairs to show."
            yield issue((*self.place, "presentation", "together"), message)
        if together == "single" or self.part.annotation is None:
            return
        yield issue((*self.place, "annotation"), f"annotation rates one clip in a trial; here {together} are shown.")

    def _checks(self) -> Iterator[InitErrorDetails]:
        for field in ("training", "gold"):
            for position, shown in enumerate(getattr(self.part, field)):
                place = (*self.place, field, position)
                if self.part.presentation.together != "single":
                    yield issue(place, f"{field} shows one clip; here {self.part.presentation.together} are shown.")
                for kind, names in (
                    ("stimulus", [stimulus.id for stimulus in self.spec.stimuli]),
                    ("condition", [condition.name for condition in self.spec.conditions]),
                ):
                    if getattr(shown, kind) not in names:
                        message = f"there is no {kind} {getattr(shown, kind)!r}; there are {', '.join(names)}."
                        yield issue((*place, kind), message)
                if shown.accept is not None:
                    asked = [use.use for use in self.part.instruments]
                    yield from self._accepted((*place, "accept"), shown.accept, asked)
        for position, told in enumerate(self.part.instructed):
            place = (*self.place, "instructed", position)
            if told.instrument not in self.known:
                message = f"there is no instrument {told.instrument!r}; there are {', '.join(self.known)}."
                yield issue((*place, "instrument"), message)
            elif self.known[told.instrument].per != "trial" or self.known[told.instrument].clips is not None:
                message = f"{told.instrument} asks about what is shown, but an instructed question shows nothing."
                yield issue((*place, "instrument"), message)
            else:
                yield from self._accepted((*place, "accept"), told.accept, [told.instrument])

    def _accepted(self, place: Place, accept: Answers, asked: Sequence[str]) -> Iterator[InitErrorDetails]:
        for key, values in accept.items():
            name, _, item_id = key.partition(".")
            instrument = self.known.get(name) if name in asked else None
            items = {item.id: item for item in instrument.items} if instrument else {}
            if item_id not in items or instrument is None:
                known = [self.known[one] for one in asked if one in self.known]
                there = ", ".join(f"{one.name}.{item.id}" for one in known for item in one.items)
                yield issue((*place, key), f"there is no item {key!r} here; there are {there}.")
                continue
            for value in values:
                try:
                    instrument.validate_item(items[item_id], value)
                except EvaluationError as error:
                    yield issue((*place, key), str(error))

    def _rounds(self) -> Iterator[InitErrorDetails]:
        annotation = self.part.annotation
        place = (*self.place, "annotation")
        count = self._cell_count()
        if annotation is not None:
            if self.part.presentation.assignment != "full" or self.part.presentation.per_participant is not None:
                message = "annotation decides itself who rates what; right is `assignment: full`, all of it."
                yield issue((*self.place, "presentation"), message)
            if annotation.mode == "incremental" and annotation.sets > count:
                yield issue((*place, "sets"), f"{count} samples cannot be divided into {annotation.sets} sets.")
            asked = [self.known[use.use] for use in self.part.instruments if use.use in self.known]
            rated = any(instrument.scores or any(item.numeric for item in instrument.items) for instrument in asked)
            if annotation.mode == "incremental" and not rated:
                message = "none of the answers is a number; right is `mode: consensus`."
                yield issue((*place, "mode"), message)
            for target in ("sd", "r"):
                if annotation.mode == "consensus" and getattr(annotation.stop, target) is not None:
                    message = "a consensus ends when enough raters agree; right is `rounds` alone."
                    yield issue((*place, "stop", target), message)
            if annotation.mode == "consensus" and annotation.agree > annotation.raters:
                message = f"{annotation.agree} of {annotation.raters} raters can never agree."
                yield issue((*place, "agree"), message)
            if annotation.mode == "incremental":
                for position, use in enumerate(self.part.instruments):
                    if use.use in self.known and self.known[use.use].per == "word":
                        message = f"{use.use} rates words; right is `mode: consensus`."
                        yield issue((*self.place, "instruments", position), message)
            yield from self._dimensions(labels=annotation.mode == "consensus")
            if self.part.repeats is not None:
                yield issue((*self.place, "repeats"), "in annotation the rounds repeat samples; leave this out.")
        elif self.part.repeats is not None and self.part.repeats.count > count:
            yield issue((*self.place, "repeats"), f"there are only {count} trials that could be repeated.")

    def _dimensions(self, *, labels: bool) -> Iterator[InitErrorDetails]:
        """Check that the raters of a round rate something, and each thing once."""
        owner: dict[str, str] = {}
        for position, use in enumerate(self.part.instruments):
            instrument = self.known.get(use.use)
            for name in instrument.dimensions(labels=labels) if instrument else ():
                other = owner.setdefault(name, use.use)
                # Scores of one name are named already.
                if other != use.use and not any(score.name == name for score in self.known[other].scores):
                    message = f"{use.use} and {other} both rate {name}; in annotation the names must differ."
                    yield issue((*self.place, "instruments", position), message)
        if labels and not owner:
            message = "none of the answers is a number or one label, on which raters could agree."
            yield issue((*self.place, "annotation", "mode"), message)

    def _conditions(self) -> Counter[str]:
        """Count in how many conditions the part has each stimulus."""
        chosen = self.part.presentation.cells
        if chosen is None:
            return Counter({stimulus.id: len(self.spec.conditions) for stimulus in self.spec.stimuli})
        return Counter(cell.stimulus for cell in chosen)

    def _cell_count(self) -> int:
        chosen = self.part.presentation.cells
        return len(self.spec.stimuli) * len(self.spec.conditions) if chosen is None else len(chosen)
