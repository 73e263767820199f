import numpy as np
import pandas as pd
import pytest

from evaluation.errors import DataError
from evaluation.instruments.mos import MOS5
from evaluation.instruments.pad12 import PAD12
from evaluation.responses import RESPONSE_COLUMNS
from evaluation.simulate import RATER_SD, answer_mos5, answer_pad12, simulate_responses


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
