import re
import warnings
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from evaluation.errors import DataError
from evaluation.report.emotion_figures import caption, pad_by_category, pad_by_category_png, pad_by_category_svg
from evaluation.statistics.ellipse import ellipse

EMOTIONS = ("Joy", "Sadness", "Surprise", "Fear", "Anger", "Disgust")
WIDTH_AND_HEIGHT = slice(16, 24)


@pytest.fixture(scope="module")
def annotations():
    rng = np.random.default_rng(1)
    centres = rng.uniform(-0.5, 0.5, size=(6, 3))
    return np.clip(np.repeat(centres, 12, axis=0) + 0.1 * rng.normal(size=(72, 3)), -1, 1), np.repeat(EMOTIONS, 12)


@pytest.fixture(scope="module")
def drawn(annotations):
    return pad_by_category_svg(*annotations)


def texts(svg):
    return ["".join(node.itertext()).strip() for node in ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")]


def outlines(axes):
    return [line for line in axes.lines if len(line.get_xdata()) > 100]


def test_three_panels_with_a_legend(drawn):
    shown = texts(drawn)
    assert shown.count("Pleasure (P)") == 2
    assert shown.count("Arousal (A)") == 2
    assert shown.count("Dominance (D)") == 2
    assert [text for text in shown if text.endswith("(12)")] == [f"{name} (12)" for name in EMOTIONS]


def test_the_ellipses_are_those_of_the_categories(annotations):
    pad, categories = annotations
    panels = pad_by_category(pad, categories, coverage=0.9).axes
    for axes, places in zip(panels, ([0, 1], [0, 2], [1, 2]), strict=True):
        assert axes.get_aspect() == 1
        assert axes.get_xlim() == axes.get_ylim()
        assert len(outlines(axes)) == 6
        expected = ellipse(pad[categories == "Fear"][:, places], coverage=0.9).outline(180)
        assert np.column_stack(outlines(axes)[3].get_data()) == pytest.approx(expected)


def test_every_point_and_mean_is_drawn(annotations):
    pad, categories = annotations
    axes = pad_by_category(pad, categories).axes[0]
    points = [line for line in axes.lines if len(line.get_xdata()) == 12]
    assert np.concatenate([line.get_xdata() for line in points]) == pytest.approx(pad[:, 0])
    means = [line.get_ydata()[0] for line in axes.lines if len(line.get_xdata()) == 1]
    assert means == pytest.approx([pad[categories == name, 1].mean() for name in EMOTIONS])


def test_colour_and_shape_together_tell_56_categories_apart():
    pad = np.random.default_rng(1).uniform(-1, 1, size=(56, 3))
    axes = pad_by_category(pad, [f"category {k}" for k in range(56)]).axes[0]
    looks = {(line.get_color(), line.get_marker()) for line in axes.lines if line.get_marker() != "None"}
    assert len(looks) == 56


def test_the_same_annotations_give_the_same_files(annotations, drawn):
    assert pad_by_category_svg(*annotations) == drawn
    png = pad_by_category_png(*annotations, dpi=50)
    assert png == pad_by_category_png(*annotations, dpi=50)
    assert png.startswith(b"\x89PNG")
    assert b"Software" not in png
    width = int.from_bytes(png[WIDTH_AND_HEIGHT][:4], "big")
    assert width == 550


def test_every_reference_inside_carries_the_name(drawn):
    ids = set(re.findall(r'\bid="([^"]+)"', drawn))
    used = set(re.findall(r'href="#([^"]+)"', drawn)) | set(re.findall(r"url\(#([^)]+)\)", drawn))
    assert used
    assert used <= ids
    assert all(found.startswith("pad-by-category") for found in ids)


def test_categories_with_too_few_or_equal_points_have_no_ellipse():
    pad = [[0.1, 0.2, 0.3], [0.2, 0.1, 0], [0.5, 0.5, 0.5], [0.5, 0.5, 0.5], [0.5, 0.5, 0.5], [-1, -1, -1]]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = pad_by_category(pad, ["two", "two", "same", "same", "same", "one"])
    assert not any(outlines(axes) for axes in figure.axes)


def test_points_on_a_line_have_a_flat_ellipse():
    along = np.array([-0.5, 0, 0.2, 0.4])
    figure = pad_by_category(np.column_stack([along, along, along]), ["line"] * 4)
    assert all(len(outlines(axes)) == 1 for axes in figure.axes)


def test_names_are_no_markup_no_formula_and_always_drawable(annotations):
    pad = annotations[0][:6]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        shown = texts(pad_by_category_svg(pad, ["<b>x</b>", "$\\frac$", "_hidden", "高兴", "高兴", "a " * 80]))
    assert {"<b>x</b> (1)", "$\\frac$ (1)", "_hidden (1)", "Category 4 (2)"} <= set(shown)
    assert max(len(text) for text in shown) < 50


def test_the_caption():
    assert "50 % error ellipse" in caption()
    assert "95 % error ellipse" in caption(0.95)


def test_bad_input(annotations):
    pad, categories = annotations
    with pytest.raises(DataError, match="three columns, P, A and D"):
        pad_by_category(pad[:, :2], categories)
    with pytest.raises(DataError, match="from -1 to 1"):
        pad_by_category(2 * np.ones((1, 3)), ["Joy"])
    with pytest.raises(DataError, match="72 annotations and 71 categories"):
        pad_by_category(pad, categories[1:])
    with pytest.raises(DataError, match="0 annotations and 0 categories"):
        pad_by_category(np.empty((0, 3)), [])
    with pytest.raises(DataError, match="coverage is 50"):
        pad_by_category(pad, categories, coverage=50)
    with pytest.raises(DataError, match="missing or infinite"):
        pad_by_category(np.full((1, 3), np.nan), ["Joy"])
