"""`padlab power` as scripts and people use it."""

import json
from pathlib import Path

import pytest

QUICK = ("--replications", "100")


def test_a_plan_is_told_with_its_unit_its_power_and_what_it_takes(run: object) -> None:
    result = run("power", "demo", "--raters", "15", *QUICK)
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert lines[0].startswith("demo, part main: 15 raters x 12 stimuli x 3 conditions (subtle, moderate, full)")
    assert "0.5 points" in lines[1]
    assert any(line.startswith("  raters and items random (quasi-F)") for line in lines)
    assert "  63 raters with 12 stimuli" in result.stdout
    assert "  21 stimuli with 15 raters" in result.stdout
    assert any(line.startswith("  raters \\ stimuli") for line in lines)


def test_json_is_one_object(run: object) -> None:
    result = run("power", "mtap-2013-exp1", "--effect", "0.3", "--json", *QUICK)
    assert result.stderr == ""
    found = json.loads(result.stdout)
    assert (found["raters"], found["items"], found["assignment"], found["ratings"]) == (15, 20, "full", 900)
    assert found["conditions"] == ["exp1-static", "exp1-random", "exp1-prosodic"]
    assert found["power_ci"][0] <= found["power_closed_form"] <= found["power_ci"][1]
    assert (found["raters_needed"], found["power_at_raters_needed"]) == (None, None)
    assert found["items_needed"] > 20
    assert "no number of raters up to 5000 with 20 stimuli" in run("power", "mtap-2013-exp1", "--effect", "0.3").stdout
    assert found["effect"]["means"] == pytest.approx([2.85, 3.0, 3.15])
    assert found["seed"] == 20131
    assert run("power", "mtap-2013-exp1", "--effect", "0.3", "--json", *QUICK).stdout == result.stdout


def test_options_change_the_plan(run: object) -> None:
    def power(*options: str) -> float:
        result = run("power", "mtap-2013-exp1", "--effect", "0.3", "--json", "--seed", "1", *QUICK, *options)
        return json.loads(result.stdout)["power_closed_form"]

    plain = power()
    assert power("--raters", "40") > plain
    assert power("--items", "60") > plain
    assert power("--alpha", "0.01") < plain
    assert power("--item-condition-sd", "0.6") < plain
    assert power("--residual-sd", "0.3", "--rater-condition-sd", "0") > plain
    assert power("--rater-sd", "2", "--item-sd", "1") == pytest.approx(plain)


def test_a_papers_effect_is_told_as_printed_and_within(run: object) -> None:
    result = run("power", "mtap-2013-exp3", "--effect", "avatar", *QUICK)
    assert "means 2.62, 3.75, 4.36" in result.stdout
    assert "F[2, 57]" in result.stdout
    assert "within sentences it is F(2, 38)" in result.stdout
    few = run("power", "demo", "--effect", "head", "--power", "0.99", "--json", *QUICK)
    assert json.loads(few.stdout)["target"] == 0.99


def test_parts_are_told_one_after_the_other(run: object) -> None:
    found = json.loads(run("power", "mtap-2013", "--raters", "4", "--json", *QUICK).stdout)
    assert list(found["parts"]) == ["exp1", "exp2", "exp3"]
    assert found["part"] == "exp1"
    text = run("power", "mtap-2013", "--raters", "4", "--part", "exp2", *QUICK).stdout
    assert "part exp2" in text
    assert "part exp1" not in text


def test_correlations(run: object) -> None:
    found = json.loads(run("power", "mtap-2013-reverse-pad", "--effect", "pad-a", "--json", *QUICK).stdout)
    assert (found["items"], found["items_needed"]) == (14, 21)
    assert found["power_closed_form"] == pytest.approx(0.6033, abs=1e-3)
    text = run("power", "acii-2007-labelling", "--effect", "acii-d", "--items", "6", *QUICK).stdout
    assert text.startswith("acii-2007-labelling, part pad: 6 stimuli")


def test_effects_are_listed(run: object) -> None:
    lines = run("power", "--effect", "list").stdout.splitlines()
    assert [line.split()[0] for line in lines[:3]] == ["head", "face", "avatar"]
    assert len(lines) == 9
    assert set(json.loads(run("power", "--effect", "list", "--json").stdout)) >= {"head", "pad-p", "acii-d"}
    assert "avatar" in run("power", "--help").stdout


def test_a_file_of_ones_own(run: object, tmp_path: Path) -> None:
    text = run("study", "schema").stdout
    assert "latin_square" in text
    source = Path(__file__).parents[2] / "data" / "mini.yaml"
    path = tmp_path / "mine.yaml"
    path.write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
    result = run("power", str(path), "--items", "10", "--json", *QUICK)
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["items"] == 10


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("nosuch.yaml",), ("no study file nosuch.yaml", "demo")),
        (("demo", "--raters", "4"), ("plans 4 raters", "at least 6")),
        (("demo", "--part", "nosuch"), ("no part 'nosuch'",)),
        (("acii-2007-labelling",), ("several conditions", "--effect list")),
        (("mtap-2013-exp1", "--effect", "pad-p"), ("PAD",)),
        (("mtap-2013-exp1", "--residual-sd", "0"), ("residual_sd is 0",)),
        (("mtap-2013-exp1", "--rater-sd", "nan"), ("rater_sd is nan",)),
        (("mtap-2013-exp1", "--alpha", "nan"), ("alpha is nan",)),
        (("mtap-2013-exp1", "--raters", "100000"), ("simulated",)),
    ],
)
def test_wrong_input_gives_one_sentence(
    run: object, fails: object, arguments: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    fails(run("power", *arguments, *QUICK), *parts)


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ((), "FILE"),
        (("demo", "--effect", "nosuch"), "head, face, avatar"),
        (("demo", "--effect", "nan"), "nan is no difference"),
        (("demo", "--effect", "-0.5"), "more than 0"),
        (("demo", "--effect", "9"), "at most 4"),
        (("demo", "--power", "1"), "0<x<1"),
        (("demo", "--raters", "1"), "2<=x"),
        (("demo", "--replications", "5"), "100<=x"),
    ],
)
def test_wrong_usage_is_exit_code_2(run: object, arguments: tuple[str, ...], part: str) -> None:
    result = run("power", *arguments)
    assert result.exit_code == 2
    assert part in result.stderr
