// The clips of a trial: each is played to its end before the questions open, and what the players did goes along.
"use strict";

(() => {
  const form = document.getElementById("answers");
  const questions = document.getElementById("questions");
  const hint = document.getElementById("hint");
  const log = document.getElementById("playback");
  // The server keeps 500 events; the last word of each clip must find room among them.
  const MAX_EVENTS = 450;
  const AS_THEY_ARE = ["play", "playing", "pause", "ended", "stalled", "waiting", "error"];

  // A page that was sent and came back brings its log along: time goes on where that ended.
  const parsed = (text) => {
    try {
      const found = JSON.parse(text || "[]");
      return Array.isArray(found) ? found : [];
    } catch {
      return [];
    }
  };
  const events = parsed(log.value);
  const earlier = events.reduce((latest, event) => Math.max(latest, Number(event[1]) || 0), 0);
  const pageTime = () => earlier + Math.round(performance.now());
  const rounded = (seconds) => Math.round((Number.isFinite(seconds) ? seconds : 0) * 1000) / 1000;

  class Player {
    constructor(box) {
      this.box = box;
      this.place = Number(box.dataset.place);
      this.media = box.querySelector("video, audio");
      this.button = box.querySelector("[data-play]");
      this.label = box.querySelector("[data-label]");
      this.bar = box.querySelector(".clip-progress");
      this.seen = form.dataset.watched === "yes";
      // Where the clip was before a jump is only known from before the jump.
      this.position = 0;
    }

    event(kind, value = null, position = this.media.currentTime) {
      return [kind, pageTime(), rounded(position), value, this.place];
    }

    record(...event) {
      if (events.length < MAX_EVENTS) {
        events.push(this.event(...event));
      }
    }

    dropped() {
      const quality = this.media.getVideoPlaybackQuality?.();
      return quality ? quality.droppedVideoFrames : null;
    }

    recordFrames() {
      const dropped = this.dropped();
      if (dropped !== null) {
        this.record("frames", dropped);
      }
    }

    // What is only known when the form is sent: how far a clip that still plays has come, and its dropped frames.
    closing() {
      const last = this.media.paused ? [] : [this.event("pause")];
      const dropped = this.dropped();
      return dropped === null ? last : [...last, this.event("frames", dropped)];
    }

    listen() {
      const { media } = this;
      for (const kind of AS_THEY_ARE) {
        media.addEventListener(kind, () => this.record(kind));
      }
      for (const kind of ["pause", "ended"]) {
        media.addEventListener(kind, () => this.recordFrames());
      }
      for (const kind of ["timeupdate", "pause", "ended", "seeked"]) {
        media.addEventListener(kind, () => { this.position = media.currentTime; });
      }
      media.addEventListener("seeking", () => this.record("seeking", null, this.position));
      media.addEventListener("seeked", () => this.record("seeked"));
      media.addEventListener("ratechange", () => this.record("ratechange", media.playbackRate));
      const duration = () => {
        if (Number.isFinite(media.duration)) {
          this.record("duration", rounded(media.duration));
        }
      };
      if (media.readyState >= HTMLMediaElement.HAVE_METADATA) {
        duration();
      }
      media.addEventListener("durationchange", duration);
    }

    show() {
      const { media } = this;
      // Without the browser's own controls nobody skips ahead; a page without scripts keeps them.
      media.controls = false;
      this.button.hidden = false;
      this.bar.hidden = false;
      media.addEventListener("timeupdate", () => { this.bar.value = media.currentTime / (media.duration || 1); });
      media.addEventListener("playing", () => {
        this.button.hidden = true;
        this.box.classList.add("is-playing");
      });
      for (const kind of ["pause", "ended"]) {
        media.addEventListener(kind, () => {
          this.button.hidden = false;
          this.box.classList.remove("is-playing");
        });
      }
      media.addEventListener("error", () => say("error"));
      if (media.error) {
        say("error");
      }
      this.mark();
    }

    mark() {
      this.box.classList.toggle("is-seen", this.seen);
      if (this.seen) {
        this.label.textContent = this.label.dataset.again;
      }
    }

    play() {
      // Whoever plays a clip again begins at its start; a clip that was interrupted goes on.
      if (this.seen && this.media.currentTime > 0 && !this.media.ended) {
        this.media.currentTime = 0;
      }
      this.media.play().catch((fault) => {
        if (fault.name !== "AbortError") {
          say("error");
        }
      });
    }
  }

  const players = [...document.querySelectorAll(".clip")]
    .filter((box) => box.querySelector("video, audio"))
    .map((box) => new Player(box));

  const say = (which) => {
    if (hint) {
      hint.hidden = false;
      hint.textContent = hint.dataset[which];
    }
  };
  const open = () => {
    questions.disabled = false;
    document.body.classList.add("watched");
    say("after");
  };

  for (const player of players) {
    player.listen();
    player.show();
    player.button.addEventListener("click", () => {
      for (const other of players) {
        if (other !== player) {
          other.media.pause();
        }
      }
      player.play();
    });
    player.media.addEventListener("playing", () => {
      if (questions.disabled) {
        say("during");
      }
    });
    player.media.addEventListener("ended", () => {
      player.seen = true;
      player.mark();
      if (!questions.disabled) {
        return;
      }
      if (!players.every((each) => each.seen)) {
        say("others");
        players.find((each) => !each.seen).button.focus({ preventScroll: true });
        return;
      }
      open();
      // The button that was pressed has changed its place: keyboards and screen readers go on with the questions.
      questions.focus({ preventScroll: true });
    });
  }
  document.addEventListener("visibilitychange", () => {
    for (const player of players) {
      player.record(document.hidden ? "hidden" : "visible");
    }
  });
  form.addEventListener("submit", () => {
    log.value = JSON.stringify([...events, ...players.flatMap((player) => player.closing())]);
  });

  if (players.every((player) => player.seen)) {
    open();
  } else {
    questions.disabled = true;
    say("before");
  }
})();
