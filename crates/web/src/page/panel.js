"use strict";
// The panels of `rungd web`: pages for people at the machine, for fingers in gloves. Loaded before app.js,
// whose functions it calls. Each kind of part is a function that returns its card (`card`), what each scan
// changes in it (`update`), and what ends with the page (`leave`).

const PARTS = { mimic: mimicPart, alarms: alarmsPart, recipe: recipePart, lamp: lampPart, button: commandPart, hold: holdPart, value: valuePart, bar: barPart, trend: trendPart };

function panel(name) {
  const all = state.panels, chosen = all.find((of) => of.name === name) || all[0];
  if (!chosen) {
    $("content").replaceChildren(h("h2", {}, "Panels"), h("p", {},
      "This controller has no panel. A `[[panel]]` in its controller file makes one: docs/web.md shows how."));
    return {};
  }
  const parts = chosen.show.map((part) => {
    const label = part.text || part.operand, made = PARTS[part.kind](part, label);
    made.card.setAttribute("aria-label", label);
    return made;
  });
  $("content").replaceChildren(h("div", { class: "tools" }, h("h2", {}, chosen.name), ...all.filter((of) => of !== chosen)
    .map((of) => h("a", { href: "#panel/" + encodeURIComponent(of.name) }, of.name))),
  h("div", { class: "panel" }, ...parts.map((part) => part.card)));
  const named = chosen.show.filter((part) => !["alarms", "recipe", "mimic"].includes(part.kind)).map((part) => part.operand);
  // A drawing names its tags when it has come.
  const look = () => watch([...named, ...parts.flatMap((part) => part.tags || [])]);
  parts.forEach((part) => { if (part.load) part.load(look); });
  look();
  const each = (what) => parts.forEach((part) => { if (part[what]) part[what](); });
  each("update");
  return { update() { each("update"); }, leave() { each("leave"); } };
}

// --- Values ------------------------------------------------------------------------------------

// A number of a part, with its decimal places: a whole number 235 with one is 23.5.
function numberOf(part, value) {
  if (part.decimals == null) return text(value);
  return (part.real ? value : value / 10 ** part.decimals).toFixed(part.decimals);
}

// The value of a part as it is read: the text of a state, or a number with its unit.
function partText(part, value) {
  if (isOutput(value) || typeof value !== "number") return textOf(part.operand, value);
  const meant = (state.texts[part.operand] || {})[value];
  return meant !== undefined ? `${meant} (${value})` : numberOf(part, value) + (part.unit ? " " + part.unit : "");
}

// Changes a text only if it differs, so that nothing is selected away and nothing is read aloud twice.
function tell(place, words, kind) {
  if (place.textContent !== words) place.textContent = words;
  if (kind !== undefined) place.className = kind;
}

// The place of a part's value, kept up to date by `update`.
function shownValue(part) {
  const place = h("p", { class: "value", "data-value-of": part.operand }, "…");
  return { place, update: () => tell(place, partText(part, state.values[part.operand])) };
}

function lampPart(part, label) {
  const lamp = h("p", { class: "lamp", "data-lamp": part.operand }, "…");
  return { card: card(label, lamp), update() {
    const value = state.values[part.operand], on = isOutput(value) ? value.on : value;
    const sign = on === null ? "? " : on ? "● " : "○ ";
    lamp.classList.add(part.color || "green");
    tell(lamp, value === undefined ? "…" : sign + (isOutput(value) ? outputText(value) : text(!!value)));
    lamp.classList.toggle("on", on === true);
  } };
}

// The alarms of a group, or all of them.
function alarmsPart(part, label) {
  const place = h("div", {}), isShown = (alarm) => part.operand === "*" || alarm.group === part.operand;
  return { card: h("section", { class: "card wide" }, h("h3", {}, label === "*" ? "Alarms" : label), place),
    update() { if (state.status) renew(place, alarmTable(state.status.alarms.filter(isShown))); } };
}

// A drawing, in which `data-` attributes bind colours, texts and visibility to tags. The server has made it
// safe: what comes has shapes and texts alone.
function mimicPart(part, label) {
  const place = h("div", { class: "mimic" }), said = h("p", { class: "soft" });
  const made = { card: h("section", { class: "card wide" }, h("h3", {}, label === part.operand ? null : label), place, said), tags: [],
    async load(look) {
      try {
        const got = await get("/api/mimic", { operand: part.operand });
        if (!place.isConnected) return;
        const drawing = new DOMParser().parseFromString(got.svg, "image/svg+xml").documentElement;
        place.replaceChildren(document.importNode(drawing, true));
        const bound = [...place.querySelectorAll("[data-tag]")];
        bound.forEach(bind);
        made.tags = [...new Set(bound.map((of) => of.dataset.tag))];
        const told = [got.unknown.length ? "not in the ladder: " + got.unknown.join(", ") : "",
          got.left_out.length ? "left out of the drawing: " + got.left_out.join(", ") : ""];
        tell(said, told.filter(Boolean).join("; "));
        look();
      } catch (error) { tell(said, error.message, "error"); }
    },
    update() { for (const of of place.querySelectorAll("[data-tag]")) showBound(of); } };
  return made;
}

// A press on a part of a drawing asks why its tag has its value.
function bind(element) {
  const name = element.dataset.tag, ask = () => why(name);
  element.setAttribute("tabindex", "0");
  element.setAttribute("role", "button");
  element.addEventListener("click", (event) => { event.stopPropagation(); ask(); });
  element.addEventListener("keydown", (event) => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); ask(); } });
}

function showBound(element) {
  const { tag, on, off, show, text: shown, decimals, unit } = element.dataset;
  const value = state.values[tag], driven = isOutput(value) ? value.on : value, is = !!driven;
  const known = value !== undefined && driven !== null;
  const set = (name, wanted) => { if (element.getAttribute(name) !== wanted) element.setAttribute(name, wanted); };
  const colour = known ? is ? on : off : undefined;
  // A line has no inside: its colour is that of its stroke.
  if (colour) set(element.getAttribute("fill") === "none" || element.localName === "line" ? "stroke" : "fill", colour);
  if (show !== undefined) set("visibility", !known || is === (show !== "off") ? "visible" : "hidden");
  element.classList.toggle("unknown", !known);
  const words = partText({ operand: tag, unit, decimals: decimals === undefined ? null : Math.min(6, Number(decimals) || 0), real: !Number.isInteger(value) }, value);
  if (shown !== undefined && element.textContent !== words) element.textContent = words;
  const label = `${tag}: ${words}`;
  set("aria-label", label);
}

function barPart(part, label) {
  const [low, high] = part.limits, shown = shownValue(part), length = h("div", {});
  const ends = `${numberOf(part, low)} to ${numberOf(part, high)}`;
  return { card: card(label, shown.place, h("div", { class: "bar", "data-bar": part.operand }, length), h("p", { class: "soft" }, ends)),
    update() {
      shown.update();
      const share = (Number(state.values[part.operand]) - low) / (high - low);
      length.style.width = Math.min(100, Math.max(0, share * 100)) + "%";
    } };
}

function trendPart(part, label) {
  const canvas = h("canvas", { role: "img", "aria-label": "trend of " + label }), shown = shownValue(part);
  let data = null, pointer = null;
  const show = () => { if (data) draw(canvas, data, { from: 0, to: 1 }, part.limits, pointer); };
  const named = (value) => (state.texts[part.operand] || {})[value] || numberOf(part, data.isBit ? !!value : value);
  const took = (got) => {
    data = { ...got, name: part.operand, named, isBit: got.points.some((point) => typeof point[2] === "boolean") };
    show();
  };
  pointAt(canvas, (at) => { pointer = at; show(); });
  const followed = follow(part.operand, part.minutes || 1, took, () => { /* the link says it */ });
  const made = h("section", { class: "card trend" }, h("h3", {}, label), shown.place,
    spanButtons(part.minutes || 1, (minutes) => followed.choose(minutes)), canvas);
  return { card: made, update: shown.update, leave: followed.end };
}

// --- Commands ----------------------------------------------------------------------------------

// Why a part cannot be operated; empty: it can.
function whyNot(name) {
  if (state.session.write.includes(name)) return "";
  if (!state.session.user) return "for users who have signed in";
  if (state.session.signed_out) return "signed out: sign in again";
  return "`[web] write` does not list it for the role " + state.session.role;
}

// A button whose press writes ON once. The ladder takes the command by turning the bit OFF.
function commandPart(part, label) {
  const name = part.operand, not = whyNot(name), said = h("p", { role: "status", class: "soft" }, not);
  // The moment of a write whose bit is still ON, by the controller's clock.
  let waits = null;
  const taken = () => { waits = null; tell(said, "taken, " + clockOf(Date.now()), "taken"); };
  const send = async () => {
    if (part.confirm && !await confirmed(part.confirm, label)) return;
    const reason = await reasonFor(name, label);
    if (reason === null) return;
    waits = null;
    tell(said, "…", "soft");
    try {
      const change = await post("/api/write", { operand: name, value: true, reason });
      if (change.taken) taken();
      else if (change.now.value === true) { waits = change.at_ms; tell(said, "ON: waits for the ladder", "soft"); }
      else {
        tell(said, "not taken: the ladder has overwritten it. ", "error");
        said.append(whyButton(name, "Why?"));
      }
    } catch (error) { tell(said, error.message, "error"); }
  };
  const button = h("button", { class: "big", disabled: !!not, onclick: send }, label);
  return { card: h("section", { class: "card" }, button, said), update() {
    const value = state.values[name];
    button.classList.toggle("on", value === true);
    if (waits !== null && !state.hold && state.time > waits && value === false) taken();
  } };
}

// How long a bit is held without a renewal, and the time between two renewals, ms. The controller has the
// same limit, and its scan turns the bit OFF.
const HOLD = 400, RENEW_EVERY = 100;
// The most renewals that wait for their answers: more of them only fill a slow connection.
const RENEWALS_MAX = 4;

// A button that holds a bit ON while it is pressed. A renewal that comes late is refused, so the machine
// never moves for longer than HOLD after the finger, the page, the tablet or the network is gone.
function holdPart(part, label) {
  const name = part.operand, not = whyNot(name), said = h("p", { role: "status", class: "soft" }, not);
  // The present press: its number in the controller when it is known, and what renews it.
  let press = null;
  // Why it is pressed, if the operand wants a reason: asked before the first press, and the reason of all
  // presses until the page is left. Nobody writes while holding a button.
  let reason;
  const asksFirst = () => state.session.reasons.includes(name) && reason === undefined;
  const ask = async () => {
    const given = await reasonFor(name, label);
    if (!given) return;
    reason = given;
    tell(said, "now hold it pressed: " + reason, "soft");
  };
  const send = (change) => post("/api/press", change, HOLD);
  const end = (words, kind) => {
    const ended = press;
    if (!ended) return;
    press = null;
    clearInterval(ended.timer);
    if (words !== undefined) tell(said, words, kind);
    if (ended.hold) post("/api/press", { hold: ended.hold, end: true }).catch(() => { /* it ends by itself */ });
  };
  const renew = async (mine) => {
    if (press !== mine || mine.waiting >= RENEWALS_MAX) return;
    mine.waiting += 1;
    try { await send({ hold: mine.hold }); }
    catch (error) { if (press === mine && error.status) end("let go: " + error.message, "error"); }
    mine.waiting -= 1;
  };
  const begin = async () => {
    if (press || not) return;
    // Asked by the click: a dialog that opens while the finger is down loses its focus.
    if (asksFirst()) return;
    // Without the controller's clock the page could not say until when it presses.
    if (!clock) { tell(said, "not connected yet", "error"); return; }
    const mine = press = { waiting: 0 };
    tell(said, "…", "soft");
    try {
      const change = await send({ operand: name, reason });
      mine.hold = change.hold;
      // Released before the answer came: it is over at once.
      if (press !== mine) { post("/api/press", { hold: mine.hold, end: true }).catch(() => {}); return; }
      if (change.now.value !== true) { end("the ladder has turned it OFF", "error"); return; }
      tell(said, "ON while pressed", "taken");
      mine.timer = setInterval(renew, RENEW_EVERY, mine);
    } catch (error) {
      if (press === mine) { press = null; tell(said, error.message, "error"); }
    }
  };
  const letGo = () => end("", "soft");
  const button = h("button", { class: "big hold", disabled: !!not, "aria-label": label + ", hold it pressed",
    onpointerdown: (event) => { if (event.button === 0) { button.setPointerCapture(event.pointerId); begin(); } },
    onclick: () => { if (!not && asksFirst()) ask(); },
    onpointerup: letGo, onpointercancel: letGo, onlostpointercapture: letGo, onblur: letGo,
    // A long press on a tablet opens a menu instead.
    oncontextmenu: (event) => event.preventDefault(),
    onkeydown: (event) => { if ((event.key === " " || event.key === "Enter") && !event.repeat) begin(); },
    onkeyup: (event) => { if (event.key === " " || event.key === "Enter") letGo(); } }, label);
  const hidden = () => { if (document.hidden) letGo(); };
  document.addEventListener("visibilitychange", hidden);
  window.addEventListener("pagehide", letGo);
  return { card: h("section", { class: "card" }, button, h("p", { class: "soft" }, "hold it pressed"), said), update() {
    const value = state.values[name];
    button.classList.toggle("on", value === true);
  }, leave() {
    letGo();
    document.removeEventListener("visibilitychange", hidden);
    window.removeEventListener("pagehide", letGo);
  } };
}

// Asks a question before a command is sent; true: yes.
function confirmed(question, yes) {
  return new Promise((answer) => {
    const dialog = h("dialog", { class: "ask", "aria-label": question });
    const end = (word) => () => dialog.close(word);
    dialog.append(h("p", {}, question), h("div", { class: "tools" },
      h("button", { class: "big", onclick: end("yes") }, yes), h("button", { class: "big", autofocus: true, onclick: end("") }, "Cancel")));
    openDialog(dialog, () => answer(dialog.returnValue === "yes"));
  });
}

// The reason of a write, if the operand wants one: undefined if it wants none, null if none is given.
function reasonFor(name, label) {
  return state.session.reasons.includes(name) ? askReason(`${label}: why?`) : Promise.resolve(undefined);
}

function askReason(question) {
  return new Promise((answer) => {
    const field = h("input", { maxlength: "200", required: true, autofocus: true, autocomplete: "off", "aria-label": question });
    const dialog = h("dialog", { class: "ask", "aria-label": question });
    let given = null;
    dialog.append(h("form", { onsubmit: (event) => {
      event.preventDefault();
      given = field.value.trim() || null;
      dialog.close();
    } }, h("p", {}, question), field, h("div", { class: "tools" }, h("button", { class: "big" }, "OK"),
      h("button", { class: "big", type: "button", onclick: () => dialog.close() }, "Cancel"))));
    openDialog(dialog, () => answer(given));
  });
}

// Shows a dialog, and removes it when it is closed.
function openDialog(dialog, closed) {
  dialog.addEventListener("close", () => { dialog.remove(); closed(); });
  // A page that is left takes its dialogs with it, and none of them answers yes.
  window.addEventListener("hashchange", () => dialog.close(""), { once: true });
  document.body.append(dialog);
  dialog.showModal();
}

// --- New values --------------------------------------------------------------------------------

// A value; with a button that asks for a new one, where the user may write.
function valuePart(part, label) {
  const shown = shownValue(part), said = h("p", { role: "status", class: "soft" });
  const name = part.operand;
  const send = async (value) => {
    const reason = await reasonFor(name, label);
    if (reason === null) return;
    tell(said, "…", "soft");
    try {
      const change = await post("/api/write", { operand: name, value, reason });
      tell(said, "now " + partText(part, ofAnswer(change.now)) + (change.note ? "; " + change.note : ""), "soft");
    } catch (error) { tell(said, error.message, "error"); }
  };
  let set = null;
  if (!whyNot(name)) {
    set = !part.takes ? h("div", { class: "tools" }, ...[true, false].map((on) =>
      h("button", { class: "big", "aria-label": `${label} ${text(on)}`, onclick: () => send(on) }, text(on))))
      : h("button", { class: "big", "aria-label": "Set " + label, onclick: async () => {
        const value = await entered(part, label);
        if (value !== null) send(value);
      } }, "Set");
  }
  return { card: card(label, shown.place, set, said), update: shown.update };
}

// Asks for a new value: the states of a word that has texts, else a number by a keypad.
function entered(part, label) {
  return new Promise((answer) => {
    const dialog = h("dialog", { class: "ask keypad", "aria-label": "new value of " + label });
    let value = null;
    const take = (given) => { value = given; dialog.close(); };
    const texts = Object.entries(state.texts[part.operand] || {});
    dialog.append(h("h2", {}, label), ...(texts.length ? statesOf(texts, take) : keypad(part, label, take)),
      h("button", { class: "big", onclick: () => dialog.close() }, "Cancel"));
    openDialog(dialog, () => answer(value));
  });
}

function statesOf(texts, take) {
  return texts.map(([value, meant]) => h("button", { class: "big", onclick: () => take(value) }, `${meant} (${value})`));
}

// The keys of a keypad, and what each makes of the text that stands there.
const KEYS = [..."789456123"].map((key) => [key, (said) => said + key]).concat([
  ["±", (said) => said.startsWith("-") ? said.slice(1) : "-" + said], ["0", (said) => said + "0"],
  [".", (said) => said.includes(".") ? said : said + "."]]);

function keypad(part, label, take) {
  const [low, high] = part.takes, places = part.real ? null : part.decimals || 0;
  const limits = `${numberOf(part, low)} to ${numberOf(part, high)}${part.unit ? " " + part.unit : ""}`;
  // A keyboard of the tablet's own would hide the keys.
  const field = h("input", { inputmode: "none", autocomplete: "off", autofocus: true, "aria-label": "new value of " + label });
  const wrong = h("p", { role: "alert", class: "error" });
  const give = () => {
    const written = field.value.trim().replace(",", "."), behind = (written.split(".")[1] || "").length;
    const number = Number(written), content = places === null ? number : Math.round(number * 10 ** places);
    // Durations and other notations are the controller's to read.
    if (places === 0 && /^0x|[a-z]/i.test(written)) return take(written);
    if (written === "" || !Number.isFinite(number)) tell(wrong, "this is no number");
    else if (places !== null && behind > places) tell(wrong, places ? `at most ${places} behind the point` : "a whole number");
    else if (content < low || content > high) tell(wrong, "outside of " + limits);
    else take(places === null ? written : String(content));
  };
  const press = (change) => () => { field.value = change(field.value); tell(wrong, ""); field.focus(); };
  const key = (sign, change, label) => h("button", { type: "button", class: "key", "aria-label": label, onclick: press(change) }, sign);
  return [h("p", { class: "soft" }, `now ${partText(part, part.value !== undefined ? part.value : state.values[part.operand])}; takes ${limits}`),
    h("form", { onsubmit: (event) => { event.preventDefault(); give(); } }, field, wrong,
      h("div", { class: "keys" }, ...KEYS.map(([sign, change]) => key(sign, change))),
      h("div", { class: "tools" }, key("⌫", (said) => said.slice(0, -1), "delete the last digit"),
        key("C", () => "", "delete all"), h("button", { class: "big" }, "OK")))];
}
