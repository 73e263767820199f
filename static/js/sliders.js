// Sliders on which no point stands, and which send nothing, before they are touched.
"use strict";

(() => {
  const THUMB_PX = 24;

  const enhance = (item) => {
    const field = item.querySelector("input[type=number]");
    const range = document.createElement("input");
    const shown = document.createElement("output");
    range.type = "range";
    range.className = "slider-range";
    for (const name of ["min", "max", "step"]) {
      range[name] = field[name];
    }
    range.setAttribute("aria-label", field.getAttribute("aria-label"));
    shown.className = "slider-value";

    const show = () => {
      const touched = field.value !== "";
      item.classList.toggle("is-untouched", !touched);
      shown.textContent = field.value;
      if (touched) {
        range.value = field.value;
        range.removeAttribute("aria-valuetext");
      } else {
        range.setAttribute("aria-valuetext", item.dataset.untouched);
      }
    };
    const take = (value) => {
      field.value = String(value);
      show();
      field.dispatchEvent(new Event("change", { bubbles: true }));
    };
    range.addEventListener("input", () => take(range.value));
    // A click where the browser already thinks the point to be changes nothing for it, and some browsers only let the
    // point be dragged: the place of the click decides.
    range.addEventListener("click", (event) => {
      if (field.value !== "" || event.detail === 0) {
        return;
      }
      const box = range.getBoundingClientRect();
      const way = (event.clientX - box.left - THUMB_PX / 2) / (box.width - THUMB_PX);
      const [low, high] = [Number(range.min), Number(range.max)];
      take(Math.round(low + Math.min(Math.max(way, 0), 1) * (high - low)));
    });
    range.addEventListener("keydown", (event) => {
      if (field.value === "" && (event.key === "Enter" || event.key === " ")) {
        event.preventDefault();
        take(range.value);
      }
    });

    // The field stays in the form, so that what is sent has one name with and without scripts.
    field.type = "hidden";
    field.after(range, shown);
    show();
  };

  for (const item of document.querySelectorAll("[data-slider]")) {
    enhance(item);
  }
})();
