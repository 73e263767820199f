import csv
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.csv_file import read_csv
from synth.errors import SpecError


@pytest.fixture
def read(tmp_path: Path):
    def make(content: str | bytes, *required: str, expected: str = ""):
        path = tmp_path / "a.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_csv(path, required, expected=expected)

    return make


def test_columns_and_fields_have_no_blanks_around_them(read):
    header, (row,) = read("\ufeff b , a\r\n 1 ,two words\r\n", "a", "b")
    assert (header.line, header.columns) == (1, ("b", "a"))
    assert (row.line, row.text("a"), row.whole("b"), row.text("c")) == (2, "two words", 1, "")


def test_empty_lines_mean_nothing_but_count(read):
    header, rows = read("\n a,b\n\n,\n1,2\n \n3,4\n", "a")
    assert header.line == 2
    assert [(row.line, row.whole("a"), row.whole("b")) for row in rows] == [(5, 1, 2), (7, 3, 4)]


def test_quoted_fields_hold_commas_quotes_and_line_ends(read):
    _, rows = read('a,b\n"1, ""x""\n2",3\n4,5\n')
    assert [(row.line, row.text("a")) for row in rows] == [(3, '1, "x"\n2'), (4, "4")]


def test_one_column_may_lack_a_name_where_others_are_allowed(read):
    header, (row,) = read(",a\n0,1\n", "a")
    assert row.whole("a") == 1
    with pytest.raises(SpecError, match="line 1: column 1 has no name; the first line must name the columns a"):
        header.permit({"a"})


@pytest.mark.parametrize(
    ("content", "line", "message"),
    [
        ("", 1, "the file is empty; the first line must name the columns a,b."),
        ("\n , \n", 1, "the file is empty"),
        ("a\n1\n", 1, "there is no column b; the first line must name the columns a,b."),
        ("\nc\n1\n", 2, "there is no column a, b"),
        ("a,b, a\n1,2,3\n", 1, "the column 'a' comes twice"),
        ("a,b,,\n1,2,3,4\n", 1, "the column '' comes twice"),
        ("a,b\n", 1, "nothing follows the first line"),
        ("a,b\n1,2\n\n3\n", 4, "has 1 fields; there must be 2, as in the first line"),
        ("a,b\n1,2,3\n", 2, "has 3 fields"),
        ('a,b\n1,"2\n', 2, "is not CSV"),
        ('a,b\n1,"2"3\n', 2, "is not CSV"),
        (b"a,b\n1,\xff\n", 2, "is not UTF-8 text; save the file as CSV in UTF-8"),
    ],
)
def test_malformed_files_are_refused_with_the_line(read, content, line, message):
    with pytest.raises(SpecError) as caught:
        read(content, "a", "b")
    assert f"a.csv, line {line}: {message}" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_messages_tell_which_columns_are_expected(read):
    with pytest.raises(SpecError, match="no column a; the first line must name the columns a and perhaps b"):
        read("b\n1\n", "a", expected="a and perhaps b")
    header, _ = read("a,c\n1,2\n", "a", expected="a and perhaps b")
    header.permit({"a", "b", "c"})
    with pytest.raises(SpecError, match="the column 'c' is unknown; the first line must name the columns a and"):
        header.permit({"a", "b"})
    with pytest.raises(SpecError, match="there is no column b, d; "):
        header.require(["a", "b", "d"])


def test_a_name_must_not_be_empty(read):
    _, (row,) = read("a,b\n x ,\n")
    assert row.name("a") == "x"
    with pytest.raises(SpecError, match="line 2, column b: the field is empty"):
        row.name("b")


@pytest.mark.parametrize(
    ("text", "number"), [("0", 0), ("-3.5", -3.5), ("+.5", 0.5), ("7.", 7), ("1e1", 10), ("2E-01", 0.2), ("-10", -10)]
)
def test_decimal_numbers(read, text, number):
    _, (row,) = read(f"a,b\n{text},\n")
    assert row.number("a", -10.0, 10.0) == number


@pytest.mark.parametrize(
    "text", ["x", "", "nan", "inf", "1_0", "0x1", "1e", "1 0", ".", "١", "1e400", "10.1", "-11", "9" * 5000]
)
def test_what_is_no_number_in_the_range(read, text):
    _, (row,) = read(f"a,b\n{text},1\n")
    with pytest.raises(SpecError, match=r"line 2, column a: the value is '.*it must be a number from -10 to 10"):
        row.number("a", -10.0, 10.0)
    with pytest.raises(SpecError) as caught:
        row.number("a", -10.0, 10.0)
    assert len(str(caught.value).partition("column")[2]) < 120


@pytest.mark.parametrize("text", ["-1", "+1", "1.0", "1e1", "", "1_0", "9" * 10])
def test_what_is_no_whole_number(read, text):
    _, (row,) = read(f"a,b\n{text},1\n")
    with pytest.raises(SpecError, match=r"line 2, column a: the value is '.*it must be a whole number, 0 or more"):
        row.whole("a")


def test_faults_of_rows_and_fields(read):
    _, (row,) = read("a,b\n1,2\n")
    assert re.search(r"a\.csv, line 2: it is late; go to bed\.$", str(row.fault("it is late", "go to bed")))
    assert "a.csv, line 2, column b: wrong; right." in str(row.fault("wrong", "right", column="b"))


fields = st.text(st.characters(codec="utf-8", exclude_characters="\x00"), max_size=4).map(str.strip)


@settings(max_examples=100, deadline=None)
@given(table=st.lists(st.tuples(fields, fields, st.just("x")), min_size=1, max_size=4))
def test_what_a_writer_writes_is_read(tmp_path_factory, table):
    path = tmp_path_factory.mktemp("csv") / "a.csv"
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([("a", "b", "c"), *table])
    _, rows = read_csv(path, ("a", "b"))
    assert [(row.text("a"), row.text("b"), row.text("c")) for row in rows] == table


@settings(max_examples=200, deadline=None)
@given(content=st.one_of(st.binary(max_size=40), st.text('a,b"\n\r 1', max_size=40).map(str.encode)))
def test_anything_is_read_or_refused_with_a_line(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("csv") / "a.csv"
    path.write_bytes(content)
    try:
        header, rows = read_csv(path, ())
    except SpecError as error:
        assert "a.csv, line " in str(error)
    else:
        assert all(set(row.fields) == set(header.columns) for row in rows)
