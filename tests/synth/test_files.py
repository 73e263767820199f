import pytest

from synth.errors import SpecError
from synth.files import read_text, shown


def test_a_byte_order_mark_is_no_text(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbf\xe6\x9c\x80\r\n")
    assert read_text(path, "save it as UTF-8") == "最\r\n"


@pytest.mark.parametrize(("content", "line"), [(b"\xff", 1), (b"one\r\ntwo\xe9\nthree\xff", 2)])
def test_other_encodings_are_refused_with_the_line(tmp_path, content, line):
    path = tmp_path / "a.txt"
    path.write_bytes(content)
    with pytest.raises(SpecError) as caught:
        read_text(path, "save it as UTF-8")
    assert str(caught.value) == f"{path}, line {line}: is not UTF-8 text; save it as UTF-8."


def test_a_missing_file_is_the_systems_error(tmp_path):
    with pytest.raises(FileNotFoundError):
        read_text(tmp_path / "a.txt", "")


def test_what_is_shown_is_quoted_and_short():
    assert shown("a\nb") == r"'a\nb'"
    assert shown("x" * 24) == f"'{'x' * 24}'"
    assert shown("x" * 25) == f"'{'x' * 24}…'"
