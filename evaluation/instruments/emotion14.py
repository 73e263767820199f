"""emotion14: one of the fourteen emotion words of the MTAP article."""

from evaluation.instruments.base import Instrument
from evaluation.instruments.items import ChoiceItem, Option

_WORDS = (
    ("Happy", "高兴"),
    ("Surprise", "惊讶"),
    ("Sad", "悲伤"),
    ("Scornful", "轻蔑"),
    ("Relax", "放松"),
    ("Anxious", "焦虑"),
    ("Mildness", "温和"),
    ("Scared", "害怕"),
    ("Angry", "愤怒"),
    ("Disgust", "厌恶"),
    ("Optimistic", "乐观"),
    ("Hostile", "敌意"),
    ("Boring", "无聊"),
    ("Dependent", "依赖"),
)

EMOTION14 = Instrument(
    name="emotion14",
    title={"en": "Which word fits best?", "zh": "哪个词最合适？"},
    instruction={
        "en": "Choose the one word that fits best what this face expresses.",
        "zh": "请选择最符合这张脸所表达情感的一个词。",
    },
    items=(
        ChoiceItem(
            id="emotion",
            prompt={"en": "What does this face express?", "zh": "这张脸表达了什么？"},
            options=tuple(
                Option(value, {"en": english, "zh": chinese})
                for value, (english, chinese) in enumerate(_WORDS, start=1)
            ),
        ),
    ),
    scores=(),
    source="Jia et al. (2013), Multimedia Tools and Applications, Table 8",
)
