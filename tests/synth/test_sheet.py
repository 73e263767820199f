import imageio.v3 as iio
import numpy as np
import pytest

from synth.errors import SpecError, VideoError
from synth.face.identity import IDENTITIES
from synth.pad import PAD, emotion_words
from synth.sheet import BASIC, contact_sheet, expressions, render_sheet
from synth.words import look_up

PAPER = 255


def plain(n: int, *, width: int = 60, height: int = 40) -> list[np.ndarray]:
    """Pictures of one colour each, none of them grey as labels are."""
    return [np.full((height, width, 3), (200, k, 40), dtype=np.uint8) for k in range(n)]


def test_words_are_found_in_any_case():
    assert expressions(["happy", "SCARED"]) == [(word, emotion_words()[word]) for word in ("Happy", "Scared")]
    assert expressions(["neutral"]) == [("Neutral", PAD())]
    assert expressions(["all"]) == list(emotion_words().items())


def test_the_six_basic_emotions_have_the_papers_words():
    assert [label.lower() for label, _ in expressions(["Basic"])] == list(BASIC)
    for word, paper in BASIC.items():
        assert expressions([word])[0][1] == emotion_words()[paper]


def test_other_words_of_the_norms_are_put_on_the_papers_scale():
    assert expressions(["Terrified", "in love", "surprised"]) == [
        ("Terrified", look_up("terrified").pad),
        ("In love", look_up("In love").pad),
        ("Surprised", emotion_words()["Surprise"]),
    ]


def test_an_unknown_word_is_told_with_those_there_are():
    with pytest.raises(SpecError, match="'glad'") as caught:
        expressions(["Happy", "glad"])
    for word in (*emotion_words(), *BASIC, "neutral", "all", "basic"):
        assert word in str(caught.value)
    assert "`padlab words`" in str(caught.value)
    assert "Terrified" not in str(caught.value)


@pytest.mark.parametrize("lengths", [[1], [3], [3, 1], [8] * 7 + [4], [14] * 6])
def test_pictures_stand_in_rows_with_room_between_them(lengths):
    pictures = iter(plain(sum(lengths), width=30, height=20))
    sheet = contact_sheet([[("Word", next(pictures)) for _ in range(length)] for length in lengths])
    inside = {}
    for k in range(sum(lengths)):
        rows, columns = np.nonzero((sheet == (200, k, 40)).all(axis=2))
        top, left = rows.min(), columns.min()
        assert (rows.max() - top + 1, columns.max() - left + 1) == (20, 30)
        assert len(rows) == 20 * 30
        inside[k] = (top, left)
    assert len({top for top, _ in inside.values()}) == len(lengths)
    assert len({left for _, left in inside.values()}) == max(lengths)
    for border in (sheet[:8], sheet[-4:], sheet[:, :8], sheet[:, -8:]):
        assert (border == PAPER).all()


@pytest.mark.parametrize("size", [(16, 16), (60, 40), (720, 576)])
def test_labels_are_below_their_pictures_and_apart(size):
    width, height = size
    rows = [[("Dependent", picture) for picture in plain(3, width=width, height=height)]]
    sheet = contact_sheet(rows)
    text = max(13, height // 18)
    below = sheet[text + height :]
    ink = (below < 128).any(axis=(0, 2))
    # Runs of columns with ink that are further apart than letters: one for each label.
    columns = np.flatnonzero(ink)
    assert 1 + (np.diff(columns) >= text * 0.8).sum() == 3
    tall = np.flatnonzero((below < 128).any(axis=(1, 2)))
    assert 8 <= np.ptp(tall) <= 2 * text


def test_what_cannot_be_laid_out_is_refused():
    for rows in ([], [[]], [[("a", plain(1)[0]), ("b", plain(1, width=61)[0])]]):
        with pytest.raises(SpecError, match="of one size"):
            contact_sheet(rows)
    wide = np.broadcast_to(np.uint8(0), (4000, 4000, 3))
    with pytest.raises(SpecError, match="100 million"):
        contact_sheet([[("a", wide)] * 7])


def test_a_sheet_of_two_identities_has_a_row_for_each(face_dir, tmp_path):
    identities = list(IDENTITIES)[:2]
    render_sheet(["neutral", "joy", "Sad"], tmp_path / "a.png", face_dir, identities=identities, width=64, height=48)
    sheet = iio.imread(tmp_path / "a.png")
    assert sheet.shape[0] > 2 * 48
    assert sheet.shape[1] > 3 * 64
    one = 48 + 3 * 13
    upper, lower = sheet[:one], sheet[one : 2 * one]
    assert upper.shape == lower.shape
    assert np.abs(upper.astype(int) - lower).max() > 60
    assert [file.name for file in tmp_path.iterdir()] == ["a.png"]


def test_columns_and_intensity_are_obeyed(face_dir, tmp_path):
    options = {"identities": ["mei"], "width": 64, "height": 48}
    render_sheet(["Happy"] * 3, tmp_path / "tall.png", face_dir, columns=1, **options)
    render_sheet(["Happy"] * 3, tmp_path / "weak.png", face_dir, columns=1, intensity=0.1, **options)
    tall, weak = (iio.imread(tmp_path / f"{name}.png").astype(int) for name in ("tall", "weak"))
    assert tall.shape[0] > 3 * 48
    assert tall.shape[1] < 2 * 64
    assert np.abs(tall - weak).max() > 20


def test_failures_are_told_and_leave_nothing_behind(face_dir, tmp_path):
    out = tmp_path / "a.png"
    with pytest.raises(SpecError, match="at least one word"):
        render_sheet([], out, face_dir, identities=["mei"])
    with pytest.raises(SpecError, match="one identity"):
        render_sheet(["Happy"], out, face_dir, identities=[])
    with pytest.raises(SpecError, match="one column"):
        render_sheet(["Happy"], out, face_dir, identities=["mei"], columns=0)
    with pytest.raises(SpecError, match="nobody"):
        render_sheet(["Happy"], out, face_dir, identities=["nobody"])
    with pytest.raises(SpecError, match="100 million"):
        render_sheet(["all"], out, face_dir, identities=["mei"], width=4000, height=4000)
    with pytest.raises(VideoError, match="missing"):
        render_sheet(["Happy"], tmp_path / "missing" / "a.png", face_dir, identities=["mei"], width=32, height=32)
    assert list(tmp_path.iterdir()) == []
