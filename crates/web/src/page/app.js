"use strict";
// The pages of `rungd web`. No library, no request to another host. What is shown of a scan comes
// in one event, so that nothing of two scans is mixed.

const $ = (id) => document.getElementById(id);
const state = {
  session: null, ladder: null, status: null, values: {}, texts: {}, on: [], running: [],
  scan: 0, scans: [0, 0], time: 0, mode: "", hold: null, power: {}, compared: {},
  // The present mode, whatever scan is looked at: its name, and its reason.
  now: null,
};
let source = null, page = null, asked = 0, opened = 0;

// An element: h("p", {class: "soft"}, "text", child ...).
function h(tag, attributes, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes || {})) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value != null) element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child != null));
  return element;
}

// The time until a failed request is sent again, ms.
const AGAIN = 2000;

// Shows these children, and leaves those alone that are as they were made: a place that has the
// focus keeps it, and a click is not lost between two scans.
function renew(place, ...children) {
  children.forEach((child, at) => {
    child.made = child.outerHTML;
    const old = place.children[at];
    if (!old) place.append(child);
    else if (old.made !== child.made) old.replaceWith(child);
  });
  while (place.children.length > children.length) place.lastElementChild.remove();
}

async function get(path, query) {
  const text = new URLSearchParams(query || {}).toString();
  const answer = await fetch(path + (text ? "?" + text : ""));
  const json = await answer.json().catch(() => ({ error: "the answer cannot be read" }));
  if (answer.status === 401 && path !== "/api/session") { location.reload(); }
  if (!answer.ok) throw Object.assign(new Error(json.error), { status: answer.status });
  return json;
}

// How long a change waits for its answer, and how long before that it is still begun, ms: what is
// begun in time must be answered in time.
const WAIT = 10000, BEGUN_BEFORE = 2000;

// The controller's clock, by which changes say how long they wait: its name, and its lead over the
// page's own clock. An event that was long on its way shows too small a lead.
let clock = null;

function know(now) {
  if (!now) return;
  const lead = now.ms - performance.now();
  if (!clock || clock.name !== now.clock) clock = { name: now.clock, lead, at: now.ms };
  // Slowly forgets the greatest lead, because clocks drift: 1 ms in a second.
  else clock.lead = Math.max(lead, clock.lead - Math.max(0, now.ms - clock.at) / 1000);
  clock.at = now.ms;
}

// Until when a change is begun. After that nothing is done, even if it arrives later.
function deadline(wait) {
  if (!clock) return undefined;
  return { clock: clock.name, ms: Math.max(0, Math.floor(clock.lead + performance.now() + wait)) };
}

// `begun`: the time within which the change is begun, or it is not made at all.
async function post(path, value, begun = WAIT - BEGUN_BEFORE) {
  const headers = { "Content-Type": "application/json" };
  if (state.session) headers["X-CSRF-Token"] = state.session.csrf;
  const body = JSON.stringify({ ...value, deadline: deadline(begun) });
  const wait = begun + BEGUN_BEFORE, signal = AbortSignal.timeout(wait);
  const answer = await fetch(path, { method: "POST", headers, body, signal }).catch((error) => {
    throw error.name !== "TimeoutError" ? error
      : new Error(`no answer for ${wait / 1000} s: if nothing has changed by now, nothing will`);
  });
  const json = await answer.json().catch(() => ({ error: "the answer cannot be read" }));
  if (!answer.ok) throw Object.assign(new Error(json.error), { status: answer.status, mistakes: json.mistakes });
  return json;
}

// A time of the day, of the viewer's zone.
function clockOf(ms, digits) {
  return new Date(ms).toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", second: "2-digit",
    hourCycle: "h23", fractionalSecondDigits: digits });
}

// --- What comes in -----------------------------------------------------------------------------

const view = { element: "", from: 1, to: 0, within: "", tags: [] };

function listen() {
  if (source) source.close();
  source = null;
  if (state.hold) return;
  state.power = {}; state.compared = {};
  source = new EventSource("/events?" + new URLSearchParams(windowOf()));
  source.onmessage = (event) => take(JSON.parse(event.data));
  source.onerror = () => {
    link("the connection to `rungd web` is gone; it is tried again" + shownOf(), true);
    // The browser tries no refused stream again. If the session has ended, `get` loads the page anew.
    if (source && source.readyState === EventSource.CLOSED) {
      setTimeout(() => get("/api/status").then(listen, source && source.onerror), AGAIN);
    }
  };
}

// What a page without news still shows.
function shownOf() {
  return state.scan ? `; what you see is of scan ${state.scan}, ${clockOf(state.time)}` : "";
}

function windowOf() {
  return { element: view.element, from: view.from, to: view.to, within: view.within, tags: view.tags.join(",") };
}

function take(event) {
  know(event.clock);
  if (event.now && !state.hold) state.now = event.now;
  if (event.status) { state.status = event.status; overviewParts(); }
  if (event.error) { link(event.error + shownOf(), true); return; }
  link(state.hold ? "held at a scan of the past" : "live", false);
  if (state.ladder && event.program !== state.ladder.program && !state.hold) {
    // A new stream: this one has sent the values, and would send only their changes.
    if (source) source.close();
    source = null; state.ladder = null; state.values = {}; open();
    return;
  }
  Object.assign(state.values, event.values);
  Object.assign(state.texts, event.texts);
  Object.assign(state.power, event.power);
  Object.assign(state.compared, event.compared);
  for (const key of ["on", "running", "scans"]) if (event[key]) state[key] = event[key];
  state.executes = event.executes !== false;
  [state.scan, state.time, state.mode] = [event.scan, event.time_ms, event.mode];
  head();
  if (page && page.update) page.update(event);
}

function link(text, isGone) {
  const place = $("link");
  if (place.textContent !== text) place.textContent = text;
  place.className = isGone ? "error" : "soft";
  document.body.classList.toggle("stale", isGone);
}

function head() {
  const clock = clockOf(state.time);
  const status = state.status, now = state.now || { mode: state.mode };
  // The present mode, also while a scan of the past is looked at. What is read aloud changes with the
  // mode, not with each scan.
  const mode = now.mode + (now.reason ? ` (${now.reason})` : "");
  if ($("mode").textContent !== mode) $("mode").textContent = mode;
  $("mode").className = now.mode === "RUN" ? "" : "alarm";
  const then = state.hold ? `; you look at scan ${state.scan}, ${clock}, in ${state.mode}` : `, scan ${state.scan}, ${clock}`;
  $("clock").textContent = state.scan ? then : "";
  const alarms = status ? status.alarms.filter((alarm) => !alarm.ended && !alarm.shelved).length : 0;
  const place = $("alarms-short");
  place.textContent = alarms === 0 ? "no alarm" : alarms === 1 ? "1 alarm" : alarms + " alarms";
  place.className = alarms ? "alarm" : "soft";
  const forces = status ? status.forces.length : 0;
  if (forces) place.textContent += forces === 1 ? ", 1 force" : `, ${forces} forces`;
}

// `rungs`: the rungs of a ladder's page that are shown (`element`, `from`, `to`), and those of the
// subroutines within it (`within`: "Dose:1-4,Rinse:1-2").
function watch(tags, rungs) {
  const next = { element: "", from: 1, to: 0, within: "", ...rungs, tags: [...new Set(tags)] };
  if (source && JSON.stringify(next) === JSON.stringify(view)) return;
  Object.assign(view, next);
  if (state.hold) { heldScan(state.scan); return; }
  listen();
}

// --- Values ------------------------------------------------------------------------------------

// The value of an output that does not follow memory has parts: `on`, what it is driven to (null: not
// known, `last`: the last one known), and `memory`.
const isOutput = (value) => value !== null && typeof value === "object";

function text(value) {
  if (value === true) return "ON";
  if (value === false) return "OFF";
  if (value === undefined || value === null) return "…";
  if (isOutput(value)) return outputText(value) + (value.memory === value.on || value.memory === undefined ? "" : `; memory holds ${text(value.memory)}`);
  return Number.isInteger(value) ? String(value) : String(Math.round(value * 1e4) / 1e4);
}

function outputText(value) {
  if (value.on !== null) return text(value.on) + ", safe value";
  return "not known" + (value.last == null ? "" : ", last " + text(value.last));
}

// The value in an answer of the controller, as the values of a page are.
function ofAnswer(shown) {
  if (shown.unknown) return { on: null, last: shown.unknown.last, memory: shown.value };
  return shown.driven == null ? shown.value : { on: shown.driven, memory: shown.value };
}

// A value with the text that the ladder gives for it: `1 (dosing)`.
function textOf(name, value) {
  const texts = state.texts[name], meant = texts && !isOutput(value) ? texts[Number(value)] : undefined;
  return text(value) + (meant === undefined ? "" : ` (${meant})`);
}

function valueOf(name) {
  return h("span", { "data-value": name }, textOf(name, state.values[name]));
}

function refreshValues(root) {
  for (const place of root.querySelectorAll("[data-value]")) {
    const now = textOf(place.dataset.value, state.values[place.dataset.value]);
    if (place.textContent !== now) place.textContent = now;
  }
  // Of an output that follows memory its rung tells enough.
  for (const place of root.querySelectorAll("[data-output]")) place.hidden = !isOutput(state.values[place.dataset.output]);
}

function whyButton(name, label) {
  return h("button", { class: "plain", onclick: () => why(name), title: "why is it so?" },
    label || name);
}

// --- Why ---------------------------------------------------------------------------------------

let asker = null;

function closeWhy() {
  if ($("why").hidden) return;
  $("why").hidden = true;
  (asker && asker.isConnected ? asker : $("content")).focus();
}

async function why(name) {
  const pane = $("why"), mine = ++asked;
  if (pane.hidden) asker = document.activeElement;
  const close = closeWhy;
  const head = h("div", { class: "tools" }, h("h2", {}, "Why " + name),
    h("a", { href: "#trend/" + encodeURIComponent(name), onclick: close }, "trend"),
    h("button", { onclick: close, "aria-label": "close" }, "Close"));
  pane.replaceChildren(head, h("p", { class: "soft" }, "…"));
  pane.hidden = false;
  pane.focus();
  try {
    const answer = await get("/api/why", { operand: name, ...held() });
    if (mine !== asked) return;
    const names = namesIn(answer.answer);
    pane.replaceChildren(head, linked(answer.text.replace(/…: more with --depth \d+/, "…: a name leads on"), names),
      ...(state.session.how ? [howBlock(name)] : []));
    pane.scrollTop = 0;
  } catch (error) {
    if (mine === asked) pane.replaceChildren(head, h("p", { class: "error" }, error.message));
  }
}

// The button that asks how a value could change, and its answer.
function howBlock(name) {
  const block = h("div", { class: "how" });
  const told = (kind, text) => { if (block.isConnected) block.replaceChildren(h(kind, {}, text)); };
  const ask = async () => {
    told("p", "…");
    try {
      told("pre", (await get("/api/how", { operand: name, ...held() })).text);
    } catch (error) {
      told("p", error.message);
    }
  };
  block.append(h("button", { onclick: ask }, "How could it change?"));
  return block;
}

function held() {
  return state.hold ? { hold: state.hold, scan: state.scan } : {};
}

// The names of operands in an answer.
function namesIn(json) {
  const names = new Set();
  const walk = (part, key) => {
    if (Array.isArray(part)) part.forEach((one) => walk(one, key));
    else if (part && typeof part === "object") {
      if (typeof part.name === "string" && ("value" in part || "address" in part)) names.add(part.name);
      Object.entries(part).forEach(([inner, one]) => walk(one, inner));
    }
  };
  walk(json, "");
  return names;
}

// A text in which the names of operands ask further.
function linked(text, names) {
  const pre = h("pre", {});
  for (const line of text.replace(/\n$/, "").split("\n")) {
    // A line that wraps goes on behind its own indentation.
    const depth = line.search(/\S|$/), place = h("div", { class: "line" });
    place.style.setProperty("--depth", depth);
    for (const piece of line.slice(depth).split(/([\p{L}_$][\p{L}\p{N}_.$-]*)/u)) {
      place.append(names.has(piece) ? whyButton(piece) : piece);
    }
    // The end of the line, for who copies the answer.
    place.append("\n");
    pre.append(place);
  }
  return pre;
}

// --- Overview ----------------------------------------------------------------------------------

function card(title, ...children) {
  return h("section", { class: "card" }, h("h3", {}, title), ...children);
}

// A card that has a row of cards to itself, if there is much to read in it.
function wide(made, isWide) {
  made.classList.toggle("wide", isWide);
  return made;
}

function list(rows) {
  return h("table", {}, h("tbody", {}, ...rows.map(([name, value]) =>
    h("tr", {}, h("th", { scope: "row" }, name), h("td", { class: "value-of" }, value)))));
}

const us = (value) => value >= 1000 ? (value / 1000).toFixed(1) + " ms" : Math.round(value) + " µs";

function overview() {
  watch([]);
  const place = h("div", { class: "cards", id: "cards" });
  const field = h("input", { type: "search", autocomplete: "off", size: 26, placeholder: "pump1, Y3, contactor …" });
  const find = (event) => { event.preventDefault(); location.hash = "#tags/" + encodeURIComponent(field.value); };
  $("content").replaceChildren(h("h2", {}, "Overview"),
    h("form", { class: "tools", onsubmit: find }, h("label", {}, "Why is it ON or OFF? ", field), h("button", {}, "Find the tag")),
    place);
  overviewParts();
  return { update() { const runs = $("runs"); if (runs) renew(runs, ...blockRows()); } };
}

// In STOP and FAULT no block runs, whatever memory holds. The overview tells of the present; a ladder
// of the scan that is looked at.
function runs(name, isNow) {
  const stands = isNow && state.now && state.now.mode !== "RUN";
  return state.executes !== false && !stands && state.running.includes(name);
}

function blockRows() {
  const blocks = state.ladder ? state.ladder.blocks : [];
  return blocks.map((block) => {
    const stages = block.stages.map((stage) => block.name + "." + stage.name);
    const on = stages.filter((name) => state.on.includes(name));
    return h("tr", {}, h("th", { scope: "row" },
      h("a", { href: "#ladder/" + encodeURIComponent(block.name) }, block.name)),
    h("td", {}, runs(block.name, true) ? "runs" : "does not run"),
    h("td", {}, ...on.flatMap((name) => [
      h("a", { href: "#ladder/" + encodeURIComponent(name) }, name.slice(block.name.length + 1)), " "])));
  });
}

function overviewParts() {
  head();
  const place = $("cards"), status = state.status;
  if (!place || !status) return;
  const scan = status.scan;
  renew(place,
    wide(card("Alarms", alarmsInShort(status.alarms)), status.alarms.length > 0),
    card("Blocks", h("table", {}, h("tbody", { id: "runs" }))),
    card("Forces", status.forces.length ? list(status.forces.map((of) =>
      [whyButton(of.tag || of.operand), text(of.value) + (isOutput(ofAnswer(of)) ? "; the output is " + outputText(ofAnswer(of)) : "")])) : h("p", { class: "soft" }, "nothing is forced")),
    card("Devices", deviceTable(status.devices)),
    card("Scan", list([
      ["period", us(status.period_us)], ["execution, 99 %", us(scan.execution.p99_us)],
      ["execution, longest", us(scan.execution.max_us)], ["lateness, 99 %", us(scan.lateness.p99_us)],
      ["overruns", String(scan.overruns)], ["scans", String(status.scans)]])),
    card("Controller", list([
      ["ladder", status.ladder.name], ["mode", status.mode + (status.reason ? ": " + status.reason : "")],
      ["rungd", status.version], ["files", status.ladder.files],
      ["SHA-256", status.ladder.sha256.slice(0, 12)]])));
  renew($("runs"), ...blockRows());
}

function deviceTable(devices) {
  const rows = [...(devices.field || []).map((device) => [device.name,
    (device.ok ? "Ok" : "not Ok") + (device.stale ? ", stale" : "")
      + (device.trouble ? ": " + device.trouble : ", " + us(device.took_us))])];
  if (devices.modbus) rows.push(["Modbus server", `${devices.modbus.address}, ${devices.modbus.clients} clients`]);
  if (devices.simulated_rules) rows.push(["simulated", devices.simulated_rules + " rules"]);
  return rows.length ? list(rows) : h("p", { class: "soft" }, "none");
}

// --- Ladder ------------------------------------------------------------------------------------

const ROW = 58, AROUND = 66, CHUNK = 20;

function elements() {
  return state.ladder.blocks.flatMap((block) => [
    { name: block.name, label: block.name, doc: block.doc, kind: block.kind, rows: block.rows, ways: block.ways },
    ...block.stages.map((stage) => ({
      name: block.name + "." + stage.name, label: stage.name, doc: stage.doc, kind: "Stage",
      rows: stage.rows, ways: block.ways, of: block.name }))]);
}

function ladder(name) {
  const all = elements();
  const element = all.find((of) => of.name === name) || all.find((of) => of.rows.length) || all[0];
  if (!element) { $("content").replaceChildren(h("p", {}, "the ladder has no block")); return {}; }
  const rungs = h("div", { class: "rungs" });
  const menu = h("ul", {}, ...all.map((of) => h("li", {}, h("a", {
    href: "#ladder/" + encodeURIComponent(of.name), "data-element": of.name,
    "aria-current": of === element ? "true" : false }, (of.of ? "– " : "") + of.label))));
  $("content").replaceChildren(h("div", { class: "ladder" }, menu, h("div", {},
    h("h2", {}, element.name + " ", h("small", { class: "soft" }, element.kind)),
    element.doc ? h("p", {}, element.doc) : null,
    element.ways.length ? h("details", {}, h("summary", {}, "The ways between the Stages"),
      h("ul", {}, ...element.ways.map((way) => h("li", {}, way)))) : null,
    stepper(), rungs)));
  const shown = { element, rungs, lines: linesOf(element, null), tops: [], places: new Map(), asked: new Set() };
  layOut(shown);
  const scroll = () => look(shown);
  window.addEventListener("scroll", scroll, { passive: true });
  window.addEventListener("resize", scroll);
  setTimeout(() => look(shown), 0);
  return {
    shown,
    update(event) { compare(shown, event.compared); light(shown, event.power); marks(menu); },
    leave() { window.removeEventListener("scroll", scroll); window.removeEventListener("resize", scroll); },
  };
}

function marks(menu) {
  for (const link of menu.querySelectorAll("a")) {
    const name = link.dataset.element;
    link.className = state.on.includes(name) ? "on" : runs(name) ? "runs" : "";
  }
}

// The lines of an element: one for each rung. `of`: the line and the CALL below which the rungs of a
// subroutine are folded out. The key is that of the rung in the events.
function linesOf(element, of) {
  return element.rows.map((rows, at) => ({ element: element.name, number: at + 1, rows, of,
    depth: of ? of.line.depth + 1 : 0, key: of ? `${element.name}:${at + 1}` : String(at + 1), open: new Set() }));
}

// Gives each line its place in the page.
function layOut(shown) {
  shown.tops = [0];
  shown.lines.forEach((line, at) => {
    line.at = at;
    shown.tops.push(shown.tops[at] + line.rows * ROW + AROUND);
    const place = shown.places.get(line);
    if (place) place.root.style.top = shown.tops[at] + "px";
  });
  shown.rungs.style.height = shown.tops[shown.lines.length] + "px";
}

// The first and the last line in the window.
function inWindow(shown) {
  const top = -shown.rungs.getBoundingClientRect().top, bottom = top + window.innerHeight;
  const at = (y) => {
    let low = 0, high = shown.tops.length - 1;
    while (low < high) { const mid = (low + high) >> 1; if (shown.tops[mid + 1] <= y) low = mid + 1; else high = mid; }
    return low;
  };
  return { first: Math.max(0, at(top) - 2), last: Math.min(shown.lines.length - 1, at(bottom) + 2) };
}

// Shows the rungs that are in the window, and asks for their power alone.
function look(shown) {
  const { first, last } = inWindow(shown);
  for (const [line, place] of shown.places) {
    if (line.at < first - 20 || line.at > last + 20) { place.root.remove(); shown.places.delete(line); }
  }
  for (const line of shown.lines.slice(first, last + 1)) if (!shown.places.has(line)) fetchChunk(shown, line);
  clearTimeout(shown.timer);
  shown.timer = setTimeout(() => {
    if (!page || page.shown !== shown) return;
    const lines = shown.lines.slice(first, last + 1);
    const words = lines.flatMap((line) => (shown.places.get(line) || { words: [] }).words);
    watch(words.slice(0, 250), rungsOf(shown, lines));
  }, shown.begun ? 120 : 0);
  shown.begun = true;
}

// The rungs of some lines, as `watch` takes them.
function rungsOf(shown, lines) {
  const ranges = new Map();
  for (const { element, number, depth } of lines) {
    const name = depth ? element : "", range = ranges.get(name) || { from: number, to: number };
    ranges.set(name, { from: Math.min(range.from, number), to: Math.max(range.to, number) });
  }
  const own = ranges.get("") || {};
  ranges.delete("");
  const within = [...ranges].map(([name, { from, to }]) => `${name}:${from}-${to}`).join(",");
  return { element: shown.element.name, ...own, within };
}

async function fetchChunk(shown, { element, number }) {
  const from = Math.floor((number - 1) / CHUNK) * CHUNK + 1, asked = `${element}:${from}`;
  if (shown.asked.has(asked)) return;
  shown.asked.add(asked);
  try {
    const answer = await get("/api/rungs", { element, from, to: from + CHUNK - 1 });
    const { first, last } = inWindow(shown), near = shown.lines.slice(Math.max(0, first - 20), last + 21);
    for (const rung of answer.rungs) {
      for (const line of near) {
        if (line.element === element && line.number === rung.number && !shown.places.has(line)) place(shown, line, rung);
      }
    }
    compare(shown, state.compared);
    light(shown, state.power);
    shown.asked.delete(asked);
    look(shown);
  } catch (error) {
    shown.asked.delete(asked);
    link(error.message, true);
    setTimeout(() => { if (page && page.shown === shown) look(shown); }, AGAIN);
  }
}

// A press on a CALL folds the rungs of its subroutine out below its rung, and back.
function callBox(shown, line, box) {
  const name = box.dataset.name.replace(/^CALL /, "");
  const said = () => box.setAttribute("aria-expanded", String(line.open.has(name)));
  const turn = () => { fold(shown, line, name); said(); };
  box.setAttribute("tabindex", "0");
  box.setAttribute("role", "button");
  box.setAttribute("aria-description", "the rungs of " + name);
  said();
  box.addEventListener("click", turn);
  box.addEventListener("keydown", (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); turn(); } });
}

function fold(shown, line, name) {
  if (line.open.delete(name)) {
    const isWithin = (one) => one.of && (one.of.line === line && one.of.name === name || isWithin(one.of.line));
    for (const one of shown.lines.filter(isWithin)) {
      const place = shown.places.get(one);
      if (place) place.root.remove();
      shown.places.delete(one);
    }
    shown.lines = shown.lines.filter((one) => !isWithin(one));
  } else {
    const element = elements().find((of) => of.name === name);
    if (!element) return;
    line.open.add(name);
    shown.lines.splice(line.at + 1, 0, ...linesOf(element, { line, name }));
  }
  layOut(shown);
  look(shown);
}

function place(shown, line, rung) {
  const root = h("article", { class: line.depth ? "rung within" : "rung", "data-rung": line.key });
  root.style.top = shown.tops[line.at] + "px";
  root.style.left = line.depth * 1.5 + "rem";
  const words = h("div", { class: "words" }, ...rung.words.map((name) =>
    h("span", {}, whyButton(name), " = ", valueOf(name))), ...rung.outputs.map((name) =>
    h("span", { "data-output": name, hidden: true }, "output ", whyButton(name), " is ", valueOf(name))));
  const at = `${rung.file}:${rung.line}`, title = rung.title.replace(at, "").trim();
  root.append(h("p", { title: `${title} ${rung.doc || ""} ${at}` }, line.depth ? h("span", { class: "soft" }, line.element + " ") : null,
    h("strong", {}, title), " ", h("span", { class: "state" }),
    rung.use ? h("span", { class: "soft" }, "of " + rung.use + " ") : null,
    rung.doc || "", " ", h("span", { class: "soft" }, at)));
  const drawing = new DOMParser().parseFromString(rung.svg, "image/svg+xml").documentElement;
  // Its symbols are buttons: the drawing is a group of them, and no picture.
  drawing.setAttribute("role", "group");
  atRightRail(drawing, shown.rungs.clientWidth - line.depth * 24);
  root.append(document.importNode(drawing, true), words);
  for (const symbol of root.querySelectorAll("g[data-name]")) {
    if (symbol.classList.contains("box")) continue;
    symbol.setAttribute("tabindex", "0");
    symbol.setAttribute("role", "button");
    const ask = () => why(symbol.dataset.name);
    symbol.addEventListener("click", ask);
    symbol.addEventListener("keydown", (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); ask(); } });
  }
  for (const box of root.querySelectorAll("g.box[data-mnemonic=CALL]")) callBox(shown, line, box);
  // In the order of the lines, which is the one of the keyboard.
  const behind = [...shown.places].filter(([other]) => other.at > line.at);
  const next = behind.reduce((least, one) => !least || one[0].at < least[0].at ? one : least, null);
  shown.rungs.insertBefore(root, next && next[1].root);
  for (const box of root.querySelectorAll("g.boxed, g.not-boxed")) sidesBelow(box);
  for (const box of root.querySelectorAll("g.box")) progressBelow(box, rung.words);
  shown.places.set(line, { root, words: [...rung.words, ...rung.outputs], lit: [...root.querySelectorAll("[data-p]")], power: undefined });
}

// The widest ladder, px.
const LADDER_MAX = 900;

// Moves the right rail of a drawing, with its coils and boxes, to where all rungs have it if there is room.
function atRightRail(svg, room) {
  const width = Number(svg.getAttribute("width")), by = Math.min(room, LADDER_MAX) - width;
  if (by <= 0) return;
  for (const part of svg.querySelectorAll("g.coil, g.box, .rail.right")) {
    part.setAttribute("transform", `translate(${by} 0)`);
    // The wires to it become longer, and what reacts to a press with them.
    const touch = part.querySelector(".touch");
    if (touch) {
      touch.setAttribute("x", touch.getAttribute("x") - by);
      touch.setAttribute("width", Number(touch.getAttribute("width")) + by);
    }
    for (const wire of part.querySelectorAll(".wire")) {
      wire.setAttribute("d", wire.getAttribute("d").replace(/^M\d+/, (start) => "M" + (start.slice(1) - by)));
    }
  }
  svg.setAttribute("width", width + by);
  svg.setAttribute("viewBox", `0 0 ${width + by} ${svg.getAttribute("height")}`);
}

// The place for the values of a compare's sides, below its box.
function sidesBelow(box) {
  const inner = box.querySelector(".inner"), sides = inner.cloneNode();
  sides.setAttribute("class", "sides");
  sides.setAttribute("y", Number(inner.getAttribute("y")) + 21);
  box.append(sides);
}

// The place for how far a timer or a counter is, below its box: `3 of 12`, `2.1 s of 10s`.
function progressBelow(box, words) {
  const found = /^(\S+) (\S+) (?:.* )?preset=(\S+)/.exec(box.dataset.name), inner = box.querySelector(".text");
  if (!found || !inner || !words.includes(found[2] + ".Acc")) return;
  const frame = box.querySelector("rect.symbol"), sides = inner.cloneNode();
  sides.setAttribute("class", "sides");
  sides.setAttribute("x", Number(frame.getAttribute("x")) + Number(frame.getAttribute("width")) / 2);
  sides.setAttribute("y", Number(inner.getAttribute("y")) + 21);
  Object.assign(sides.dataset, { acc: found[2] + ".Acc", preset: found[3], timer: /TMR/.test(found[1]) ? "1" : "" });
  // The value of a constant is in the title: `settle = 2s, most = 5`.
  const title = box.querySelector("title"), named = (title ? title.textContent : "").split(/[;,] /).find((text) => text.startsWith(found[3] + " = "));
  if (named) sides.dataset.preset = `${named.slice(found[3].length + 3)} (${found[3]})`;
  box.append(sides);
}

// A time in ms, as short as its unit allows.
function timeText(ms) {
  if (ms < 1000) return ms + " ms";
  if (ms < 120000) return (ms / 1000).toFixed(1) + " s";
  const seconds = Math.floor(ms / 1000);
  return seconds < 7200 ? `${Math.floor(seconds / 60)} min ${seconds % 60} s` : `${Math.floor(seconds / 3600)} h ${Math.floor(seconds % 3600 / 60)} min`;
}

function showProgress(place) {
  for (const sides of place.root.querySelectorAll("[data-acc]")) {
    const { acc, preset, timer } = sides.dataset, value = state.values[acc], wanted = state.values[preset];
    const said = (number) => timer && typeof number === "number" ? timeText(number) : text(number);
    const words = typeof value === "number" ? `${said(value)} of ${typeof wanted === "number" ? said(wanted) : preset}` : "";
    if (sides.textContent !== words) sides.textContent = words;
  }
}

// Shows the values of the compares, as they were when their rung was executed.
function compare(shown, compared) {
  for (const [line, place] of shown.places) {
    const values = (compared || {})[line.key];
    if (!values) continue;
    for (const sides of place.root.querySelectorAll(".sides:not([data-acc])")) sides.textContent = values[sides.parentNode.dataset.leaf] || "";
  }
}

// Lights the wires that have power.
function light(shown, powers) {
  for (const [line, place] of shown.places) {
    showProgress(place);
    const power = (powers || {})[line.key];
    if (power === undefined || place.power === power) continue;
    place.root.classList.toggle("idle", power === null);
    const before = place.power || "";
    place.lit.forEach((element, at) => {
      const on = power !== null && power[at] === "1";
      if ((before[at] === "1") === on && place.power !== undefined) return;
      element.classList.toggle("on", on);
      // Its name is what it shows: name, address, values.
      if (element.dataset.leaf) element.setAttribute("aria-description", on ? "conducts" : "does not conduct");
    });
    place.power = power;
  }
  refreshValues(shown.rungs);
}

// --- The last minute, scan by scan -------------------------------------------------------------

function stepper() {
  const range = h("input", { type: "range", id: "scan", "aria-label": "scan", disabled: !state.hold, max: 1, value: 1,
    oninput: (event) => heldScan(Number(event.target.value)) });
  const step = (by) => () => heldScan(state.scan + by);
  const place = h("div", { class: "tools" },
    h("button", { id: "hold", onclick: hold }, state.hold ? "Live" : "Pause"),
    h("button", { onclick: step(-1), "data-step": true, disabled: !state.hold, "aria-label": "one scan back" }, "◀ scan"),
    h("button", { onclick: step(1), "data-step": true, disabled: !state.hold, "aria-label": "one scan on" }, "scan ▶"),
    range, h("span", { id: "scan-text", class: "soft" }, state.hold ? "" : "pause to step through the last minute"));
  if (state.hold) setTimeout(scanText, 0);
  return place;
}

function scanText() {
  const range = $("scan");
  if (!range) return;
  [range.min, range.max] = state.scans;
  range.value = state.scan;
  $("scan-text").textContent = `scan ${state.scan} of ${state.scans[0]} to ${state.scans[1]}, `
    + clockOf(state.time, 3);
}

async function hold() {
  try {
    if (state.hold) { state.hold = null; open(); return; }
    const answer = await get("/api/hold");
    state.hold = answer.hold;
    state.scans = answer.scans;
    setTimeout(presentOf, NOW_EVERY, answer.hold);
    if (source) source.close();
    source = null;
    $("hold").textContent = "Live";
    document.querySelectorAll("[data-step], #scan").forEach((part) => { part.disabled = false; });
    heldScan(answer.scans[1]);
  } catch (error) { link(error.message, true); }
}

// The time between two looks at the present while a scan of the past is shown, ms.
const NOW_EVERY = 1000;

// The present mode, alarms and forces, while a scan of the past is shown.
async function presentOf(hold) {
  if (state.hold !== hold) return;
  try {
    const answer = await get("/api/status");
    if (state.hold !== hold) return;
    if (answer.now) state.now = answer.now;
    if (answer.status) state.status = answer.status;
    link(answer.error ? answer.error + "; the mode shown is old" : "held at a scan of the past", !!answer.error);
    overviewParts();
    if (page && page.update) page.update({ status: answer.status });
  } catch (error) { link(error.message + "; the mode shown is old", true); }
  setTimeout(presentOf, NOW_EVERY, hold);
}

async function heldScan(scan) {
  if (!state.hold) return;
  const wanted = Math.min(Math.max(scan, state.scans[0]), state.scans[1]), mine = ++asked;
  try {
    const event = await get("/api/scan", { ...windowOf(), hold: state.hold, scan: wanted });
    if (mine !== asked || !state.hold) return;
    const scans = state.scans;
    take(event);
    state.scans = scans;
    scanText();
  } catch (error) { link(error.message, true); if (error.status === 410) { state.hold = null; open(); } }
}

// --- Tags, trends, devices, panels -------------------------------------------------------------

function tags(find) {
  const body = h("tbody", {}), more = h("p", { class: "soft" });
  const field = h("input", { type: "search", id: "find", autocomplete: "off", value: find || null, oninput: () => search() });
  $("content").replaceChildren(h("h2", {}, "Tags"), h("label", {}, "Search names, addresses and descriptions ", field), more,
    h("table", { class: "tags" }, h("thead", {}, h("tr", {}, ...["tag", "address", "value", "", "what it is"].map((name) =>
      h("th", { scope: "col" }, name)))), body));
  let turn = 0;
  async function search() {
    const mine = ++turn, isCurrent = () => mine === turn && body.isConnected;
    let answer;
    try { answer = await get("/api/tags", { find: field.value }); }
    catch (error) {
      if (!isCurrent()) return;
      link(error.message, true);
      setTimeout(() => { if (isCurrent()) search(); }, AGAIN);
      return;
    }
    // A late answer must not change what a different page watches.
    if (!isCurrent()) return;
    const rows = answer.tags.slice(0, 200).flatMap((tag) => tag.members.length
      ? tag.members.map((member) => ({ ...tag, name: member, address: member.replace(tag.name, tag.address) })) : [tag]);
    body.replaceChildren(...rows.slice(0, 250).map((tag) => h("tr", {},
      h("td", {}, whyButton(tag.name)), h("td", {}, tag.address),
      h("td", { class: "num" }, valueOf(tag.name), tag.unit ? " " + tag.unit : ""),
      h("td", {}, h("a", { href: "#trend/" + encodeURIComponent(tag.name) }, "trend"), " ", writer(tag.name)),
      h("td", {}, tag.doc || ""))));
    const left = answer.more + Math.max(0, rows.length - 250);
    more.textContent = left ? `${left} more: search for a part of a name, an address or a description`
      : rows.length ? "Select a tag to see why it has its value." : "no tag has this in its name, its address or its description";
    watch(rows.slice(0, 250).map((tag) => tag.name));
  }
  search();
  return { update() { refreshValues(body); } };
}

// A form that writes, where the user may.
function writer(name, label) {
  if (!state.session.write.includes(name)) return null;
  const said = h("span", { role: "status" });
  if (state.session.bits.includes(name)) {
    const to = (word) => h("button", { "aria-label": name + " " + word, onclick: () => write(name, word, said) }, word);
    return h("span", { class: "tools" }, to("ON"), to("OFF"), said);
  }
  const field = h("input", { size: "8", "aria-label": "new value of " + name });
  return h("form", { class: "tools", onsubmit: async (event) => {
    event.preventDefault();
    await write(name, field.value, said);
  } }, field, h("button", {}, label || "Write"), said);
}

async function write(name, value, said) {
  const reason = await reasonFor(name, name);
  if (reason === null) return;
  try {
    const change = await post("/api/write", { operand: name, value, reason });
    said.className = "soft";
    said.textContent = "now " + textOf(name, ofAnswer(change.now)) + (change.note ? "; " + change.note : "");
  } catch (error) { said.className = "error"; said.textContent = error.message; }
}

function alarms() {
  watch([]);
  const place = h("div", {});
  const fill = () => renew(place, alarmTable(state.status ? state.status.alarms : []));
  $("content").replaceChildren(h("h2", {}, "Alarms"), place);
  fill();
  return { update(event) { if (event.status) fill(); } };
}

function events() {
  watch([]);
  const body = h("tbody", {}), said = h("p", { class: "soft", role: "status" }), changes = h("section", {});
  async function load() {
    deploys(changes).catch((error) => changes.replaceChildren(h("h2", {}, "Changes of the program"), h("p", { class: "error" }, error.message)));
    try {
      const answer = await get("/api/events", held());
      said.textContent = answer.events.length ? "" : "nothing has happened for a minute";
      body.replaceChildren(...answer.events.map((of) => h("tr", {},
        h("td", { class: "num" }, clockOf(of.time_ms, 3)), h("td", { class: "num", "data-label": "scan" }, of.scan),
        h("td", { class: of.alarm ? "alarm" : "" }, of.text), h("td", {}, of.operand ? whyButton(of.operand, `Why ${of.operand}?`) : ""))));
    } catch (error) { said.textContent = error.message; }
  }
  $("content").replaceChildren(h("div", { class: "tools" }, h("h2", {}, "Latest events"),
    h("button", { onclick: load }, "Refresh")), said,
  h("table", { class: "stack events" }, h("thead", {}, h("tr", {}, ...["time", "scan", "event", ""].map((name) => h("th", { scope: "col" }, name)))), body),
  changes);
  load();
  return {};
}

// The changes of the program since the controller started: who, when, and each difference.
async function deploys(place) {
  const { deploys } = await get("/api/deploys");
  const when = (ns) => new Date(ns / 1e6).toLocaleDateString() + " " + clockOf(ns / 1e6);
  place.replaceChildren(h("h2", {}, "Changes of the program"), ...deploys.length ? deploys.map((of, at) => h("details", { open: at === 0 },
    h("summary", {}, `${when(of.unix_ns)}: ${of.who} ${of.rollback ? "went back to" : "loaded"} ${of.ladder} (SHA-256 ${of.sha256.slice(0, 12)})`),
    h("ul", { class: "report" }, ...(of.report.length ? of.report : ["no difference in what the program does"]).map((line) => h("li", {}, line)),
      of.more ? h("li", {}, `and ${of.more} more: the log has all of them`) : null)))
    : [h("p", { class: "soft" }, "none since the controller has started")]);
}

function devices() {
  watch([]);
  const place = h("div", {});
  const fill = () => { if (state.status) renew(place, deviceTable(state.status.devices)); };
  $("content").replaceChildren(h("h2", {}, "Devices"), place);
  fill();
  return { update(event) { if (event.status) fill(); } };
}

// --- Pages -------------------------------------------------------------------------------------

const PAGES = [["overview", "Overview", overview], ["ladder", "Ladder", ladder], ["tags", "Tags", tags],
  ["alarms", "Alarms", alarms], ["events", "Events", events], ["devices", "Devices", devices], ["panel", "Panels", panel], ["trend", null, trend]];

// Opens the page that the address names. Answers may come late: only the latest call shows its page.
async function open() {
  const mine = ++opened;
  const [name, ...rest] = location.hash.slice(1).split("/");
  const found = PAGES.find(([key]) => key === name) || PAGES[0];
  try {
    if (!state.ladder) {
      [state.ladder, state.panels] = [await get("/api/ladder"), (await get("/api/panels")).panels];
      state.session = await get("/api/session");
      $("name").textContent = state.ladder.name;
      document.title = state.ladder.name + " – rungd";
    }
  } catch (error) {
    if (mine !== opened) return;
    link(error.message, true);
    $("content").replaceChildren(h("p", { class: "error" }, error.message));
    setTimeout(() => { if (mine === opened) open(); }, AGAIN);
    return;
  }
  if (mine !== opened) return;
  if (page && page.leave) page.leave();
  tabs(found[0]);
  page = null;
  const next = found[2](decodeURIComponent(rest.join("/")));
  page = next;
}

function tabs(current) {
  const shown = PAGES.filter(([, label]) => label);
  const user = state.session.user;
  $("tabs").replaceChildren(...shown.map(([key, label]) => h("li", {},
    h("a", { href: "#" + key, "aria-current": key === current ? "page" : false }, label))),
  user ? h("li", {}, state.session.signed_out
    ? h("button", { class: "plain", onclick: () => signIn("sign in", user) }, "Sign in")
    : h("button", { class: "plain", onclick: async () => { await post("/api/logout", {}); location.reload(); } },
      `Sign out ${user} (${state.session.role})`)) : "");
}

// --- Signing out by itself -----------------------------------------------------------------------

// When a person last did something here, and when the server was last told so, ms.
let acted = Date.now(), told = Date.now();

function act() {
  acted = Date.now();
  const max = state.session && state.session.sign_out_ms;
  if (!max || state.session.signed_out || acted - told < max / 10) return;
  told = acted;
  post("/api/stay", {}).catch(() => { /* the next one tells it */ });
}

// Nobody has done anything for the time of `sign-out`: the server says whether that ends the rights.
async function lookIdle() {
  const session = state.session, max = session && session.sign_out_ms;
  if (!max || !session.user || session.signed_out || Date.now() - acted < max) return;
  // A second page of this browser may have been in use: asked again in a while.
  acted = Date.now() - max + Math.min(max, 5000);
  try {
    state.session = await get("/api/session");
    if (state.session.signed_out) open();
  } catch { /* the link says it */ }
}

// The form for a name and a password or PIN. After signing in, the page that was open is shown again.
function signIn(why, name) {
  if (page && page.leave) page.leave();
  page = null;
  const user = h("input", { autocomplete: "username", required: true, value: name });
  const password = h("input", { type: "password", autocomplete: "current-password", required: true });
  const said = h("p", { class: "error", role: "alert" });
  $("content").replaceChildren(why === "sign in" ? h("form", { class: "sign", onsubmit: async (event) => {
    event.preventDefault();
    said.textContent = "";
    try { await post("/api/login", { user: user.value, password: password.value }); location.reload(); }
    catch (error) { said.textContent = error.message; }
  } }, h("h2", {}, "Sign in"), h("label", {}, "User ", user), h("label", {}, "Password or PIN ", password),
  h("button", {}, "Sign in"), said) : h("p", {}, why));
}

$("skip").addEventListener("click", (event) => { event.preventDefault(); $("content").focus(); });
window.addEventListener("hashchange", () => { $("why").hidden = true; window.scrollTo(0, 0); open(); });
for (const input of ["pointerdown", "keydown"]) document.addEventListener(input, act, { capture: true, passive: true });
setInterval(lookIdle, 1000);
document.addEventListener("keydown", (event) => {
  if (event.key === "Escape") closeWhy();
  if (state.hold && !/INPUT|CANVAS/.test(event.target.tagName)) {
    if (event.key === ",") heldScan(state.scan - 1);
    if (event.key === ".") heldScan(state.scan + 1);
  }
});
(async () => {
  try { state.session = await get("/api/session"); }
  catch (error) {
    if (error.status === 401) { signIn(error.message); return; }
    link(error.message, true);
  }
  open();
})();
