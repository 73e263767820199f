"""slider100: several clips side by side, each rated on a line from 0 to 100."""

from evaluation.instruments.base import Instrument, Score
from evaluation.instruments.items import SliderItem

_SOURCE = "Continuous quality scale from 0 to 100, as in Recommendation ITU-R BS.1534-3"

SLIDER100 = Instrument(
    name="slider100",
    per="clip",
    clips=("pairs", "all"),
    title={"en": "How good is each clip?", "zh": "每段短片有多好？"},
    instruction={
        "en": "Watch all clips, then set a point on each line. You may watch a clip again and move its point.",
        "zh": "请看完所有短片，然后在每条线上选定一个点。您可以重新观看短片并移动对应的点。",
    },
    items=(
        SliderItem(
            id="quality",
            prompt={"en": "How natural and expressive is it?", "zh": "它有多自然、多有表现力？"},
            left={"en": "Bad", "zh": "很差"},
            right={"en": "Excellent", "zh": "极好"},
        ),
    ),
    scores=(
        Score(
            name="quality",
            text="Quality, from 0 (bad) to 100 (excellent)",
            weights={"quality": 1},
            divisor=1,
            source=_SOURCE,
        ),
    ),
    source=_SOURCE,
)
