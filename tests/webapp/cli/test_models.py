"""Training and evaluation by commands: the loop from a study to a face, what is printed, and wrong use."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

from evaluation.study import StudySpec
from synth.corpus.landmarks import write_set
from synth.expression.model_set import ModelSet
from webapp.cli import model_tables, models
from webapp.db import Database
from webapp.services import studies
from webapp.services.corpora import Corpus
from webapp.services.modelling import ModelReport

Run = Callable[..., Result]
Study = Callable[..., StudySpec]

SET_FILES = ["evaluation.json", "evaluation.txt", "models.json"]


def digests(database: Database, slug: str) -> list[str]:
    with database.read() as session:
        return [stimulus.clip.digest for stimulus in studies.find(session, slug).stimuli]


def test_the_loop_from_ratings_to_new_faces(
    run: Run, apply_study: Study, collect: Callable[..., None], database: Database, folder: Path
) -> None:
    collect(apply_study("first"), 4)
    trained = run("train", "--data", "study:first", "--seed", "2")
    assert trained.exit_code == 0, trained.output
    home = folder / "models" / "first"
    assert sorted(path.name for path in home.iterdir()) == SET_FILES
    assert [line for line in trained.stdout.splitlines() if line.startswith("Written: ")] == [
        f"Written: {home / name}" for name in ("models.json", "evaluation.json", "evaluation.txt")
    ]
    assert "--model first/ann, first/linear, first/quadratic" in trained.stdout
    origin = ModelSet.read(home / "models.json").origin
    assert (origin["data"], origin["samples"], origin["seed"], origin["pseudo"]) == ("study:first", 30, 2, False)
    assert "mean over 4 raters in the study first" in (home / "evaluation.txt").read_text(encoding="utf-8")

    pictures = {}
    for name in ("first/ann", "ann"):
        out = folder / f"{name.replace('/', '-')}.png"
        drawn = run("face", "0.7", "0.2", "0.1", "--out", str(out), "--model", name, "--size", "96x80")
        assert drawn.exit_code == 0, drawn.output
        pictures[name] = out.read_bytes()
    assert pictures["first/ann"][:8] == b"\x89PNG\r\n\x1a\n"
    assert pictures["first/ann"] != pictures["ann"]
    for arguments in (
        ("faces", "joy", "--out", "sheet.png", "--model", "first/quadratic", "--size", "64x48"),
        ("say", "Yes.", "--out", "clip.mp4", "--mute", "--face", "first/linear", "--size", "64x48"),
    ):
        assert run(*arguments).exit_code == 0

    # The next study shows the trained faces; the same file with the built-in model has other clips.
    apply_study("next", model="first/linear")
    apply_study("builtin", model="linear")
    ours, theirs = digests(database, "next"), digests(database, "builtin")
    assert len(set(ours)) == len(set(theirs)) == 30
    assert not set(ours) & set(theirs)

    listed = json.loads(run("models", "list", "--json").stdout)
    assert [row["name"] for row in listed] == ["(built in)", "first"]
    assert listed[1]["data"] == "study:first"
    assert set(listed[1]["nmse"]) == {"linear", "quadratic", "ann"}


def test_a_study_file_that_names_no_set_is_refused(run: Run, fails: object, folder: Path, database: Database) -> None:
    source = (Path(__file__).parents[2] / "data" / "mini.yaml").read_text(encoding="utf-8")
    file = folder / "mini.yaml"
    for name, parts in (("nosuch/ann", ("nosuch",)), ("cubic", ("mini.yaml, line", "'cubic'"))):
        file.write_text(source.replace("clip: {pad:", f"clip: {{model: {name}, pad:", 1), encoding="utf-8")
        fails(run("study", "apply", str(file)), *parts)
        assert json.loads(run("study", "list", "--json").stdout) == []


@pytest.fixture(scope="module")
def faces(pseudo_corpus: Corpus, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small folder of measured faces: those of the first subjects of the pseudo database."""
    folder = tmp_path_factory.mktemp("data") / "my faces_"
    folder.mkdir()
    write_set(pseudo_corpus.expressions, folder)
    for name, count in (("landmarks.csv", 60), ("pad.csv", 30)):
        lines = (folder / name).read_text(encoding="utf-8").splitlines(keepends=True)
        (folder / name).write_text("".join(lines[: count + 1]), encoding="utf-8")
    return folder


def test_json_is_all_that_is_printed(run: Run, faces: Path, folder: Path) -> None:
    out = folder / "deep" / "nest"
    result = run("models", "evaluate", "--data", str(faces), "--json", "--out", str(out))
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert (told["samples"], told["folds"], told["seed"]) == (30, 10, 0)
    assert [len(told["pad_pep"][kind]["nmse"]) for kind in ("linear", "quadratic", "network")] == [9, 9, 9]
    assert len(told["pep_fap"]["nmse"]) == 9
    assert 0 < told["first_canonical_correlation"] <= 1
    assert "Training networks: 0 of 1800" in result.stderr
    assert json.loads((out / "evaluation.json").read_text(encoding="utf-8")) == told
    assert not (out / "models.json").exists()


def test_a_folder_is_trained_into_a_set_that_can_be_named(run: Run, faces: Path, folder: Path) -> None:
    result = run("train", "--data", str(faces))
    assert result.exit_code == 0, result.output
    assert "--model my-faces/ann" in result.stdout
    assert {path.name for path in (folder / "models" / "my-faces").iterdir()} > set(SET_FILES)
    assert run("face", "0", "0", "0", "--out", "a.png", "--model", "my-faces/ann", "--size", "32x32").exit_code == 0


@pytest.mark.parametrize(
    ("out", "advice"),
    [("elsewhere/mine", "move the folder into"), ("models/mine", "--model mine/ann"), ("models/m y", "letters")],
)
def test_training_tells_how_a_set_is_used(
    *, run: Run, folder: Path, pseudo_report: ModelReport, monkeypatch: pytest.MonkeyPatch, out: str, advice: str
) -> None:
    monkeypatch.setattr(models, "_build", lambda *_: pseudo_report)
    result = run("train", "--out", out)
    assert result.exit_code == 0, result.output
    assert advice in result.stdout.splitlines()[-1]
    assert (folder / out / "models.json").is_file()
    assert f"Written: {Path(out) / 'models.json'}" in result.stdout


def test_sets_are_named_after_folders_and_studies() -> None:
    assert models._set_name("study:demo") == "demo"
    assert models._set_name("pseudo") == "pseudo"
    assert models._set_name("data/my faces/") == "my-faces"
    assert models._set_name(".") == models._set_name(str(Path.cwd()))


def test_the_text_tells_the_papers_figures_from_ours(pseudo_report: ModelReport) -> None:
    text = model_tables.text_of(pseudo_report)
    assert max(map(len, text.splitlines())) <= 130
    for word in ("Not comparable", "pseudo database", "AMMSE", "NMSE", "Cohn-Kanade", "JAFFE"):
        assert word in text
    lines = text.splitlines()
    (start,) = [k for k, line in enumerate(lines) if line.startswith("MTAP 2013, Table 6")]
    row = next(line for line in lines[start:] if line.startswith("1 raise eyebrow"))
    _, ours, theirs = row.split(" | ")
    # Printed in MTAP 2013, Table 6.
    assert theirs.split() == ["0.57", "0.70", "0.25", "0.89", "0.13"]
    scores = pseudo_report.evaluation.scores
    assert ours.split()[0::2] == [
        f"{value:.2f}"
        for value in (
            *(scores[kind].mean_nmse[0] for kind in ("linear", "quadratic", "ann")),
            pseudo_report.evaluation.pep_fap_nmse[0],
        )
    ]
    captions = next(line for line in lines[start:] if "THE PAPER" in line)
    assert captions.index("|", captions.index("PADLAB")) == row.rindex("|")
    (last,) = [line for line in lines if line.startswith("1.1L")]
    # Printed in ACII 2007, Table 7.
    assert last.rsplit("|", maxsplit=1)[1].split() == ["0.56", "0.88", "0.77", "0.74"]
    assert "V = .63, purity = .62" in text
    assert "Rc = .81" in text
    assert lines[-1].startswith("Mean NMSE of PAD to PEP")


def test_the_text_warns_of_small_folds(pseudo_report: ModelReport) -> None:
    small = replace(pseudo_report, evaluation=replace(pseudo_report.evaluation, pooled=True))
    assert "folds have fewer than 10 expressions" in " ".join(model_tables.text_of(small).split())
    assert "folds have fewer" not in model_tables.text_of(pseudo_report)


def test_damaged_sets_do_not_hide_others(run: Run, folder: Path, pseudo_report: ModelReport) -> None:
    for name, content in (("broken", "{"), ("good", pseudo_report.models.to_json()), ("older", '{"format": 0}')):
        (folder / "models" / name).mkdir(parents=True)
        (folder / "models" / name / "models.json").write_text(content, encoding="utf-8")
    result = run("models", "list")
    assert result.exit_code == 0
    assert [line.split("\t")[0] for line in result.stdout.splitlines()] == ["(built in)", "good"]
    assert result.stderr.count("Left out: ") == 2
    assert str(Path("models") / "broken" / "models.json") in result.stderr


@pytest.fixture
def untrained(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wrong use is found before any network is trained."""

    def never(*_: object, **__: object) -> None:
        raise AssertionError("trained")

    monkeypatch.setattr("webapp.services.modelling.fit_set", never)


@pytest.mark.parametrize("command", [("train",), ("models", "evaluate")], ids=" ".join)
@pytest.mark.parametrize(
    ("data", "parts"),
    [
        ("nowhere", ("no folder nowhere", "study:SLUG")),
        ("empty", ("empty holds no landmarks.csv", "docs/corpora.md")),
        ("malformed", ("malformed/landmarks.csv, line 1", "sample", "state")),
        ("file.csv", ("no folder file.csv",)),
        ("study:nosuch", ("no study 'nosuch'",)),
        ("study:unrated", ("no rated face yet",)),
        ("study:few", ("study:few has 8 annotated expressions", "at least 25")),
        ("study:opinions", ("does not ask pad12",)),
    ],
)
def test_wrong_data_give_one_sentence(
    *,
    run: Run,
    folder: Path,
    untrained: None,
    apply_study: Study,
    collect: Callable[..., None],
    command: tuple[str, ...],
    data: str,
    parts: tuple[str, ...],
) -> None:
    for name in ("empty", "malformed"):
        (folder / name).mkdir()
    (folder / "malformed" / "landmarks.csv").write_text("a,b\n1,2\n")
    (folder / "file.csv").touch()
    slug = data.removeprefix("study:")
    if slug in {"unrated", "few", "opinions"}:
        spec = apply_study(slug, faces=4, instruments="mos5" if slug == "opinions" else "pad12")
        collect(spec, 0 if slug == "unrated" else 1)
    result = run(*command, "--data", data)
    note, failure = result.stderr.splitlines()
    assert result.exit_code == 1
    assert note == "Reading the data"
    assert failure.startswith("Error: ")
    assert all(part in failure for part in parts), failure
    assert result.stdout == ""
    assert not (folder / "models").exists()


@pytest.mark.parametrize("out", ["file/inside", "/proc/padlab-set"])
def test_a_folder_that_cannot_be_made_is_refused_before_training(
    run: Run, fails: object, folder: Path, untrained: None, out: str
) -> None:
    (folder / "file").touch()
    fails(run("train", "--out", out), out, "--out")


@pytest.mark.parametrize(
    "arguments",
    [
        ("train", "--data", ""),
        ("train", "--data", "study:"),
        ("models", "evaluate", "--data", " "),
        ("train", "--seed", "-1"),
        ("train", "--seed", "many"),
        ("train", "--out", "file"),
        ("models", "evaluate", "--out", "file"),
        ("models", "nosuch"),
        ("train", "pseudo"),
    ],
)
def test_wrong_usage_is_exit_code_2(run: Run, folder: Path, untrained: None, arguments: tuple[str, ...]) -> None:
    (folder / "file").touch()
    result = run(*arguments)
    assert result.exit_code == 2
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("face", "0", "0", "0", "--out", "a.png", "--model", "nosuch/ann"),
        ("faces", "joy", "--out", "a.png", "--model", "nosuch/linear"),
        ("say", "Yes.", "--out", "a.mp4", "--face", "nosuch/quadratic"),
    ],
)
def test_sets_that_are_not_there_are_refused(run: Run, fails: object, folder: Path, arguments: tuple[str, ...]) -> None:
    fails(run(*arguments), "no trained set 'nosuch'", "padlab train")
    assert not list(folder.glob("a.*"))


@pytest.mark.parametrize("name", ["pseudo/table", "nosuch/cubic", "../ann", "a/b/ann", "ANN", ""])
def test_names_that_no_model_can_have_are_wrong_usage(run: Run, folder: Path, name: str) -> None:
    result = run("face", "0", "0", "0", "--out", "a.png", "--model", name)
    assert result.exit_code == 2
    assert "SET/ann" in result.stderr


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGINT, 1)])
def test_training_that_is_stopped_leaves_no_set(
    environment: dict[str, str], tmp_path: Path, faces: Path, number: int, code: int
) -> None:
    older = tmp_path / "models" / "own" / "models.json"
    older.parent.mkdir(parents=True)
    older.write_text("as it was")
    command = [sys.executable, "-c", "from webapp.cli.main import main; main()", "train"]
    # Set apart from pytest's own process group, so that only the command is told.
    with subprocess.Popen(
        [*command, "--data", str(faces), "--out", str(older.parent)],
        env=os.environ | environment,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        for line in process.stderr:
            if line.startswith("Training networks"):
                break
        time.sleep(0.1)
        process.send_signal(number)
        rest = process.stderr.read()
        printed = process.stdout.read()
        assert process.wait(timeout=30) == code, rest
    assert "Traceback" not in rest
    assert printed == ""
    assert [path.name for path in older.parent.iterdir()] == ["models.json"]
    assert older.read_text() == "as it was"


def test_each_pass_has_a_bar_of_its_own(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with models._progress_bars("Training networks") as update:
        for total in (20, 5):
            for finished in range(total + 1):
                update(finished, total)
    shown = capsys.readouterr().err
    assert "20/20" in shown
    assert "5/5" in shown
    assert all(0 <= int(finished) <= int(total) for finished, total in re.findall(r"(-?\d+)/(\d+)", shown))


def test_errors_that_are_not_known_are_left_out(pseudo_report: ModelReport) -> None:
    own = pseudo_report.models
    assert set(models._errors(own)) == {"linear", "quadratic", "ann"}
    scores = pseudo_report.evaluation.scores
    assert models._errors(own)["ann"] == pytest.approx(float(np.nanmean(scores["ann"].mean_nmse)))
    own_origin = {"evaluation": {"pad_pep": {"ann": {"nmse": [None, 0.5]}, "linear": {"nmse": [None]}}}}
    bare = ModelSet(own.ann, own.linear, own.quadratic, own.pep_fap, own.pep_pad, own.calibrations, own_origin)
    assert models._errors(bare) == {"ann": 0.5}
