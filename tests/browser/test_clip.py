"""A clip of `padlab say` as a browser plays it."""

import json
import time
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from serving import padlab

pytestmark = pytest.mark.browser
PAGE = '<!doctype html><title>A clip</title><video id="clip" src="a.mp4" onclick="this.play()"></video>'
STATE = """() => {
    const clip = document.getElementById("clip");
    return {
        error: clip.error && clip.error.message, ended: clip.ended, at: clip.currentTime, seconds: clip.duration,
        size: [clip.videoWidth, clip.videoHeight], ready: clip.readyState >= 3, sound: clip.webkitAudioDecodedByteCount,
    };
}"""


@pytest.mark.parametrize("text", ["Welcome to Hong Kong!", "歡迎！"])
def test_a_clip_plays_with_its_sound(chromium: Browser, environment: dict[str, str], tmp_path: Path, text: str) -> None:
    files = ("--out", str(tmp_path / "a.mp4"), "--lineage", str(tmp_path / "a.json"))
    done = padlab("say", text, "--size", "160x128", *files, environment=environment)
    assert done.returncode == 0, done.stderr
    (tmp_path / "index.html").write_text(PAGE, encoding="utf-8")
    page = chromium.new_page()
    page.goto((tmp_path / "index.html").as_uri())
    end = time.monotonic() + 20
    while not (state := page.evaluate(STATE))["ready"]:
        assert state["error"] is None
        assert time.monotonic() < end, state
        page.wait_for_timeout(20)
    assert state["size"] == [160, 128]
    made = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert state["seconds"] == pytest.approx(made["duration_s"], abs=0.05)

    page.locator("#clip").click()
    times = [0.0]
    while not (state := page.evaluate(STATE))["ended"]:
        assert state["error"] is None
        assert time.monotonic() < end, state
        times.append(state["at"])
        page.wait_for_timeout(50)
    assert len(set(times)) > 10
    assert times == sorted(times)
    assert state["sound"] > 0
    page.close()
