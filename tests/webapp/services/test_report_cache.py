"""Reports that are kept, and those that must not be."""

import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from evaluation.report.full import FullReport
from lab import Lab, Rater, always, at_once
from webapp.config import Settings
from webapp.db import Database
from webapp.models import Participant
from webapp.services import asking, decisions, report_cache, results, trials, withdrawal
from webapp.services.report_cache import ReportCache
from webapp.services.withdrawal import Extent


def full(lab: Lab, slug: str = "mini") -> FullReport:
    found: FullReport = lab.see(lambda session: results.full_report(session, slug))
    return found


def withdraw(lab: Lab, rater: Rater, extent: Extent) -> None:
    lab.do(lambda session: withdrawal.withdraw(session, session.get_one(Participant, rater.id), extent, actor="wu"))


@pytest.fixture
def answered(lab: Lab) -> Rater:
    """One rater of the small study who has answered its first trial."""
    lab.apply()
    rater = lab.rater()
    rater.answer(always(2))
    return rater


def test_a_report_is_kept_while_nothing_changes(lab: Lab, answered: Rater) -> None:
    first = full(lab)
    assert full(lab) is first
    assert lab.see(lambda session: results.reports(session, "mini"))["main"] is first.report
    assert first.report.trials == 1


def test_a_new_answer_and_a_changed_one_make_a_new_report(lab: Lab, answered: Rater) -> None:
    first = full(lab)
    answered.answer(always(3))
    second = full(lab)
    assert (first.report.trials, second.report.trials) == (1, 2)
    position = answered.trials()[0].position
    answered.send(position, answered.form(position, always(4)))
    third = full(lab)
    assert third.report.trials == 2
    said = [one.report.answers.loc[one.report.answers["item"] == "mos", "raw"].tolist() for one in (second, third)]
    assert said == [[2, 3], [4, 3]]


@pytest.mark.parametrize("extent", list(Extent))
def test_a_withdrawal_makes_a_new_report(lab: Lab, answered: Rater, extent: Extent) -> None:
    other = lab.rater()
    other.answer(always(1))
    first = full(lab)
    withdraw(lab, other, extent)
    second = full(lab)
    assert second is not first
    assert second.report.participants == (1 if extent == Extent.ERASE else 2)


def test_an_answer_after_one_that_was_erased_makes_a_new_report(lab: Lab, answered: Rater) -> None:
    other = lab.rater()
    other.answer(always(1))
    first = full(lab)
    withdraw(lab, other, Extent.ERASE)
    answered.answer(always(3))
    assert full(lab).report.answers["raw"].tolist() != first.report.answers["raw"].tolist()
    assert full(lab).report.participants == 1


def test_another_studys_withdrawal_never_leaves_a_stale_report(lab: Lab, answered: Rater) -> None:
    # A database may give the key of an erased answer to the next one, of whatever study.
    lab.apply(slug="other")
    stranger = lab.rater("other")
    stranger.answer(always(1))
    first = full(lab)
    withdraw(lab, stranger, Extent.ERASE)
    answered.answer(always(3))
    second = full(lab)
    assert (first.report.trials, second.report.trials) == (1, 2)


def test_studies_have_reports_of_their_own(lab: Lab, answered: Rater) -> None:
    lab.apply(slug="other")
    stranger = lab.rater("other")
    stranger.answer(always(1))
    stranger.answer(always(1))
    assert (full(lab).report.spec.slug, full(lab, "other").report.spec.slug) == ("mini", "other")
    assert (full(lab).report.trials, full(lab, "other").report.trials) == (1, 2)


def test_a_decision_makes_a_new_report(lab: Lab, answered: Rater) -> None:
    first = full(lab)
    assert first.report.used is None

    def decide(gate: str) -> None:
        lab.do(
            lambda session: decisions.decide(
                session, session.get_one(Participant, answered.id), gate, "told us so", actor="wu"
            )
        )

    decide("used")
    second = full(lab)
    assert second.report.used is not None
    assert second.report.used.participants == 0
    decide("")
    assert full(lab).report.used is None


def test_two_databases_never_share(lab: Lab, answered: Rater, settings: Settings, tmp_path: Path) -> None:
    (tmp_path / "second").mkdir()
    second = Database(f"sqlite:///{tmp_path / 'second' / 'padlab.sqlite'}")
    second.upgrade()
    other = Lab(second, settings, tmp_path)
    other.apply()
    rater = other.rater()
    rater.answer(always(3))
    mine, theirs = full(lab), full(other)
    assert mine is not theirs
    assert set(mine.report.answers["raw"]) == {2}
    assert set(theirs.report.answers["raw"]) == {3}
    second.dispose()


class Kept:
    """Stands in for a report with this many rows of scores."""

    def __init__(self, rows: int) -> None:
        self.report = self
        self.scores = range(rows)
        self.answers = range(0)
        self.used = None


def maker(rows: int, made: list[int]) -> Callable[[], FullReport]:
    def make() -> FullReport:
        made.append(rows)
        return Kept(rows)  # type: ignore[return-value]

    return make


def test_the_report_used_longest_ago_leaves_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report_cache, "REPORTS", 2)
    cache, made = ReportCache(), list[int]()
    for key in ("a", "b", "a", "c", "a", "b"):
        cache.get(key, maker(1, made))
    assert len(made) == 4


def test_large_reports_leave_room_but_the_newest_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report_cache, "ROWS", 10)
    cache, made = ReportCache(), list[int]()
    for key, rows in (("a", 4), ("b", 5), ("c", 20), ("c", 20), ("a", 4)):
        cache.get(key, maker(rows, made))
    assert made == [4, 5, 20, 4]


def test_a_report_that_fails_is_made_anew() -> None:
    cache, made = ReportCache(), list[int]()

    def fail() -> FullReport:
        raise ValueError

    with pytest.raises(ValueError):
        cache.get("a", fail)
    cache.get("a", maker(1, made))
    assert made == [1]


def test_who_asks_meanwhile_waits_for_the_same_report() -> None:
    cache, made, begun = ReportCache(), list[int](), threading.Event()

    def slow() -> FullReport:
        begun.wait(0.05)
        return maker(1, made)()

    found = at_once(*[lambda: cache.get("a", slow)] * 4)
    assert made == [1]
    assert len({id(one) for one in found}) == 1


@pytest.mark.postgresql
@pytest.mark.parametrize("database_url", ["postgresql"], indirect=True)
def test_an_answer_that_is_committed_late_makes_a_new_report(lab: Lab, answered: Rater) -> None:
    # PostgreSQL gives keys when rows are written, but shows the rows when their transaction ends.
    other = lab.rater()
    form = other.form(1, always(1))
    submissions = asking.read_form(other.asks(1), form)
    with lab.database.write() as session:
        person = session.get_one(Participant, other.id)
        trials.record(session, person, 1, submissions, visit_id=other.visit, playback=())
        session.flush()
        answered.answer(always(3))
        assert full(lab).report.trials == 2
    assert full(lab).report.trials == 3
