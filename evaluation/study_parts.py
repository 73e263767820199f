"""The pieces of a study file: what is shown, what is asked, in which design, and when an answer counts."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    JsonValue,
    ModelWrapValidatorHandler,
    SerializerFunctionWrapHandler,
    StringConstraints,
    model_serializer,
    model_validator,
)

from evaluation.annotation.rounds import RULES, SHARE


class Translated:
    """Marks a field that holds one text, or one list of texts, for each language of the study."""


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
Texts = Annotated[Mapping[Language, Line], Field(description="one text for each language of the study"), Translated()]
Paragraphs = Annotated[
    Mapping[Language, Annotated[tuple[Line, ...], Field(min_length=1)]],
    Field(description="a list of short paragraphs for each language of the study"),
    Translated(),
]
ClipFields = Annotated[
    Mapping[str, JsonValue], Field(description="fields of the clip, such as pad, intensity, text or model")
]
Answers = Annotated[
    Mapping[str, Annotated[tuple[int, ...], Field(min_length=1)]],
    Field(min_length=1, description='accepted answers of items, such as {"mos5.mos": [4, 5]}'),
]
Share = Annotated[float, Field(ge=0, le=1, description="a number from 0 to 1")]


class Cell(NamedTuple):
    """One stimulus in one condition: what a trial shows."""

    stimulus: str
    condition: str


class Piece(BaseModel):
    """Base of all parts of a study file: frozen, and without fields that are not known."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class VideoSettings(Piece):
    """Frame size in pixels and frames per second of every clip of the study."""

    width: int = Field(default=720, ge=16, le=3840, multiple_of=2, description="an even whole number from 16 to 3840")
    height: int = Field(default=576, ge=16, le=2160, multiple_of=2, description="an even whole number from 16 to 2160")
    fps: int = Field(default=25, ge=10, le=120, description="a whole number from 10 to 120")


class Condition(Piece):
    """What is varied: the papers' "group"."""

    name: Name
    label: Texts
    description: str = Field(default="", description="for the experimenter; participants never see it")
    clip: ClipFields = Field(default_factory=dict)


class Stimulus(Piece):
    """What is shown, before a condition changes it: a clip that is made, or a file of one's own."""

    id: Name
    label: Texts
    clip: ClipFields = Field(default_factory=dict)
    media: Line | None = Field(
        default=None,
        description="a video, audio or image file beside the study file; {condition} stands for the condition's name",
    )
    words: tuple[Line, ...] = Field(
        default=(), description="the prosodic words of its sentence; left out, they are found in the clip's text"
    )


class CellChoice(Piece):
    """One stimulus in one condition, as written in a study file."""

    stimulus: str
    condition: str


class InstrumentUse(Piece):
    """An instrument as a part of the study asks it; written as its name alone if it is asked as it is."""

    use: str = Field(description="the name of an instrument")
    shuffle: bool = Field(default=False, description="true: the items come in a new random order in each trial")
    flip: bool = Field(default=False, description="true: the poles of half of the items, drawn anew, change sides")

    @model_validator(mode="wrap")
    @classmethod
    def _from_name(cls, value: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        return handler({"use": value} if isinstance(value, str) else value)

    @model_serializer(mode="wrap")
    def _as_name(self, handler: SerializerFunctionWrapHandler) -> Any:
        return self.use if not self.shuffle and not self.flip else handler(self)


class Presentation(Piece):
    """Which participant sees what, and in which order.

    ``full``: everything. ``latin_square``: each stimulus once, the conditions rotated over the participants, so that
    each stimulus is seen equally often in each of its conditions. ``between``: all stimuli, in the one condition of
    the participant's group. ``cells`` lists the stimuli and conditions that go together; left out, every stimulus is
    made in every condition.
    """

    assignment: Literal["latin_square", "full", "between"]
    cells: tuple[CellChoice, ...] | None = Field(
        default=None, min_length=1, description="pairs of stimulus and condition; left out, all of them"
    )
    order: Literal["random", "fixed", "blocks", "williams"] = Field(
        default="random",
        description=(
            "random: anew for each participant, neither stimulus nor condition twice in a row when avoidable; fixed: "
            "as in the file; blocks: one condition after the other, their order random; williams: as blocks, their "
            "order by a Williams square"
        ),
    )
    together: Literal["single", "pairs", "all"] = Field(
        default="single",
        description="how many conditions of a stimulus one trial shows: one, every two of them, or all",
    )
    per_participant: int | None = Field(
        default=None, ge=1, description="how many trials each participant gets of those; left out, all"
    )


class Training(Piece):
    """A trial before those that count, with an explanation after it."""

    stimulus: str
    condition: str
    accept: Answers | None = None
    feedback: Texts


class Gold(Piece):
    """A clip with known answers, shown among the others."""

    stimulus: str
    condition: str
    accept: Answers


class Instructed(Piece):
    """A question that says what to answer, among the trials."""

    prompt: Texts
    instrument: str = Field(description="the name of an instrument")
    accept: Answers


class Repeats(Piece):
    """Trials that come a second time without a word, so that the rater's own reliability can be told."""

    count: int = Field(ge=1, description="how many trials are repeated, 1 or more")
    gap: int = Field(default=1, ge=1, description="at least how many other trials lie between, when there are enough")


class Stop(Piece):
    """When rounds end before their time."""

    rounds: int | None = Field(
        default=None, ge=1, description="the largest number of rounds; a consensus left open ends after 10"
    )
    sd: float | None = Field(default=None, gt=0, description="ends when no dimension's mean SD over raters is larger")
    r: float | None = Field(
        default=None, gt=-1, le=1, description="ends when no dimension's mean correlation of two raters is smaller"
    )


class Annotation(Piece):
    """Annotation in rounds: incremental (MTAP 2013, section 2.4) or by consensus (section 2.2)."""

    mode: Literal["incremental", "consensus"] = "incremental"
    raters: int = Field(ge=2, le=1000, description="how many rate each sample in each round, 2 to 1000")
    panel: Literal["fixed", "fresh"] = Field(
        default="fixed", description="fixed: the same raters in all rounds; fresh: new raters for each round"
    )
    sets: int = Field(default=5, ge=1, description="into how many sets the samples are divided (incremental)")
    share: Share = SHARE
    rule: Literal["mean", "largest", "root_mean_square"] = Field(
        default="mean", description=f"how a sample's SDs become one number: {', '.join(RULES)}"
    )
    agree: int = Field(default=2, ge=2, description="how many raters must give the same answer (consensus)")
    stop: Stop = Stop()
    advance: Literal["automatic", "manual"] = Field(
        default="automatic",
        description="whether a complete round opens the next by itself, or by command or button alone",
    )


class Part(Piece):
    """One sitting of the study: its trials, and the questions before and after them."""

    name: Name
    title: Texts | None = None
    instructions: Paragraphs | None = None
    instruments: Annotated[
        tuple[InstrumentUse, ...],
        Field(min_length=1, description="names of instruments, in the order of the page"),
    ]
    presentation: Presentation
    before: tuple[str, ...] = Field(default=(), description="names of instruments asked once, before the trials")
    after: tuple[str, ...] = Field(default=(), description="names of instruments asked once, after the trials")
    training: tuple[Training, ...] = ()
    gold: tuple[Gold, ...] = ()
    instructed: tuple[Instructed, ...] = ()
    repeats: Repeats | None = None
    annotation: Annotation | None = None
    watched: Share = Field(
        default=0.0,
        description="share of a clip that must have been played before an answer counts, from 0 (none) to 1",
    )
    wait_days: float = Field(
        default=0.0, ge=0, le=3650, description="days that must have passed since the part before was finished"
    )


class Completion(Piece):
    """What a participant gets in the end, to prove to a panel that they took part."""

    code: Line | None = Field(
        default=None,
        max_length=40,
        description="the code that is shown, at most 40 characters; 'generate' makes one for each participant",
    )
    redirect: Line | None = Field(
        default=None,
        pattern=r"^https?://",
        description="an address with https:// that leads back; {code} and {panel_id} stand for what they name",
    )


class Collect(Piece):
    """What is stored besides the answers."""

    playback: bool = Field(default=True, description="what the player did: plays, pauses, seeks, stalls, hidden tab")
    user_agent: bool = Field(default=True, description="kind of the browser")
    panel_id: bool = Field(default=True, description="who the panel says this is; needed to pay")


class Sharing(Piece):
    """What exports contain besides the answers."""

    times: bool = Field(default=True, description="when trials were shown and answered")
    texts: bool = Field(default=True, description="answers in the participants' own words")
    playback: bool = Field(default=True, description="what the player did")
    panel_id: bool = Field(default=False, description="who the panel says this is")


class Threshold(Piece):
    """A rule's limit and what follows: not paid and not used, only not used, or only reported."""

    limit: float
    gate: Literal["accepted", "used", "report"] = "used"


class Screening(Piece):
    """Rules by which raters are screened, fixed before the data; a rule left out is not applied."""

    gold: Threshold | None = Field(default=None, description="least share of gold clips answered as known")
    instructed: Threshold | None = Field(default=None, description="least share of instructed answers that are right")
    watched: Threshold | None = Field(default=None, description="least share of the clips' time that was played")
    seconds: Threshold | None = Field(default=None, description="least median of seconds for a trial")
    straight_lining: Threshold | None = Field(
        default=None, description="largest share of trials in which all items of an instrument have the same answer"
    )
    variance: Threshold | None = Field(
        default=None, description="least variance of a rater's scores over the trials (ITU-T P.808)"
    )
    z_score: Threshold | None = Field(
        default=None, description="largest |z| of a rater's mean among the raters (ITU-T P.808 takes 3.29)"
    )
    kurtosis: Threshold | None = Field(
        default=None, description="share of a rater's scores out of range (ITU-R BT.500-14, A1-2.3.1, takes 0.05)"
    )
    bias: Threshold | None = Field(default=None, description="largest |bias| of a rater (ITU-T P.910)")
    inconsistency: Threshold | None = Field(default=None, description="largest inconsistency of a rater (ITU-T P.910)")
    correlation: Threshold | None = Field(
        default=None, description="least correlation of a rater's scores with the mean of the others"
    )
    repeats: Threshold | None = Field(
        default=None, description="largest mean difference between a trial and its hidden repeat"
    )


class Analysis(Piece):
    """What the report is to test beside the usual, fixed before the data."""

    equivalence: float | None = Field(
        default=None,
        gt=0,
        le=1e6,
        description="largest difference of the conditions' mean opinion scores that counts as none (TOST)",
    )
    half_width: float = Field(
        default=0.25,
        gt=0,
        le=1e6,
        description="half-width that the 95 % interval of each clip's mean opinion score should have at most",
    )
