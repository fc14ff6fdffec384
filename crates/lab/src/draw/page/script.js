// Hides the rungs and operands that do not contain what is searched for; "/" goes to the field.
"use strict";
const field = document.getElementById("search");
const count = document.getElementById("found");
const items = Array.from(document.querySelectorAll(".rung, #rows tbody tr"));
const words = items.map((item) => item.dataset.words + " " + item.textContent.toLowerCase());
field.addEventListener("input", () => {
  const wanted = field.value.toLowerCase().split(/\s+/).filter(Boolean);
  let found = 0;
  items.forEach((item, at) => {
    const fits = wanted.every((word) => words[at].includes(word));
    item.hidden = !fits;
    found += fits ? 1 : 0;
  });
  count.textContent = wanted.length ? found + " of " + items.length : "";
});
document.addEventListener("keydown", (event) => {
  if (event.key === "/" && document.activeElement !== field) {
    event.preventDefault();
    field.focus();
  } else if (event.key === "Escape" && document.activeElement === field) {
    field.value = "";
    field.dispatchEvent(new Event("input"));
  }
});
