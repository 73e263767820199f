"""The study file: what is shown to whom, what is asked, and the texts around it."""

import hashlib
import json
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, JsonValue, ValidationError, model_validator

from evaluation import instruments, located_yaml
from evaluation.errors import EvaluationError, Problem, StudyFileError
from evaluation.instruments import Instrument
from evaluation.instruments.definition import InstrumentDefinition
from evaluation.study_checks import inconsistencies
from evaluation.study_parts import (
    Analysis,
    Cell,
    CellChoice,
    Collect,
    Completion,
    Condition,
    InstrumentUse,
    Language,
    Paragraphs,
    Part,
    Piece,
    Presentation,
    Screening,
    Sharing,
    Slug,
    Stimulus,
    Texts,
    VideoSettings,
)
from evaluation.study_problems import problems_of

__all__ = [
    "SCHEMA_ID",
    "Cell",
    "CellChoice",
    "Condition",
    "InstrumentUse",
    "Part",
    "Presentation",
    "Stimulus",
    "StudySpec",
    "VideoSettings",
    "bundled_names",
    "bundled_text",
    "load_bundled",
    "read_text",
]

SCHEMA_ID = "https://json-schema.org/draft/2020-12/schema"
MAIN = "main"
"""Name of the one part of a study whose file names no parts."""


class StudySpec(Piece):
    """A study, complete and consistent.

    Read one with `from_yaml`, `read` or `load_bundled`. Equal studies have equal `digest`. A study of one part may
    write that part's instruments and presentation at the top, without ``parts``; `all_parts` returns them alike.
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
    own_instruments: tuple[InstrumentDefinition, ...] = ()
    instruments: tuple[InstrumentUse, ...] | None = Field(
        default=None, min_length=1, description="names of instruments, in the order of the page"
    )
    presentation: Presentation | None = None
    parts: tuple[Part, ...] | None = Field(
        default=None, min_length=1, description="at least one part, each with its instruments and presentation"
    )
    quota: int | None = Field(default=None, ge=1, description="how many participants are wanted; left out, any number")
    lapse_hours: float = Field(
        default=24.0,
        gt=0,
        le=87_600,
        description="hours without a sign of a participant after which their place is given back, at most 87600",
    )
    completion: Completion = Completion()
    collect: Collect = Collect()
    share: Sharing = Sharing()
    screening: Screening = Screening()
    analysis: Analysis = Analysis()

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        found = list(inconsistencies(self))
        if found:
            raise ValidationError.from_exception_data(type(self).__name__, found)
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
        schema = cls.model_json_schema()
        whole = schema["$defs"]["InstrumentUse"]
        # Bundled names first, so that editors offer them; a study may have instruments of its own besides.
        schema["$defs"]["InstrumentUse"] = {"anyOf": [{"enum": list(instruments.names())}, {"type": "string"}, whole]}
        return {"$schema": SCHEMA_ID, **schema}

    @property
    def digest(self) -> str:
        """Return the sha-256 of the study's content, in hexadecimal; comments and layout of the file do not count."""
        # Without defaults, so that a field added by a later version does not change the studies that do not use it.
        content = self.model_dump(mode="json", exclude_defaults=True)
        canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
        return hashlib.sha256(canonical.encode()).hexdigest()

    @property
    def all_parts(self) -> tuple[Part, ...]:
        """Return the parts in their order; of a study without ``parts`` the one that it is."""
        if self.parts is not None:
            return self.parts
        return (Part(name=MAIN, instruments=self.instruments, presentation=self.presentation),)  # type: ignore[arg-type]

    def part(self, name: str) -> Part:
        """Return the part of this name; EvaluationError if there is none."""
        for part in self.all_parts:
            if part.name == name:
                return part
        raise EvaluationError(f"Study {self.slug}: there is no part {name!r}.")

    def only(self, name: str) -> Self:
        """Return the study as if the part of this name were all of it, for what looks at one part alone."""
        return self.model_copy(update={"parts": (self.part(name),), "instruments": None, "presentation": None})

    @property
    def instrument_names(self) -> tuple[str, ...]:
        """Return the names of the instruments that trials ask, each once, in the order of parts and pages."""
        return tuple(dict.fromkeys(use.use for part in self.all_parts for use in part.instruments))

    def instrument(self, name: str) -> Instrument:
        """Return the instrument of this name, the study's own or a bundled one; EvaluationError if there is none."""
        for definition in self.own_instruments:
            if definition.name == name:
                return definition.build()
        return instruments.get(name)

    def cells(self, part: str | None = None) -> tuple[Cell, ...]:
        """Return every stimulus in every condition it is made in, in the order of the file's stimuli.

        Parameters
        ----------
        part : str, optional
            Only those of this part; left out, those of all parts.
        """
        parts = self.all_parts if part is None else (self.part(part),)
        every = [Cell(stimulus.id, condition.name) for stimulus in self.stimuli for condition in self.conditions]
        chosen: set[Cell] = set()
        for one in parts:
            listed = one.presentation.cells
            chosen |= set(every) if listed is None else {Cell(cell.stimulus, cell.condition) for cell in listed}
            if part is None:
                chosen |= {Cell(shown.stimulus, shown.condition) for shown in one.training}
                chosen |= {Cell(shown.stimulus, shown.condition) for shown in one.gold}
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
