import re
import warnings
from xml.etree import ElementTree as ET

import pandas as pd
import pytest

from evaluation.errors import EvaluationError
from evaluation.report import figures
from evaluation.report.analysis import RESPONSE_COLUMNS, analyse
from evaluation.simulate import simulate_responses

EMPTY = pd.DataFrame(columns=list(RESPONSE_COLUMNS))


@pytest.fixture(scope="module")
def drawn(report) -> dict[str, str]:
    """Every figure of the report."""
    return {name: figures.draw(name, report) for name in figures.NAMES}


def texts(svg: str) -> list[str]:
    return ["".join(node.itertext()).strip() for node in ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")]


@pytest.mark.parametrize("name", figures.NAMES)
class TestEveryFigure:
    def test_it_is_svg_with_a_caption(self, name, drawn):
        svg = drawn[name]
        assert ET.fromstring(svg).tag == "{http://www.w3.org/2000/svg}svg"
        assert "<script" not in svg
        assert figures.caption(name).endswith(".")

    def test_the_same_report_gives_the_same_file(self, name, report, drawn):
        assert figures.draw(name, report) == drawn[name]

    @pytest.mark.parametrize("participants", [0, 1, 2])
    def test_it_can_be_drawn_from_the_first_answer_on(self, name, demo, participants):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            svg = figures.draw(name, analyse(demo, simulate_responses(demo, participants, seed=1)))
        assert texts(svg)

    def test_every_reference_inside_leads_somewhere_and_carries_the_name(self, name, drawn):
        svg = drawn[name]
        ids = set(re.findall(r'\bid="([^"]+)"', svg))
        used = set(re.findall(r'href="#([^"]+)"', svg)) | set(re.findall(r"url\(#([^)]+)\)", svg))
        assert used
        assert used <= ids
        assert all(found.startswith(name.replace("_", "-")) for found in ids)


def test_the_scatter_names_stimuli_and_correlations(drawn):
    shown = texts(drawn["reverse_evaluation"])
    assert shown.count("Happy") == 3
    titles = [text for text in shown if " r = " in text]
    assert [title.split(":")[0] for title in titles] == ["Pleasure", "Arousal", "Dominance"]
    assert {"Subtle", "Moderate", "Full", "All conditions"} <= set(shown)


def test_the_scatter_names_no_more_stimuli_than_can_be_read(demo, report, monkeypatch):
    monkeypatch.setattr(figures, "MOST_NAMED", len(demo.stimuli) - 1)
    shown = texts(figures.draw("reverse_evaluation", report))
    assert "Happy" not in shown
    assert [text for text in shown if " r = " in text]


def test_the_opinion_figure_names_means_and_the_scale(report, drawn):
    shown = texts(drawn["mos_by_condition"])
    assert {f"{found.result.mean:.2f}" for found in report.mos_by_condition} <= set(shown)
    assert any("Expressive" in text for text in shown)


def test_without_answers_the_figures_say_so(demo):
    empty = analyse(demo, EMPTY)
    assert any("No face has been rated" in text for text in texts(figures.draw("reverse_evaluation", empty)))
    assert sum("no ratings" in text for text in texts(figures.draw("mos_by_condition", empty))) == 3


def test_labels_in_chinese_alone_are_replaced_by_names(demo, answers):
    stimuli = tuple(s.model_copy(update={"label": {"zh": s.label["zh"]}}) for s in demo.stimuli)
    conditions = tuple(c.model_copy(update={"label": {"zh": c.label["zh"]}}) for c in demo.conditions)
    spec = demo.model_copy(update={"stimuli": stimuli, "conditions": conditions, "languages": ("zh",)})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        shown = texts(figures.draw("reverse_evaluation", analyse(spec, answers)))
    assert {"happy", "subtle"} <= set(shown)


def test_texts_of_a_study_are_no_markup_and_no_formula(demo, answers):
    hostile = demo.stimuli[0].model_copy(update={"label": {"en": "<script>x</script> $\\frac$", "zh": "x"}})
    spec = demo.model_copy(update={"stimuli": (hostile, *demo.stimuli[1:])})
    svg = figures.draw("reverse_evaluation", analyse(spec, answers))
    assert "<script>" not in svg
    assert "<script>x</script> $\\frac$" in texts(svg)


def test_each_figure_belongs_to_a_section(crossed):
    assert set(figures.NAMES) <= {section.name for section in crossed.sections}


def test_an_unknown_figure_is_named_with_those_there_are(report):
    with pytest.raises(EvaluationError, match="no figure 'pie'; there are reverse_evaluation, mos_by_condition"):
        figures.draw("pie", report)
    with pytest.raises(EvaluationError, match="no figure 'pie'"):
        figures.caption("pie")
