import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from synth.errors import SpecError, VideoError
from synth.fap.file import MAX_VALUE, read_fap, write_fap
from synth.fap.table import FAP_COUNT, column

whole = st.integers(-int(MAX_VALUE), int(MAX_VALUE)).map(float)
real = st.floats(-MAX_VALUE, MAX_VALUE)


def sequences(elements):
    shapes = array_shapes(min_dims=1, max_dims=1, max_side=4).map(lambda shape: (*shape, FAP_COUNT - 2))
    return shapes.flatmap(lambda shape: arrays(np.float64, shape, elements=elements, fill=st.just(0.0))).map(
        lambda tail: np.hstack([np.zeros((len(tail), 2)), tail])
    )


def text(*frames: dict[int, str], header: str | None = None, numbers: list[str] | None = None) -> str:
    """A file of frames that give texts for some FAPs."""
    lines = [header if header is not None else f"2.1 test 25 {len(frames)}"]
    for k, frame in enumerate(frames):
        lines.append(" ".join("1" if fap in frame else "0" for fap in range(1, FAP_COUNT + 1)))
        lines.append(" ".join([numbers[k] if numbers else str(k), *(frame[fap] for fap in sorted(frame))]))
    return "\n".join(lines) + "\n"


@pytest.fixture
def read(tmp_path: Path):
    def make(content: str | bytes):
        path = tmp_path / "given.fap"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_fap(path)

    return make


@settings(max_examples=60, deadline=None)
@given(values=st.one_of(sequences(whole), sequences(real)), fps=st.integers(1, 240))
def test_what_is_written_is_read(tmp_path_factory, values, fps):
    path = tmp_path_factory.mktemp("fap") / "a.fap"
    write_fap(path, values, fps=fps, name="sample")
    back = read_fap(path)
    assert (back.name, back.fps, back.ignored) == ("sample", fps, ())
    np.testing.assert_array_equal(back.values, values)


def test_whole_numbers_are_written_as_such(tmp_path):
    values = np.zeros((2, FAP_COUNT))
    values[1, column(3)], values[1, column(48)] = 120.0, -0.25
    write_fap(tmp_path / "a.fap", values, fps=25, name="nod")
    lines = (tmp_path / "a.fap").read_text().splitlines()
    assert lines[0] == "2.1 nod 25 2"
    assert lines[1].split() == ["1" if fap in {3, 48} else "0" for fap in range(1, FAP_COUNT + 1)]
    assert lines[2::2] == ["0 0 0", "1 120 -0.25"]
    assert [file.name for file in tmp_path.iterdir()] == ["a.fap"]


def test_comments_line_ends_and_blanks_mean_nothing(read):
    plain = text({3: "120", 19: "-3.5"}, {}, {19: "1e2"})
    odd = "# a comment\r\n\r\n" + plain.replace("\n", " \t\r\n  # ünd another\r\n").removesuffix("\r\n")
    one, other = read(plain), read("\ufeff" + odd)
    np.testing.assert_array_equal(one.values, other.values)
    assert one.values[:, [column(3), column(19)]].tolist() == [[120, -3.5], [0, 0], [0, 100]]
    assert one.masks.sum(axis=1).tolist() == [2, 0, 1]


@pytest.mark.parametrize(("version", "factor"), [("2.0", 1 / 20), ("2.1", 1.0), ("2.2", 1.0)])
def test_version_2_0_counts_twentieths(read, version, factor):
    assert read(text({3: "200"}, header=f"{version} a 25 1")).values[0, column(3)] == 200 * factor


@pytest.mark.parametrize(
    ("given_fap", "other", "follows"),
    [
        *[(inner, inner + 47, True) for inner in range(4, 14)],
        *[(inner + 47, inner, inner < 12) for inner in range(4, 14)],
    ],
)
def test_lips_that_are_left_out_follow_their_twins(read, given_fap, other, follows):
    values = read(text({given_fap: "80"}, {given_fap: "80", other: "0"})).values
    assert values[:, column(other)].tolist() == [80.0 if follows else 0.0, 0.0]


def test_visemes_and_expressions_are_ignored_and_not_written(read, tmp_path):
    found = read(text({1: "7", 3: "10"}, {2: "3"}))
    assert found.ignored == (1, 2)
    assert found.values[:, :3].tolist() == [[0, 0, 10], [0, 0, 0]]
    values = np.zeros((1, FAP_COUNT))
    values[0, column(2)] = 1.0
    with pytest.raises(SpecError, match="FAP 1 and 2"):
        write_fap(tmp_path / "a.fap", values, fps=25, name="a")


@pytest.mark.parametrize(
    ("content", "line", "message"),
    [
        ("", 1, "empty"),
        ("# only a comment\n", 1, "empty"),
        (text({}, header="2.1 25 1"), 1, "3 fields"),
        (text({}, header="2.1 my smile 25 1"), 1, "5 fields"),
        (text({}, header="1.0 a 25 1"), 1, "version is '1.0'"),
        (text({}, header="2.1 a 0 1"), 1, "frame rate is '0'"),
        (text({}, header="2.1 a 25.0 1"), 1, "frame rate is '25.0'"),
        (text({}, header="2.1 a 25 0"), 1, "number of frames is '0'"),
        (text({}, header="2.1 a 25 -1"), 1, "number of frames is '-1'"),
        (text({}, header="2.1 a 25 1_0"), 1, "number of frames is '1_0'"),
        (text({}, header="2.1 a 25 " + "9" * 5000), 1, "whole number"),
        (text({}, {}, header="2.1 a 25 999999999"), 5, "ends after 2 of 999999999"),
        (text({}, {}, header="2.1 a 25 3"), 5, "ends after 2 of 3"),
        (text({}, {}, header="2.1 a 25 1"), 4, "goes on after frame 0; by the first line there are 1"),
        (text({}) + "# fine\n7\n", 5, "goes on"),
        (text({}).replace("0 0 0", "0 0", 1), 2, "67 masks"),
        (text({}).replace("0 0 0", "0 0 0 0", 1), 2, "69 masks"),
        (text({3: "1"}).replace(" 1 ", " 2 ", 1), 2, "mask of frame 0 is '2'"),
        ("2.1 a 25 1\n" + "0 " * 68, 2, "masks but no values"),
        (text({3: "1"}, {3: "1"}, numbers=["0", "2"]), 5, "number is '2'; it must be 1"),
        (text({3: "1"}, numbers=["-0"]), 3, "it must be 0"),
        (text({3: "1 2"}), 3, "has 2 values; its masks ask for 1 after"),
        (text({1: "1 2 3 0"}), 3, "has 4 values; its masks ask for 1 .one for each of FAP 1 and 2"),
        (text({3: ""}), 3, "has 0 values"),
        *[
            (text({3: bad}), 3, "is no number")
            for bad in ("x", "nan", "inf", "1_0", "1,5", "0x1", "1e", "١", "1\u00a0")
        ],
        *[(text({3: bad}), 3, "too large") for bad in ("1e999", "1000001", "-1e7", "9" * 400)],
        (text({}).encode("utf-16"), 1, "not UTF-8"),
        (b"2.1 a 25 1\n\xff\xfe\x00\n", 2, "not UTF-8"),
        (b"\x00\x01\x02 \x03 \x04 \x05", 1, "version"),
        (b"2.1 \x07 25 1\n", 1, "control characters"),
    ],
)
def test_malformed_files_are_refused_with_the_line(read, content, line, message):
    with pytest.raises(SpecError, match=message) as caught:
        read(content)
    assert f"given.fap, line {line}: " in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


SOUND = text({3: "120", 5: "-4"}, {}, {48: "3.5", 62: "0"}).encode()


@settings(max_examples=400, deadline=None)
@given(data=st.data())
def test_any_change_is_read_or_refused_with_a_line(tmp_path_factory, data):
    start = data.draw(st.integers(0, len(SOUND)))
    end = data.draw(st.integers(start, min(len(SOUND), start + 5)))
    fragments = st.sampled_from([b"\n", b"\r\n", b" ", b"0", b"1", b"-", b"e9", b"nan", b"#", b"\x00", b"\xe2\x80\xa8"])
    content = SOUND[:start] + data.draw(st.one_of(st.binary(max_size=4), fragments)) + SOUND[end:]
    path = tmp_path_factory.mktemp("fap") / "changed.fap"
    path.write_bytes(content)
    try:
        found = read_fap(path)
    except SpecError as error:
        assert "changed.fap, line " in str(error)
    else:
        assert found.values.shape[1] == FAP_COUNT
        assert np.isfinite(found.values).all()


@settings(max_examples=100, deadline=None)
@given(content=st.binary(max_size=200))
def test_garbage_is_refused(tmp_path_factory, content):
    path = tmp_path_factory.mktemp("fap") / "garbage.fap"
    path.write_bytes(content)
    with pytest.raises(SpecError, match=r"garbage\.fap, line "):
        read_fap(path)


def test_a_minute_is_read_in_well_under_a_second(tmp_path):
    values = np.random.default_rng(1).uniform(-500, 500, (1500, FAP_COUNT))
    values[:, :2] = 0.0
    write_fap(tmp_path / "long.fap", values, fps=25, name="long")
    start = time.perf_counter()
    read_fap(tmp_path / "long.fap")
    assert time.perf_counter() - start < 1.0


@pytest.mark.parametrize(
    ("values", "options", "message"),
    [
        (np.zeros((0, FAP_COUNT)), {}, "no frames"),
        (np.zeros((2, 66)), {}, "shape"),
        (np.full((1, FAP_COUNT), np.nan), {}, "finite"),
        (np.eye(1, FAP_COUNT, 2) * 1e7, {}, "FAP 3 in frame 0"),
        (np.zeros((1, FAP_COUNT)), {"fps": 0}, "fps is 0"),
        (np.zeros((1, FAP_COUNT)), {"fps": 25.0}, "whole number"),
        (np.zeros((1, FAP_COUNT)), {"name": "two words"}, "one word"),
        (np.zeros((1, FAP_COUNT)), {"name": ""}, "one word"),
    ],
)
def test_what_cannot_be_written_is_refused(tmp_path, values, options, message):
    with pytest.raises(SpecError, match=message):
        write_fap(tmp_path / "a.fap", values, **{"fps": 25, "name": "a", **options})
    assert list(tmp_path.iterdir()) == []


def test_a_failure_leaves_nothing_behind(tmp_path):
    with pytest.raises(VideoError, match="missing"):
        write_fap(tmp_path / "missing" / "a.fap", np.zeros((1, FAP_COUNT)), fps=25, name="a")
    with pytest.raises(FileNotFoundError):
        read_fap(tmp_path / "none.fap")
