from evaluation.instruments.sam import SAM


def test_nine_figures_for_each_dimension():
    assert [(item.id, item.figure) for item in SAM.items] == [("P", "pleasure"), ("A", "arousal"), ("D", "dominance")]
    assert all(item.values == (1, 2, 3, 4, 5, 6, 7, 8, 9) for item in SAM.items)


def test_the_scores_run_from_minus_one_to_one_with_the_middle_figure_at_zero():
    assert SAM.score({"P": 9, "A": 5, "D": 1}) == {"P": 1.0, "A": 0.0, "D": -1.0}
    assert SAM.score({"P": "6", "A": "4", "D": "8"}) == {"P": 0.25, "A": -0.25, "D": 0.75}


def test_the_codebook():
    rows = {row.variable: row for row in SAM.codebook()}
    assert (rows["P"].scoring, rows["P"].values) == ("(P - 5) / 4", "-1 to 1, in steps of 0.25")
    assert rows["sam.D"].values == "1 (Controlled, submissive) to 9 (In control, dominant)"
