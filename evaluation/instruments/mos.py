"""mos5: the five-point opinion scale of the MTAP article."""

from evaluation.instruments.base import Instrument, Score
from evaluation.instruments.items import LikertItem, Option

_SOURCE = "Jia et al. (2013), Multimedia Tools and Applications, section 5.4"

MOS5 = Instrument(
    name="mos5",
    title={"en": "How natural and expressive is it?", "zh": "它有多自然、多有表现力？"},
    instruction={
        "en": "Choose the one description that fits the face in this film best.",
        "zh": "请选择最符合这段视频中人脸的一项描述。",
    },
    items=(
        LikertItem(
            id="mos",
            prompt={
                "en": "How natural and expressive is this face?",
                "zh": "您觉得这张脸有多自然、多有表现力？",
            },
            options=(
                Option(
                    5,
                    {"en": "Expressive", "zh": "富有表现力"},
                    {"en": "natural and expressive gestures like human", "zh": "动作和表情自然、生动，如同真人"},
                ),
                Option(
                    4,
                    {"en": "Natural", "zh": "自然"},
                    {"en": "appropriate gestures to message content", "zh": "动作和表情与所表达的内容相符"},
                ),
                Option(
                    3,
                    {"en": "Acceptable", "zh": "可以接受"},
                    {"en": "neutral gestures with some expressivity", "zh": "动作和表情比较平淡，有一定的表现力"},
                ),
                Option(
                    2,
                    {"en": "Unnatural", "zh": "不自然"},
                    {"en": "robotic gestures with little expressivity", "zh": "动作和表情机械呆板，几乎没有表现力"},
                ),
                Option(
                    1,
                    {"en": "Erratic", "zh": "怪异"},
                    {"en": "inappropriate and weird gestures", "zh": "动作和表情不恰当，令人感到奇怪"},
                ),
            ),
        ),
    ),
    scores=(
        Score(
            name="MOS",
            text="Opinion score, from 1 (Erratic) to 5 (Expressive); its mean over raters is the MOS",
            weights={"mos": 1},
            divisor=1,
            source=_SOURCE,
        ),
    ),
    source=_SOURCE,
)
