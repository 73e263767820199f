import re
import signal
import socket
import time
import urllib.request
from http.cookiejar import CookieJar
from pathlib import Path
from urllib.parse import urlencode

import pytest
from sqlalchemy import select

from evaluation import instruments
from serving import Server, padlab, processes_below, wait_until
from webapp.db import Database
from webapp.models import Clip, Response


class Person:
    """Someone with a browser: cookies are kept, forms are sent with their token."""

    def __init__(self, url: str) -> None:
        self.url = url
        self.text = ""
        self._opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))

    def open(self, path: str, form: dict[str, str] | None = None) -> str:
        data = None
        if form is not None:
            token = re.search(r'name="csrf_token" value="([^"]+)"', self.text)
            assert token is not None
            data = urlencode({"csrf_token": token[1], **form}).encode()
        with self._opener.open(self.url + path, data=data, timeout=30) as answer:
            self.text = answer.read().decode()
        return self.text


@pytest.mark.every_database
def test_an_acknowledged_answer_survives_the_death_of_the_server(
    mini: str, database: Database, environment: dict[str, str]
) -> None:
    form = {f"pad12.{item.id}": "2" for item in instruments.get("pad12").items} | {"mos5.mos": "5"}
    with Server(environment) as server:
        person = Person(server.url)
        person.open("/s/mini/")
        person.open("/s/mini/consent", {"consent": "yes"})
        person.open("/s/mini/trial")
        assert "Clip 2 of 4" in person.open("/s/mini/trial/1", form)
        family = processes_below(server.process_group)
        server.stop(signal.SIGKILL)
        wait_until(lambda: not any(Path(f"/proc/{process}").exists() for process in family))
        with database.read() as session:
            assert [response.instrument for response in session.scalars(select(Response))] == ["pad12", "mos5"]
        server.start()
        assert "Clip 2 of 4" in person.open("/s/mini/")


def test_a_port_in_use_gives_one_sentence(mini: str, environment: dict[str, str]) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = str(other.getsockname()[1])
        for command in ("serve", "demo"):
            done = padlab(command, "--port", port, environment=environment)
            assert done.returncode == 1
            assert re.fullmatch(rf"Error: padlab cannot listen on 127\.0\.0\.1, port {port} .*--port.*\n", done.stderr)


def test_stopping_while_clips_are_rendered_is_quick_and_leaves_nobody_behind(
    mini: str, database: Database, environment: dict[str, str], tmp_path: Path
) -> None:
    with Server({**environment, "PADLAB_MEDIA_URL": str(tmp_path / "empty")}) as server:
        # The store is another one, so all clips are lost and rendered again.
        wait_until(lambda: _states(database) != {"done"})
        group = server.process_group
        began = time.monotonic()
        server.stop(signal.SIGTERM)
        assert time.monotonic() - began < 25
    wait_until(lambda: not processes_below(group))
    wait_until(lambda: "rendering" not in _states(database))


def test_no_web_process_holds_a_connection_of_its_parent(mini: str, environment: dict[str, str]) -> None:
    with Server(environment) as server:
        links = list(Path(f"/proc/{server.process_group}/fd").iterdir())
        held = [str(link.readlink()) for link in links if link.is_symlink()]
    assert held
    assert not [name for name in held if "padlab.sqlite" in name]


def _states(database: Database) -> set[str]:
    with database.read() as session:
        return set(session.scalars(select(Clip.status)))
