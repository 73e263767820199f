"""paired: which of two clips is preferred."""

from evaluation.instruments.base import Instrument
from evaluation.instruments.items import ChoiceItem, Option

PAIRED = Instrument(
    name="paired",
    clips=("pairs",),
    title={"en": "Which one is better?", "zh": "哪一个更好？"},
    instruction={
        "en": "Watch both clips, then choose one, even if the difference is small.",
        "zh": "请看完两段短片，然后选择其中一段；即使差别很小，也请作出选择。",
    },
    items=(
        ChoiceItem(
            id="preference",
            prompt={
                "en": "Which of the two is more natural and expressive?",
                "zh": "两段短片中，哪一段更自然、更有表现力？",
            },
            options=(
                Option(1, {"en": "Clip A", "zh": "短片 A"}),
                Option(2, {"en": "Clip B", "zh": "短片 B"}),
            ),
        ),
    ),
    scores=(),
    source="Forced choice between two, as for the model of Bradley & Terry (1952), Biometrika, 39, 324-345",
)
