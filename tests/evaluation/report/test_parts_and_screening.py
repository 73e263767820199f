"""Reports on parts, other scores, votes, preferences and repeats, with and without screened raters."""

import math
from pathlib import Path

import pandas as pd
import pytest

from evaluation.errors import DataError
from evaluation.report import export, html, tables
from evaluation.report.analysis import RESPONSE_COLUMNS, Unavailable, analyse
from evaluation.report.full import FullReport
from evaluation.report.ratings import preference_scores
from evaluation.responses import check_responses, score_trials
from evaluation.screening import ScreeningData, screen
from evaluation.simulate import simulate_responses, simulate_trials
from evaluation.statistics.bradley_terry import BradleyTerry
from evaluation.statistics.opinion import opinion_score
from evaluation.study import StudySpec
from evaluation.study_parts import Screening

RICH = (Path(__file__).parents[2] / "data" / "rich.yaml").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def rich():
    """The rich study without its annotation in rounds."""
    return StudySpec.from_yaml(RICH[: RICH.index("  - name: words")] + RICH[RICH.index("screening:") :])


@pytest.fixture(scope="module")
def given(rich):
    return simulate_responses(rich, 6, seed=3)


@pytest.fixture(scope="module")
def preferences(rich):
    rows = [
        (trial.participant, trial.trial, trial.cells[0].condition, trial.cells[1].condition, trial.keyed["paired"])
        for trial in simulate_trials(rich, 6, seed=3, quality={"subtle": 3.0, "full": 3.3})
        if trial.part == "pairs"
    ]
    table = pd.DataFrame(rows, columns=["participant", "trial", "condition_a", "condition_b", "answer"])
    first = table["answer"].map(lambda answer: answer["preference"] == 1)
    return table.assign(preferred=table["condition_a"].where(first, table["condition_b"]))


def of(part, rich, given):
    asked = {use.use for use in rich.part(part).instruments}
    return given[given["instrument"].isin(asked)]


def without(demo, *participants):
    decisions = dict.fromkeys(participants, ("used", "told us so"))
    everybody = pd.DataFrame({"participant": range(1, 31), "kind": "gold", "passed": True})
    return screen(Screening(), ScreeningData(checks=everybody), decisions=decisions)


def names(report):
    return [section.name for section in tables.sections(report)]


def test_scores_of_own_instruments_by_condition(rich, given):
    report = analyse(rich.only("faces"), of("faces", rich, given))
    assert report.part == "faces"
    found = report.scores_by_condition.set_index(["score", "condition"])
    scores = score_trials(rich.only("faces"), check_responses(rich.only("faces"), of("faces", rich, given)))
    expected = opinion_score(scores.loc[scores["condition"] == "full", "clarity"].to_numpy())
    row = found.loc[("clarity", "full")]
    assert (row["n"], row["mean"], row["sd"]) == (expected.n, pytest.approx(expected.mean), pytest.approx(expected.sd))
    assert (row["ci_low"], row["ci_high"]) == pytest.approx(expected.ci)
    assert names(report) == ["overview", "reverse_evaluation", "pad_by_stimulus", "scores_by_condition", "votes"]
    assert tables.to_text(report).startswith("Everything: Single faces (rich, part faces)\n")
    assert "part faces" in html.render(FullReport(report))


def test_votes_count_every_answer(rich, given):
    report = analyse(rich.only("faces"), of("faces", rich, given))
    own = given[given["item"] == "emotion"]
    assert sum(one.votes.n for one in report.votes) == len(own) == 36
    one = next(one for one in report.votes if (one.stimulus, one.condition) == ("happy", "full"))
    values = own[(own["stimulus"] == "happy") & (own["condition"] == "full")]["raw"]
    assert one.votes.counts[0] == (values == 1).sum()
    assert one.votes.labels[0] == "Happy"
    frame = tables.frames(report)["votes"]
    assert frame["votes"].sum() == 36
    assert len(frame) == 6 * 14


def test_preferences_give_scores_of_the_conditions(rich, given, preferences):
    report = analyse(rich.only("pairs"), of("pairs", rich, given), preferences=preferences)
    assert isinstance(report.preferences, BradleyTerry)
    assert report.preferences.names == ("subtle", "full")
    assert report.preferences.comparisons == 18
    wins = (preferences["preferred"] == "full").sum()
    section = next(one for one in tables.sections(report) if one.name == "preferences")
    assert section.rows[1][:3] == ("Full", str(wins), str(18 - wins))
    assert report.trials == 18
    assert any(sentence.startswith("Preferences: ") for sentence in tables.headline(report))
    assert tables.frames(report)["preferences"]["condition"].tolist() == ["subtle", "full"]


def test_preferences_that_give_no_scores_say_why(rich, preferences):
    spec, empty = rich.only("pairs"), pd.DataFrame(columns=list(RESPONSE_COLUMNS))
    assert analyse(spec, empty).preferences == Unavailable("No clips have been compared yet.")
    with pytest.raises(DataError, match="one of the two conditions"):
        analyse(spec, empty, preferences=preferences.assign(preferred="huge"))


def test_one_sided_preferences_give_scores_that_say_how(rich, preferences):
    spec, empty = rich.only("pairs"), pd.DataFrame(columns=list(RESPONSE_COLUMNS))
    onesided = analyse(spec, empty, preferences=preferences.assign(preferred="full"))
    assert onesided.participants == 6
    assert onesided.preferences.prior == 0.5
    # Odds of 18.5 to 0.5.
    assert onesided.preferences.difference("full", "subtle")[0] == pytest.approx(math.log(18.5 / 0.5))
    assert "0.5 preferences were added in each direction" in tables.to_text(onesided)


def test_conditions_that_nobody_compared_have_no_common_scale():
    table = pd.DataFrame({"condition_a": ["a", "c"], "condition_b": ["b", "d"], "preferred": ["a", "d"]})
    found = preference_scores(table, ["a", "b", "c", "d"])
    assert isinstance(found, Unavailable)
    assert "never compared" in found.reason


def test_repeats_tell_how_well_raters_agree_with_themselves(demo, answers):
    repeats = pd.DataFrame({"participant": 1, "score": "P", "first": [0.1, 0.4, -0.2], "second": [0.2, 0.4, -0.4]})
    report = analyse(demo, answers, repeats=repeats)
    (found,) = report.repeats
    assert (found.score, found.n, found.mean_difference) == ("P", 3, pytest.approx(0.1))
    assert found.result.r == pytest.approx(repeats["first"].corr(repeats["second"]))
    assert "repeats" in names(report)
    few = analyse(demo, answers, repeats=repeats.head(1)).repeats[0]
    assert isinstance(few.result, Unavailable)


def test_nobody_excluded_means_one_report(demo, answers):
    report = analyse(demo, answers, screening=without(demo))
    assert report.screening is None
    assert report.used is None
    assert not any("raters" in section.title for section in tables.sections(report))


def test_screened_raters_are_left_out_beside_the_full_results(demo, answers):
    report = analyse(demo, answers, screening=without(demo, 3, 17))
    left = analyse(demo, answers[~answers["participant"].isin([3, 17])])
    assert (report.participants, report.used.participants) == (30, 28)
    assert report.used.mos_anova == left.mos_anova
    assert report.mos_anova == analyse(demo, answers).mos_anova
    assert report.mos_anova != left.mos_anova
    found = {section.name: section for section in tables.sections(report)}
    assert found["mos_anova"].title.endswith("– all 30 raters")
    assert found["mos_anova_used"].title.endswith("– the 28 raters used")
    assert left.mos_anova.summary() in found["mos_anova_used"].notes
    assert [row[0] for row in found["screening"].rows] == ["3", "17"]
    assert "told us so" in found["screening"].rows[0][2]
    assert sum(line.startswith("With the 28 raters used: ") for line in tables.headline(report)) == 4
    frames = tables.frames(report)
    assert frames["mos_by_cell"]["n"].sum() == 420
    assert frames["mos_by_cell_used"]["n"].sum() == 28 * 14
    assert html.render(FullReport(report)).count('id="mos_anova_used"') == 1


def test_nobody_left_still_gives_a_report(demo, answers):
    report = analyse(demo, answers, screening=without(demo, *range(1, 31)))
    assert report.used.participants == 0
    assert isinstance(report.used.mos_anova, Unavailable)
    assert "– the 0 raters used" in tables.to_text(report)


def test_conditions_of_other_parts_do_not_appear(make_study):
    spec = make_study(3, 3)
    parts = [
        {"name": "a", "instruments": ["mos5"], "presentation": {"assignment": "full", "cells": cells}}
        for cells in [[{"stimulus": f"s{k}", "condition": f"c{c}"} for k in range(3) for c in (0, 1)]]
    ]
    content = spec.model_dump(mode="json", exclude_defaults=True) | {"parts": parts}
    del content["instruments"], content["presentation"]
    two = StudySpec.model_validate(content)
    report = analyse(two, simulate_responses(two, 4, seed=1, quality={"c0": 2, "c1": 4, "c2": 3}))
    assert report.conditions == ("c0", "c1")
    assert [found.condition for found in report.mos_by_condition] == ["c0", "c1"]
    assert names(report)[:4] == ["overview", "mos_by_condition", "mos_anova", "mos_by_stimulus"]
    assert report.notes == ()


def test_a_score_asked_in_two_parts_is_explained_for_each(rich):
    book = export.codebook(rich)
    assert {"pad12.Q1", "emotion14.emotion", "extra.why", "clarity", "about.tired", "slider100.quality-k"} <= set(
        book["variable"]
    )
