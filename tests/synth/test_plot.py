import re
import subprocess
import sys
import warnings
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib import font_manager
from matplotlib.image import imread

from synth.errors import SpecError, VideoError
from synth.head.published import example_sentence
from synth.head.trajectory import head_motion
from synth.head.words import ProsodicWord, evenly
from synth.plot import plot_clip

TEXT = re.compile(r'<text [^>]*\bx="([-\d.]+)" y="([-\d.]+)"[^>]*>([^<]*)</text>')


def english(count: int, *, text: str = "word", syllable_s: float = 0.17) -> tuple[ProsodicWord, ...]:
    each_s = 2 * syllable_s
    return tuple(
        ProsodicWord(
            f"{text} {k}",
            0.3 + each_s * k,
            0.3 + each_s * (k + 1),
            (0.0, 1.0, -1.0)[k % 3],
            (0.0, 0.5)[k % 2],
            evenly([("wo", None, True), ("rd", None, False)], 0.3 + each_s * k, 0.3 + each_s * (k + 1)),
        )
        for k in range(count)
    )


def drawn(folder, words, *, suffix=".svg", **options):
    head = head_motion(words, rng=np.random.default_rng(3))
    out = folder / f"clip{suffix}"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plot_clip(head.angles, head.fps, words, head, out, **options)
    return out.read_bytes() if suffix.lower() == ".png" else out.read_text(encoding="utf-8")


def texts(svg):
    return re.findall(r"<text[^>]*>([^<]*)</text>", svg)


def test_the_papers_sentence_has_its_words_values_and_marks(tmp_path, caplog):
    words = example_sentence()
    svg = drawn(tmp_path, words)
    found = texts(svg)
    for word in words:
        assert word.text in found
    assert found.count("(1, 1)") == sum((word.P, word.A) == (1, 1) for word in words) == 4
    syllables = [syllable for word in words for syllable in word.syllables]
    marks = [text for text in found if text in {"S", "F", "SF"}]
    assert len(marks) == sum(one.stressed or one.falling for one in syllables)
    assert "SF" in marks  # 最
    assert caplog.records == []


def test_a_font_that_has_chinese_is_named(tmp_path):
    line = next(line for line in drawn(tmp_path, example_sentence()).splitlines() if "太平山頂" in line)
    fonts = re.findall(r"'([^']+)'", re.search(r"font-family: ([^;]+);", line)[1])
    assert fonts[0] == "DejaVu Sans"
    covered = [font_manager.get_font(font_manager.findfont(font)).get_charmap() for font in fonts]
    assert all(any(ord(character) in charmap for charmap in covered) for character in "太平山頂")


@pytest.mark.parametrize("suffix", [".svg", ".png", ".PNG"])
def test_the_same_clip_is_the_same_file(tmp_path, suffix):
    first, second = tmp_path / "a", tmp_path / "b"
    first.mkdir(), second.mkdir()
    assert drawn(first, english(6), suffix=suffix) == drawn(second, english(6), suffix=suffix)
    assert [file.name for file in first.iterdir()] == [f"clip{suffix}"]


def test_another_process_draws_the_same(tmp_path):
    code = (
        "import sys, pathlib, numpy as np\n"
        "from synth.head.published import example_sentence\n"
        "from synth.plot import plot_clip\n"
        "plot_clip(np.zeros((400, 3)), 25.0, example_sentence(), None, pathlib.Path(sys.argv[1]))\n"
    )
    files = [tmp_path / "a.svg", tmp_path / "b.svg"]
    for file in files:
        subprocess.run([sys.executable, "-c", code, str(file)], check=True, timeout=60)
    assert files[0].read_bytes() == files[1].read_bytes()


@pytest.mark.parametrize("count", [3, 12, 40])
def test_labels_do_not_overlap_and_none_is_missing(tmp_path, count):
    svg = drawn(tmp_path, english(count, text="magnificent"))
    labels = [(float(y), float(x), text) for x, y, text in TEXT.findall(svg) if text.startswith("magnificent")]
    assert sorted(text for _, _, text in labels) == sorted(f"magnificent {k}" for k in range(count))
    lines = {}
    for y, x, _text in sorted(labels):
        lines.setdefault(round(y), []).append(x)
    for places in lines.values():
        # The label is more than 65 points wide.
        assert all(b - a > 65 for a, b in pairwise(places))


def test_long_clips_take_rows_and_not_width(tmp_path):
    def size(svg):
        width, height = re.search(r'width="([\d.]+)pt" height="([\d.]+)pt"', svg).groups()
        return float(width), float(height)

    short, long = size(drawn(tmp_path, english(12))), size(drawn(tmp_path, english(60)))
    assert long[0] < 1.7 * 72 * 10
    assert long[1] > 1.8 * short[1]


def test_peaks_are_marked_where_the_motion_has_them(tmp_path):
    words = english(8)
    with_peaks = drawn(tmp_path, words)
    plot_clip(np.zeros((75, 3)), 25.0, words, None, tmp_path / "without.svg")
    without = (tmp_path / "without.svg").read_text(encoding="utf-8")
    assert "peak placed in a word" in texts(with_peaks)
    assert "peak placed in a word" not in texts(without)
    assert with_peaks.count("<use") - without.count("<use") >= 9  # eight words and a silence


def test_the_mouth_has_a_panel(tmp_path):
    words = english(4)
    frames = len(head_motion(words, rng=np.random.default_rng(3)).angles)
    svg = drawn(tmp_path, words, mouth=np.linspace(0, 400, frames))
    assert "(FAP 3)" in texts(svg)
    assert "(FAP 3)" not in texts(drawn(tmp_path, words))


@pytest.mark.parametrize(
    "text",
    ["\U0010fffd\U0010fffc", "$x^2$ & <b>", "🙂", "मुंबई", "a\nb\tc", "鱗次櫛比", "x" * 300, "\x01", "\ud800a", "\ufffe"],
)
@pytest.mark.parametrize("suffix", [".svg", ".png"])
def test_any_text_is_drawn_without_warnings(tmp_path, caplog, text, suffix):
    words = (ProsodicWord(text, 0.1, 0.5, 0.0, 0.0), ProsodicWord("end", 0.6, 0.9, 0.0, 0.0))
    found = drawn(tmp_path, words, suffix=suffix)
    if suffix == ".svg":
        ElementTree.fromstring(found)
    assert caplog.records == []


def test_a_character_without_font_is_a_box(tmp_path):
    svg = drawn(tmp_path, (ProsodicWord("a\U0010fffdb", 0.1, 0.5, 0.0, 0.0),))
    assert "a□b" in texts(svg)


@pytest.mark.parametrize("frames", [1, 2, 30, 1_500])
def test_a_still_head_of_any_length_is_drawn(tmp_path, frames):
    plot_clip(np.zeros((frames, 3)), 25.0, (), None, tmp_path / "still.png")
    height, width = imread(tmp_path / "still.png").shape[:2]
    assert 1400 < width < 2400
    assert height > 700


@pytest.mark.parametrize(
    ("angles", "fps", "options", "says"),
    [
        (np.zeros((5, 2)), 25.0, {}, r"shape \(5, 2\)"),
        (np.zeros(5), 25.0, {}, r"shape \(5,\)"),
        (np.zeros((0, 3)), 25.0, {}, "0 frames"),
        (np.full((5, 3), np.nan), 25.0, {}, "finite"),
        (np.full((5, 3), np.inf), 25.0, {}, "finite"),
        (np.zeros((5, 3)), 0.0, {}, "fps"),
        (np.zeros((5, 3)), float("nan"), {}, "fps"),
        (np.zeros((5, 3)), 25.0, {"mouth": np.zeros(4)}, "4 frames"),
        (np.zeros((5, 3)), 25.0, {"mouth": np.zeros((5, 1))}, r"shape \(5, 1\)"),
        (np.zeros((100_001, 3)), 25.0, {}, "100001 frames"),
    ],
)
def test_what_is_malformed_is_refused(tmp_path, angles, fps, options, says):
    with pytest.raises(SpecError, match=says):
        plot_clip(angles, fps, (), None, tmp_path / "a.svg", **options)
    assert list(tmp_path.iterdir()) == []


def test_the_suffix_tells_the_kind(tmp_path):
    with pytest.raises(SpecError, match=r"\.svg or \.png"):
        plot_clip(np.zeros((5, 3)), 25.0, (), None, tmp_path / "a.jpg")
    with pytest.raises(VideoError, match="could not be written"):
        plot_clip(np.zeros((5, 3)), 25.0, (), None, tmp_path / "missing" / "a.svg")
