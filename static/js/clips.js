// The experimenter's progress bar of clips that are being rendered.
"use strict";

(() => {
  const card = document.getElementById("clips");
  const EVERY_MS = 2000;
  const update = async () => {
    try {
      const answer = await fetch(card.dataset.address, { headers: { Accept: "application/json" } });
      if (!answer.ok) {
        return;
      }
      const counts = await answer.json();
      card.querySelector("[data-done]").textContent = String(counts.done);
      card.querySelector("progress").value = counts.done;
      if (counts.pending + counts.rendering > 0) {
        setTimeout(update, EVERY_MS);
      }
    } catch {
      setTimeout(update, 5 * EVERY_MS);
    }
  };
  if (Number(card.dataset.unfinished) > 0) {
    setTimeout(update, EVERY_MS);
  }
})();
