import re
from collections.abc import Iterator

import pytest
from flask import Flask
from flask.testing import FlaskClient
from werkzeug.test import TestResponse

from evaluation import instruments
from webapp import create_app
from webapp.config import Settings
from webapp.db import Database
from webapp.services import experimenters

PASSWORD = "a long password"


@pytest.fixture
def app(settings: Settings, mini: str) -> Flask:
    return create_app(settings)


class Browser:
    """A client that fills in forms as a browser does: with the hidden fields that the page carries."""

    def __init__(self, client: FlaskClient) -> None:
        self.client = client
        self.page: TestResponse = client.get("/")

    @property
    def text(self) -> str:
        return self.page.get_data(as_text=True)

    def open(self, path: str, **options: object) -> TestResponse:
        self.page = self.client.get(path, follow_redirects=True, **options)
        return self.page

    def send(self, path: str, form: dict[str, str] | None = None) -> TestResponse:
        token = re.search(r'name="csrf_token" value="([^"]+)"', self.text)
        assert token is not None, self.text
        self.page = self.client.post(path, data={"csrf_token": token[1], **(form or {})}, follow_redirects=True)
        return self.page

    def enrol(self) -> None:
        self.open("/s/mini/")
        self.send("/s/mini/consent", {"consent": "yes"})
        self.open("/s/mini/trial")

    def log_in(self) -> None:
        self.open("/experimenter/login")
        assert self.send("/experimenter/login", {"name": "wu", "password": PASSWORD}).status_code == 200


@pytest.fixture
def browser(app: Flask) -> Iterator[Browser]:
    with app.test_client() as client:
        yield Browser(client)


@pytest.fixture
def experimenter(database: Database) -> None:
    with database.write() as session:
        experimenters.add(session, "wu", PASSWORD)


@pytest.fixture
def answers() -> dict[str, str]:
    """A complete form of a trial."""
    form = {f"pad12.{item.id}": "1" for item in instruments.get("pad12").items}
    return {**form, "mos5.mos": "4", "playback": '[["play", 10, 0], ["ended", 900, 0.6]]'}
