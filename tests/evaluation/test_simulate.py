from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from evaluation.annotation.rounds import combine, number_of
from evaluation.errors import DataError, InsufficientDataError
from evaluation.instruments.mos import MOS5
from evaluation.instruments.pad12 import PAD12
from evaluation.responses import RESPONSE_COLUMNS
from evaluation.simulate import (
    PAD_SPREAD,
    RATER_SD,
    annotate_incrementally,
    annotate_pad,
    answer_mos5,
    answer_pad12,
    simulate_responses,
    simulate_trials,
)
from evaluation.statistics.agreement.annotation import annotation_agreement
from evaluation.study import StudySpec


def faces(n, seed=7):
    """True PAD of faces with the spread that the printed agreement implies."""
    spread = [PAD_SPREAD[dimension] for dimension in "PAD"]
    return np.clip(np.random.default_rng(seed).normal(size=(n, 3)) * spread, -1, 1)


def test_the_noise_is_that_of_mtap_section_2_4():
    rng = np.random.default_rng(7)
    scores = pd.DataFrame([PAD12.score(answer_pad12((0.3, 0.0, -0.2), rng=rng)) for _ in range(4000)])
    assert scores.mean().tolist() == pytest.approx([0.3, 0.0, -0.2], abs=0.02)
    assert scores.std().to_dict() == pytest.approx({"P": 0.20, "A": 0.32, "D": 0.30}, abs=0.015)
    assert dict(RATER_SD) == {"P": 0.20, "A": 0.32, "D": 0.30}


@pytest.mark.parametrize("pad", [(1, 1, 1), (-1, -1, -1)])
def test_answers_stay_on_the_scale_at_its_ends(pad):
    rng = np.random.default_rng(7)
    for _ in range(50):
        answers = answer_pad12(pad, rng=rng)
        assert PAD12.validate(answers) == answers
        opinion = answer_mos5(5 if pad[0] > 0 else 1, rng=rng)
        assert MOS5.validate(opinion) == opinion


def test_opinions_have_the_mean_asked_for():
    rng = np.random.default_rng(7)
    assert np.mean([answer_mos5(3.3, rng=rng)["mos"] for _ in range(4000)]) == pytest.approx(3.3, abs=0.05)


def test_the_first_of_many_participants_answer_as_the_first_of_few(demo):
    few, many = simulate_responses(demo, 2, seed=5), simulate_responses(demo, 4, seed=5)
    pd.testing.assert_frame_equal(many[many["participant"] <= 2].reset_index(drop=True), few)
    assert not simulate_responses(demo, 2, seed=6).equals(few)


def test_a_participant_answers_every_item_of_every_trial(demo, answers):
    assert list(answers.columns) == list(RESPONSE_COLUMNS)
    assert len(answers) == 30 * 14 * 13
    assert answers.groupby(["stimulus", "condition"])["participant"].nunique().eq(10).all()


def test_what_cannot_be_simulated():
    rng = np.random.default_rng(7)
    with pytest.raises(DataError, match="three numbers from -1 to 1"):
        answer_pad12((0.1, 0.2), rng=rng)
    with pytest.raises(DataError, match="three numbers from -1 to 1"):
        answer_pad12((0, 0, float("nan")), rng=rng)
    with pytest.raises(DataError, match="from 1 to 5"):
        answer_mos5(0, rng=rng)
    with pytest.raises(DataError, match="three columns, P, A and D, with values from -1 to 1"):
        annotate_pad([[0.1, 0.2]], rng=rng)
    with pytest.raises(DataError, match="three columns"):
        annotate_pad([[0.1, 0.2, 1.1]], rng=rng)
    with pytest.raises(DataError, match="missing or infinite"):
        annotate_pad([[0.1, 0.2, float("nan")]], rng=rng)
    with pytest.raises(DataError, match="raters is 0"):
        annotate_pad([[0.1, 0.2, 0.3]], raters=0, rng=rng)


class TestAnnotators:
    def test_their_agreement_is_that_of_mtap_section_2_4(self, case):
        published = case("mtap2013_annotation")
        expected, rtol = published["expected"], published["tolerance"]["rtol"]
        found = annotation_agreement(annotate_pad(faces(20000), rng=np.random.default_rng(1)))
        assert [one.sd for one in found.dimensions] == pytest.approx(expected["sd"], rel=rtol)
        assert [one.pairwise_r for one in found.dimensions] == pytest.approx(expected["pairwise_r"], rel=rtol)

    def test_so_it_is_on_as_few_samples_as_there(self, case):
        published = case("mtap2013_annotation")
        rng = np.random.default_rng(1)
        studies = [
            annotation_agreement(annotate_pad(faces(486, seed), rng=rng)).to_frame()[["sd", "pairwise_r"]].to_numpy()
            for seed in range(20)
        ]
        assert np.mean(studies, axis=0)[:, 0] == pytest.approx(published["expected"]["sd"], rel=0.02)
        assert np.std(studies, axis=0)[:, 0].max() < 0.01
        assert all(np.abs(study[:, 1] - published["expected"]["pairwise_r"]).max() < 0.1 for study in studies)

    def test_they_answer_on_the_five_points(self):
        ratings = annotate_pad(faces(2000), raters=3, rng=np.random.default_rng(1))
        assert ratings.shape == (2000, 3, 3)
        assert set(np.unique(ratings)) == {-1, -0.5, 0, 0.5, 1}
        assert not np.signbit(ratings[ratings == 0]).any()

    def test_their_mean_is_the_truth_except_near_the_ends(self):
        pad = np.tile([0.4, -0.1, 0.2], (4000, 1))
        ratings = annotate_pad(pad, rng=np.random.default_rng(1))
        assert ratings.mean(axis=(0, 1)) == pytest.approx([0.4, -0.1, 0.2], abs=0.03)
        assert (annotate_pad(np.ones((500, 3)), rng=np.random.default_rng(1)).mean(axis=(0, 1)) < 1).all()

    def test_the_same_seed_gives_the_same_ratings(self):
        first, again, other = (annotate_pad(faces(50), rng=np.random.default_rng(seed)) for seed in (1, 1, 2))
        assert (first == again).all()
        assert (first != other).any()

    def test_no_faces_no_ratings(self):
        assert annotate_pad(np.empty((0, 3)), rng=np.random.default_rng(1)).shape == (0, 5, 3)


class TestIncrementalAnnotation:
    def test_the_papers_setting(self, case):
        published = case("mtap2013_annotation")
        true = faces(published["data"]["samples"])
        found = annotate_incrementally(true, rng=np.random.default_rng(1))
        assert len(found.rounds) == published["expected"]["rounds"]
        assert found.ratings.shape == (486, published["data"]["raters"], 3)
        assert found.pad == pytest.approx(combine(found.rounds, 486).mean(axis=1))
        assert found.times.sum() == sum(one.samples.size for one in found.rounds)
        assert found.times.min() == 1
        for before, after in zip(found.rounds[:-1], found.rounds[1:], strict=True):
            assert after.again.size == number_of(before.samples.size, published["data"]["share"])
        # The mean over rounds makes the agreement somewhat better than the paper's.
        sds, correlations = published["expected"]["sd"], published["expected"]["pairwise_r"]
        for one, sd, r in zip(found.agreement.dimensions, sds, correlations, strict=True):
            assert 0.8 * sd < one.sd < sd
            assert r - 0.05 < one.pairwise_r < r + 0.15
        assert all(np.corrcoef(found.pad[:, k], true[:, k])[0, 1] > 0.8 for k in range(3))

    def test_rating_again_what_is_disputed_lowers_the_deviation(self):
        true = faces(3000)
        once = annotate_incrementally(true, share=0, rng=np.random.default_rng(1))
        again = annotate_incrementally(true, rng=np.random.default_rng(1))
        assert len(once.rounds) == 5
        for one, two in zip(once.agreement.dimensions, again.agreement.dimensions, strict=True):
            assert 0.85 * one.sd < two.sd < 0.95 * one.sd
            assert two.pairwise_r > one.pairwise_r

    def test_the_same_seed_gives_the_same_annotation(self):
        first, again = (annotate_incrementally(faces(60), rng=np.random.default_rng(3)).pad for _ in range(2))
        assert (first == again).all()

    def test_what_cannot_be_annotated(self):
        with pytest.raises(DataError, match="cannot be divided into 5 sets"):
            annotate_incrementally(faces(4), rng=np.random.default_rng(1))
        with pytest.raises(InsufficientDataError, match="two raters"):
            annotate_incrementally(faces(40), raters=1, rng=np.random.default_rng(1))
        with pytest.raises(DataError, match="from -1 to 1"):
            annotate_incrementally(2 * np.ones((10, 3)), rng=np.random.default_rng(1))


RICH = (Path(__file__).parents[1] / "data" / "rich.yaml").read_text(encoding="utf-8")


class TestAnyDesign:
    @pytest.fixture
    def rich(self):
        """The rich study without its annotation in rounds."""
        return StudySpec.from_yaml(RICH[: RICH.index("  - name: words")] + RICH[RICH.index("screening:") :])

    def test_flipped_items_are_given_as_on_the_page(self, rich):
        frame = simulate_responses(rich, 3, seed=1)
        assert list(frame.columns) == [*RESPONSE_COLUMNS, "keyed", "clip"]
        pad12 = frame[frame["instrument"] == "pad12"]
        turned = pad12[pad12["raw"] != pad12["keyed"]]
        assert (turned["raw"] == -turned["keyed"]).all()
        assert turned.groupby(["participant", "trial"]).size().between(1, 6).all()

    def test_what_is_no_statistic_is_in_the_trials_alone(self, rich):
        frame = simulate_responses(rich, 2, seed=1)
        assert set(frame["instrument"]) == {"pad12", "emotion14", "extra", "slider100"}
        assert set(frame.loc[frame["instrument"] == "extra", "item"]) == {"clear"}
        assert sorted(frame.loc[frame["instrument"] == "slider100", "clip"].unique()) == [1, 2]
        made = list(simulate_trials(rich, 2, seed=1))
        assert [trial.trial for trial in made if trial.participant == 1] == list(range(1, 15))
        assert {trial.kind for trial in made} == {"before", "rating", "repeat", "gold", "instructed"}
        assert {trial.part for trial in made} == {"faces", "pairs"}
        assert all("paired" in trial.raw for trial in made if trial.part == "pairs")
        assert all(trial.keyed["extra"]["clear"] == 3 for trial in made if trial.kind == "instructed")

    def test_rounds_cannot_be_simulated_beforehand(self):
        with pytest.raises(DataError, match="Part words is annotated in rounds"):
            simulate_responses(StudySpec.from_yaml(RICH), 1, seed=1)

    def test_words_are_answered_word_by_word(self):
        spec = StudySpec.from_yaml(
            RICH.replace("    annotation: {mode: consensus, raters: 3, agree: 2, stop: {rounds: 2}}\n", "")
        )
        words = [trial for trial in simulate_trials(spec, 1, seed=1) if trial.part == "words"]
        by_stimulus = {trial.cells[0].stimulus: list(trial.raw["prosodic_words"]) for trial in words}
        assert by_stimulus == {"happy": ["P-1", "A-1", "P-2", "A-2"], "angry": ["P-1", "A-1"]}
