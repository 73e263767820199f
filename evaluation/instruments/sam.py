"""sam: the self-assessment manikin, nine figures for each of pleasure, arousal and dominance."""

from evaluation.instruments.base import Instrument, Score
from evaluation.instruments.items import PictorialItem

_SOURCE = "Bradley & Lang (1994), Journal of Behavior Therapy and Experimental Psychiatry, 25, 49-59"

SAM = Instrument(
    name="sam",
    title={"en": "Which figures show this feeling?", "zh": "哪些图形符合这种感受？"},
    instruction={
        "en": (
            "In each row, choose the one figure that fits best what is expressed. Look at the whole row before you "
            "choose; your first impression is the right answer."
        ),
        "zh": "请在每一行中选择最符合所表达感受的一个图形。选择前请先看完整行，凭第一印象作答即可。",
    },
    items=(
        PictorialItem(
            id="P",
            prompt={"en": "How pleasant is the feeling?", "zh": "这种感受有多愉快？"},
            figure="pleasure",
            left={"en": "Unhappy, displeased", "zh": "不快乐、不愉快"},
            right={"en": "Happy, pleased", "zh": "快乐、愉快"},
        ),
        PictorialItem(
            id="A",
            prompt={"en": "How excited is the feeling?", "zh": "这种感受有多激动？"},
            figure="arousal",
            left={"en": "Calm, sleepy", "zh": "平静、困倦"},
            right={"en": "Excited, wide awake", "zh": "激动、清醒"},
        ),
        PictorialItem(
            id="D",
            prompt={"en": "How much in control is the person?", "zh": "这个人在多大程度上掌控局面？"},
            figure="dominance",
            left={"en": "Controlled, submissive", "zh": "受控制、顺从"},
            right={"en": "In control, dominant", "zh": "掌控局面、支配"},
        ),
    ),
    scores=(
        Score(
            name="P",
            text="Pleasure, from -1 (displeasure) to 1 (pleasure)",
            weights={"P": 1},
            constant=-5,
            divisor=4,
            source=_SOURCE,
        ),
        Score(
            name="A",
            text="Arousal, from -1 (nonarousal) to 1 (arousal)",
            weights={"A": 1},
            constant=-5,
            divisor=4,
            source=_SOURCE,
        ),
        Score(
            name="D",
            text="Dominance, from -1 (submissiveness) to 1 (dominance)",
            weights={"D": 1},
            constant=-5,
            divisor=4,
            source=_SOURCE,
        ),
    ),
    source=_SOURCE,
)
