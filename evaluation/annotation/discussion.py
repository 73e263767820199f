"""The discussion of a consensus annotation: raters may say why they answered as they did."""

from evaluation.instruments.base import Instrument
from evaluation.instruments.items import TextItem

DISCUSSION = Instrument(
    name="discussion",
    title={"en": "Your reasons", "zh": "您的理由"},
    instruction={
        "en": "If you like, say why you answered so. The other raters read it, without your name, if you disagree.",
        "zh": "如果愿意，请说明您这样回答的理由。如果意见不一致，其他评定者会看到您的说明，但不会看到您的姓名。",
    },
    items=(
        TextItem(
            id="comment",
            prompt={"en": "Reasons (you may leave this empty)", "zh": "理由（可不填）"},
            max_length=1000,
            required=False,
        ),
    ),
    scores=(),
    source="Jia et al. (2013), section 2.2",
)
