from evaluation.instruments.mos import MOS5


def test_the_scale_runs_from_expressive_to_erratic():
    (item,) = MOS5.items
    scale = [(option.value, option.label["en"], option.description["en"]) for option in item.options]
    assert scale == [
        (5, "Expressive", "natural and expressive gestures like human"),
        (4, "Natural", "appropriate gestures to message content"),
        (3, "Acceptable", "neutral gestures with some expressivity"),
        (2, "Unnatural", "robotic gestures with little expressivity"),
        (1, "Erratic", "inappropriate and weird gestures"),
    ]


def test_the_score_is_the_answer():
    assert MOS5.score({"mos": 4}) == {"MOS": 4.0}
