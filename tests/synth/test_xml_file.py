import pytest

from synth.errors import SpecError
from synth.xml_file import LARGEST_BYTES, read_xml

BOMB = '<!DOCTYPE a [<!ENTITY x "ha"><!ENTITY y "&x;&x;&x;">]><a>&y;</a>'
FETCH = '<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/hostname">]><a>&x;</a>'


def read(tmp_path, content):
    path = tmp_path / "a.xml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_xml(path, "give XML")


def test_elements_know_their_lines_and_names(tmp_path):
    root = read(
        tmp_path, '<?xml version="1.0"?>\n<a xmlns="urn:a" xmlns:b="urn:b">\none<b:c b:d="1"\n e="2"/>two\n</a>'
    )
    (child,) = root.children
    assert (root.namespace, root.name, root.line) == ("urn:a", "a", 2)
    assert (child.namespace, child.name, child.line) == ("urn:b", "c", 3)
    assert child.attributes == {"{urn:b}d": "1", "e": "2"}
    assert root.content == ("\none", child, "two\n")
    assert root.text == "\nonetwo\n"
    assert root.called("urn:b", "c") == (child,)
    assert root.called("urn:a", "c") == ()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "line 1: is not well-formed XML"),
        ("<a>\n<b></a>", "line 2: is not well-formed XML"),
        ("<a>&nbsp;</a>", "is not well-formed XML"),
        ("<a/><a/>", "is not well-formed XML"),
        ("<a>\x01</a>", "is not well-formed XML"),
        (BOMB, "line 1: there is a document type declaration"),
        (FETCH, "there is a document type declaration"),
        ("\n<!DOCTYPE a><a/>", "line 2: there is a document type declaration"),
        ("<a>" * 40 + "</a>" * 40, "nested more than 32 deep"),
        ("<a/>".encode("utf-16"), "not UTF-8"),
        (b"<a>" + b" " * LARGEST_BYTES + b"</a>", "bytes, more than"),
        ('<a xmlns:b="urn:b"><c:d/></a>', "not well-formed XML"),
    ],
)
def test_what_is_malformed_or_dangerous_is_refused(tmp_path, content, says):
    with pytest.raises(SpecError, match=says) as caught:
        read(tmp_path, content)
    assert str(caught.value).startswith(str(tmp_path / "a.xml"))


def test_the_encoding_is_utf_8_whatever_the_declaration_says(tmp_path):
    assert read(tmp_path, '<?xml version="1.0" encoding="ISO-8859-1"?><a>é山</a>').text == "é山"
