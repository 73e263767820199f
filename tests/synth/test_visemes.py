import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.expression.models import DEFAULT_MODEL, load_model
from synth.face.deformation import solve
from synth.face.mesh import load_face
from synth.face.motion import Motion
from synth.face.mouth import teeth_points
from synth.face.rig import Rig
from synth.fap.blend import MOUTH, blend
from synth.fap.table import FAP_COUNT, column, faps, mirrored
from synth.pad import emotion_words
from synth.speech.spoken import SILENCE, Phone
from synth.visemes import (
    articulators,
    speaking_track,
    unknown_symbols,
    viseme_track,
    visemes,
    visemes_of,
)

ENGLISH = """
    p b t d tʃ dʒ k ɡ f v θ ð s z ʃ ʒ h m n ŋ l ɹ r j w ɾ ʔ iː ɪ i ɛ e æ a ɑː ɒ ɔː ʌ ʊ uː u ɜː ə ɐ ɚ ᵻ
    aɪ aʊ eɪ oʊ əʊ ɔɪ iə eə ʊə aɪə aɪɚ ɑːɹ oːɹ əl n̩
"""
MANDARIN = """
    p pʰ m f t tʰ n l k kʰ x χ tɕ tɕʰ ɕ ts tsʰ s ʈʂ tʂ ʈʂʰ ʂ ɻ ʐ ts. ts.h s.
    a o ɤ i u y ɛ ə ɚ ɨ i. i̪ ər o- ai ei ɑu ou iɑ iɛ iou ua uo uai uei yɛ yæ yə
"""
KNOWN = (*ENGLISH.split(), *MANDARIN.split())
CLOSED = 30.0
"""FAPU (of 1024 in MNS) below which the gap of lips that meet remains."""

phones_in_a_row = st.lists(st.tuples(st.sampled_from([*KNOWN, SILENCE]), st.floats(0.03, 0.4)), min_size=1, max_size=25)


def _spoken(text, length=0.06, start=0.0):
    """Put phones in a row, each as long as said."""
    lengths = [length] * len(text.split()) if np.isscalar(length) else length
    phones = []
    for symbol, one in zip(text.split(), lengths, strict=True):
        phones.append(Phone(symbol, start, start + one))
        start = phones[-1].end_s
    return phones


def _frame(phone, fps=25):
    """Return the frame nearest to a phone's middle."""
    return int(np.floor((phone.start_s + phone.end_s) / 2 * fps + 0.5))


def _expression(word, frames):
    _, apex = load_model(DEFAULT_MODEL, None).apex(np.array([emotion_words()[word].as_tuple()]), intensity=1.0)
    return np.repeat(apex, frames, axis=0)


def test_there_are_the_visemes_of_mpeg4_and_silence():
    found = {viseme.mpeg4 for viseme in visemes().values()}
    assert found == set(range(15))
    assert not visemes()["sil"].target.any()


@pytest.mark.parametrize("name", sorted(visemes()))
def test_a_viseme_moves_both_halves_of_the_mouth_alike_and_nothing_else(name):
    target = visemes()[name].target
    assert {index + 1 for index in np.flatnonzero(target)} <= set(MOUTH)
    np.testing.assert_array_equal(mirrored(target[None])[0], target)
    for index in np.flatnonzero(target):
        low, high = faps()[index + 1].usable
        assert 1.1 * low <= target[index] <= 1.1 * high


def test_the_articulators_share_the_mouth():
    assert sorted(fap for one in articulators() for fap in one.faps) == sorted(MOUTH)


@pytest.mark.parametrize("symbol", sorted(set(KNOWN)))
def test_phones_of_both_languages_are_known(symbol):
    assert not unknown_symbols([Phone(symbol, 0.0, 0.1)])


@pytest.mark.parametrize(
    ("symbol", "names"),
    [
        ("p", ("PP",)),
        ("pʰ", ("PP",)),
        ("ˈuː", ("oo",)),
        ("tʃ", ("CH",)),
        ("t͡ʃ", ("CH",)),
        ("ʈʂʰ", ("CH",)),
        ("tɕʰ", ("SS",)),
        ("ts.h", ("CH",)),
        ("aɪ", ("aa", "ih")),
        ("əʊ", ("uh", "ou")),
        ("iou", ("ih", "oh", "oo")),
        ("əl", ("uh", "nn")),
        (SILENCE, ("sil",)),
        ("ã", ("aa",)),
        ("ᶀ", ("PP",)),
    ],
)
def test_phone_to_visemes(symbol, names):
    assert visemes_of(symbol) == names


@given(st.text(min_size=1, max_size=8))
def test_any_symbol_is_spoken(symbol):
    names = visemes_of(symbol)
    assert names
    assert set(names) <= set(visemes())


def test_what_is_unknown_is_said_and_opens_the_mouth_a_little():
    phones = [Phone("a", 0, 0.2), Phone("中", 0.2, 0.4), Phone("中", 0.4, 0.6), Phone("?", 0.6, 0.8)]
    assert unknown_symbols(phones) == ("中", "?")
    jaw = viseme_track(phones, fps=25, frames=20)[12, column(3)]
    assert 200 < jaw < 400


@pytest.mark.parametrize("identity", ["mei", "amara", "erik"])
def test_lips_meet_and_touch_teeth_on_the_mesh(face_dir, identity):
    rig = Rig(load_face(face_dir, identity))
    neutral, _ = rig.pose(Motion.of())
    at = dict(zip(rig.control.names, rig.control.rows, strict=True))
    fapu = rig.units.MNS / 1024
    edge = teeth_points(rig.face)["9.10"]
    # Short phones, in less than the time of a frame and a half each.
    phones = _spoken("_ a p a b uː m æ p iː f a v uː f ɔː s uː m b ɪ f", 0.05)
    frames = _frame(phones[-1]) + 5
    track = viseme_track(phones, fps=25, frames=frames)
    speaking = speaking_track(phones, fps=25, frames=frames)
    for word in (None, "Happy", "Surprise", "Angry", "Hostile"):
        both = track if word is None else blend(track, _expression(word, frames), speaking=speaking)
        wanted = [phone for phone in phones if phone.symbol in set("pbmfv")]
        motion = solve(both[[_frame(phone) for phone in wanted]], rig)
        for k, phone in enumerate(wanted):
            posed, _ = rig.pose(motion, k)
            for upper, lower in (("2.2", "2.3"), ("2.6", "2.8"), ("2.7", "2.9")):
                gap = posed[at[upper], 1] - posed[at[lower], 1] - (neutral[at[upper], 1] - neutral[at[lower], 1])
                if phone.symbol in set("pbm"):
                    assert gap / fapu < CLOSED, (word, phone)
            if phone.symbol in set("fv"):
                # The lip reaches the edge of the upper teeth, is drawn back to them, and they are seen.
                assert 0.0 <= (posed[at["2.3"], 1] - edge[1]) / fapu < 120.0, (word, phone)
                assert (posed[at["2.3"], 2] - neutral[at["2.3"], 2]) / fapu < -250.0
                assert (posed[at["2.2"], 1] - edge[1]) / fapu > 200.0


def test_open_vowels_are_open_on_the_mesh(rig):
    neutral, _ = rig.pose(Motion.of())
    rows = rig.control.rows[[rig.control.names.index(name) for name in ("2.2", "2.3", "8.3", "8.4")]]
    phones = _spoken("t ɑː t _ t iː t _ t uː t", 0.12)
    track = viseme_track(phones, fps=25, frames=40)
    motion = solve(track[[_frame(phones[k]) for k in (1, 5, 9)]], rig)
    change = [(rig.pose(motion, k)[0] - neutral)[rows] * 1024 for k in range(3)]
    gaps = [(one[0, 1] - one[1, 1]) / rig.units.MNS for one in change]
    widths = [(one[2, 0] - one[3, 0]) / rig.units.MW for one in change]
    assert gaps[0] > 700
    assert gaps[0] > 2 * max(gaps[1:])
    assert widths[1] > 150
    assert widths[2] < -200


@pytest.mark.parametrize("fps", [24, 25, 30, 50, 60])
@given(
    sounds=st.lists(
        st.tuples(st.sampled_from("pbmfvθ"), st.sampled_from(["a", "uː", "iː"]), st.floats(0.04, 0.2)),
        min_size=1,
        max_size=8,
    ),
    start=st.floats(0.0, 0.1),
)
@settings(max_examples=25, deadline=None)
def test_what_is_held_is_reached_within_a_frame_of_its_centre(fps, sounds, start):
    text = " ".join(f"{consonant} {vowel}" for consonant, vowel, _ in sounds)
    phones = _spoken(text, [length for one in sounds for length in (one[2], one[2])], start)
    track = viseme_track(phones, fps=fps, frames=_frame(phones[-1], fps) + 2)
    for phone in phones[::2]:
        viseme = visemes()[visemes_of(phone.symbol)[0]]
        fap = 44 if phone.symbol == "θ" else 5
        reached = track[_frame(phone, fps), column(fap)]
        assert reached == pytest.approx(viseme.target[column(fap)], abs=0.1)


def test_two_held_phones_on_neighbouring_frames_are_both_reached():
    track = viseme_track(_spoken("a m f a", 0.04, 0.012), fps=25, frames=12)
    lower = track[:, column(5)]
    close, touch = (visemes()[name].target[column(5)] for name in ("PP", "FF"))
    assert np.abs(lower - close).min() < 0.1
    assert np.abs(lower - touch).min() < 0.1
    assert np.abs(lower - close).argmin() < np.abs(lower - touch).argmin()


def test_the_extreme_of_a_vowel_is_within_a_frame_of_its_centre():
    for length in (0.08, 0.12, 0.2):
        phones = _spoken("t ɑː t", length, 0.2)
        track = viseme_track(phones, fps=25, frames=30)
        assert abs(track[:, column(3)].argmax() / 25 - (0.2 + 1.5 * length)) <= 0.04


def test_rounding_begins_before_the_vowel():
    """In "stew" the lips are rounded when the s begins to sound; in "stay" they are not."""
    stew, stay = (
        viseme_track(_spoken(f"_ s t {vowel}", [0.4, 0.1, 0.08, 0.2]), fps=100, frames=90) for vowel in ("uː", "eɪ")
    )
    rounded = visemes()["oo"].target[column(17)]
    assert stew[45, column(17)] > 0.3 * rounded
    assert stew[54, column(17)] > 0.6 * rounded
    assert stew[54, column(6)] < -60
    assert stay[54, column(17)] < 0.1 * rounded
    # It comes on steadily.
    assert (np.diff(stew[30:60, column(17)]) > -1.0).all()


def test_mandarin_consonants_before_a_rounded_vowel_are_rounded():
    for consonant in ("k", "ɕ", "ʂ", "n"):
        for vowel in ("u", "y", "uo"):
            round_one, plain = (
                viseme_track(_spoken(f"a {consonant} {one}", 0.1), fps=100, frames=30)[15] for one in (vowel, "a")
            )
            assert round_one[column(17)] > plain[column(17)] + 100
            assert round_one[column(6)] < plain[column(6)]


def test_silence_closes_the_mouth_gently():
    phones = _spoken("_ ɑː _ ɑː _", [0.5, 0.3, 0.6, 0.3, 0.5])
    jaw = viseme_track(phones, fps=100, frames=300)[:, column(3)]
    most = jaw.max()
    assert jaw[0] < 0.02 * most
    assert jaw[110] < 0.05 * most
    assert jaw[-1] == 0.0
    # From open to shut takes at least a tenth of a second.
    falling = jaw[65:140]
    assert np.flatnonzero(falling < 0.1 * most)[0] - np.flatnonzero(falling < 0.9 * most)[0] >= 10
    short = viseme_track(_spoken("ɑː _ ɑː", [0.3, 0.05, 0.3]), fps=100, frames=65)[:, column(3)]
    assert short[20:45].min() > 0.5 * most


@given(phones_in_a_row)
@settings(max_examples=60, deadline=None)
def test_any_row_of_phones_gives_a_smooth_track_in_range(row):
    phones = _spoken(" ".join(symbol for symbol, _ in row), [length for _, length in row])
    frames = int(phones[-1].end_s * 200) + 100
    track = viseme_track(phones, fps=200, frames=frames)
    assert track.shape == (frames, FAP_COUNT)
    assert np.isfinite(track).all()
    for fap in MOUTH:
        low, high = faps()[fap].usable
        assert (track[:, column(fap)] >= 1.1 * low).all()
        assert (track[:, column(fap)] <= 1.1 * high).all()
        # In a second no FAP could cross its usable range more often than 25 times: a jump would, a movement does not.
        assert np.abs(np.diff(track[:, column(fap)])).max() * 200 < 25 * (high - low)
    # No jitter: where nothing is spoken any more, nothing moves.
    assert np.abs(track[-2:]).max() < 1e-9


@given(phones_in_a_row, st.sampled_from(["Happy", "Surprise", "Angry", "Sad"]))
@settings(max_examples=30, deadline=None)
def test_speech_in_an_expression_stays_smooth_and_in_range(row, word):
    phones = _spoken(" ".join(symbol for symbol, _ in row), [length for _, length in row], 0.4)
    frames = int(phones[-1].end_s * 200) + 100
    track = viseme_track(phones, fps=200, frames=frames)
    face = _expression(word, frames)
    mixed = blend(track, face, speaking=speaking_track(phones, fps=200, frames=frames))
    assert np.isfinite(mixed).all()
    low, high = np.minimum(track.min(axis=0), face[0]), np.maximum(track.max(axis=0), face[0])
    assert (mixed >= low - 1e-9).all()
    assert (mixed <= high + 1e-9).all()
    for fap in MOUTH:
        least, most = faps()[fap].usable
        assert np.abs(np.diff(mixed[:, column(fap)])).max() * 200 < 50 * (most - least)


def test_long_speech_does_not_depend_on_how_it_is_cut():
    phones = _spoken("p aɪ s uː n ə _ f ɑː " * 40, 0.08)
    whole = viseme_track(phones, fps=25, frames=700)
    np.testing.assert_array_equal(viseme_track(phones, fps=25, frames=300), whole[:300])
    assert np.abs(np.diff(whole[:, column(3)])).max() < 600


def test_speaking_goes_over_smoothly_and_keeps_short_pauses():
    phones = _spoken("_ a _ a _ a _", [0.6, 0.2, 0.3, 0.2, 1.0, 0.2, 0.6])
    speaking = speaking_track(phones, fps=100, frames=340)
    assert speaking[0] == 0.0
    np.testing.assert_array_equal(speaking[60:130], 1.0)
    assert speaking[180] == 0.0
    assert speaking[-1] == 0.0
    assert np.abs(np.diff(speaking)).max() < 0.07
    assert not speaking_track([], fps=25, frames=3).any()


def test_nothing_spoken_moves_nothing():
    assert not viseme_track([], fps=25, frames=10).any()
    assert viseme_track([], fps=25, frames=0).shape == (0, FAP_COUNT)


@pytest.mark.parametrize(("fps", "frames"), [(0, 1), (25, -1)])
def test_impossible_lengths_are_refused(fps, frames):
    with pytest.raises(SpecError, match="at least 1 and 0"):
        viseme_track([], fps=fps, frames=frames)
    with pytest.raises(SpecError, match="at least 1 and 0"):
        speaking_track([], fps=fps, frames=frames)


def test_phones_out_of_order_are_refused():
    with pytest.raises(SpecError, match="in order"):
        viseme_track([Phone("a", 1.0, 1.2), Phone("p", 0.0, 0.5)], fps=25, frames=10)
