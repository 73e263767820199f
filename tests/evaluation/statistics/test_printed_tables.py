import numpy as np
import pytest

from evaluation.errors import DataError
from evaluation.statistics.printed_tables import ACII, MTAP, citation, figures, rounding, table


@pytest.mark.parametrize(("name", "paper"), [("mtap2013_table8", MTAP), ("acii2007_table8", ACII)])
def test_tables_8_are_as_printed(case, name, paper):
    data, found = case(name)["data"], table(paper, 8).frame
    for side in ("input", "evaluated"):
        assert found[[f"{side}_{axis}" for axis in "PAD"]].to_numpy().tolist() == data[side]
    if "words" in data:
        assert found["word"].tolist() == data["words"]


def test_the_table_of_clusters_is_as_printed(case):
    counts = table(ACII, 4).frame.iloc[:, 1:-1].to_numpy()
    np.testing.assert_array_equal(counts, case("acii2007_table4")["data"]["table"])


def test_tables_of_predictions_are_as_printed():
    np.testing.assert_allclose(table(MTAP, 6).frame.iloc[:, 1:].sum(), [6.56, 4.68, 5.16, 5.63, 2.01])
    np.testing.assert_allclose(table(ACII, 7).frame.iloc[:, 1:].sum(), [4.59, 10.11, 7.93, 8.19])


def test_counts_are_as_printed():
    assert table(MTAP, 1).frame["words"].tolist() == [8, 50, 7, 17, 12]
    assert table(MTAP, 4).frame["peaks"].tolist() == [15, 26, 22, 31]


def test_what_is_not_kept_is_said():
    with pytest.raises(DataError, match="Table 9 of mtap_2013 is not kept; there are 1, 2"):
        table(MTAP, 9)
    for ask in (figures, citation):
        with pytest.raises(DataError, match="no paper 'nosuch'; there are mtap_2013, acii_2007"):
            ask("nosuch")
    assert "(2013)" in citation(MTAP)
    assert "(2007)" in citation(ACII)


def test_a_table_can_be_changed_without_changing_the_next():
    first = table(MTAP, 1).frame
    first.loc[0, "words"] = 99
    assert table(MTAP, 1).frame.loc[0, "words"] == 8


def test_by_how_much_a_printed_number_may_be_off():
    assert [rounding(text) for text in ("94", "8.5", "0.69", "-1.221")] == pytest.approx([0.5, 0.05, 0.005, 0.0005])
