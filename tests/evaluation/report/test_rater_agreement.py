"""How well raters agree, against numpy, pandas and the formulas."""

import itertools

import numpy as np
import pandas as pd
import pytest

from evaluation.report.analysis import RESPONSE_COLUMNS, analyse
from evaluation.report.methods import methods
from evaluation.report.rater_agreement import rater_agreement, rater_consistencies
from evaluation.simulate import simulate_responses

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

EMPTY = pd.DataFrame(columns=list(RESPONSE_COLUMNS))


@pytest.fixture(scope="module")
def block(crossed):
    return crossed.blocks["rater_agreement"]


def wide(report, score):
    return report.scores.pivot_table(index=["stimulus", "condition"], columns="participant", values=score)


def share(value):
    return f"{round(value, 2) + 0.0:.2f}".replace("0.", ".")


def test_spread_and_pairwise_r_are_those_of_pandas(block, crossed):
    frame = block.frames["agreement"]
    for row, line in zip(block.sections[0].rows, frame.to_dict("records"), strict=True):
        table = wide(crossed.report, row[0])
        if line["condition"] != "all":
            table = table.xs(line["condition"], level="condition")
        # A rater who always gave the same answer is in no pair.
        r = np.nanmean(table.corr().to_numpy()[np.triu_indices(8, 1)])
        shown = row[1].replace("Grade ", "c")
        assert (line["score"], line["condition"]) == (row[0], shown)
        assert row[2:6] == (str(len(table)), "8", f"{table.std(axis=1).mean():.2f}", share(r))
        assert (line["sd"], line["pairwise_r"]) == pytest.approx((table.std(axis=1).mean(), r))
    # All conditions together, then each.
    conditions = ("c0", "c1", "c2")
    assert [*zip(frame["score"], frame["condition"], strict=True)] == [
        *((score, "all") for score in ("MOS", "P", "A", "D")),
        *((score, one) for score in ("MOS", "P", "A", "D") for one in conditions),
    ]
    assert frame["ratings"].tolist() == [144] * 4 + [48] * 12


def test_what_single_conditions_leave_out_is_told(block, crossed):
    table = wide(crossed.report, "MOS").xs("c2", level="condition")
    (constant,) = table.columns[table.nunique() == 1]
    notes = block.sections[0].notes
    assert f"MOS, Grade 2: Raters who did not give two different ratings were left out: {constant}." in notes
    # What holds for all of them is said once.
    assert sum("The interval rests on 6 items" in note for note in notes) == 1


def test_alpha_of_incomplete_ratings_by_its_definition(demo, answers):
    report = analyse(demo, answers)
    block = rater_agreement(report)
    rows = {row[:2]: row for row in block.sections[0].rows}
    frame = block.frames["agreement"].set_index(["score", "condition"])
    for score, condition, shown in (("MOS", "all", "all"), ("A", "all", "all"), ("MOS", "full", "Full")):
        own = report.scores[(report.scores["condition"] == condition) | (condition == "all")]
        units = [group.to_numpy() for _, group in own.groupby(["stimulus", "condition"])[score]]
        within = sum(((unit[:, None] - unit) ** 2).sum() / (len(unit) - 1) for unit in units)
        every = np.concatenate(units)
        expected = 1 - within * (len(every) - 1) / ((every[:, None] - every) ** 2).sum()
        assert frame.loc[(score, condition), "alpha"] == pytest.approx(expected)
        ends = frame.loc[(score, condition), ["alpha_ci_low", "alpha_ci_high"]]
        assert ends.iloc[0] < expected < ends.iloc[1]
        assert rows[score, shown][6:] == (share(expected), f"{share(ends.iloc[0])} to {share(ends.iloc[1])}")


def test_intraclass_correlations_from_mean_squares(block, crossed):
    table = wide(crossed.report, "P").to_numpy()
    n, k = table.shape
    grand = table.mean()
    rows, columns = table.mean(axis=1), table.mean(axis=0)
    between = k * ((rows - grand) ** 2).sum() / (n - 1)
    judges = n * ((columns - grand) ** 2).sum() / (k - 1)
    error = ((table - rows[:, None] - columns + grand) ** 2).sum() / ((n - 1) * (k - 1))
    within = ((table - rows[:, None]) ** 2).sum() / (n * (k - 1))
    expected = {
        "ICC(1,1)": (between - within) / (between + (k - 1) * within),
        "ICC(2,1)": (between - error) / (between + (k - 1) * error + k * (judges - error) / n),
        "ICC(3,1)": (between - error) / (between + (k - 1) * error),
        "ICC(1,8)": (between - within) / between,
        "ICC(2,8)": (between - error) / (between + (judges - error) / n),
        "ICC(3,8)": (between - error) / between,
    }
    found = {row[1]: row[2] for row in block.sections[1].rows if row[0] == "P"}
    assert found == {name: share(value) for name, value in expected.items()}
    frame = block.frames["icc"]
    own = frame[frame["score"] == "P"].set_index("symbol")["value"]
    assert own.to_dict() == pytest.approx(expected)


def test_every_number_of_the_table_is_in_its_file(block):
    section = block.sections[0]
    frame = block.frames[section.frame]
    numbers = frame.select_dtypes("number").to_numpy(dtype=float).ravel()
    for row in section.rows:
        for cell in itertools.chain(row[2:-1], row[-1].split(" to ")):
            digits = len(cell.partition(".")[2])
            assert np.nanmin(np.abs(numbers - float(cell))) <= 0.5000001 * 10.0**-digits, (row[0], cell)


def test_raters_without_common_clips_have_no_intraclass_correlation(demo, answers):
    report = analyse(demo, answers)
    block = rater_agreement(report)
    found = next(one for one in block.sections if one.name == "icc")
    # What could not be computed must be said, and must not stand in the methods.
    assert found.rows == ()
    assert [note.partition(":")[0] for note in found.notes] == ["MOS", "P", "A", "D"]
    assert all("without a missing rating" in note for note in found.notes)
    assert block.frames["icc"].empty
    assert "intraclass" not in methods(report, {"rater_agreement": block})


def test_an_interval_without_a_lower_end_is_no_infinity(build):
    # The raters disagree so much on arousal that the mean of them has no least reliability.
    spec = build(4, 1, instruments=("pad12", "mos5"))
    block = rater_agreement(analyse(spec, simulate_responses(spec, 4, seed=1)))
    found = next(one for one in block.sections if one.name == "icc")
    frame = block.frames["icc"]
    open_ends = frame.loc[np.isinf(frame["ci_low"]), ["score", "symbol", "ci_high"]].to_numpy().tolist()
    assert open_ends
    rows = {row[:2]: row for row in found.rows}
    for score, symbol, high in open_ends:
        assert rows[score, symbol][3] == f"≤ {share(high)}"
        assert f"{score}, {symbol}: its interval has no lower end." in found.notes
    assert "inf" not in str(found.rows)


def test_raters_who_differ_by_a_constant_have_an_infinite_f_in_words(build):
    spec = build(4, 1)
    answers = simulate_responses(spec, 3, seed=1)
    clip = answers["stimulus"].str.removeprefix("s").astype(int)
    block = rater_agreement(analyse(spec, answers.assign(raw=1 + clip % 3 + answers["participant"] % 3)))
    tests = {row[1]: row[4] for row in block.sections[1].rows}
    assert tests["ICC(3,1)"] == "F(3, 6) infinite"
    assert not any("inf" in cell for row in block.sections[1].rows for cell in (row[2], row[3]))


def test_agreement_in_choices(build):
    spec = build(5, 2, instruments=("emotion14",))
    report = analyse(spec, simulate_responses(spec, 4, seed=1))
    block = rater_agreement(report)
    (found,) = block.sections
    assert (found.name, [row[:2] for row in found.rows]) == (
        "choices",
        [("emotion14.emotion", "Fleiss' kappa"), ("emotion14.emotion", "Krippendorff's alpha")],
    )
    counts = pd.crosstab([report.answers["stimulus"], report.answers["condition"]], report.answers["keyed"]).to_numpy()
    agreed = (counts * (counts - 1)).sum(axis=1) / (4 * 3)
    shares = counts.sum(axis=0) / counts.sum()
    kappa = (agreed.mean() - (shares**2).sum()) / (1 - (shares**2).sum())
    # With the same raters for all clips alpha is kappa but for chance, which it counts without replacement.
    chance = (counts.sum(axis=0) * (counts.sum(axis=0) - 1)).sum() / (40 * 39)
    alpha = (agreed.mean() - chance) / (1 - chance)
    frame = block.frames["choices"].set_index("measure")
    fleiss = frame.loc["emotion14.emotion, Fleiss' kappa"].set_index("category")["kappa"]
    assert fleiss["all"] == pytest.approx(kappa)
    # The categories are the values of the answers.
    assert fleiss.index[1:].tolist() == [str(value) for value in spec.instrument("emotion14").items[0].values]
    assert frame.loc["emotion14.emotion, Krippendorff's alpha", "alpha"] == pytest.approx(alpha)
    assert f"= {share(kappa)}" in found.rows[0][2]
    assert f"= {share(alpha)}" in found.rows[1][2]


def test_choices_of_one_rater_have_no_agreement(build):
    spec = build(3, 2, instruments=("emotion14",))
    assert rater_agreement(analyse(spec, simulate_responses(spec, 1, seed=1))) is None


def test_constant_ratings_have_no_agreement(crossed_study, crossed_answers):
    block = rater_agreement(analyse(crossed_study, crossed_answers.assign(raw=3, keyed=3)))
    assert {row[4] for row in block.sections[0].rows} == {"0.00"}
    assert {row[5:] for row in block.sections[0].rows} == {("–", "–", "–")}
    assert "nan" not in str(block.sections).lower()


def test_nobody_agrees_alone(crossed_study, crossed_answers):
    assert rater_agreement(analyse(crossed_study, crossed_answers[crossed_answers["participant"] == 1])) is None
    assert rater_agreement(analyse(crossed_study, EMPTY)) is None


def test_bootstrap_intervals_come_from_the_seed_of_the_study(crossed_study, crossed_answers, block):
    def alphas(spec):
        return rater_agreement(analyse(spec, crossed_answers)).frames["krippendorff"]

    pd.testing.assert_frame_equal(alphas(crossed_study), block.frames["krippendorff"])
    other = alphas(crossed_study.model_copy(update={"seed": 5}))
    assert other["alpha"].tolist() == block.frames["krippendorff"]["alpha"].tolist()
    assert other["ci_low"].tolist() != block.frames["krippendorff"]["ci_low"].tolist()


def test_raters_against_themselves(build):
    spec = build(6, 2)
    rows = [
        (person, trial + 10, trial, 1, "mos5", "MOS", float(1 + (person + trial) % 5), float(1 + (2 * trial) % 5))
        for person in range(1, 5)
        for trial in range(1, 6)
    ]
    repeats = pd.DataFrame(
        rows, columns=["participant", "trial", "of", "clip", "instrument", "score", "first", "second"]
    )
    answers = simulate_responses(spec, 4, seed=1)
    block = rater_consistencies(analyse(spec, answers, repeats=repeats))
    ((score, said),) = block.sections[0].rows
    assert score == "MOS"
    frame = block.frames["consistency"]
    assert len(frame)
    assert set(frame["score"]) == {"MOS"}
    assert said
    assert rater_consistencies(analyse(spec, answers)) is None
    assert rater_consistencies(analyse(spec, answers, repeats=repeats.iloc[:0])) is None
    few = rater_consistencies(analyse(spec, answers, repeats=repeats.head(1)))
    assert "nan" not in str(few.sections).lower()
