"""The questionnaire as a scale, against numpy."""

import numpy as np
import pandas as pd
import pytest

from evaluation.report.analysis import RESPONSE_COLUMNS, analyse
from evaluation.report.scale_quality import scale_quality
from evaluation.simulate import simulate_responses

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


@pytest.fixture(scope="module")
def block(crossed):
    return crossed.blocks["scale_quality"]


def turned(report, dimension):
    answers = report.answers[report.answers["instrument"] == "pad12"]
    wide = answers.pivot_table(index=["participant", "trial"], columns="item", values="keyed")
    weights = next(score for score in report.spec.instrument("pad12").scores if score.name == dimension).weights
    return np.column_stack([wide[item] * weight for item, weight in weights.items()]).astype(float)


def share(value):
    return f"{value:.2f}".replace("0.", ".")


def test_alpha_and_item_correlations_by_hand(block, crossed):
    frame = block.frames["scale_quality"].set_index("dimension")
    items = block.frames["scale_items"]
    for row in block.sections[0].rows:
        table = turned(crossed.report, row[0])
        k = table.shape[1]
        alpha = k / (k - 1) * (1 - table.var(axis=0, ddof=1).sum() / table.sum(axis=1).var(ddof=1))
        rest = [np.corrcoef(table[:, j], np.delete(table, j, axis=1).sum(axis=1))[0, 1] for j in range(k)]
        assert frame.loc[row[0], "alpha"] == pytest.approx(alpha)
        assert items.loc[items["dimension"] == row[0], "rest_r"].to_numpy() == pytest.approx(rest)
        assert row[1:3] == ("4", share(alpha))
        assert row[6] == f"{share(min(rest))} to {share(max(rest))}"
        ends = frame.loc[row[0], ["rest_r_min", "rest_r_max"]].tolist()
        assert ends == pytest.approx([min(rest), max(rest)])
        assert row[4] == share(frame.loc[row[0], "omega"])
        # With one factor and nearly equal loadings omega and alpha agree.
        assert frame.loc[row[0], "omega"] == pytest.approx(alpha, abs=0.02)


def test_arousal_is_flagged_as_the_weak_side(block):
    assert any(note.startswith("Arousal is known to be the weak side") for note in block.sections[0].notes)


def test_rows_are_said_to_be_nested(block):
    assert any("8 raters and 6 stimuli" in note for note in block.sections[0].notes)


def test_the_interval_comes_from_the_seed_of_the_study(crossed_study, crossed_answers, block):
    again = scale_quality(analyse(crossed_study, crossed_answers)).frames["scale_quality"]
    pd.testing.assert_frame_equal(again, block.frames["scale_quality"])


def test_studies_without_the_questionnaire_have_no_block(build):
    spec = build(3, 2, instruments=("sam",))
    assert scale_quality(analyse(spec, simulate_responses(spec, 3, seed=1))) is None


@pytest.mark.parametrize("rows", [0, 13, 26])
def test_few_answers_are_said_in_words(crossed_study, crossed_answers, rows):
    some = crossed_answers.head(rows) if rows else pd.DataFrame(columns=list(RESPONSE_COLUMNS))
    (section,) = scale_quality(analyse(crossed_study, some)).sections
    assert section.notes
    assert "nan" not in str(section).lower()


def test_constant_answers_are_said_in_words(crossed_study, crossed_answers):
    (section,) = scale_quality(analyse(crossed_study, crossed_answers.assign(raw=3, keyed=3))).sections
    assert "nan" not in str(section).lower()
    assert all(row[2] == "–" for row in section.rows)


def test_turned_poles_are_turned_back(crossed_study, crossed_answers, block):
    flipped = crossed_answers.assign(keyed=crossed_answers["raw"])
    own = flipped["instrument"] == "pad12"
    flipped["raw"] = flipped["raw"].where(~own, -flipped["raw"])
    found = scale_quality(analyse(crossed_study, flipped)).frames["scale_quality"]
    pd.testing.assert_frame_equal(found, block.frames["scale_quality"])
