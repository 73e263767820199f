import numpy as np
import pytest

from synth.errors import SpecError
from synth.head.published import (
    RotationStatistics,
    example_sentence,
    printed,
    published_counts,
    published_peaks,
    published_statistics,
)
from synth.head.recording import percentages


def test_counts_add_up_to_the_papers_percentages():
    # MTAP 2013, Tables 1 and 4, as printed.
    assert sum(published_counts().values()) == sum(published_peaks().values()) == 94
    assert percentages(list(published_counts().values())) == [8.5, 53.2, 7.4, 18.1, 12.8]
    assert percentages(list(published_peaks().values())) == [16.0, 27.7, 23.4, 33.0]


def test_table_3_is_the_papers():
    table = published_statistics()
    assert table.angle_range.tolist() == [32.09, 14.61, 20.03]
    assert (table.avg_mean[0], table.avg_sd[2], table.amp_mean[1]) == (-5.09, 1.88, 3.41)
    with pytest.raises(ValueError, match="read-only"):
        table.amp_sd[0] = 0.0


def test_the_sentence_is_table_2():
    words = example_sentence()
    assert [(word.P, word.A) for word in words] == [
        *((0, 0.5), (0, 0.5), (1, 1), (1, 1), (1, 0), (0, 0.5)),
        *((0, 0), (1, 1), (0, 0.5), (1, 1), (0, 0.5), (0, 0)),
    ]
    assert all("".join(syllable.text for syllable in word.syllables) == word.text for word in words)
    assert [syllable.text for word in words for syllable in word.syllables if syllable.stressed] == ["最"]
    lengths = [syllable.end_s - syllable.start_s for word in words for syllable in word.syllables]
    np.testing.assert_allclose(lengths, printed()["syllable_frames"] / 25)


@pytest.mark.parametrize(
    ("name", "value"), [("amp_sd", [1.0, -1.0, 1.0]), ("avg_mean", [0.0, np.nan, 0.0]), ("angle_range", [1.0, 2.0])]
)
def test_malformed_statistics_are_refused(name, value):
    rows = {row: [1.0, 1.0, 1.0] for row in printed()["rotation"]}
    with pytest.raises(SpecError, match=name):
        RotationStatistics(**{**rows, name: np.array(value)})
