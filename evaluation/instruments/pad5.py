"""pad5: pleasure, arousal and dominance rated directly, in five steps each."""

from evaluation.instruments.base import Instrument, Score
from evaluation.instruments.items import BipolarItem

_SOURCE = "Jia et al. (2013), Multimedia Tools and Applications, section 2.4"

PAD5 = Instrument(
    name="pad5",
    title={"en": "What does this face express?", "zh": "这张脸表达了什么？"},
    instruction={
        "en": (
            "Each row has two words, one at either end. Choose the point that shows which word describes the face "
            "better, and how much better. The middle point means that neither fits better than the other."
        ),
        "zh": (
            "每一行的两端各有一个词。请选择一个点，表示哪个词更符合这张脸，以及符合的程度。"
            "中间的点表示两个词同样符合，或同样不符合。"
        ),
    },
    items=(
        BipolarItem(
            id="P",
            prompt={"en": "Pleasure", "zh": "愉悦度"},
            left={"en": "Negative", "zh": "消极的"},
            right={"en": "Positive", "zh": "积极的"},
            low=-2,
            high=2,
        ),
        BipolarItem(
            id="A",
            prompt={"en": "Arousal", "zh": "激活度"},
            left={"en": "Calm", "zh": "平静的"},
            right={"en": "Excited", "zh": "激动的"},
            low=-2,
            high=2,
        ),
        BipolarItem(
            id="D",
            prompt={"en": "Dominance", "zh": "优势度"},
            left={"en": "Weak", "zh": "弱势的"},
            right={"en": "Strong", "zh": "强势的"},
            low=-2,
            high=2,
        ),
    ),
    scores=(
        Score(
            name="P",
            text="Pleasure, from -1 (negative) to 1 (positive)",
            weights={"P": 1},
            divisor=2,
            source=_SOURCE,
        ),
        Score(name="A", text="Arousal, from -1 (calm) to 1 (excited)", weights={"A": 1}, divisor=2, source=_SOURCE),
        Score(name="D", text="Dominance, from -1 (weak) to 1 (strong)", weights={"D": 1}, divisor=2, source=_SOURCE),
    ),
    source=_SOURCE,
)
