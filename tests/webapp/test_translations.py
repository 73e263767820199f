"""Every text of the pages exists in Chinese, with the same placeholders."""

import re
from pathlib import Path

import pytest
from babel.messages.catalog import Message
from babel.messages.extract import extract_from_dir
from babel.messages.pofile import read_po

METHODS = [("**.py", "python"), ("templates/**.html", "jinja2")]
KEYWORDS = {"_": None, "gettext": None, "lazy_gettext": None, "ngettext": (1, 2)}


@pytest.fixture(scope="module")
def root() -> Path:
    return Path(__file__).resolve().parents[2]


def test_no_text_is_left_untranslated(root: Path) -> None:
    with (root / "webapp" / "translations" / "zh_Hans" / "LC_MESSAGES" / "messages.po").open("rb") as file:
        catalogue = read_po(file, locale="zh_Hans")
    found = {message for _, _, message, _, _ in extract_from_dir(root / "webapp", METHODS, keywords=KEYWORDS)}
    assert len(found) > 60
    for message in found:
        key = message[0] if isinstance(message, tuple) else message
        translated = catalogue.get(key)
        assert translated is not None, f"not in the catalogue: {key}"
        assert translated.string, f"no translation: {key}"
        assert all(translated.string), f"no translation: {key}"
        _same_placeholders(translated)


def _same_placeholders(message: Message) -> None:
    source = message.id[-1] if isinstance(message.id, tuple) else message.id
    for text in message.string if isinstance(message.string, tuple) else (message.string,):
        assert sorted(re.findall(r"%\(\w+\)s|\{\w+\}", text)) == sorted(re.findall(r"%\(\w+\)s|\{\w+\}", source))
