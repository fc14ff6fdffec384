"use strict";
// Trends of `rungd web`: the page of one operand, and the drawing that panels share. Loaded before app.js.
// A trend has axes, the value below the pointer, and gaps where no scan gave a value.

// The room of the axes, and the room for one label of the times and of the values, px.
const LEFT = 64, RIGHT = 10, ABOVE = 10, BELOW = 22, TIME_ROOM = 90, VALUE_ROOM = 30;
// The times that a trend shows, minutes, and the time between two looks at the controller, s. While the scan log
// is being read, and after a choice, it looks at once every READ_EVERY ms.
const SPANS = [[1, "1 min", 2], [10, "10 min", 5], [60, "1 h", 10], [480, "8 h", 30]];
const READ_EVERY = 1500, BEING_READ = "is being read";

// The buttons that choose what a trend shows; `chosen` gets the minutes.
function spanButtons(minutes, chosen) {
  const buttons = SPANS.map(([of, label]) => h("button", { "aria-pressed": String(of === minutes), onclick: () => {
    buttons.forEach((button, at) => button.setAttribute("aria-pressed", String(SPANS[at][0] === of)));
    chosen(of);
  } }, label));
  return h("div", { class: "tools spans", role: "group", "aria-label": "the time that is shown" }, ...buttons);
}

// Whether a part of a trend is still being read.
const isBeingRead = (got) => (got.gaps || []).some((gap) => gap[2] === BEING_READ);

// Looks at a trend again and again, as often as its span wants. `took` gets each answer, `failed` each failure.
function follow(operand, minutes, took, failed) {
  let shown = minutes, timer = null, turn = 0;
  const again = (every) => { clearTimeout(timer); timer = setTimeout(look, every); };
  async function look() {
    const mine = ++turn, every = (SPANS.find(([of]) => of >= shown) || SPANS[SPANS.length - 1])[2] * 1000;
    try {
      const got = await get("/api/trend", { operand, ...(shown > 1 ? { minutes: shown } : held()) });
      if (mine !== turn) return;
      took(got);
      again(isBeingRead(got) ? READ_EVERY : every);
    } catch (error) { if (mine === turn) { failed(error); again(every); } }
  }
  look();
  return { choose(of) { shown = of; look(); }, end() { turn += 1; clearTimeout(timer); }, get minutes() { return shown; } };
}

// The least of 1, 2, 5, 10, 20 … that is not less than a number.
function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((n) => n * power).find((step) => step >= least * 0.999);
}

// The steps of clocks above a second, ms.
const TIME_STEPS = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 900, 1800, 3600].map((s) => s * 1000);

function timeStep(span, most) {
  const least = span / Math.max(1, most);
  return least < 1000 ? Math.max(1, roundStep(least)) : TIME_STEPS.find((step) => step >= least) || 2 * 3600000;
}

// The numbers between two ends at a step.
function ticks(low, high, step) {
  const all = [];
  for (let at = Math.ceil(low / step - 1e-9) * step; at <= high + step * 1e-9 && all.length < 100; at += step) all.push(at);
  return all;
}

// What is drawn of a trend: its points with their levels, its window, and its scales.
function trendView(canvas, data, zoom, limits) {
  const width = canvas.clientWidth, height = canvas.clientHeight;
  const [begin, end] = data.span_ms, whole = Math.max(1, end - begin);
  const from = begin + whole * zoom.from, to = begin + whole * zoom.to;
  // Each point with its level. A value that is not known (null) has the level of the last known one.
  let level = 0;
  const isBit = data.points.some((point) => typeof point[2] === "boolean");
  const points = data.points.map(([ms, , value]) => ({ ms, isKnown: value !== null, level: level = value === null ? level : Number(value) }));
  const inside = points.filter((point, at) => point.ms <= to && (at + 1 >= points.length || points[at + 1].ms >= from));
  let low = Math.min(...inside.map((point) => point.level)), high = Math.max(...inside.map((point) => point.level));
  if (isBit) [low, high] = [0, 1];
  if (limits) [low, high] = limits;
  // A value that does not change lies in the middle.
  if (low === high) [low, high] = [low - 1, high + 1];
  const x = (ms) => LEFT + (ms - from) / Math.max(1, to - from) * (width - LEFT - RIGHT);
  const y = (value) => height - BELOW - (value - low) / (high - low) * (height - ABOVE - BELOW);
  const gaps = (data.gaps || []).map(([first, last, mode]) => ({ first, last: last === null ? end : last, mode }))
    .filter((gap) => gap.last > from && gap.first < to);
  return { width, height, from, to, end, isBit, isWhole: points.every((point) => Number.isInteger(point.level)), inside, low, high, x, y, gaps, named: data.named || ((value) => textOf(data.name, value)) };
}

// Draws a trend, and says it in words. `at`: the place of the pointer, px from the left; null: none.
function draw(canvas, data, zoom, limits, at = null) {
  const ratio = window.devicePixelRatio || 1, pen = canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
  [canvas.width, canvas.height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio];
  pen.scale(ratio, ratio);
  if (!data.span_ms || !data.points.length) return "no scan is recorded yet";
  const view = trendView(canvas, data, zoom, limits), colour = (name) => style.getPropertyValue("--" + name);
  pen.font = "12px system-ui";
  drawAxes(pen, view, colour);
  drawLine(pen, view, colour("accent"));
  drawGaps(pen, view, colour);
  if (at !== null) drawPointer(pen, view, colour, at);
  const { inside, low, high, named, from, to, gaps } = view;
  const levels = inside.map((point) => point.level);
  const ends = inside.length ? [Math.min(...levels), Math.max(...levels)] : [low, high];
  const isKnown = inside.every((point) => point.isKnown) ? "" : "; not known where the line is dashed";
  const stood = gaps.length ? `; no scan in ${[...new Set(gaps.map((gap) => gap.mode))].join(" and ")}` : "";
  return `${clockOf(from, 3)} to ${clockOf(to, 3)}: ${Math.max(0, inside.length - 1)} changes, from ${named(ends[0])} to ${named(ends[1])}${isKnown}${stood}`;
}

function drawAxes(pen, { width, height, from, to, isBit, isWhole, low, high, x, y, named }, colour) {
  const line = (x0, y0, x1, y1) => { pen.beginPath(); pen.moveTo(x0, y0); pen.lineTo(x1, y1); pen.stroke(); };
  pen.strokeStyle = colour("line");
  pen.fillStyle = colour("soft");
  pen.lineWidth = 1;
  const least = (high - low) / Math.max(1, Math.floor((height - ABOVE - BELOW) / VALUE_ROOM));
  const step = isBit ? 1 : isWhole ? Math.max(1, roundStep(least)) : roundStep(least);
  pen.textAlign = "right";
  for (const value of ticks(low, high, step)) {
    line(LEFT, y(value), width - RIGHT, y(value));
    pen.fillText(named(Number(value.toPrecision(6))), LEFT - 6, y(value) + 4, LEFT - 8);
  }
  const every = timeStep(to - from, Math.floor((width - LEFT - RIGHT) / TIME_ROOM)), digits = every < 1000 ? 3 : undefined;
  for (const ms of ticks(from, to, every)) {
    line(x(ms), ABOVE, x(ms), height - BELOW + 4);
    const label = clockOf(ms, digits), half = pen.measureText(label).width / 2;
    pen.textAlign = "center";
    pen.fillText(label, Math.min(Math.max(x(ms), half + 2), width - half - 2), height - 6);
  }
}

function drawLine(pen, { width, height, end, inside, x, y }, colour) {
  pen.save();
  pen.beginPath();
  pen.rect(LEFT, 0, width - LEFT - RIGHT + 1, height - BELOW + 2);
  pen.clip();
  pen.strokeStyle = colour;
  pen.lineWidth = 2;
  inside.forEach((point, at) => {
    const next = inside[at + 1];
    pen.setLineDash(point.isKnown ? [] : [4, 4]);
    pen.beginPath();
    pen.moveTo(x(point.ms), y(point.level));
    pen.lineTo(next ? x(next.ms) : Math.min(width - RIGHT, x(end)), y(point.level));
    if (next) pen.lineTo(x(next.ms), y(next.level));
    pen.stroke();
  });
  pen.restore();
}

// Where no scan gave a value there is no line.
function drawGaps(pen, { width, height, gaps, x }, colour) {
  for (const { first, last, mode } of gaps) {
    const from = Math.max(LEFT, x(first)), to = Math.min(width - RIGHT, x(last));
    pen.fillStyle = colour("pane");
    pen.fillRect(from, ABOVE, Math.max(1, to - from), height - ABOVE - BELOW);
    pen.fillStyle = colour("alarm");
    pen.textAlign = "center";
    if (to - from > pen.measureText(mode).width + 4) pen.fillText(mode, (from + to) / 2, ABOVE + 14);
  }
}

// The value below the pointer, with its time.
function drawPointer(pen, { width, height, from, to, inside, gaps, y, named }, colour, at) {
  const ms = from + (Math.min(Math.max(at, LEFT), width - RIGHT) - LEFT) / (width - LEFT - RIGHT) * (to - from);
  const point = inside.filter((of) => of.ms <= ms).pop(), gap = gaps.find((of) => of.first <= ms && ms <= of.last);
  pen.strokeStyle = colour("ink");
  pen.lineWidth = 1;
  pen.beginPath();
  pen.moveTo(Math.max(at, LEFT), ABOVE);
  pen.lineTo(Math.max(at, LEFT), height - BELOW);
  pen.stroke();
  const value = gap ? gap.mode : !point ? "…" : point.isKnown ? named(point.level) : `not known, last ${named(point.level)}`;
  const words = `${value}, ${clockOf(ms, 3)}`, room = pen.measureText(words).width + 8;
  const left = Math.min(Math.max(at + 6, LEFT), width - RIGHT - room), high = point ? Math.max(ABOVE, Math.min(y(point.level) - 22, height - BELOW - 20)) : ABOVE;
  pen.fillStyle = colour("paper");
  pen.fillRect(left, high, room, 18);
  pen.strokeRect(left, high, room, 18);
  pen.fillStyle = colour("ink");
  pen.textAlign = "left";
  pen.fillText(words, left + 4, high + 13);
}

// Follows a finger or a mouse over a trend. `show` draws with the place of the pointer, or null.
function pointAt(canvas, show) {
  const at = (event) => show(event.offsetX);
  canvas.addEventListener("pointermove", at);
  canvas.addEventListener("pointerdown", at);
  canvas.addEventListener("pointerleave", () => show(null));
}

function trend(name) {
  const canvas = h("canvas", { class: "wide", tabindex: "0", role: "img", "aria-label": "trend of " + name });
  const said = h("p", { class: "soft", role: "status" });
  const zoom = { from: 0, to: 1 };
  let data = null, pointer = null;
  const by = (factor, at) => {
    const width = Math.min(1, Math.max(1e-4, (zoom.to - zoom.from) * factor));
    const middle = zoom.from + (zoom.to - zoom.from) * at;
    zoom.from = Math.min(Math.max(0, middle - width * at), 1 - width);
    zoom.to = zoom.from + width;
    show(true);
  };
  const move = (part) => {
    const width = zoom.to - zoom.from, from = Math.min(Math.max(0, zoom.from + width * part), 1 - width);
    [zoom.from, zoom.to] = [from, from + width];
    show(true);
  };
  // `tells`: what is drawn is also said; not by itself every two seconds.
  function show(tells) {
    if (!data) return;
    const words = draw(canvas, { ...data, name }, zoom, undefined, pointer) + (data.note ? "; " + data.note : "");
    if (tells || !said.textContent) said.textContent = words;
  }
  const following = () => follow(name, 1, (got) => {
    const isOther = !data || data.minutes !== got.minutes, isKnown = data && isBeingRead(data) && !isBeingRead(got);
    // What is zoomed into stands still, so that it can be read.
    if (!isOther && (zoom.from > 0 || zoom.to < 1)) return;
    data = got;
    said.className = "soft";
    show(isOther || isKnown);
  }, (error) => { said.className = "error"; said.textContent = error.message; });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const share = (event.offsetX - LEFT) / (canvas.clientWidth - LEFT - RIGHT);
    by(event.deltaY > 0 ? 1.25 : 0.8, Math.min(1, Math.max(0, share)));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const keys = { "+": () => by(0.5, 0.5), "-": () => by(2, 0.5), ArrowLeft: () => move(-0.25), ArrowRight: () => move(0.25) };
    if (keys[event.key]) { event.preventDefault(); keys[event.key](); }
  });
  pointAt(canvas, (at) => { pointer = at; show(false); });
  const resized = () => show(false);
  window.addEventListener("resize", resized);
  $("content").replaceChildren(h("h2", {}, "Trend of ", whyButton(name)),
    spanButtons(1, (minutes) => { [zoom.from, zoom.to] = [0, 1]; followed.choose(minutes); }),
    h("div", { class: "tools" },
      h("button", { onclick: () => by(0.5, 0.5), "aria-label": "zoom in" }, "+"),
      h("button", { onclick: () => by(2, 0.5), "aria-label": "zoom out" }, "−"),
      h("button", { onclick: () => move(-0.5), "aria-label": "earlier" }, "◀"),
      h("button", { onclick: () => move(0.5), "aria-label": "later" }, "▶"),
      "now: ", valueOf(name)), canvas, said);
  watch([name]);
  const followed = following();
  return { update() { refreshValues($("content")); }, leave() { followed.end(); window.removeEventListener("resize", resized); } };
}
