"""The study file: what is shown to whom, what is asked, and the texts around it."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    JsonValue,
    StringConstraints,
    ValidationError,
    field_validator,
    model_validator,
)
from pydantic_core import InitErrorDetails, PydanticCustomError

from evaluation import instruments, located_yaml
from evaluation.errors import EvaluationError, Problem, StudyFileError
from evaluation.study_problems import problems_of

SCHEMA_ID = "https://json-schema.org/draft/2020-12/schema"

Slug = Annotated[
    str,
    StringConstraints(pattern=r"^[a-z0-9](?:[a-z0-9-]{0,62}[a-z0-9])?$"),
    Field(description="1 to 64 lower-case letters, digits and hyphens, beginning and ending with a letter or digit"),
]
Name = Annotated[
    str,
    StringConstraints(pattern=r"^[a-z0-9][a-z0-9_-]{0,63}$"),
    Field(description="1 to 64 lower-case letters, digits, - and _, beginning with a letter or digit"),
]
Language = Annotated[str, StringConstraints(pattern=r"^[a-z]{2,3}(?:-[A-Za-z0-9]{2,8})*$")]
Line = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
Texts = Annotated[Mapping[Language, Line], Field(description="one text for each language of the study")]
Paragraphs = Annotated[
    Mapping[Language, Annotated[tuple[Line, ...], Field(min_length=1)]],
    Field(description="a list of short paragraphs for each language of the study"),
]
ClipFields = Annotated[
    Mapping[str, JsonValue], Field(description="fields of the clip, such as pad, intensity, text or model")
]


class Cell(NamedTuple):
    """One stimulus in one condition: what a trial shows."""

    stimulus: str
    condition: str


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class VideoSettings(_Part):
    """Frame size in pixels and frames per second of every clip of the study."""

    width: int = Field(default=720, ge=16, le=3840, multiple_of=2, description="an even whole number from 16 to 3840")
    height: int = Field(default=576, ge=16, le=2160, multiple_of=2, description="an even whole number from 16 to 2160")
    fps: int = Field(default=25, ge=10, le=120, description="a whole number from 10 to 120")


class Condition(_Part):
    """What is varied: the papers' "group"."""

    name: Name
    label: Texts
    description: str = Field(default="", description="for the experimenter; participants never see it")
    clip: ClipFields = Field(default_factory=dict)


class Stimulus(_Part):
    """What is shown, before a condition changes it."""

    id: Name
    label: Texts
    clip: ClipFields = Field(default_factory=dict)


class CellChoice(_Part):
    """One stimulus in one condition, as written in a study file."""

    stimulus: str
    condition: str


class Presentation(_Part):
    """Which participant sees what.

    ``full``: everything. ``latin_square``: each stimulus once, the conditions rotated over the participants, so that
    each stimulus is seen equally often in each of its conditions. ``cells`` lists the stimuli and conditions that go
    together; left out, every stimulus is made in every condition.
    """

    assignment: Literal["latin_square", "full"]
    cells: tuple[CellChoice, ...] | None = Field(
        default=None, min_length=1, description="pairs of stimulus and condition; left out, all of them"
    )


class StudySpec(_Part):
    """A study, complete and consistent.

    Read one with `from_yaml`, `read` or `load_bundled`. Equal studies have equal `digest`.
    """

    slug: Slug
    title: Texts
    languages: Annotated[tuple[Language, ...], Field(min_length=1, description="language codes, such as [en, zh]")]
    seed: int = Field(ge=0, lt=2**63, description="a whole number from 0 to 2**63 - 1; it fixes all random orders")
    welcome: Paragraphs
    consent: Paragraphs
    instructions: Paragraphs
    debrief: Paragraphs
    video: VideoSettings = VideoSettings()
    conditions: Annotated[tuple[Condition, ...], Field(min_length=1, description="at least one condition")]
    stimuli: Annotated[tuple[Stimulus, ...], Field(min_length=1, description="at least one stimulus")]
    instruments: Annotated[
        tuple[str, ...],
        Field(
            min_length=1,
            description="names of instruments, in the order of the page",
            json_schema_extra={"items": {"type": "string", "enum": list(instruments.names())}},
        ),
    ]
    presentation: Presentation

    @field_validator("instruments")
    @classmethod
    def _known(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        _raise(
            cls.__name__,
            [
                _issue((position,), f"there is no instrument {name!r}; there are {', '.join(instruments.names())}.")
                for position, name in enumerate(names)
                if name not in instruments.names()
            ],
        )
        return names

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        _raise(type(self).__name__, [*self._repeated(), *self._untranslated(), *self._wrong_cells()])
        return self

    @classmethod
    def from_yaml(cls, text: str, *, source: str = "study file") -> Self:
        """Read a study from the text of its file.

        Parameters
        ----------
        text : str
            YAML (or JSON, which is YAML).
        source : str
            Name of the file, for messages.

        Returns
        -------
        StudySpec
            The study.

        Raises
        ------
        StudyFileError
            If the text is not YAML or does not describe a study; the message names every problem with its line, its
            field and what would be right.
        """
        located = located_yaml.parse(text, source=source)
        try:
            return cls.model_validate_json(json.dumps(located.value, allow_nan=False), strict=True)
        except ValidationError as error:
            raise StudyFileError(source, problems_of(error, located, cls)) from error

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a study from a file in UTF-8.

        Raises
        ------
        StudyFileError
            As `from_yaml`, and if the file cannot be read or is not UTF-8.
        """
        return cls.from_yaml(read_text(path), source=path.name)

    @classmethod
    def json_schema(cls) -> dict[str, Any]:
        """Return the JSON Schema (2020-12) of study files, with which editors check and complete them."""
        return {"$schema": SCHEMA_ID, **cls.model_json_schema()}

    @cached_property
    def digest(self) -> str:
        """Return the sha-256 of the study's content, in hexadecimal; comments and layout of the file do not count."""
        # Without defaults, so that a field added by a later version does not change the studies that do not use it.
        content = self.model_dump(mode="json", exclude_defaults=True)
        canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
        return hashlib.sha256(canonical.encode()).hexdigest()

    def cells(self) -> tuple[Cell, ...]:
        """Return every stimulus in every condition it is made in, in the order of the file's stimuli."""
        if self.presentation.cells is None:
            return tuple(
                Cell(stimulus.id, condition.name) for stimulus in self.stimuli for condition in self.conditions
            )
        chosen = {Cell(cell.stimulus, cell.condition) for cell in self.presentation.cells}
        every = (Cell(stimulus.id, condition.name) for stimulus in self.stimuli for condition in self.conditions)
        return tuple(cell for cell in every if cell in chosen)

    def stimulus(self, stimulus_id: str) -> Stimulus:
        """Return the stimulus of this id; EvaluationError if there is none."""
        for stimulus in self.stimuli:
            if stimulus.id == stimulus_id:
                return stimulus
        raise EvaluationError(f"Study {self.slug}: there is no stimulus {stimulus_id!r}.")

    def condition(self, name: str) -> Condition:
        """Return the condition of this name; EvaluationError if there is none."""
        for condition in self.conditions:
            if condition.name == name:
                return condition
        raise EvaluationError(f"Study {self.slug}: there is no condition {name!r}.")

    def clip_fields(self, stimulus_id: str, condition: str) -> dict[str, JsonValue]:
        """Return the fields of a cell's clip: the video settings, then the stimulus, then what the condition changes.

        Parameters
        ----------
        stimulus_id, condition : str
            A cell of the study.

        Returns
        -------
        dict
            Plain JSON values; what they mean is the renderer's business.

        Raises
        ------
        EvaluationError
            If the stimulus or the condition is unknown.
        """
        return {
            **self.video.model_dump(),
            **self.stimulus(stimulus_id).clip,
            **self.condition(condition).clip,
        }

    def _repeated(self) -> Iterator[InitErrorDetails]:
        lists: dict[str, list[str]] = {
            "languages": list(self.languages),
            "conditions": [condition.name for condition in self.conditions],
            "stimuli": [stimulus.id for stimulus in self.stimuli],
            "instruments": list(self.instruments),
        }
        names_inside = {"conditions": ("name",), "stimuli": ("id",)}
        for field, values in lists.items():
            for position, value in enumerate(values):
                if value in values[:position]:
                    place = (field, position, *names_inside.get(field, ()))
                    yield _issue(place, f"{value!r} is here for the second time, but must be unique.")

    def _untranslated(self) -> Iterator[InitErrorDetails]:
        texts: list[tuple[tuple[str | int, ...], Mapping[str, object]]] = [
            (("title",), self.title),
            (("welcome",), self.welcome),
            (("consent",), self.consent),
            (("instructions",), self.instructions),
            (("debrief",), self.debrief),
            *((("conditions", n, "label"), condition.label) for n, condition in enumerate(self.conditions)),
            *((("stimuli", n, "label"), stimulus.label) for n, stimulus in enumerate(self.stimuli)),
        ]
        listed = ", ".join(self.languages)
        for place, text in texts:
            for language in self.languages:
                if language not in text:
                    yield _issue(place, f"the text in {language} is missing; the study's languages are {listed}.")
            for language in text:
                if language not in self.languages:
                    yield _issue((*place, language), f"{language} is not one of the study's languages ({listed}).")
        for position, name in enumerate(self.instruments):
            known = instruments.get(name).languages
            for language in self.languages:
                if language not in known:
                    message = f"the instrument {name} has no text in {language}; it has {', '.join(known)}."
                    yield _issue(("instruments", position), message)

    def _wrong_cells(self) -> Iterator[InitErrorDetails]:
        chosen = self.presentation.cells
        if chosen is None:
            return
        known = {
            "stimulus": [stimulus.id for stimulus in self.stimuli],
            "condition": [condition.name for condition in self.conditions],
        }
        for kind, names in known.items():
            used = [getattr(cell, kind) for cell in chosen]
            for position, name in enumerate(used):
                if name not in names:
                    message = f"there is no {kind} {name!r}; there are {', '.join(names)}."
                    yield _issue(("presentation", "cells", position, kind), message)
            for name in names:
                if name not in used:
                    yield _issue(("presentation", "cells"), f"the {kind} {name!r} is in no cell, so it is never shown.")
        for position, cell in enumerate(chosen):
            if cell in chosen[:position]:
                yield _issue(("presentation", "cells", position), "this cell is here for the second time.")


def read_text(path: Path) -> str:
    """Return the text of a study file in UTF-8.

    Raises
    ------
    StudyFileError
        If the file cannot be read or is not UTF-8; the message names the line of the first byte that is not.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise StudyFileError(path.name, [Problem(None, "", f"the file cannot be read ({error.strerror}).")]) from error
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        message = "this is not UTF-8 text; save the file in the encoding UTF-8."
        raise StudyFileError(path.name, [Problem(line, "", message)]) from error


def bundled_names() -> tuple[str, ...]:
    """Return the names of the study files that come with padlab, sorted."""
    folder = resources.files("evaluation").joinpath("studies")
    return tuple(sorted(file.name.removesuffix(".yaml") for file in folder.iterdir() if file.name.endswith(".yaml")))


def bundled_text(name: str) -> str:
    """Return the text of a bundled study file.

    Raises
    ------
    EvaluationError
        If there is none of this name; the message lists those there are.
    """
    if name not in bundled_names():
        raise EvaluationError(f"There is no bundled study {name!r}; there are {', '.join(bundled_names())}.")
    return resources.files("evaluation").joinpath("studies", f"{name}.yaml").read_text(encoding="utf-8")


def load_bundled(name: str) -> StudySpec:
    """Return a bundled study, for instance ``load_bundled("demo")``; raises as `bundled_text`."""
    return StudySpec.from_yaml(bundled_text(name), source=f"{name}.yaml")


def _issue(place: tuple[str | int, ...], message: str) -> InitErrorDetails:
    # The message is passed as a value, since pydantic would take braces in it for fields of a template.
    return InitErrorDetails(type=PydanticCustomError("study", "{text}", {"text": message}), loc=place, input=None)


def _raise(title: str, issues: list[InitErrorDetails]) -> None:
    if issues:
        raise ValidationError.from_exception_data(title, issues)
