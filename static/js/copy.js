// Buttons that copy what stands in a field.
"use strict";

(() => {
  for (const button of document.querySelectorAll("[data-copy]")) {
    const field = document.getElementById(button.dataset.copy);
    button.hidden = false;
    button.addEventListener("click", async () => {
      field.select();
      try {
        await navigator.clipboard.writeText(field.value);
      } catch {
        // Without HTTPS there is no clipboard to write to; the old way still copies what is selected.
        document.execCommand("copy");
      }
      button.textContent = button.dataset.done;
    });
  }
})();
