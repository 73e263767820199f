"""Training and evaluation on a corpus: the issue's claims on the pseudo database, and small or poor data."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from synth.errors import SpecError
from synth.expression.model_set import KINDS, bundled_set
from synth.expression.samples import check_pad
from synth.fap.table import FAP_COUNT
from webapp.services import modelling
from webapp.services.corpora import Corpus
from webapp.services.modelling import ModelReport


def _strict(text: str) -> dict[str, object]:
    """Read JSON that has no NaN and Infinity, which are none."""

    def refuse(name: str) -> None:
        raise AssertionError(name)

    return json.loads(text, parse_constant=refuse)


def test_the_network_beats_the_linear_model_on_the_pseudo_database(pseudo_report: ModelReport) -> None:
    scores = pseudo_report.evaluation.scores
    mean = {kind: float(np.nanmean(own.mean_nmse)) for kind, own in scores.items()}
    assert mean["ann"] < mean["quadratic"] < mean["linear"] < 1
    assert np.ptp(scores["ann"].fold_nmse) > 0
    for kind in KINDS:
        assert pseudo_report.evaluation.permuted[kind] == pytest.approx(1.0, abs=0.12)


def test_analyses_of_the_papers_are_there(pseudo_report: ModelReport) -> None:
    assert pseudo_report.canonical.correlations[0] == pytest.approx(0.81, abs=0.1)
    assert pseudo_report.clusters.total == 213
    assert len(pseudo_report.clusters.row_names) == 7
    assert set(pseudo_report.clusters.column_names) >= {"happy", "sad", "fear"}
    assert 0.4 < pseudo_report.acii.mean.mean() < 0.9


def test_the_bundled_set_is_what_training_on_the_pseudo_database_gives(pseudo_report: ModelReport) -> None:
    ours, bundled = pseudo_report.models, bundled_set()
    assert ours.origin["data_digest"] == bundled.origin["data_digest"]
    # Closed forms agree to the digits that another processor keeps; networks are compared by their errors.
    np.testing.assert_allclose(ours.linear.T, bundled.linear.T, rtol=1e-6)
    errors = [
        np.nanmean([x for x in one.origin["evaluation"]["pad_pep"]["ann"]["nmse"] if x is not None])
        for one in (ours, bundled)
    ]
    assert errors[0] == pytest.approx(errors[1], abs=0.02)


def test_the_report_has_the_keys_of_the_contract(pseudo_report: ModelReport) -> None:
    told = _strict(json.dumps(pseudo_report.to_dict()))
    assert (told["data"], told["folds"], told["pseudo"], told["samples"]) == ("pseudo-mtap2013", 10, True, 486)
    assert set(told["pad_pep"]) == {"linear", "quadratic", "network"}
    for kind, own in zip(("linear", "quadratic", "network"), ("linear", "quadratic", "ann"), strict=True):
        assert told["pad_pep"][kind]["nmse"] == pseudo_report.evaluation.scores[own].mean_nmse.tolist()
        assert len(told["pad_pep"][kind]["correlation"]) == 9
    assert len(told["pep_fap"]["nmse"]) == 9
    assert len(told["acii2007"]["codes"]) == len(told["acii2007"]["correlation"]) == 12
    assert told["acii2007"]["correlation"] == pseudo_report.acii.mean.tolist()
    assert told["first_canonical_correlation"] == pseudo_report.canonical.correlations[0]


def test_a_report_is_written_whole(pseudo_report: ModelReport, tmp_path: Path) -> None:
    folder = tmp_path / "deep" / "nest"
    files = pseudo_report.write(folder, "as text\n")
    assert sorted(files) == sorted(folder.iterdir())
    assert _strict((folder / "evaluation.json").read_text(encoding="utf-8")) == _strict(
        json.dumps(pseudo_report.to_dict())
    )
    assert (folder / "evaluation.txt").read_text(encoding="utf-8") == "as text\n"
    assert (folder / "pad_by_emotion.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert "<svg" in (folder / "pad_by_emotion.svg").read_text(encoding="utf-8")
    # Of data without measured expressions there is no figure, so that of other data must not stay.
    bare = replace(pseudo_report, corpus=Corpus(samples=pseudo_report.corpus.samples))
    assert sorted(bare.write(folder, "")) == sorted(folder.iterdir())
    assert not list(folder.glob("pad_by_emotion.*"))


def _few(corpus: Corpus, count: int) -> Corpus:
    samples = corpus.samples
    own = replace(
        samples,
        pad=samples.pad[:count],
        faps=samples.faps[:count],
        emotions=samples.emotions[:count],
    )
    return Corpus(samples=own)


def test_too_few_expressions_are_refused_with_the_number_that_is_needed(pseudo_corpus: Corpus) -> None:
    assert modelling.SMALLEST == 25
    with pytest.raises(SpecError, match=r"has 24 annotated expressions; at least 25 are needed"):
        modelling.build(_few(pseudo_corpus, 24), seed=0)


def test_the_smallest_corpus_is_enough(pseudo_corpus: Corpus) -> None:
    told = []
    report = modelling.build(_few(pseudo_corpus, 25), seed=3, on_progress=lambda *numbers: told.append(numbers))
    check_pad(report.models.pep_pad.predict(np.zeros((1, 9))))
    for kind in KINDS:
        pep = report.models.for_drawing(kind).predict(np.array([[0.5, 0.2, 0.3]]))
        assert (np.abs(pep) <= 1).all()
    assert report.models.origin["seed"] == 3
    assert told[0] == (0, 1800)
    assert all(finished <= total for finished, total in told)
    assert "no measured feature points" in report.acii
    assert "no intended emotions" in report.clusters
    assert _strict(json.dumps(report.to_dict()))["acii2007"]["reason"] == report.acii


def test_raters_who_all_say_the_same_teach_nothing(pseudo_corpus: Corpus) -> None:
    few = _few(pseudo_corpus, 30)
    constant = replace(few.samples, pad=np.full((30, 3), 0.25), reliability=None)
    with pytest.raises(SpecError, match="the same PAD"):
        modelling.build(Corpus(samples=constant), seed=0)


def test_a_dimension_on_which_all_agree_does_no_harm(pseudo_corpus: Corpus) -> None:
    few = _few(pseudo_corpus, 30)
    level = replace(few.samples, pad=few.samples.pad * [1, 1, 0], reliability=None)
    report = modelling.build(Corpus(samples=level), seed=0)
    assert "does not vary" in report.canonical
    _strict(json.dumps(report.to_dict()))
    for kind in KINDS:
        assert np.isfinite(report.models.for_drawing(kind).predict(np.array([[0.9, -0.9, 0.9]]))).all()


def test_expressions_that_are_all_alike_are_refused(pseudo_corpus: Corpus) -> None:
    still = replace(_few(pseudo_corpus, 30).samples, faps=np.zeros((30, FAP_COUNT)))
    with pytest.raises(SpecError, match="nothing to learn"):
        modelling.build(Corpus(samples=still), seed=0)


def test_equal_seeds_give_equal_sets(pseudo_corpus: Corpus) -> None:
    corpus = _few(pseudo_corpus, 25)
    first, second, third = (modelling.build(corpus, seed=seed).models.to_json() for seed in (5, 5, 6))
    assert first == second
    assert first != third
