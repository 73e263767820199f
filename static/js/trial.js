// The questions of a trial: how many are left, which were forgotten, and sent only once.
"use strict";

(() => {
  const form = document.getElementById("answers");
  const remaining = document.getElementById("remaining");
  // So long nobody waits for a page: whoever presses the button again then means it, and the server takes it once.
  const SENT_MS = 8000;

  const answered = (item) => [...item.querySelectorAll("input, textarea")].some((field) => {
    if (field.type === "radio" || field.type === "checkbox") {
      return field.checked;
    }
    return field.type !== "range" && field.value.trim() !== "";
  });
  const required = [...form.querySelectorAll("[data-required]")];
  const unanswered = () => required.filter((item) => !answered(item));

  const count = () => {
    const left = unanswered().length;
    const template = left === 1 ? remaining.dataset.one : remaining.dataset.many;
    remaining.textContent = left === 0 ? "" : template.replace("{n}", String(left));
  };
  const changed = (event) => {
    event.target.closest("[data-item]")?.classList.remove("has-problem");
    count();
  };
  form.addEventListener("change", changed);
  form.addEventListener("input", changed);
  count();

  // A radio button cannot be unticked by itself; where no answer is needed it can be taken back.
  for (const button of form.querySelectorAll("[data-clear]")) {
    const item = button.closest("[data-item]");
    const offer = () => { button.hidden = !answered(item); };
    item.addEventListener("change", offer);
    button.addEventListener("click", () => {
      for (const field of item.querySelectorAll("input")) {
        field.checked = false;
      }
      item.querySelector("input").focus();
      offer();
      count();
    });
    offer();
  }

  // The browser's own message on a hidden radio button is easily missed on a phone: mark and scroll to the item.
  form.noValidate = true;
  let sent = false;
  form.addEventListener("submit", (event) => {
    const left = unanswered();
    if (left.length > 0) {
      event.preventDefault();
      for (const item of left) {
        item.classList.add("has-problem");
      }
      left[0].scrollIntoView({ block: "center", behavior: "smooth" });
      left[0].querySelector("input:not([type=hidden]), textarea").focus({ preventScroll: true });
      return;
    }
    if (sent) {
      event.preventDefault();
      return;
    }
    sent = true;
    setTimeout(() => { sent = false; }, SENT_MS);
  });
  // Coming back with the browser's history restores the page as it was left: it may be sent again.
  window.addEventListener("pageshow", () => { sent = false; });
  document.querySelector(".has-problem")?.scrollIntoView({ block: "center" });
})();
