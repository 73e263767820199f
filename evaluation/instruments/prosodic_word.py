"""prosodic_words: appraisal and degree of each prosodic word of a sentence, as its (P, A) values."""

from evaluation.instruments.base import Instrument, Score
from evaluation.instruments.items import LikertItem, Option

_SOURCE = "Jia et al. (2013), Multimedia Tools and Applications, section 2.2"

PROSODIC_WORDS = Instrument(
    name="prosodic_words",
    per="word",
    title={"en": "What does each word say?", "zh": "每个词表达了什么？"},
    instruction={
        "en": (
            "For each word of the sentence, choose what it says about its subject, and in which degree. Judge the word "
            "as it is used in this sentence."
        ),
        "zh": "请针对句中的每个词，选择它对所谈对象的评价以及程度。请按该词在本句中的用法判断。",
    },
    items=(
        LikertItem(
            id="P",
            prompt={"en": "What does the word say about its subject?", "zh": "这个词带有怎样的评价？"},
            options=(
                Option(
                    -1,
                    {"en": "Derogatory", "zh": "贬义"},
                    {"en": "it finds fault", "zh": "表示否定或批评"},
                ),
                Option(
                    0,
                    {"en": "Neutral", "zh": "中性"},
                    {"en": "it neither praises nor finds fault", "zh": "既不褒扬也不贬低"},
                ),
                Option(
                    1,
                    {"en": "Commendatory", "zh": "褒义"},
                    {"en": "it praises", "zh": "表示肯定或赞扬"},
                ),
            ),
        ),
        LikertItem(
            id="A",
            prompt={"en": "In which degree?", "zh": "程度如何？"},
            options=(
                Option(
                    0,
                    {"en": "Neutral degree", "zh": "一般程度"},
                    {"en": "no degree, and no key fact", "zh": "不表示程度，也不含关键信息"},
                ),
                Option(
                    1,
                    {"en": "Comparative or key fact", "zh": "比较级或关键信息"},
                    {"en": "it compares, or carries a key fact", "zh": "表示比较，或含有关键信息"},
                ),
                Option(
                    2,
                    {"en": "Superlative or high degree", "zh": "最高级或高程度"},
                    {"en": "such as “most”, “super” or “very”", "zh": "例如“最”“超”“很”"},
                ),
            ),
        ),
    ),
    scores=(
        Score(
            name="P",
            text="Pleasure: -1 (derogatory), 0 (neutral) or 1 (commendatory)",
            weights={"P": 1},
            divisor=1,
            source=_SOURCE,
        ),
        Score(
            name="A",
            text="Arousal: 0 (neutral degree), 0.5 (comparative or key fact) or 1 (superlative or high degree)",
            weights={"A": 1},
            divisor=2,
            source=_SOURCE,
        ),
    ),
    source=_SOURCE,
)
