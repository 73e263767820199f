"""What is told when simulated raters cannot even begin; tests/service has the rest."""

import re
from collections.abc import Callable

import pytest
from click.testing import Result

Run = Callable[..., Result]


def test_without_a_server_one_sentence_says_how_to_start_it(run: Run, fails: Callable[..., None]) -> None:
    # Nobody may listen on port 9 of this machine; the database is not needed either.
    done = run("bots", "demo", "--raters", "2", "--base-url", "http://127.0.0.1:9")
    fails(done, "Nothing answers at http://127.0.0.1:9", "`padlab serve`", "--base-url")
    assert done.stdout == ""


@pytest.mark.parametrize(
    "address", ["localhost", "ftp://127.0.0.1", "http://", "http://127.0.0.1:port", "127.0.0.1:80"]
)
def test_what_is_no_address_is_wrong_usage(run: Run, address: str) -> None:
    done = run("bots", "demo", "--raters", "2", "--base-url", address)
    assert done.exit_code == 2
    assert re.search(r"right\s+is\s+one\s+such\s+as", done.stderr)


@pytest.mark.parametrize("arguments", [("demo",), ("demo", "--raters", "0"), ("demo", "--raters", "1", "--seed", "-1")])
def test_raters_are_counted_and_seeds_not_negative(run: Run, arguments: tuple[str, ...]) -> None:
    assert run("bots", *arguments).exit_code == 2
