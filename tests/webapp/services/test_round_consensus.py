from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from annotating import annotation_of, apply_annotation, overview_of

from evaluation.instruments import Item, TextItem
from lab import Lab
from webapp.models import Trial

pytestmark = pytest.mark.every_database


class TestConsensus:
    @staticmethod
    def _vote(*values: int) -> list[Any]:
        """Say of the first sample (by key) what these are, and of the others 0."""

        def choose(value: int) -> Any:
            def answer(item: Item, trial: Trial) -> Sequence[str]:
                if isinstance(item, TextItem):
                    return [f"because of {value}"]
                return [str(value if trial.stimulus_id % 4 == 1 else 0)]

            return answer

        return [choose(value) for value in values]

    def test_what_is_disputed_is_discussed_until_it_is_settled(self, lab: Lab) -> None:
        apply_annotation(lab, mode="consensus", raters=3, agree=2, sets=1)
        panel = [lab.rater() for _ in range(3)]
        for rater, vote in zip(panel, self._vote(-1, 0, 1), strict=True):
            assert rater.answer_all(vote, most=4) == 4
        for rater, vote in zip(panel, self._vote(1, 0, 1), strict=True):
            rater.come_back()
            assert rater.answer_all(vote) == 1
        for rater in panel:
            rater.come_back()
            assert rater.row().state == "completed"
        lines = overview_of(lab)
        assert [(line.samples, line.reannotated, line.agreed) for line in lines] == [(4, 0, 0.75), (1, 1, 1.0)]
        found = annotation_of(lab)
        values = {key: list(value) for (key, _), value in zip(found.stimuli, found.values, strict=True)}
        assert values == {key: [0.5] * 3 if key % 4 == 1 else [0.0] * 3 for key in values}

    def test_an_open_discussion_does_not_undo_what_was_agreed_on(self, lab: Lab) -> None:
        def choose(value: int) -> Any:
            return lambda item, trial: [] if isinstance(item, TextItem) else [str(value if item.id == "P" else 1)]

        apply_annotation(lab, mode="consensus", raters=2, agree=2, sets=1)
        panel = [lab.rater(), lab.rater()]
        for value, rater in enumerate(panel):
            rater.answer_all(choose(value), most=4)
        panel[0].come_back()
        panel[0].answer(choose(1))
        values = annotation_of(lab).values
        assert np.isnan(values[:, 0]).all()
        assert (values[:, 1:] == 0.5).all()
        for rater in panel:
            rater.come_back()
            rater.answer_all(choose(1))
        assert (annotation_of(lab).values == 0.5).all()

    def test_discussions_end_by_their_number(self, lab: Lab) -> None:
        apply_annotation(lab, mode="consensus", raters=3, agree=2, sets=1, stop={"rounds": 2})
        panel = [lab.rater() for _ in range(3)]
        for _ in range(2):
            for rater, vote in zip(panel, self._vote(-1, 0, 1), strict=True):
                rater.come_back()
                rater.answer_all(vote)
        assert [line.samples for line in overview_of(lab)] == [4, 1]
        assert np.isnan(annotation_of(lab).values).any(axis=1).sum() == 1

    def test_raters_agree_on_labels_too(self, lab: Lab) -> None:
        apply_annotation(lab, mode="consensus", raters=2, agree=2, sets=1, part={"instruments": ["emotion14"]})
        panel = [lab.rater(), lab.rater()]
        words = [option.value for option in panel[0].asks(1)[0].items[0].options]

        def choose(place: int) -> Any:
            return lambda item, trial: (
                [] if isinstance(item, TextItem) else [str(words[place if trial.stimulus_id % 4 == 1 else 0])]
            )

        for place, rater in enumerate(panel, start=1):
            rater.answer_all(choose(place), most=4)
        for rater in panel:
            rater.come_back()
            assert rater.answer_all(choose(3)) == 1
        values = annotation_of(lab).values
        assert sorted(values.ravel()) == sorted([words[0]] * 3 + [words[3]])

    def test_words_are_rated_one_by_one(self, lab: Lab) -> None:
        text = {"en": "x", "zh": "x"}
        part = {
            "name": "rate",
            "instruments": ["prosodic_words"],
            "presentation": {"assignment": "full"},
            "annotation": {"mode": "consensus", "raters": 2, "agree": 2},
        }
        lab.apply(
            parts=[part],
            conditions=[{"name": "full", "label": text}],
            stimuli=[{"id": "one", "label": text, "clip": {"pad": [0.1, 0.2, 0.3]}, "words": ["你好", "世界"]}],
        )
        panel = [lab.rater(), lab.rater()]
        for rater in panel:
            rater.answer_all()
        found = annotation_of(lab)
        assert [word for _, word in found.stimuli] == [1, 2]
        assert not np.isnan(found.values).any()
        assert [line.agreed for line in overview_of(lab)] == [1.0]
