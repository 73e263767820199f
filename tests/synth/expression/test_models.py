import os
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.expression.model_set import FILE_NAME, KINDS, bundled_set
from synth.expression.models import DEFAULT_MODEL, MODEL_NAMES, check_model_name, load_model
from synth.expression.pad_pep import LinearModel
from synth.expression.pep_fap import template
from synth.expression.word_table import word_table
from synth.fap.table import within_reach

POINTS = np.random.default_rng(2).uniform(-1, 1, (20, 3))


def own_set(offset):
    """A set whose linear model gives the same face everywhere."""
    return replace(bundled_set(), linear=LinearModel(T=np.zeros((9, 3)), V=np.full(9, offset)))


def write(models, folder):
    folder.mkdir(exist_ok=True)
    models.write(folder / FILE_NAME)
    return folder / FILE_NAME


def test_the_built_in_models_are_those_of_the_bundled_set():
    assert MODEL_NAMES == ("table", "ann", "linear", "quadratic", "neutral")
    for kind in KINDS:
        model = load_model(kind)
        assert model.name == kind
        np.testing.assert_array_equal(model.pad_pep.predict(POINTS), bundled_set().for_drawing(kind).predict(POINTS))
        assert model.pep_fap.digest == bundled_set().pep_fap.digest
    assert len({load_model(name).pad_pep.digest for name in MODEL_NAMES}) == 5


def test_the_neutral_model_shows_nothing():
    pep, faps = load_model("neutral").apex(POINTS)
    assert pep.shape == (len(POINTS), 9)
    assert not pep.any()
    assert not faps.any()


def test_the_table_is_exact_at_the_words():
    assert DEFAULT_MODEL == "table"
    _, pad, pep = word_table()
    found, faps = load_model("table").apex(pad)
    np.testing.assert_allclose(found, pep, atol=1e-9)
    np.testing.assert_allclose(faps, within_reach(template().translate(pep)), atol=1e-6)
    neutral, still = load_model("table").apex(np.zeros((1, 3)))
    assert not neutral.any()
    assert not still.any()


@settings(max_examples=40, deadline=None)
@given(st.floats(0.0, 2.0), st.sampled_from(MODEL_NAMES))
def test_intensity_scales_peps_and_faps(intensity, name):
    model = load_model(name)
    (pep, faps), (scaled_pep, scaled_faps) = model.apex(POINTS), model.apex(POINTS, intensity=intensity)
    assert faps.shape == (20, 68)
    np.testing.assert_allclose(scaled_pep, intensity * pep, atol=1e-12)
    np.testing.assert_allclose(scaled_faps, within_reach(model.pep_fap.translate(intensity * pep)), atol=1e-9)
    np.testing.assert_array_equal(within_reach(scaled_faps), scaled_faps)


def test_a_trained_set_is_found_by_its_name(tmp_path):
    write(own_set(0.25), tmp_path / "mine")
    for name in ("mine/linear", "mine/ann", "mine/quadratic"):
        assert load_model(name, tmp_path).name == name
    # What its calibration makes of a face that is the same everywhere is the same everywhere.
    found = load_model("mine/linear", tmp_path).pad_pep
    np.testing.assert_array_equal(found.model.predict(POINTS), np.full((20, 9), 0.25))
    assert found.digest != load_model("linear").pad_pep.digest
    assert load_model("mine/ann", tmp_path).pad_pep.digest == load_model("ann").pad_pep.digest


def test_a_set_that_was_trained_anew_is_noticed(tmp_path):
    for offset in (0.1, 0.2, 0.3):
        write(own_set(offset), tmp_path / "mine")
        assert load_model("mine/linear", tmp_path).pad_pep.model.V[0] == offset
    # Even where a copy has kept the time of the file before.
    file = tmp_path / "mine" / FILE_NAME
    before = file.stat()
    write(own_set(0.4), tmp_path / "mine")
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert load_model("mine/linear", tmp_path).pad_pep.model.V[0] == 0.4


def test_sets_of_one_name_in_two_folders_are_two(tmp_path):
    for name, offset in (("a", 0.1), ("b", 0.2)):
        (tmp_path / name).mkdir()
        write(own_set(offset), tmp_path / name / "mine")
    for name, offset in (("a", 0.1), ("b", 0.2), ("a", 0.1)):
        assert load_model("mine/linear", tmp_path / name).pad_pep.model.V[0] == offset


def test_an_unknown_set_is_told_which_there_are(tmp_path):
    for folder in (None, tmp_path, tmp_path / "missing"):
        with pytest.raises(SpecError, match="no trained set 'mine'; make one with `padlab train`"):
            load_model("mine/ann", folder)
    write(own_set(0.0), tmp_path / "second")
    write(own_set(0.0), tmp_path / "first")
    (tmp_path / "empty").mkdir()
    # Nobody could ask for these two by name.
    write(own_set(0.0), tmp_path / "my set")
    write(own_set(0.0), tmp_path / ".hidden")
    for name in ("mine/ann", "empty/linear"):
        with pytest.raises(SpecError, match=r"there are first, second\.$"):
            load_model(name, tmp_path)


def test_a_damaged_set_is_named(tmp_path):
    file = write(own_set(0.0), tmp_path / "mine")
    load_model("mine/ann", tmp_path)
    file.write_text("{", encoding="utf-8")
    with pytest.raises(SpecError, match=re.escape(str(file))):
        load_model("mine/ann", tmp_path)
    # A refusal is not kept once the file has been mended.
    write(own_set(0.5), tmp_path / "mine")
    assert load_model("mine/linear", tmp_path).pad_pep.model.V[0] == 0.5


@pytest.mark.parametrize(
    "name",
    [
        "",
        "table ",
        "ANN",
        "ann\n",
        "mine",
        "mine/",
        "/ann",
        "mine/table",
        "mine/spline",
        "../x/ann",
        "../ann",
        "./ann",
        "..",
        "x/../ann",
        "x/../../y/ann",
        "/etc/ann",
        "..\\x/ann",
        "x\\..\\y/ann",
        "x/y/ann",
        "x//ann",
        ".x/ann",
        "-x/ann",
        "x\x00/ann",
        "x\n/ann",
        "%2e%2e/ann",
        "~/ann",
        "C:x/ann",
        "名/ann",
        None,
        3,
        ("ann",),
    ],
)
def test_what_is_no_name_is_refused(name, tmp_path):
    # A set that lies outside the folder must not be reached.
    inside = tmp_path / "models"
    inside.mkdir()
    write(own_set(0.0), tmp_path / "x")
    for ask in (check_model_name, lambda value: load_model(value, inside)):
        with pytest.raises(
            SpecError, match=r"There is no model .* table, ann, linear, quadratic, neutral, and SET/ann"
        ):
            ask(name)


@given(st.text(max_size=20) | st.from_regex(r"[./\\A-Za-z0-9_-]{0,12}/(ann|table|linear)", fullmatch=True))
def test_a_name_never_leads_out_of_the_folder(name):
    try:
        checked = check_model_name(name)
    except SpecError:
        return
    assert checked == name
    parts = name.split("/")
    assert parts[-1] in MODEL_NAMES
    if len(parts) > 1:
        assert len(parts) == 2
        assert parts[1] in KINDS
        assert parts[0][0].isalnum()
        assert not set(parts[0]) & set("/\\:~\0")
