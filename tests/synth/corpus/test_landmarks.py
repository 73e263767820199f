import csv
import json

import numpy as np
import pytest

from synth.corpus.landmarks import MTAP_NEEDED, MTAP_POINTS, NEEDED, POINT_SETS, read_set, write_set
from synth.errors import SpecError
from synth.expression.measurement import ACII_POINTS, measurable_faps
from synth.expression.pep import ACII, MTAP


@pytest.fixture
def folder(tmp_path, like_mtap):
    """Three expressions of two subjects on the eighteen points: s1 has its own neutral face, s2 and s3 share one."""
    landmarks = like_mtap[0].landmarks
    rows = [landmarks.points.index(name) for name in ACII_POINTS]
    header = ["sample", "subject", "emotion", "state", *(f"{name}.{axis}" for name in ACII_POINTS for axis in "xy")]
    faces = [
        ("s1", "p1", "happy", "neutral", landmarks.neutral[0]),
        ("s1", "p1", "happy", "apex", landmarks.apex[0]),
        ("n2", "p2", "", "neutral", landmarks.neutral[1]),
        ("s2", "p2", "", "apex", landmarks.apex[1]),
        ("s3", "p2", "sad", "apex", landmarks.apex[1] + 1.0),
        ("n3", "p2", "", "neutral", landmarks.neutral[1] + 2.0),
    ]
    with (tmp_path / "landmarks.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        for *ids, places in faces:
            writer.writerow([*ids, *(places[rows] * (1, -1)).ravel()])
    return tmp_path


def change(path, *, line, column, value):
    """Put another value into a cell; line 1 is the header."""
    with path.open(newline="") as file:
        table = list(csv.reader(file))
    table[line - 1][table[0].index(column)] = value
    with path.open("w", newline="") as file:
        csv.writer(file).writerows(table)


def rate(folder, text):
    (folder / "pad.csv").write_text(text)


def test_the_papers_numbers_of_points():
    assert len(MTAP_POINTS) == len(set(MTAP_POINTS)) == 59
    assert len(ACII_POINTS) == len(set(ACII_POINTS)) == 18
    assert set(ACII_POINTS) | set(MTAP_NEEDED) <= set(MTAP_POINTS)
    assert len(measurable_faps(MTAP_NEEDED)) == 38
    assert POINT_SETS[MTAP] == MTAP_POINTS
    assert NEEDED[ACII] == POINT_SETS[ACII] == ACII_POINTS


def test_a_set_without_pad(folder, like_mtap):
    result = read_set(folder)
    assert result.scheme == ACII
    assert result.name == folder.name
    assert result.samples == ("s1", "s2", "s3")
    assert result.subjects == ("p1", "p2", "p2")
    assert result.emotions == ("happy", "", "sad")
    assert result.pad is None
    assert not result.pseudo
    rows = [like_mtap[0].landmarks.points.index(name) for name in ACII_POINTS]
    np.testing.assert_allclose(result.landmarks.apex[0], like_mtap[0].landmarks.apex[0, rows])
    # Of two neutral faces of the subject, the mean.
    np.testing.assert_allclose(result.landmarks.neutral[1], like_mtap[0].landmarks.neutral[1, rows] + 1.0)
    # A shift of the picture is no expression.
    np.testing.assert_allclose(result.faps[1], result.faps[2], atol=1e-6)


def test_rounds_first_then_raters(folder):
    rate(
        folder,
        "sample,rater,round,P,A,D\n"
        "s1,r1,1,0.2,0,0\ns1,r1,2,0.4,0,0\ns1,r2,1,0.9,0.1,-1\n"
        "s2,r1,1,-1,0,0\n\ns3,r1,1,1,0,0\n",
    )
    np.testing.assert_allclose(read_set(folder).pad, [[0.6, 0.05, -0.5], [-1, 0, 0], [1, 0, 0]])


def test_without_rounds(folder):
    rate(folder, "sample,rater,P,A,D\ns1,r,0.5,0,0\ns2,r,0,0.5,0\ns3,r,0,0,0.5\n")
    np.testing.assert_allclose(read_set(folder).pad, np.eye(3) / 2)


def test_what_the_set_says_of_itself(folder):
    before = read_set(folder)
    about = {"name": "n", "note": "m", "pseudo": True, "eyeball": 0.25, "scheme": "acii2007"}
    (folder / "set.json").write_text(json.dumps(about))
    result = read_set(folder)
    assert (result.name, result.note, result.pseudo, result.eyeball) == ("n", "m", True, 0.25)
    assert np.abs(result.faps[:, 22:26]).sum() < np.abs(before.faps[:, 22:26]).sum()
    np.testing.assert_array_equal(result.faps[:, 30:38], before.faps[:, 30:38])


def test_y_may_go_up(folder):
    before = read_set(folder)
    with (folder / "landmarks.csv").open(newline="") as file:
        table = list(csv.reader(file))
    for row in table[1:]:
        for k, name in enumerate(table[0]):
            if name.endswith(".y"):
                row[k] = str(-float(row[k]))
    with (folder / "landmarks.csv").open("w", newline="") as file:
        csv.writer(file).writerows(table)
    (folder / "set.json").write_text('{"y_up": true}')
    assert read_set(folder).digest == before.digest


def test_depth_and_byte_order_marks_do_no_harm(folder):
    before = read_set(folder)
    text = (folder / "landmarks.csv").read_text()
    lines = [f"{line},{'4.1.z' if k == 0 else ''}" for k, line in enumerate(text.splitlines())]
    (folder / "landmarks.csv").write_bytes(b"\xef\xbb\xbf" + "\r\n".join(lines).encode())
    assert read_set(folder).digest == before.digest


@pytest.mark.parametrize("kind", ["like_mtap", "like_acii"])
def test_what_is_written_is_read_back(kind, tmp_path, request):
    expressions, pad = request.getfixturevalue(kind)
    for given in (expressions.with_pad(pad), expressions):
        write_set(given, tmp_path)
        result = read_set(tmp_path)
        assert result.digest == given.digest
        assert result.scheme == given.scheme
        assert (result.name, result.note, result.pseudo) == (given.name, given.note, True)
        assert (result.samples, result.subjects, result.emotions) == (given.samples, given.subjects, given.emotions)
        assert result.displays == given.displays
        np.testing.assert_array_equal(result.faps, given.faps)
        np.testing.assert_array_equal(result.acii_peps, given.acii_peps)
        assert (result.pad is None) == (given.pad is None)
    assert read_set(tmp_path, scheme=ACII).scheme == ACII


@pytest.mark.parametrize(
    ("line", "column", "value", "message"),
    [
        (3, "4.1.x", "wide", "line 3, column 4.1.x: the value is 'wide'; it must be a number"),
        (3, "4.1.x", "", "line 3, column 4.1.x: the value is ''"),
        (3, "4.1.x", "nan", "line 3, column 4.1.x: the value is 'nan'"),
        (3, "4.1.x", "1e400", "line 3, column 4.1.x: the value is '1e400'"),
        (3, "4.1.x", "1e9", "line 3, column 4.1.x: the value is '1e9'; it must be a number from -1e+06 to 1e+06"),
        (4, "sample", " ", "line 4, column sample: the field is empty"),
        (5, "state", "onset", "line 5, column state: the state is 'onset'; it must be neutral or apex"),
        (3, "state", "neutral", "line 3, column sample: s1 has a second neutral face"),
        (3, "subject", "p2", "line 3, column subject: p2 shows s1, too; line 2 says"),
        (5, "subject", "p9", "line 5, column state: s2 has no neutral face, nor has its subject p9; add"),
        (1, "4.1.x", "forehead", "line 1: the column 'forehead' is unknown; the first line must name the columns"),
        (1, "4.1.x", "4.1.y", "line 1: the column '4.1.y' comes twice"),
        (1, "4.1.x", "", "line 1: column 5 has no name"),
        (1, "4.1.x", "4.1.z", "line 1: there is no column 4.1.x; the first line must name"),
        (1, "state", "4.1.z", "line 1: there is no column state; the first line must name"),
    ],
)
def test_faults_are_told_by_line_and_column(folder, line, column, value, message):
    change(folder / "landmarks.csv", line=line, column=column, value=value)
    with pytest.raises(SpecError) as caught:
        read_set(folder)
    assert message in str(caught.value)
    assert str(folder / "landmarks.csv") in str(caught.value)


def test_missing_points_are_named(folder):
    text = (folder / "landmarks.csv").read_text()
    (folder / "landmarks.csv").write_text(text.replace("9.15.", "9.14."))
    with pytest.raises(SpecError, match=r"the points 9\.15 are missing, which acii2007 needs"):
        read_set(folder)
    (folder / "landmarks.csv").write_text(text)
    with pytest.raises(SpecError, match=r"the points 2\.2, .* are missing, which mtap2013 needs"):
        read_set(folder, scheme=MTAP)
    with pytest.raises(SpecError, match="no scheme"):
        read_set(folder, scheme="other")


def test_mirrored_faces_are_refused(folder):
    with (folder / "landmarks.csv").open(newline="") as file:
        table = list(csv.reader(file))
    for row in table[1:]:
        for k, name in enumerate(table[0]):
            if name.endswith(".x"):
                row[k] = str(-float(row[k]))
    with (folder / "landmarks.csv").open("w", newline="") as file:
        csv.writer(file).writerows(table)
    with pytest.raises(SpecError, match=r"landmarks\.csv.*must be greater than 0"):
        read_set(folder)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "line 1: the file is empty"),
        (b"\xff\xfe", "is not UTF-8"),
        (b'sample,"subject\n', "line 1: is not CSV"),
        (b"sample\nsubject,", "there is no column subject, emotion, state"),
    ],
)
def test_files_that_are_no_tables(folder, content, message):
    (folder / "landmarks.csv").write_bytes(content)
    with pytest.raises(SpecError, match=message):
        read_set(folder)


def test_rows_of_another_length_and_no_rows(folder):
    text = (folder / "landmarks.csv").read_text()
    (folder / "landmarks.csv").write_text(text + "s9,p1\n")
    with pytest.raises(SpecError, match="line 8: has 2 fields; there must be 40"):
        read_set(folder)
    (folder / "landmarks.csv").write_text(text.splitlines()[0] + "\n")
    with pytest.raises(SpecError, match="line 1: nothing follows"):
        read_set(folder)
    (folder / "landmarks.csv").write_text("\n".join(text.splitlines()[:2]) + "\n")
    with pytest.raises(SpecError, match="no expressive face"):
        read_set(folder)


def test_a_missing_file_is_the_systems_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_set(tmp_path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sample,rater,P,A\n", "line 1: there is no column D; the first line must name the columns sample,rater,P,A,D"),
        ("sample,rater,P,A,D,X\ns1,r,0,0,0,0\n", "line 1: the column 'X' is unknown"),
        ("sample,rater,P,A,D\ns1,r,0,0,1.5\n", "line 2, column D: the value is '1.5'; it must be a number from -1"),
        ("sample,rater,P,A,D\ns1,r,0,,0\n", "line 2, column A: the value is ''"),
        ("sample,rater,P,A,D\ns7,r,0,0,0\n", "line 2, column sample: there is no sample s7"),
        ("sample,rater,P,A,D\ns1,,0,0,0\n", "line 2, column rater: the field is empty"),
        ("sample,rater,P,A,D\ns1,r,0,0,0\ns1,r,0,0,0\n", "line 3, column rater: r rates s1 again, as in line 2"),
        ("sample,rater,P,A,D\ns1,r,0,0,0\ns2,r,0,0,0\n", "the sample s3 has no rating"),
    ],
)
def test_faults_of_ratings(folder, text, message):
    rate(folder, text)
    with pytest.raises(SpecError) as caught:
        read_set(folder)
    assert message in str(caught.value)
    assert "pad.csv" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "is no JSON"),
        ("[]", "must be an object"),
        ('{"author": "x"}', "no key 'author'"),
        ('{"pseudo": 1}', "pseudo is 1"),
        ('{"eyeball": true}', "eyeball is True"),
        ('{"scheme": "other"}', "no scheme 'other'"),
        ('{"eyeball": 3}', "eyeball"),
    ],
)
def test_faults_of_the_description(folder, text, message):
    (folder / "set.json").write_text(text)
    with pytest.raises(SpecError, match=message):
        read_set(folder)
