import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect, sync_playwright

from serving import Server

CHROMIUM = ("chromium", "chromium-browser", "google-chrome")
# As root in a container there is no sandbox; the other flags keep the browser from calling home.
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--mute-audio",
)


# A page that is slow, because other tests run at the same time, is no fault.
expect.set_options(timeout=20_000)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    """The system's Chromium."""
    found = next((path for path in map(shutil.which, CHROMIUM) if path), None)
    assert found, "Chromium is missing: run `make setup` (or: apt-get install chromium)"
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=list(FLAGS))
        yield browser
        browser.close()


@pytest.fixture
def server(mini: str, environment: dict[str, str]) -> Iterator[Server]:
    with Server(environment) as running:
        yield running


@pytest.fixture(scope="session")
def screenshots(pytestconfig: pytest.Config) -> Path:
    """Where pictures of the pages are left, to be looked at."""
    folder = Path(os.environ.get("PADLAB_SCREENSHOTS") or pytestconfig.rootpath / "screenshots")
    folder.mkdir(parents=True, exist_ok=True)
    return folder
