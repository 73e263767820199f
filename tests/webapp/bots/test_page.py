"""What simulated raters read of a page."""

from webapp.bots import page

URL = "http://127.0.0.1:8000/s/faces/trial"
TRIAL = """<!doctype html><html><head><title>Clip</title><meta charset="utf-8"></head><body>
<form method="post" action="/language"><input type="hidden" name="csrf_token" value="a"></form>
<div class="clip" data-place="1"><video src="/clips/0a.mp4"></video></div>
<div class="clip" data-place="2"><img src="/clips/0b.png" alt=""></div>
<form method="post" action="/s/faces/trial/3">
<input type="hidden" name="csrf_token" value="b&amp;c"><input type="hidden" name="playback" value="">
<p class="prompt">Please  choose &ldquo;4&rdquo;.</p>
<fieldset id="questions"><legend>Questions</legend>
<fieldset class="item bipolar"><span class="pole pole-left"> Very
 happy</span><span class="pole pole-right">Sad</span>
<label><input type="radio" name="pad5.P" value="-1" required></label>
<label><input type="radio" name="pad5.P" value="0" required><b>0</b></label>
<label><input type="radio" name="pad5.P" value="1" required></label></fieldset>
<fieldset class="item has-problem"><input type="checkbox" name="own.kinds" value="2">
<input type="checkbox" name="own.kinds" value="5"></fieldset>
<fieldset class="item"><input type="number" name="own.mood" min="10" max="20" required></fieldset>
<div class="item"><textarea name="own.why" required>
</textarea></div>
<button>Save</button></fieldset></form></body></html>"""


def test_a_trial_page_offers_fields_clips_and_a_prompt() -> None:
    found = page.read(TRIAL, url=URL)
    form = found.form_to("/s/faces/trial/")
    assert form is not None
    assert form.action == "http://127.0.0.1:8000/s/faces/trial/3"
    assert form.hidden == {"csrf_token": "b&c", "playback": ""}
    assert found.prompt == "Please choose “4”."
    assert [(clip.place, clip.medium, clip.digest) for clip in found.clips] == [(1, "video", "0a"), (2, "image", "0b")]
    P, kinds, mood, why = form.fields.values()
    assert (P.name, P.kind, list(P.offered), P.required, P.left) == ("pad5.P", "radio", [-1, 0, 1], True, "Very happy")
    assert (kinds.kind, kinds.offered, kinds.required, kinds.problem) == ("checkbox", [2, 5], False, True)
    assert (mood.kind, mood.offered, mood.left) == ("range", range(10, 21), None)
    assert (why.kind, why.required) == ("text", True)
    assert not any(one.problem for one in (P, mood, why))


def test_pages_that_wait_say_for_what() -> None:
    again = page.read('<meta http-equiv="refresh" content="30"><h1>Wait\n a bit</h1>', url=URL)
    assert (again.reloads, again.progress, again.heading) == (True, None, "Wait a bit")
    clips = page.read(
        '<meta http-equiv="refresh" content="3"><progress class="wide-progress" max="4" value="1">', url=URL
    )
    assert clips.progress == ("1", "4")
    later = page.read('<h1>Later</h1><time datetime="2027-01-02T03:04:05Z">then</time>', url=URL)
    assert (later.reloads, later.opens) == (False, "2027-01-02T03:04:05Z")
    full = page.read('<h1>Full</h1><a href="/s/faces/">Again</a>', url=URL, status=409)
    assert full.link_to("/s/faces/") == "http://127.0.0.1:8000/s/faces/"
    assert full.link_to("/s/other/") is None
