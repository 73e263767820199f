from evaluation.known_answers import by_place, passes


def test_answers_without_places_are_one_page():
    assert by_place({"mos5": {"mos": 4}}, ()) == [{"mos5": {"mos": 4}}]
    assert by_place({}, ()) == [{}]


def test_each_word_has_its_answers_and_those_about_all():
    answers = {"tone": {"P-1": 1, "A-1": 2, "P-2": -1}, "mos5": {"mos-2": 4}}
    assert by_place(answers, {"tone"}) == [
        {"mos5": {"mos-2": 4}, "tone": {"P": 1, "A": 2}},
        {"mos5": {"mos-2": 4}, "tone": {"P": -1}},
    ]


def test_one_of_several_options_is_that_option():
    (page,) = by_place({"seen": {"colours": (3,), "shapes": [1, 2]}}, ())
    assert page == {"seen": {"colours": 3, "shapes": [1, 2]}}
    assert passes({"seen.colours": (3, 4)}, page)
    assert not passes({"seen.shapes": (1, 2)}, page)
