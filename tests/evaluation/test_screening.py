import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.errors import DataError
from evaluation.screening import RULES, ScreeningData, screen
from evaluation.statistics.rater_model import range_counts, rater_model
from evaluation.study_parts import Screening

seeds = st.integers(0, 2**31)


def rules(**limits) -> Screening:
    """Rules with limits, or with pairs of limit and gate."""
    return Screening.model_validate(
        {
            name: {"limit": one} if not isinstance(one, tuple) else {"limit": one[0], "gate": one[1]}
            for name, one in limits.items()
        }
    )


def scores(table, score="Q", raters=None) -> pd.DataFrame:
    """Long scores of a table with a row for each clip and a column for each rater."""
    table = np.asarray(table, dtype=float)
    raters = raters or [f"r{number:02d}" for number in range(table.shape[1])]
    rows = [
        (raters[rater], clip + 1, f"s{clip}", "c", score, table[clip, rater])
        for clip in range(table.shape[0])
        for rater in range(table.shape[1])
        if not np.isnan(table[clip, rater])
    ]
    return pd.DataFrame(rows, columns=["participant", "trial", "stimulus", "condition", "score", "value"])


def honest(seed=0, clips=30, raters=12, spread=0.5):
    rng = np.random.default_rng(seed)
    return rng.uniform(1, 5, (clips, 1)) + rng.normal(0, 0.1, raters) + spread * rng.normal(size=(clips, raters))


def checks(**passed) -> pd.DataFrame:
    rows = [(who, "gold", one) for who, results in passed.items() for one in results]
    return pd.DataFrame(rows, columns=["participant", "kind", "passed"])


def value(report, participant, rule):
    frame = report.to_frame()
    return frame.set_index(["participant", "rule"]).loc[(participant, rule), "value"]


def reason(report, participant, rule):
    return next(one.reason for one in report.findings if (one.participant, one.rule) == (participant, rule))


class TestGates:
    def test_who_is_not_accepted_is_not_used(self):
        data = ScreeningData(checks=checks(good=[True, True], bad=[True, False]))
        report = screen(rules(gold=(0.7, "accepted")), data)
        assert (report.accepted, report.used) == (("good",), ("good",))
        assert report["bad"].rules == ("gold",)
        assert report["bad"].reasons == ("gold: 1 of 2 gold clips answered as known; at least 0.7 is needed",)
        assert report["good"].reasons == ()

    def test_not_used_but_paid(self):
        data = ScreeningData(checks=checks(good=[True], bad=[False]))
        report = screen(rules(gold=(1, "used")), data)
        assert (report.accepted, report.used) == (("bad", "good"), ("good",))

    def test_only_reported(self):
        data = ScreeningData(checks=checks(bad=[False]))
        report = screen(rules(gold=(1, "report")), data)
        assert report.used == ("bad",)
        assert report.findings[0].fails
        assert report["bad"].reasons == ()

    def test_rules_that_are_not_applied_are_absent(self):
        report = screen(rules(), ScreeningData(checks=checks(one=[False]), scores=scores(honest())))
        assert report.findings == ()
        assert len(report.used) == 13
        assert report.to_frame().empty

    def test_each_rater_has_each_rule(self):
        report = screen(rules(**dict.fromkeys(RULES, 0.5)), ScreeningData(scores=scores(honest())))
        frame = report.to_frame()
        assert frame["rule"].tolist() == list(RULES) * 12

    def test_no_data_excludes_nobody(self):
        data = ScreeningData(checks=checks(one=[True]))
        report = screen(rules(**{rule: (1e9, "accepted") for rule in RULES if rule != "gold"}), data)
        assert report.used == ("one",)
        assert not report.to_frame()["fails"].any()
        assert all(one.value is None and "cannot be told" in one.reason for one in report.findings)

    def test_nobody(self):
        report = screen(rules(gold=1), ScreeningData())
        assert (report.raters, report.findings) == ((), ())
        assert report.summary() == "Of 0 raters, 0 are accepted and 0 are used."


class TestDecisions:
    def test_by_hand(self):
        data = ScreeningData(checks=checks(one=[True], two=[True], three=[True]))
        decisions = {"one": ("accepted", "twice the same person"), "two": ("used", "ill"), "three": ("report", "late")}
        report = screen(rules(gold=1), data, decisions=decisions)
        assert (report.accepted, report.used) == (("three", "two"), ("three",))
        assert report["one"].reasons == ("manual: twice the same person",)
        assert reason(report, "three", "manual") == "manual: late"
        assert report.to_frame().query("rule == 'manual'")["limit"].isna().all()

    def test_they_bring_nobody_back(self):
        report = screen(rules(gold=1), ScreeningData(checks=checks(one=[False])), decisions={"one": ("report", "fine")})
        assert report.used == ()

    def test_of_somebody_without_data(self):
        assert screen(rules(), ScreeningData(), decisions={7: ("used", "no show")})[7].used is False

    @pytest.mark.parametrize("decision", [("paid", "why"), ("used", "  ")])
    def test_wrong_ones(self, decision):
        with pytest.raises(DataError, match="decision on one"):
            screen(rules(), ScreeningData(), decisions={"one": decision})


class TestSimpleRules:
    def test_instructed_is_not_gold(self):
        table = pd.DataFrame({"participant": [1, 1], "kind": ["gold", "instructed"], "passed": [False, True]})
        report = screen(rules(gold=0.5, instructed=0.5), ScreeningData(checks=table))
        assert report[1].rules == ("gold",)

    def test_watched_leaves_unknown_shares_out(self):
        timing = pd.DataFrame(
            {
                "participant": [1, 1, 2, 2, 3],
                "trial": [1, 2, 1, 2, 1],
                "seconds": [4.0] * 5,
                "share": [1, 0.5, 0.2, np.nan, np.nan],
            }
        )
        report = screen(rules(watched=0.75), ScreeningData(timing=timing))
        assert report.used == (1, 3)
        assert value(report, 1, "watched") == 0.75
        assert value(report, 2, "watched") == pytest.approx(0.2)
        assert math.isnan(value(report, 3, "watched"))

    def test_seconds_is_the_median(self):
        timing = pd.DataFrame({"participant": [1] * 3, "trial": [1, 2, 3], "seconds": [1.0, 2, 60], "share": np.nan})
        assert value(screen(rules(seconds=3), ScreeningData(timing=timing)), 1, "seconds") == 2
        assert screen(rules(seconds=2), ScreeningData(timing=timing)).used == (1,)
        assert screen(rules(seconds=2.1), ScreeningData(timing=timing)).used == ()

    def test_repeats_take_the_worst_score(self):
        table = pd.DataFrame(
            {
                "participant": [1] * 4,
                "score": ["P", "P", "A", "A"],
                "first": [0, 1, 0.5, 1],
                "second": [0.5, 1, -0.5, 1],
            }
        )
        report = screen(rules(repeats=0.4), ScreeningData(repeats=table))
        assert value(report, 1, "repeats") == 0.5
        assert report.findings[0].score == "A"
        assert report.used == ()

    def test_variance(self):
        flat, lively = [3, 3, 3, 3], [1, 2, 4, 5]
        report = screen(rules(variance=0.15), ScreeningData(scores=scores(np.transpose([flat, lively]))))
        assert report.used == ("r01",)
        assert value(report, "r01", "variance") == pytest.approx(10 / 3)

    def test_variance_of_two_ratings_cannot_be_told(self):
        report = screen(rules(variance=0.15), ScreeningData(scores=scores([[3], [3]])))
        assert report.used == ("r00",)
        assert reason(report, "r00", "variance") == "variance: cannot be told from 2 ratings"

    def test_a_value_on_the_limit_passes_despite_rounding(self):
        table = pd.DataFrame(
            {"participant": [1] * 3, "score": "P", "first": [0.1, 0.2, 0.3], "second": [0.2, 0.3, 0.4]}
        )
        assert screen(rules(repeats=0.1), ScreeningData(repeats=table)).used == (1,)


class TestStraightLining:
    RANGES = pd.DataFrame(
        [("pad", item, -4, 4) for item in "abcd"] + [("pad", "x", 0, 1), ("mos", "q", 1, 5), ("mos", "w", 1, 5)],
        columns=["instrument", "item", "low", "high"],
    )

    def report(self, *trials, ranges=RANGES, limit=0.5):
        rows = [
            (1, number, instrument, item, answer)
            for number, trial in enumerate(trials)
            for instrument, answers in trial.items()
            for item, answer in answers.items()
        ]
        table = pd.DataFrame(rows, columns=["participant", "trial", "instrument", "item", "value"])
        return screen(rules(straight_lining=limit), ScreeningData(answers=table, ranges=ranges))

    def line(self, answer):
        return {"pad": dict.fromkeys("abcd", answer)}

    def test_share_of_trials(self):
        lively = {"pad": {"a": 1, "b": 2, "c": 1, "d": 1}}
        report = self.report(self.line(0), self.line(3), lively)
        assert value(report, 1, "straight_lining") == pytest.approx(2 / 3)
        assert report.used == ()
        assert self.report(self.line(0), lively, lively).used == (1,)

    def test_items_of_another_range_do_not_matter(self):
        trial = {"pad": {"a": 2, "b": 2, "c": 2, "d": 2, "x": 0}, "mos": {"q": 4, "w": 5}}
        assert value(self.report(trial, trial, trial), 1, "straight_lining") == 1

    def test_instruments_of_fewer_than_three_items_are_not_looked_at(self):
        report = self.report(*[{"mos": {"q": 3, "w": 3}}] * 5)
        assert math.isnan(value(report, 1, "straight_lining"))
        assert report.used == (1,)

    def test_items_without_a_range_are_not_looked_at(self):
        assert math.isnan(value(self.report(*[{"other": dict.fromkeys("abc", 1)}] * 5), 1, "straight_lining"))

    def test_two_answers_are_no_line(self):
        trial = {"pad": {"a": 1, "b": 1, "c": np.nan}}
        assert math.isnan(value(self.report(*[trial] * 5), 1, "straight_lining"))

    def test_all_sets_of_items_of_an_instrument_must_be_lines(self):
        ranges = pd.DataFrame(
            [("two", item, 1, 5) for item in "abc"] + [("two", item, 0, 9) for item in "def"],
            columns=["instrument", "item", "low", "high"],
        )
        one = {"two": {**dict.fromkeys("abc", 2), "d": 1, "e": 2, "f": 3}}
        both = {"two": {**dict.fromkeys("abc", 2), **dict.fromkeys("def", 7)}}
        assert value(self.report(one, one, both, ranges=ranges), 1, "straight_lining") == pytest.approx(1 / 3)

    def test_two_trials_are_too_few(self):
        assert self.report(self.line(0), self.line(0)).used == (1,)


class TestZScore:
    def test_by_hand(self):
        # Means 1, 2, 3, 6: mean 3, SD (n) 1.871.
        report = screen(rules(z_score=1.6), ScreeningData(scores=scores([[1, 2, 3, 6], [1, 2, 3, 6], [1, 2, 3, 6]])))
        assert value(report, "r03", "z_score") == pytest.approx(3 / math.sqrt(3.5))
        assert value(report, "r00", "z_score") == pytest.approx(-2 / math.sqrt(3.5))
        assert report.used == ("r00", "r01", "r02")

    def test_the_limit_itself_fails(self):
        report = screen(rules(z_score=1), ScreeningData(scores=scores([[1, 1, 3, 3]] * 3)))
        assert report.used == ()

    def test_all_alike(self):
        report = screen(rules(z_score=3.29), ScreeningData(scores=scores([[0.1] * 4, [0.2] * 4, [0.3] * 4])))
        assert report.to_frame()["value"].eq(0).all()

    def test_which_clips_a_rater_got_does_not_matter(self):
        table = np.repeat(np.arange(1.0, 9)[:, None], 6, axis=1)
        table[4:, :3] = table[:4, 3:] = np.nan
        report = screen(rules(z_score=3.29), ScreeningData(scores=scores(table)))
        assert report.to_frame()["value"].eq(0).all()

    def test_two_raters_are_too_few(self):
        report = screen(rules(z_score=0.5), ScreeningData(scores=scores([[1, 5]] * 4)))
        assert len(report.used) == 2


class TestKurtosis:
    def test_it_is_bt500(self):
        table = honest(3, clips=80, raters=30, spread=0.3)
        table[:, 4] = np.random.default_rng(4).uniform(1, 5, 80)
        report = screen(rules(kurtosis=0.05), ScreeningData(scores=scores(table)))
        counts = range_counts(table)
        rejected = (counts.share > 0.05) & (counts.asymmetry < 0.3)
        assert report.to_frame()["value"].to_numpy() == pytest.approx(counts.share)
        assert report.to_frame()["fails"].tolist() == rejected.tolist()
        assert rejected[4]

    def test_who_is_always_on_one_side_is_spared(self):
        table = honest(3, clips=40, raters=30, spread=0.3)
        table[:, 0] += 4
        report = screen(rules(kurtosis=0.001), ScreeningData(scores=scores(table)))
        assert "r00" in report.used
        assert "most on one side" in reason(report, "r00", "kurtosis")

    def test_a_score_that_fails_decides_even_if_another_is_farther_out_but_spared(self):
        table = honest(3, clips=80, raters=30, spread=0.3)
        one_sided, random = table.copy(), table.copy()
        one_sided[:, 0] += 4
        random[:, 0] = np.random.default_rng(4).uniform(1, 5, 80)
        data = ScreeningData(scores=pd.concat([scores(one_sided, "P"), scores(random, "A")]))
        report = screen(rules(kurtosis=0.05), data)
        finding = report.findings[0]
        assert (finding.participant, finding.score, finding.fails) == ("r00", "A", True)

    def test_five_raters_are_too_few(self):
        report = screen(rules(kurtosis=0.05), ScreeningData(scores=scores(honest(raters=5))))
        assert report.to_frame()["value"].isna().all()


class TestModel:
    def test_bias_is_found(self):
        table = honest()
        table[:, 3] += 1.5
        report = screen(rules(bias=1), ScreeningData(scores=scores(table)))
        assert [rater.participant for rater in report.raters if not rater.used] == ["r03"]
        assert value(report, "r03", "bias") == pytest.approx(rater_model(table).bias[3])
        table[:, 3] -= 3
        report = screen(rules(bias=1), ScreeningData(scores=scores(table)))
        assert value(report, "r03", "bias") < -1
        assert not report["r03"].used

    def test_inconsistency_is_found(self):
        table = honest()
        table[:, 5] = np.random.default_rng(1).uniform(1, 5, 30)
        report = screen(rules(inconsistency=1), ScreeningData(scores=scores(table)))
        assert [rater.participant for rater in report.raters if not rater.used] == ["r05"]

    @settings(max_examples=20, deadline=None)
    @given(seeds, st.floats(1.2, 3), st.integers(0, 11))
    def test_a_constant_added_to_one_rater_is_bias_and_nothing_else(self, seed, constant, who):
        table = honest(seed)
        before = screen(rules(bias=1, inconsistency=1, correlation=0.2), ScreeningData(scores=scores(table)))
        table[:, who] += constant
        after = screen(rules(bias=1, inconsistency=1, correlation=0.2), ScreeningData(scores=scores(table)))
        name = f"r{who:02d}"
        assert value(after, name, "bias") - value(before, name, "bias") == pytest.approx(constant * 11 / 12, abs=1e-5)
        for rule in ("inconsistency", "correlation"):
            assert value(after, name, rule) == pytest.approx(value(before, name, rule), abs=1e-4, nan_ok=True)

    def test_the_worst_score_decides(self):
        biased = honest()
        biased[:, 0] -= 1
        data = ScreeningData(scores=pd.concat([scores(honest(), "P"), scores(biased, "A"), scores(honest(), "D")]))
        finding = screen(rules(bias=0.7), data).findings[0]
        assert (finding.score, finding.fails) == ("A", True)
        assert finding.reason.startswith("bias (A): bias -1.03 against")

    def test_two_raters_cannot_be_told_apart(self):
        report = screen(rules(bias=0.1, inconsistency=0.1), ScreeningData(scores=scores(honest(raters=2))))
        assert report.to_frame()["value"].isna().all()

    def test_a_collapsed_model_excludes_nobody(self):
        table = honest(1, clips=200, raters=3)
        report = screen(rules(inconsistency=0.01), ScreeningData(scores=scores(table)))
        assert len(report.used) == 3
        assert "takes one of them for the truth" in reason(report, "r00", "inconsistency")


class TestCorrelation:
    def test_by_hand(self):
        table = [[1, 1, 4], [2, 2, 3], [3, 3, 2], [4, 4, 1]]
        report = screen(rules(correlation=0), ScreeningData(scores=scores(table)))
        assert value(report, "r02", "correlation") == pytest.approx(-1)
        assert "r02" not in report.used

    def test_constant_ratings_cannot_be_told(self):
        report = screen(rules(correlation=0.5), ScreeningData(scores=scores([[1, 3, 1], [2, 3, 2], [3, 3, 4]])))
        assert "r01" in report.used
        assert "do not vary" in reason(report, "r01", "correlation")


def test_a_clip_rated_twice_counts_with_its_mean():
    table = honest()
    once, twice = scores(table), pd.concat([scores(table - 0.25), scores(table + 0.25)])
    limits = rules(bias=1, inconsistency=1, correlation=0.5, z_score=3.29, kurtosis=0.05)
    one, two = (screen(limits, ScreeningData(scores=data)).to_frame()["value"] for data in (once, twice))
    assert two.to_numpy() == pytest.approx(one.to_numpy())


@settings(max_examples=20, deadline=None)
@given(seeds)
def test_the_order_of_rows_and_the_names_of_raters_do_not_matter(seed):
    table = honest(seed)
    table[np.random.default_rng(seed).random(table.shape) < 0.2] = np.nan
    limits = rules(**dict.fromkeys(("variance", "z_score", "kurtosis", "bias", "inconsistency", "correlation"), 0.3))
    names = [f"x{number:02d}" for number in np.random.default_rng(seed).permutation(12)]
    one = screen(limits, ScreeningData(scores=scores(table))).to_frame()
    shuffled = scores(table, raters=names).sample(frac=1, random_state=seed)
    two = screen(limits, ScreeningData(scores=shuffled)).to_frame()
    back = dict(zip(names, [f"r{number:02d}" for number in range(12)], strict=True))
    two = two.assign(participant=two["participant"].map(back)).sort_values("participant", kind="stable")
    assert two["value"].to_numpy() == pytest.approx(one["value"].to_numpy(), abs=1e-5, nan_ok=True)
    assert two["rule"].tolist() == one["rule"].tolist()


@pytest.mark.filterwarnings("error")
@settings(max_examples=40, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.integers(1, 4),
            st.integers(1, 4),
            st.sampled_from(["P", "A"]),
            st.one_of(st.none(), st.floats(-1, 1), st.integers(-1, 1)),
        ),
        max_size=40,
    ),
    st.floats(-1, 2),
    st.sampled_from(["accepted", "used", "report"]),
)
def test_any_ratings_give_a_report(rows, limit, gate):
    table = pd.DataFrame(
        [(who, number, f"s{clip}", "c", score, one) for number, (who, clip, score, one) in enumerate(rows)],
        columns=["participant", "trial", "stimulus", "condition", "score", "value"],
    )
    report = screen(rules(**dict.fromkeys(RULES, (limit, gate))), ScreeningData(scores=table))
    assert set(report.used) <= set(report.accepted)
    assert len(report.findings) == len(RULES) * len(report.raters)
    assert not any(one.fails for one in report.findings if one.value is None)
    assert all(one.value is None or math.isfinite(one.value) for one in report.findings)
    assert all(rater.used == (not rater.reasons) for rater in report.raters)
    if gate == "report":
        assert len(report.used) == len(report.raters)
    assert report.summary().startswith(f"Of {len(report.raters)} raters")


def test_summary_and_frames():
    data = ScreeningData(checks=checks(good=[True], bad=[False]), timing=ScreeningData().timing)
    report = screen(rules(gold=(0.5, "accepted"), seconds=1), data, decisions={"good": ("used", "a friend")})
    assert report.summary() == (
        "Of 2 raters, 1 are accepted and 0 are used.\n"
        "gold, limit 0.5 (accepted): 1 of 2 fail.\n"
        "seconds, limit 1 (used): 0 of 2 fail, 2 cannot be told.\n"
        "manual: 1 decided by hand.\n"
        "bad is not accepted: gold: 0 of 1 gold clips answered as known; at least 0.5 is needed.\n"
        "good is not used: manual: a friend."
    )
    frame = report.raters_frame().set_index("participant")
    assert frame["accepted"].to_dict() == {"bad": False, "good": True}
    assert frame.loc["good", "rules"] == "manual"


def test_raters_are_in_the_order_of_their_numbers():
    data = ScreeningData(checks=pd.DataFrame({"participant": [10, 9, 2], "kind": "gold", "passed": True}))
    assert data.participants == (2, 9, 10)


def test_somebody_unknown():
    with pytest.raises(DataError, match="no participant 'x'"):
        screen(rules(), ScreeningData())["x"]


class TestBadData:
    def test_a_column_is_missing(self):
        with pytest.raises(DataError, match="scores: there is no column value"):
            ScreeningData(scores=scores(honest()).drop(columns="value"))

    @pytest.mark.parametrize("wrong", ["much", math.inf, 1e200])
    def test_a_value_is_no_number(self, wrong):
        table = scores(honest()).astype({"value": object})
        table.loc[3, "value"] = wrong
        with pytest.raises(DataError, match="scores: value must be"):
            ScreeningData(scores=table)

    def test_a_name_is_missing(self):
        table = scores(honest()).astype({"participant": object})
        table.loc[3, "participant"] = None
        with pytest.raises(DataError, match="participant is missing in 1 rows"):
            ScreeningData(scores=table)

    def test_another_kind_of_check(self):
        with pytest.raises(DataError, match="no kind 'silver'"):
            ScreeningData(checks=pd.DataFrame({"participant": [1], "kind": ["silver"], "passed": [True]}))

    def test_a_check_neither_passed_nor_failed(self):
        with pytest.raises(DataError, match="true or false"):
            ScreeningData(checks=pd.DataFrame({"participant": [1], "kind": ["gold"], "passed": ["maybe"]}))

    def test_the_tables_given_are_not_changed(self):
        table = scores(honest())
        before = table.copy()
        screen(rules(bias=1, variance=1), ScreeningData(scores=table))
        pd.testing.assert_frame_equal(table, before)
