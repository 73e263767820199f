"""pad12: the abbreviated PAD emotion scale, twelve pairs of adjectives with nine points each."""

from evaluation.instruments.base import Instrument, Score
from evaluation.instruments.items import BipolarItem

_EQ13 = "Jia et al. (2013), Multimedia Tools and Applications, Eq. 13"

# English of MTAP 2013, Table 7; Chinese of Zhang et al., ACII 2007, Table 5, whose print cuts off the ends of
# "Wide awake", "充满希望的" and "有影响力的".
_ADJECTIVES = (
    ("Angry", "愤怒的", "Activated", "有活力的"),
    ("Wide awake", "清醒的", "Sleepy", "困倦的"),
    ("Controlled", "被控的", "Controlling", "主控的"),
    ("Friendly", "友好的", "Scornful", "轻蔑的"),
    ("Calm", "平静的", "Excited", "激动的"),
    ("Dominant", "支配的", "Submissive", "顺从的"),
    ("Cruel", "残忍的", "Joyful", "高兴的"),
    ("Interested", "感兴趣的", "Relaxed", "放松的"),
    ("Guided", "被引导的", "Autonomous", "自主的"),
    ("Excited", "兴奋的", "Enraged", "激怒的"),
    ("Relaxed", "放松的", "Hopeful", "充满希望的"),
    ("Influential", "有影响力的", "Influenced", "被影响的"),
)

PAD12 = Instrument(
    name="pad12",
    title={"en": "What does this face express?", "zh": "这张脸表达了什么？"},
    instruction={
        "en": (
            "Each row has two words, one at either end. Choose the point that shows which word describes the face "
            "better, and how much better. The middle point means that neither fits better than the other. "
            "Some pairs may seem odd; your first impression is the right answer."
        ),
        "zh": (
            "每一行的两端各有一个词。请选择一个点，表示哪个词更符合这张脸，以及符合的程度。"
            "中间的点表示两个词同样符合，或同样不符合。有些词对看起来可能有些奇怪，请凭第一印象作答。"
        ),
    },
    items=tuple(
        BipolarItem(
            id=f"Q{number}",
            left={"en": left_en, "zh": left_zh},
            right={"en": right_en, "zh": right_zh},
        )
        for number, (left_en, left_zh, right_en, right_zh) in enumerate(_ADJECTIVES, start=1)
    ),
    scores=(
        Score(
            name="P",
            text="Pleasure, from -1 (displeasure) to 1 (pleasure)",
            weights={"Q1": 1, "Q4": -1, "Q7": 1, "Q10": -1},
            divisor=16,
            source=_EQ13,
        ),
        Score(
            name="A",
            text="Arousal, from -1 (nonarousal) to 1 (arousal)",
            weights={"Q2": -1, "Q5": 1, "Q8": -1, "Q11": 1},
            divisor=16,
            source=_EQ13,
        ),
        Score(
            name="D",
            text="Dominance, from -1 (submissiveness) to 1 (dominance)",
            weights={"Q3": 1, "Q6": -1, "Q9": 1, "Q12": -1},
            divisor=16,
            source=_EQ13,
        ),
    ),
    source="Li et al. (2005), ACII, 513-518, as in Jia et al. (2013), Table 7, and Zhang et al. (2007), Table 5",
)
