"""Evaluated faces in PAD space: errors, nearest words, ellipsoids and chosen words."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from evaluation.report.analysis import RESPONSE_COLUMNS, analyse
from evaluation.report.pad_results import intended_words, pad_results
from evaluation.simulate import simulate_responses
from evaluation.statistics.emotion_words import MTAP_2013_WORDS

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

EMPTY = pd.DataFrame(columns=list(RESPONSE_COLUMNS))


@pytest.fixture(scope="module")
def block(crossed):
    return crossed.blocks["pad_results"]


@pytest.fixture(scope="module")
def words(build):
    spec = build(6, 2, instruments=("emotion14",))
    content = spec.model_dump(mode="json", exclude_defaults=True)
    names = ["Happy", "Surprise", "Sad", "nothing of these", "Relax", "Anxious"]
    content["stimuli"] = [
        {**one, "label": {"en": name, "zh": "脸"}} for one, name in zip(content["stimuli"], names, strict=True)
    ]
    return type(spec).model_validate(content)


def section(block, name):
    return next(one for one in block.sections if one.name == name)


def test_errors_by_hand(block, crossed):
    means = crossed.report.pad_by_stimulus
    frame = block.frames["pad_error"].set_index("dimension")
    for name, row in zip("PAD", section(block, "pad_error").rows, strict=True):
        put_in, seen = means[f"input_{name}"].to_numpy(), means[name].to_numpy()
        error = seen - put_in
        line = stats.linregress(put_in, seen)
        own = frame.loc[name]
        assert own["bias"] == pytest.approx(error.mean())
        assert own["rmse"] == pytest.approx(np.sqrt((error**2).mean()))
        assert own["mae"] == pytest.approx(np.abs(error).mean())
        assert (own["slope"], own["intercept"]) == pytest.approx((line.slope, line.intercept))
        expected = stats.t.interval(0.95, len(error) - 1, error.mean(), stats.sem(error))
        assert (own["bias_ci_low"], own["bias_ci_high"]) == pytest.approx(expected)
        assert row == (
            *(name, "6", f"{round(own['bias'], 2) + 0.0:.2f}"),
            f"{round(expected[0], 2) + 0.0:.2f} to {round(expected[1], 2) + 0.0:.2f}",
            *(f"{own['rmse']:.2f}", f"{own['mae']:.2f}", f"{line.slope:.2f}"),
            f"{own['slope_ci_low']:.2f} to {own['slope_ci_high']:.2f}",
            f"{round(line.intercept, 2) + 0.0:.2f}",
        )


def test_the_nearest_word_has_the_smallest_distance(block, crossed):
    means = crossed.report.pad_by_stimulus
    table = np.array(list(MTAP_2013_WORDS.values()))
    far = np.linalg.norm(means[list("PAD")].to_numpy()[:, None] - table, axis=2)
    frame = block.frames["nearest_words"]
    assert frame["distance"].to_numpy() == pytest.approx(far.min(axis=1))
    assert frame["word"].tolist() == [list(MTAP_2013_WORDS)[place] for place in far.argmin(axis=1)]
    rows = section(block, "nearest_words").rows
    assert [row[0] for row in rows] == [f"Face {n}" for n in range(6)]
    assert [row[2] for row in rows] == [f"{distance:.2f}" for distance in frame["distance"]]


def test_ellipsoids_are_those_of_mean_and_covariance(block, crossed):
    frame = block.frames["pad_ellipsoids"].set_index(["stimulus", "coverage"])
    for (stimulus, coverage), own in frame.iterrows():
        scores = crossed.report.scores
        points = scores.loc[scores["stimulus"] == stimulus, list("PAD")].to_numpy()
        variances = np.linalg.eigvalsh(np.cov(points.T))[::-1]
        limit = stats.chi2.ppf(coverage, 3)
        away = points - points.mean(axis=0)
        distance = np.einsum("ij,jk,ik->i", away, np.linalg.inv(np.cov(points.T)), away)
        assert own[["centre_1", "centre_2", "centre_3"]].tolist() == pytest.approx(points.mean(axis=0).tolist())
        assert own[[f"half_axis_{k}" for k in (1, 2, 3)]].tolist() == pytest.approx(np.sqrt(limit * variances).tolist())
        assert own["share_inside"] == pytest.approx((distance <= limit).mean())
    assert [row[:2] for row in section(block, "pad_ellipsoids").rows[:3]] == [
        *(("Face 0", "50 %"), ("Face 0", "95 %"), ("Face 1", "50 %")),
    ]


def test_few_ratings_have_no_ellipsoid_but_a_reason(build):
    spec = build(3, 1, instruments=("pad12",))
    block = pad_results(analyse(spec, simulate_responses(spec, 3, seed=1)))
    found = section(block, "pad_ellipsoids")
    assert found.rows == ()
    # One reason for each stimulus.
    assert len(found.notes) == 1 + 3
    assert "stimulus" in block.frames["pad_ellipsoids"]


def test_constant_ratings_are_said_in_words(crossed_study, crossed_answers):
    report = analyse(crossed_study, crossed_answers.assign(raw=3, keyed=3))
    block = pad_results(report)
    assert "nan" not in str(block.sections).lower()
    assert {row[6] for row in section(block, "pad_error").rows} <= {"0.00", "–"}


def test_clips_without_input_have_words_and_ellipsoids_alone(build):
    spec = build(3, 2, instruments=("pad12",))
    content = spec.model_dump(mode="json", exclude_defaults=True)
    for stimulus in content["stimuli"]:
        stimulus["clip"] = {"text": "hello"}
    spec = type(spec).model_validate(content)
    block = pad_results(analyse(spec, simulate_responses(spec, 4, seed=1)))
    assert [one.name for one in block.sections] == ["nearest_words", "pad_ellipsoids"]


def test_without_evaluated_pad_there_is_no_block(build, crossed_study):
    spec = build(3, 2)
    assert pad_results(analyse(spec, simulate_responses(spec, 3, seed=1))) is None
    assert pad_results(analyse(crossed_study, EMPTY)) is None


def test_intended_words_are_those_of_the_labels(words):
    report = analyse(words, simulate_responses(words, 5, seed=1))
    block = intended_words(report)
    (found,) = block.sections
    own = report.answers[report.answers["stimulus"] != "s3"]
    names = {one.id: one.label["en"] for one in words.stimuli}
    options = {one.value: one.label["en"] for one in words.instrument("emotion14").items[0].options}
    intended, chosen = own["stimulus"].map(names), own["keyed"].map(options)
    rows = {row[0]: row for row in found.rows}
    assert {name: int(row[1]) for name, row in rows.items() if row[1] != "0"} == dict(intended.value_counts())
    assert {name: int(row[2]) for name, row in rows.items() if row[2] != "0"} == dict(chosen.value_counts())
    hits = ((intended == "Sad") & (chosen == "Sad")).sum()
    assert rows["Sad"][3] == f"{hits / 10:.2f}".removeprefix("0")
    assert rows["Hostile"][3] == "–"
    counts = block.frames["confusion_emotion14_emotion_counts"].set_index(
        block.frames["confusion_emotion14_emotion_counts"].columns[0]
    )
    assert counts.to_numpy().sum() == 50
    expected = pd.crosstab(intended, chosen)
    assert all(counts.loc[a, b] == expected.loc[a, b] for a in expected.index for b in expected.columns)
    accuracy = (intended == chosen).mean()
    assert f"accuracy {accuracy:.2f}".replace("0.", ".") in block.sentences[0]


def test_words_that_nobody_offers_are_not_confused(build, crossed, words):
    assert intended_words(crossed.report) is None
    assert intended_words(analyse(words, EMPTY)) is None
    spec = build(3, 2, instruments=("emotion14",))
    assert intended_words(analyse(spec, simulate_responses(spec, 3, seed=1))) is None
