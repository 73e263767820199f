"""Where training data come from: shapes, means and refusals."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from evaluation.responses import check_responses, score_trials
from evaluation.simulate import simulate_responses
from evaluation.statistics.agreement.annotation import annotation_agreement
from evaluation.study import StudySpec
from synth.corpus.landmarks import read_set, write_set
from synth.errors import SpecError
from synth.expression.models import load_model
from synth.fap.table import FAP_COUNT
from webapp import farm
from webapp.config import Settings
from webapp.db import Database
from webapp.errors import ConflictError, DatabaseError, NotFoundError
from webapp.models import Stimulus
from webapp.services import annotated, corpora, studies
from webapp.services.corpora import Corpus
from webapp.services.modelling import ModelReport


def test_pseudo_databases_have_the_papers_sizes_and_say_that_they_are_pseudo(pseudo_corpus: Corpus) -> None:
    samples, mtap, acii = pseudo_corpus.samples, pseudo_corpus.expressions, pseudo_corpus.acii
    assert (len(samples.pad), len(mtap), len(set(mtap.subjects))) == (486, 486, 97)
    assert (len(acii), len(set(acii.subjects))) == (213, 10)
    assert samples.pseudo
    assert mtap.pseudo
    assert acii.pseudo
    assert "not agreement with people" in samples.note
    np.testing.assert_array_equal(samples.faps, mtap.faps)


def test_pseudo_raters_agree_about_as_the_papers_did(pseudo_corpus: Corpus) -> None:
    # MTAP 2013, section 2.4.
    for name, sd, r in (("P", 0.20, 0.80), ("A", 0.32, 0.44), ("D", 0.30, 0.35)):
        own = pseudo_corpus.agreement[name]
        assert own.sd == pytest.approx(sd, abs=0.06)
        assert own.pairwise_r == pytest.approx(r, abs=0.12)
        assert own.raters == 5
    np.testing.assert_array_equal(pseudo_corpus.samples.reliability, corpora.reliability(pseudo_corpus.agreement))


def test_reliability_is_that_of_spearman_and_brown() -> None:
    # Two raters whose ratings correlate by .6 (P), -.5 (A, no reliability) and 1 (D): 2 * .6 / 1.6 = .75.
    first = np.array([1.0, 1.0, -1.0, -1.0]) / 2
    second = np.array([1.0, -1.0, 1.0, -1.0]) / 2
    ratings = np.stack(
        [
            np.column_stack([first, 0.6 * first + 0.8 * second]),
            np.column_stack([first, -0.5 * first + np.sqrt(0.75) * second]),
            np.column_stack([first, first]),
        ],
        axis=2,
    )
    np.testing.assert_allclose(corpora.reliability(annotation_agreement(ratings)), [0.75, 0.0, 1.0], atol=1e-9)


@pytest.fixture
def folder(pseudo_corpus: Corpus, tmp_path: Path) -> Path:
    made = tmp_path / "faces"
    made.mkdir()
    write_set(pseudo_corpus.expressions, made)
    return made


def test_a_folder_gives_what_its_files_say(pseudo_corpus: Corpus, folder: Path, settings: Settings) -> None:
    found = corpora.load(str(folder), settings, seed=0)
    assert found.samples.name == pseudo_corpus.samples.name
    assert found.samples.pseudo
    assert found.samples.emotions == pseudo_corpus.samples.emotions
    assert found.samples.digest == pseudo_corpus.samples.digest
    assert found.samples.reliability is None
    np.testing.assert_allclose(found.samples.pad, pseudo_corpus.samples.pad, atol=1e-12)
    np.testing.assert_allclose(found.samples.faps, pseudo_corpus.samples.faps, atol=1e-6)


def test_a_folder_without_ratings_is_refused(folder: Path, settings: Settings) -> None:
    (folder / "pad.csv").unlink()
    with pytest.raises(NotFoundError, match=r"pad\.csv"):
        corpora.load(str(folder), settings, seed=0)


@pytest.mark.parametrize(
    ("file", "line", "cell", "wrong", "parts"),
    [
        ("landmarks.csv", 2, 5, "much", ("landmarks.csv, line 3, column", "'much'")),
        ("landmarks.csv", 1, 3, "smiling", ("landmarks.csv, line 2, column state", "'smiling'")),
        ("pad.csv", 6, 2, "1.5", ("pad.csv, line 7, column P", "1.5", "from -1 to 1")),
        ("pad.csv", 6, 2, "nan", ("pad.csv, line 7, column P", "'nan'")),
    ],
)
def test_malformed_tables_are_refused_by_file_and_line(
    *, folder: Path, settings: Settings, file: str, line: int, cell: int, wrong: str, parts: tuple[str, ...]
) -> None:
    lines = (folder / file).read_text(encoding="utf-8").splitlines()
    cells = lines[line].split(",")
    cells[cell] = wrong
    lines[line] = ",".join(cells)
    (folder / file).write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(SpecError) as error:
        corpora.load(str(folder), settings, seed=0)
    assert "\n" not in str(error.value)
    for part in parts:
        assert part in str(error.value)


def test_a_place_without_data_is_refused(tmp_path: Path, settings: Settings) -> None:
    with pytest.raises(NotFoundError, match=r"no folder nowhere.*study:SLUG"):
        corpora.load("nowhere", settings, seed=0)
    (tmp_path / "empty").mkdir()
    with pytest.raises(NotFoundError, match=r"holds no landmarks\.csv.*docs/corpora\.md"):
        corpora.load(str(tmp_path / "empty"), settings, seed=0)
    with pytest.raises(DatabaseError, match="padlab db upgrade"):
        corpora.load("study:demo", settings, seed=0)


def test_a_study_gives_its_raters_means_and_the_faps_that_were_shown(
    settings: Settings, apply_study: Callable[..., StudySpec], collect: Callable[..., None]
) -> None:
    spec = apply_study("many")
    collect(spec, 3)
    samples = corpora.load("study:many", settings, seed=0).samples
    cells = [(cell.stimulus, cell.condition) for cell in spec.cells()]
    scores = score_trials(spec, check_responses(spec, simulate_responses(spec, 3, seed=1)))
    wanted = scores.groupby(["stimulus", "condition"])[["P", "A", "D"]].mean()
    model = load_model("table")
    assert samples.name == "study:many"
    assert not samples.pseudo
    assert len(samples.pad) == len(cells) == 30
    assert "30 faces, mean over 3 raters" in samples.note
    assert sorted(samples.emotions) == sorted(stimulus for stimulus, _ in cells)
    shown = {}
    for cell in cells:
        fields = spec.clip_fields(*cell)
        shown[cell] = model.apex(np.array([fields["pad"]]), intensity=fields["intensity"])[1][0]
    found = list(zip(samples.emotions, samples.pad, samples.faps, strict=True))
    for (stimulus, condition), faps in shown.items():
        (pad,) = [p for name, p, own in found if name == stimulus and np.allclose(own, faps, atol=1e-9)]
        np.testing.assert_allclose(pad, wanted.loc[stimulus, condition], atol=1e-12)


def test_partly_answered_studies_give_the_faces_that_were_rated(
    settings: Settings, apply_study: Callable[..., StudySpec], collect: Callable[..., None]
) -> None:
    collect(apply_study("many"), 2, first=4)
    samples = corpora.load("study:many", settings, seed=0).samples
    assert 4 <= len(samples.pad) <= 8
    assert np.isfinite(samples.pad).all()
    assert samples.reliability is None


def test_studies_without_pad_are_refused(
    settings: Settings, apply_study: Callable[..., StudySpec], collect: Callable[..., None]
) -> None:
    apply_study("unrated")
    with pytest.raises(ConflictError, match="no rated face yet"):
        corpora.load("study:unrated", settings, seed=0)
    collect(apply_study("opinions", instruments="mos5"), 2)
    with pytest.raises(ConflictError, match="does not ask pad12"):
        corpora.load("study:opinions", settings, seed=0)
    with pytest.raises(NotFoundError, match=r"no study 'nosuch'.*opinions, unrated"):
        corpora.load("study:nosuch", settings, seed=0)


def test_a_set_trained_anew_does_not_change_what_was_shown(
    settings: Settings,
    database: Database,
    pseudo_report: ModelReport,
    apply_study: Callable[..., StudySpec],
    collect: Callable[..., None],
) -> None:
    file = settings.models_dir / "own" / "models.json"
    file.parent.mkdir(parents=True)
    pseudo_report.models.write(file)
    spec = apply_study("second", model="own/linear", faces=2)
    collect(spec, 2)
    before = corpora.load("study:second", settings, seed=0).samples
    digits = file.read_text(encoding="utf-8")
    # Another set of the same name: the linear model looks the other way.
    T = pseudo_report.models.linear.T
    other = digits.replace(str(T.tolist()), str((-T).tolist()))
    assert other != digits
    file.write_text(other, encoding="utf-8")
    with pytest.raises(ConflictError, match="own/linear or the face has changed"):
        corpora.load("study:second", settings, seed=0)
    # Where the clips were rendered, their lineage tells what was shown.
    file.write_text(digits, encoding="utf-8")
    assert [outcome.error for outcome in farm.render_unfinished(database, settings, slug="second")] == [None] * 4
    file.write_text(other, encoding="utf-8")
    after = corpora.load("study:second", settings, seed=0).samples
    np.testing.assert_allclose(after.faps, before.faps, atol=1e-9)
    assert after.faps.shape == (4, FAP_COUNT)
    assert after.digest == before.digest
    file.unlink()
    assert corpora.load("study:second", settings, seed=0).samples.digest == before.digest


def test_the_smaller_set_of_points_can_be_learned_from(
    pseudo_corpus: Corpus, tmp_path: Path, settings: Settings
) -> None:
    write_set(pseudo_corpus.acii, tmp_path)
    found = corpora.load(str(tmp_path), settings, seed=0)
    assert found.acii.scheme == read_set(tmp_path).scheme == "acii2007"
    assert len(found.samples.pad) == 213


def test_an_annotated_study_gives_what_its_rounds_came_to(
    settings: Settings, database: Database, apply_study: Callable[..., StudySpec], collect: Callable[..., None]
) -> None:
    spec = apply_study("rounds", faces=5, instruments="pad5", annotation="{raters: 3, sets: 2}")
    collect(spec, 3)
    samples = corpora.load("study:rounds", settings, seed=0).samples
    with database.read() as session:
        study = studies.find(session, "rounds")
        found = annotated.annotated(session, study, spec, spec.part("faces"))
        names = [session.get_one(Stimulus, key).name for key, _ in found.stimuli]
    assert len(samples.pad) == 10
    assert "mean over 3 raters" in samples.note
    assert samples.reliability is not None
    assert sorted(samples.pad.tolist()) == sorted(found.values.tolist())
    assert sorted(samples.emotions) == sorted(names)
