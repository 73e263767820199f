// The trial page: the clip is watched once before the questions open, and what the player did goes along with them.
"use strict";

(() => {
  const clip = document.getElementById("clip");
  const play = document.getElementById("play");
  const hint = document.getElementById("hint");
  const form = document.getElementById("answers");
  const questions = document.getElementById("questions");
  const remaining = document.getElementById("remaining");
  const log = document.getElementById("playback");
  const MAX_EVENTS = 200;
  const events = [];

  const record = (kind) => {
    if (events.length < MAX_EVENTS) {
      events.push([kind, Math.round(performance.now()), Math.round(clip.currentTime * 1000) / 1000]);
    }
  };
  for (const kind of ["play", "pause", "ended", "seeked", "stalled", "waiting", "error"]) {
    clip.addEventListener(kind, () => record(kind));
  }

  // Without the browser's own controls nobody skips ahead; a page without scripts keeps them.
  clip.controls = false;
  play.hidden = false;
  hint.hidden = false;
  hint.textContent = hint.dataset.before;
  let watched = form.dataset.watched === "yes";
  const say = (text) => { hint.textContent = text; };
  const open = () => {
    questions.disabled = false;
    document.body.classList.add("watched");
    play.querySelector("[data-label]").textContent = hint.dataset.again;
    play.hidden = false;
    say(hint.dataset.after);
  };
  questions.disabled = !watched;
  if (watched) {
    open();
  }

  play.addEventListener("click", () => {
    clip.currentTime = 0;
    clip.play().catch(() => say(hint.dataset.error));
  });
  clip.addEventListener("playing", () => {
    play.hidden = true;
    if (!watched) {
      say(hint.dataset.during);
    }
  });
  clip.addEventListener("ended", () => {
    const first = !watched;
    watched = true;
    open();
    // The button that was pressed has changed its place: keyboards and screen readers go on with the questions.
    if (first) {
      questions.focus({ preventScroll: true });
    }
  });
  // A tab in the background may pause the clip before its end: offer the button again.
  clip.addEventListener("pause", () => { play.hidden = false; });
  clip.addEventListener("error", () => say(hint.dataset.error));

  const groups = [...new Set([...form.querySelectorAll("input[type=radio]")].map((input) => input.name))];
  const unanswered = () => groups.filter((name) => !form.querySelector(`input[name="${CSS.escape(name)}"]:checked`));
  const count = () => {
    const left = unanswered().length;
    const template = left === 1 ? remaining.dataset.one : remaining.dataset.many;
    remaining.textContent = left === 0 ? "" : template.replace("{n}", String(left));
  };
  form.addEventListener("change", (event) => {
    event.target.closest(".item")?.classList.remove("has-problem");
    count();
  });
  count();

  // The browser's own message on a hidden radio button is easily missed on a phone: mark and scroll to the item.
  form.noValidate = true;
  let sent = false;
  form.addEventListener("submit", (event) => {
    const left = unanswered();
    if (left.length > 0 || sent) {
      event.preventDefault();
      for (const name of left) {
        form.querySelector(`input[name="${CSS.escape(name)}"]`).closest(".item").classList.add("has-problem");
      }
      const missing = form.querySelector(".has-problem");
      missing?.scrollIntoView({ block: "center", behavior: "smooth" });
      missing?.querySelector("input").focus({ preventScroll: true });
      return;
    }
    sent = true;
    log.value = JSON.stringify(events);
  });
  // Coming back with the browser's history restores the page as it was left: it may be sent again.
  window.addEventListener("pageshow", () => { sent = false; });
  document.querySelector(".has-problem")?.scrollIntoView({ block: "center" });
})();
