import re
from html.parser import HTMLParser

import numpy as np
import pytest
from markupsafe import escape

from evaluation.report import papers
from evaluation.report.latex import table as latex_table
from evaluation.report.section import lines
from evaluation.statistics.anova import one_way_of_matrix
from evaluation.statistics.repeated_measures import repeated_measures


@pytest.fixture(scope="module")
def blocks():
    return papers.blocks()


@pytest.fixture(scope="module")
def frames(blocks):
    return {name: frame for block in blocks for name, frame in block.frames.items()}


@pytest.fixture(scope="module")
def sections(blocks):
    return {section.name: section for block in blocks for section in block.sections}


def notes(section):
    return " ".join(section.notes)


def recomputed(frame):
    return dict(zip(frame["quantity"], frame["recomputed"], strict=True))


def test_every_table_has_its_numbers_and_can_be_written(sections, frames):
    assert len(sections) == len(frames)
    for section in sections.values():
        assert section.frame in frames
        assert all(len(row) == len(section.header) for row in section.rows)
        assert lines(section)[0] == section.title
        assert latex_table(section).startswith(r"\begin{table}")
        assert not re.search(r"\bnan\b|\binf\b", " ".join(lines(section)))


def test_where_the_print_does_not_reproduce(sections, frames, blocks):
    verdicts = {row[0]: (row[1], row[2]) for row in sections["papers_overview"].rows}
    assert verdicts == {
        "MTAP 2013, sections 2.2 and 3.1: Syllables in a word: 460 in 94 words": ("no", "4.21"),
        "MTAP 2013, sections 2.2 and 3.1: Duration of a word, s: 4.21 syllables of 7.36 frames": ("no", "1.221"),
        "ACII 2007, Table 7: Average over 12 PEPs: Test set": ("if unrounded", "0.69"),
        "ACII 2007, Table 8: Happy called Happy, 9 of 14, %": ("no", "67"),
        "ACII 2007, Table 8: Sad called Sad, 6 of 14, %": ("no", "42"),
        "ACII 2007, Table 8: Angry called Hostile, 8 of 14, %": ("no", "58"),
    }
    found = frames["papers_overview"]["agrees"].value_counts()
    assert f"{found[['yes', 'if unrounded', 'no']].sum()} printed numbers" in blocks[0].sentences[0]
    assert f"{found['yes']} agree" in blocks[0].sentences[0]


def test_published_correlations(frames, case):
    for name, published in (("mtap_table_8", "mtap2013_table8"), ("acii_table_8", "acii2007_table8")):
        expected = case(published)["expected_full_digits"]["r"]
        assert frames[name]["recomputed"].tolist() == pytest.approx(expected, rel=1e-9)


def test_percentages_of_counts(frames):
    for name, expected in (("mtap_table_1", [8.5, 53.2, 7.4, 18.1, 12.8]), ("mtap_table_4", [16.0, 27.7, 23.4, 33.0])):
        total, *percents = frames[name]["recomputed"]
        assert total == 94
        assert percents == pytest.approx(expected, abs=0.0501)
        assert (frames[name]["agrees"] == "yes").all()


def test_averages_of_predictions(frames, sections):
    expected = [0.7289, 0.52, 0.5733, 0.6256, 0.2233]
    assert frames["mtap_table_6"]["average"].tolist() == pytest.approx(expected, abs=6e-5)
    assert "8 of 9 PEPs; not for PEP 4" in notes(sections["mtap_table_6"])
    assert "18 of 18 pairs" in notes(sections["mtap_table_6_bounds"])
    expected = [0.3825, 0.8425, 0.66083333, 0.6825]
    assert frames["acii_table_7"]["recomputed"].tolist() == pytest.approx(expected)


def test_how_rare_the_printed_average_is(sections):
    # Sums of twelve rounding errors, each uniform: of 400,000, those that lift .6825 to .685 at least.
    errors = np.random.default_rng(7).uniform(-0.005, 0.005, (400_000, 12)).mean(axis=1)
    once_in = int(re.search(r"about once in (\d+)", notes(sections["acii_table_7"]))[1])
    assert 1 / once_in == pytest.approx((errors >= 0.0025).mean(), abs=2e-4)


def test_clusters(frames, sections, case):
    expected = case("acii2007_table4")["expected"]
    sums = [*expected["rows"], *expected["cols"], expected["total"]]
    assert frames["acii_table_4"]["recomputed"].tolist() == sums
    assert (frames["acii_table_4"]["agrees"] == "yes").all()
    found = notes(sections["acii_table_4_clusters"])
    assert f"χ²(36, N = 213) = {expected['chi2']:.2f}" in found
    assert f"V = {expected['V']:.2f}".replace("0.", ".") in found
    assert f"{expected['purity']:.3f} of the images" in found
    assert "SAD (0.48), FEAR (0.34), DIS (0.41)" in found


def test_length_of_words(frames):
    found = recomputed(frames["mtap_word_durations"])
    assert found["Syllables in a word: 460 in 94 words"] == pytest.approx(460 / 94)
    assert found["Syllables in a word: example sentence, Table 2"] == 45 / 12
    assert found["Duration of a word, s: 4.21 syllables of 7.36 frames"] == pytest.approx(1.239424)


def test_percentages_of_labels(frames, sections):
    verdicts = frames["acii_labels"]["agrees"].tolist()
    assert verdicts == ["no", "yes", "no", "yes", "no", "yes"]
    assert "8, 12, 5, 6, 7, 6 of 12" in notes(sections["acii_labels"])
    assert "only 12 and 24" in notes(sections["acii_labels"])


def test_what_the_printed_ratio_implies(frames, case):
    names = ("head", "face", "avatar")
    expected = [case(f"mtap2013_table10_{name}")["expected"] for name in names]
    found = frames["mtap_table_10"]
    assert found["pooled_sd"].tolist() == pytest.approx([one["pooled_sd"] for one in expected], rel=1e-4)
    assert found["eta_squared"].tolist() == pytest.approx([one["eta2"] for one in expected], rel=1e-4)
    assert (found["p"] < 0.001).all()


def test_the_ratio_within_sentences_is_that_over_one_less_the_correlation(frames):
    rng = np.random.default_rng(3)
    ratings = rng.normal(size=(20, 1)) + rng.normal(size=(20, 3)) + [0, 0.5, 1]
    covariances = np.cov(ratings.T)
    rho = covariances[np.triu_indices(3, 1)].mean() / np.diag(covariances).mean()
    within, between = repeated_measures(ratings).F, one_way_of_matrix(ratings).F
    assert within == pytest.approx(between / (1 - rho))
    table = frames["mtap_table_10_units"]
    assert table["F_within_r_0.5"].tolist() == pytest.approx((2 * table["F_within_r_0"]).tolist())


def test_raters_who_differ_so_much_reach_one_percent(frames):
    # Residuals of 15 raters without rater and group means, scaled to the SD of the table.
    noise = np.random.default_rng(5).normal(size=(15, 3))
    rest = noise - noise.mean(axis=1, keepdims=True) - noise.mean(axis=0) + noise.mean()
    sd = frames["mtap_table_10_units"]["rater_sd_at_p_01"][0]
    rest *= sd / np.sqrt((rest**2).sum() / 28)
    found = repeated_measures(rest + np.array([2.23, 2.57, 3.87]))
    assert found.p == pytest.approx(0.01, rel=1e-6)


def test_scale_of_the_input(frames, sections, case):
    found = frames["mtap_table_8_scale"]
    columns = [np.transpose(case("mtap2013_table8")["data"][side]) for side in ("input", "evaluated")]
    lines_of = [np.polyfit(*pair, 1) for pair in zip(*columns, strict=True)]
    np.testing.assert_allclose(found[["slope", "intercept"]], lines_of)
    assert found["slope_of_rescaled_input"].tolist() == pytest.approx((found["slope"] / 1.25).tolist())
    assert "contains neither" in notes(sections["mtap_table_8_scale"])
    assert "contains both" in notes(sections["acii_table_8_scale"])


def test_words_in_both_papers(frames, sections):
    found = frames["both_table_8"].set_index("word")["same"]
    assert found[found == "no"].index.tolist() == ["Angry"]
    assert len(found) == 6
    assert "14 raters" in notes(sections["both_table_8"])


def test_distances(frames):
    assert frames["acii_table_6"]["pair"][0] == "ANG and DIS"
    ranks = frames["acii_word_distances"].set_index("pair")["rank"]
    assert ranks[["Angry and Hostile", "Sad and Scared"]].tolist() == [4, 11]
    assert len(ranks) == 91


def test_agreement_of_evaluators(frames):
    expected = [0.952, 0.797, 0.729]
    assert frames["mtap_agreement"]["reliability_of_mean"].tolist() == pytest.approx(expected, abs=0.0005)


class Tags(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.tags, self.ids, self.addresses = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.ids += [value for name, value in attrs if name == "id"]
        self.addresses += [value for name, value in attrs if name in {"src", "href"}]


def test_the_page_is_whole_and_needs_nothing_from_elsewhere(sections):
    text = papers.render_papers()
    page = Tags(text)
    assert not {"script", "link", "iframe", "img"} & set(page.tags)
    assert page.ids == list(sections)
    assert {address.removeprefix("#") for address in page.addresses} == set(sections) - {"papers_overview"}
    assert all(str(escape(section.title)) in text for section in sections.values())


def test_the_page_is_the_same_every_time():
    assert papers.render_papers() == papers.render_papers()
