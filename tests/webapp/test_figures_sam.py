"""The manikin's figures: what is served is what the module draws."""

import re
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import pytest

from webapp import figures_sam
from webapp.resources import resource_dir

DIMENSIONS = ("pleasure", "arousal", "dominance")
FIGURES = [(dimension, level) for dimension in DIMENSIONS for level in range(1, 10)]


@pytest.mark.parametrize(("dimension", "level"), FIGURES)
def test_the_files_are_as_drawn_and_draw_nothing_but_shapes(dimension: str, level: int) -> None:
    path = resource_dir("static") / "img" / "sam" / f"{dimension}-{level}.svg"
    text = path.read_text(encoding="utf-8")
    assert text == figures_sam.figure(dimension, level), "run: python -m webapp.figures_sam"
    tags = {element.tag.rpartition("}")[2] for element in ElementTree.fromstring(text).iter()}
    assert tags <= {"svg", "g", "path", "circle", "ellipse"}


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_neighbours_differ(dimension: str) -> None:
    drawn = [figures_sam.figure(dimension, level) for level in range(1, 10)]
    assert all(one != other for one, other in pairwise(drawn))


def test_figures_stay_in_their_box_and_dominance_grows() -> None:
    tops = []
    for level in range(1, 10):
        head = re.findall(r'<circle cx="24" cy="([\d.]+)" r="([\d.]+)"', figures_sam.figure("dominance", level))[-1]
        tops.append(float(head[0]) - float(head[1]))
    assert tops == sorted(tops, reverse=True)
    assert 0 < tops[-1] < 5


@pytest.mark.parametrize("level", [0, 10])
def test_there_are_nine(level: int) -> None:
    with pytest.raises(ValueError, match="1 to 9"):
        figures_sam.figure("pleasure", level)


def test_all_are_written(tmp_path: Path) -> None:
    assert figures_sam.write(tmp_path / "sam") == len(list((tmp_path / "sam").iterdir())) == 27
