import json

import numpy as np
import pytest

from synth.errors import SpecError
from synth.head.amplitude import AmplitudeModel, default_model
from synth.head.published import example_sentence
from synth.head.recording import amplitude_sample, percentages, recording_statistics, syllable_type
from synth.head.trajectory import head_motion
from synth.head.words import ProsodicWord, Syllable, evenly


def word(start: int, end: int, P: float = 0.0, A: float = 0.5, parts: str = "") -> ProsodicWord:
    """A word between frames at 25 per second; parts are tones, * for stress."""
    read = [(f"s{k}", int(part[0]), part.endswith("*")) for k, part in enumerate(parts.split())]
    return ProsodicWord("w", start / 25, end / 25, P, A, evenly(read, start / 25, end / 25) if read else ())


def peaks_at(frames: list[int], length: int) -> np.ndarray:
    """Angles whose pitch has single peaks; the other axes rest."""
    angles = np.zeros((length, 3))
    angles[frames, 0] = 5.0
    return angles


@pytest.mark.parametrize(
    ("counts", "percent"),
    [
        ([8, 50, 7, 17, 12], [8.5, 53.2, 7.4, 18.1, 12.8]),  # MTAP 2013, Table 1
        ([15, 26, 22, 31], [16.0, 27.7, 23.4, 33.0]),  # MTAP 2013, Table 4
        ([0, 0], [0.0, 0.0]),
        ([], []),
    ],
)
def test_percentages(counts, percent):
    assert percentages(counts) == percent


@pytest.mark.parametrize(
    ("frame", "kind"), [(0, "falling"), (9, "falling"), (10, "stressed"), (20, "other"), (35, "falling"), (40, "other")]
)
def test_kinds_of_syllables_exclude_each_other(frame, kind):
    # Stress comes before the falling tone, the falling tone before the first place.
    assert syllable_type(word(0, 40, parts="4 4* 2 4"), frame, fps=25) == kind


def test_the_first_syllable_and_gaps():
    timed = ProsodicWord("w", 0.0, 1.0, 0, 0, (Syllable("a", 0.2, 0.4, 2), Syllable("b", 0.6, 1.0, 3)))
    assert [syllable_type(timed, frame, fps=25) for frame in (0, 5, 9, 10, 15)] == [
        *("other", "first", "first", "other", "other")
    ]
    assert syllable_type(word(0, 10), 3, fps=25) == "first"


def test_tables_1_and_4_of_a_known_recording():
    words = [
        word(0, 20, 1, 1, "1 4*"),  # peak at 15: stressed
        word(20, 40, 0, 0.5, "4 1"),  # peak at 22: falling
        word(40, 60, 0, 0.5, "2 4"),  # peak at 45: first
        word(60, 80, 0, 0, "2 3"),  # peak at 75: other
        word(80, 100, 0, 0.5, "4 4"),  # peak at 95: falling
    ]
    found = recording_statistics(peaks_at([15, 22, 45, 75, 95], 100), words)
    assert found.counts == {(0, 0): 1, (0, 0.5): 3, (1, 1): 1}
    assert found.peaks == {"stressed": 1, "falling": 2, "first": 1, "other": 1}
    assert (found.words, found.syllables, found.frames) == (5, 10, 100)
    assert found.rotation.angle_range.tolist() == [5, 0, 0]
    np.testing.assert_allclose(found.rotation.amp_mean, [5, 0, 0])
    np.testing.assert_allclose(found.rotation.avg_mean, [0.25, 0, 0])
    np.testing.assert_allclose(found.rotation.angle_sd[0], np.sqrt((5 * 25 - 100 * 0.25**2) / 99))
    assert found.extreme_points == 5
    assert found.extreme_distance == 20.0
    assert np.isnan(found.correlations[1:, :]).all()
    assert found.model is None
    assert "determine only" in found.model_fault


def test_silence_between_words_has_its_own_class():
    angles = np.zeros((100, 3))
    angles[30:40, 1] = 3.0  # within the pause
    angles[5, 0], angles[95, 2] = 2.0, 4.0
    words = [word(2, 25, 1, 1), word(25, 28, 0, 0), word(50, 80, 0, 0), word(82, 100, 0, 0)]
    found = recording_statistics(angles, words)
    assert {pair: amp.tolist() for pair, amp in found.mean_amp.items()} == {
        (0.0, -0.5): [0, 3, 0],
        (0.0, 0.0): [0, 0, pytest.approx(4 / 3)],
        (1.0, 1.0): [2, 0, 0],
    }
    # The gap of two frames is no silence, and neither is what comes before the first word.
    sample = amplitude_sample(angles, words)
    assert (~sample.spoken).sum() == 1


def test_frames_may_count_from_another_number():
    words = [word(1000, 1030, 1, 1, "1 1"), word(1030, 1060, 0, 0, "1 4")]
    found = recording_statistics(peaks_at([20, 50], 60), words, first=1000)
    assert found.peaks == {"stressed": 0, "falling": 1, "first": 0, "other": 1}
    with pytest.raises(SpecError, match="within the angles, frames 1001 to 1061"):
        recording_statistics(peaks_at([20, 50], 60), words, first=1001)


def test_correlations_of_known_axes():
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(2, 400))
    angles = np.stack([x, -2 * x, y], axis=1)
    found = recording_statistics(angles, [word(0, 100), word(100, 400)])
    np.testing.assert_allclose(found.correlations, np.corrcoef(angles.T))
    assert found.correlations[0, 1] == pytest.approx(-1.0)


def test_what_was_synthesised_is_measured_again():
    # Many renderings of the paper's sentence, with P = 1, A = 0.5 given to its first word as in Table 1.
    words, angles, now = [], [], 0.0
    for seed in range(12):
        spoken = [
            ProsodicWord(one.text, one.start_s + now, one.end_s + now, 1 if k == 0 else one.P, one.A)
            for k, one in enumerate(example_sentence(syllable_s=0.32))
        ]
        local = example_sentence(syllable_s=0.32)
        local = (ProsodicWord(local[0].text, local[0].start_s, local[0].end_s, 1, 0.5), *local[1:])
        motion = head_motion(local, rng=np.random.default_rng(seed), transition_s=0.0)
        words += spoken
        angles.append(motion.angles)
        now += len(motion.angles) / 25
    found = recording_statistics(np.concatenate(angles), words)
    for pair, amps in found.mean_amp.items():
        if pair != (0.0, -0.5):  # sampled too coarsely to hold the very peak and valley
            np.testing.assert_allclose(amps, default_model().predict([pair[0]], [pair[1]])[0], rtol=0.02)
    assert isinstance(found.model, AmplitudeModel)
    np.testing.assert_allclose(found.model.predict([1.0], [0.5]), default_model().predict([1.0], [0.5]), rtol=0.02)
    assert (np.abs(found.correlations[np.triu_indices(3, 1)]) < 0.3).all()
    again = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert again["words_by_pa"][0]["words"] == found.counts[(0.0, 0.0)]
    assert np.shape(again["coefficients"]) == (6, 3)


def test_json_says_none_where_there_is_nothing():
    found = recording_statistics(np.zeros((50, 3)), [word(0, 20), word(20, 50)]).to_dict()
    assert found["correlations"][0][1] is None
    assert found["coefficients"] is None
    assert "Eq. 2" in found["coefficients_fault"]
    assert found["extreme_distance_frames"] is None
    json.dumps(found, allow_nan=False)


@pytest.mark.parametrize(
    ("angles", "words", "message"),
    [
        (np.zeros((50, 3)), [word(0, 20)], "needs? at least 2"),
        (np.zeros((50, 3)), [word(0, 20), word(20, 51)], "goes from frame 20 to 51"),
        (np.zeros(50), [word(0, 20), word(20, 50)], "one axis only"),
        (np.full((50, 3), np.nan), [word(0, 20), word(20, 50)], "finite"),
    ],
)
def test_malformed_recordings_are_refused(angles, words, message):
    with pytest.raises(SpecError, match=message):
        recording_statistics(angles, words)
