"use strict";
// The list of alarms on the pages of `rungd web`, and what people do with an alarm: acknowledge it, shelve it,
// take it out of service, bring it back. Loaded before app.js, whose functions it calls.

// The alarms in short, for the overview.
function alarmsInShort(alarms) {
  if (!alarms.length) return h("p", { class: "soft" }, "no active alarm");
  return h("table", { class: "stack" }, h("tbody", {}, ...alarms.map((alarm) => h("tr", {},
    h("td", {}, h("span", { class: alarm.ended || alarm.shelved ? "" : "alarm" }, alarm.text)),
    h("td", {}, stateOf(alarm)), h("td", {}, whyOf(alarm))))));
}

// The alarms of the list, first the ones that stand, in the order in which they rose.
function alarmTable(alarms) {
  if (!alarms.length) return h("p", { class: "soft" }, "no active alarm");
  const clock = (at) => at ? clockOf(at.unix_ns / 1e6) : "";
  // Without groups their column would take the room of the text.
  const group = alarms.some((alarm) => alarm.group) ? ["group"] : [];
  return h("table", { class: "stack" }, h("thead", {}, h("tr", {}, ...["alarm", "priority", ...group, "state", "since", "today", ""].map((name) =>
    h("th", { scope: "col" }, name)))), h("tbody", {}, ...alarms.map((alarm) => h("tr", {},
    h("td", {}, h("span", { class: alarm.ended || alarm.shelved ? "" : "alarm" }, alarm.text), h("div", {}, whyOf(alarm))),
    h("td", {}, alarm.priority), group.length ? h("td", {}, alarm.group || "") : null, h("td", {}, stateOf(alarm)),
    h("td", { class: "num", "data-label": "since" }, clock(alarm.since) + (alarm.order ? ", no. " + alarm.order : "")),
    h("td", { class: "num", "data-label": "today" }, String(alarm.day || "")), h("td", {}, handling(alarm))))));
}

// Why an alarm is active. A watch has no tag: the controller has explained it when it rose.
function whyOf(alarm) {
  if (!alarm.watch) return whyButton(alarm.tag, `Why ${alarm.tag}?`);
  const lines = ["it does not hold: " + alarm.watch, ...(alarm.why || [])];
  return h("details", {}, h("summary", {}, `Why ${alarm.tag}?`), h("pre", {}, lines.join("\n")));
}

// The user of a change made on a page; the controller adds the program that made it: `anna by rungd-web`.
const person = (who) => who.split(" by ")[0];

function stateOf(alarm) {
  if (alarm.shelved) {
    const end = alarm.shelved.until_ns ? "shelved until " + clockOf(alarm.shelved.until_ns / 1e6) : "out of service";
    return `${end} by ${person(alarm.shelved.who)}: ${alarm.shelved.why}`;
  }
  if (alarm.state === "acknowledged") return "acknowledged" + (alarm.acknowledged ? " by " + person(alarm.acknowledged.who) : "");
  return alarm.state === "returned" ? "returned, not acknowledged" : "not acknowledged";
}

// The buttons of an alarm, for a user who may press them; what a button said is below it.
function handling(alarm) {
  const { role } = state.session, isService = role === "service";
  if (role === "view") return null;
  const said = h("span", { role: "status", class: "soft" });
  const sends = (label, send) => h("button", { onclick: async () => {
    try { tell(said, await send()); } catch (error) { tell(said, error.message, "error"); }
  } }, label);
  const buttons = [];
  if (alarm.shelved) {
    if (alarm.shelved.until_ns || isService) {
      buttons.push(sends(alarm.shelved.until_ns ? "Unshelve" : "Return to service", async () =>
        shelfWords(await post("/api/unshelve", { alarm: alarm.tag }), "back")));
    }
  } else {
    if (alarm.state !== "acknowledged") buttons.push(sends("Acknowledge", () => acknowledge(alarm)));
    // The controller would refuse it.
    if (alarm.priority !== "critical" || state.session.shelves_critical) buttons.push(h("button", { onclick: () => shelfDialog(alarm, said, isService) }, "Shelve…"));
  }
  return h("div", { class: "tools" }, ...buttons, said);
}

async function acknowledge(alarm) {
  const done = (await post("/api/ack", { alarm: alarm.tag })).alarms || [];
  const untold = done.map((acked) => acked.bit_refused).filter(Boolean);
  if (untold.length) throw new Error("acknowledged; the ladder does NOT see it: " + untold.join("; "));
  return "acknowledged";
}

// What the controller did with a shelf.
function shelfWords(done, words) {
  return done.not_kept ? `${words}; a restart of rungd would forget it: ${done.not_kept}` : words;
}

// The times for which an alarm is shelved, ms; null: out of service, until somebody brings it back.
const HOUR = 3600000;
const SHELVES = [["15 minutes", HOUR / 4], ["1 hour", HOUR], ["8 hours", 8 * HOUR], ["24 hours", 24 * HOUR], ["a week", 168 * HOUR]];

// Asks for how long an alarm is shelved, and why.
function shelfDialog(alarm, said, isService) {
  const times = isService ? [...SHELVES, ["out of service", null]] : SHELVES;
  const choice = h("select", { "aria-label": "for how long" }, ...times.map(([label], at) =>
    h("option", { value: at, selected: at === 2 }, label)));
  const why = h("input", { maxlength: "200", required: true, autofocus: true, autocomplete: "off", "aria-label": "why" });
  const question = "Shelve: " + alarm.text, dialog = h("dialog", { class: "ask", "aria-label": question });
  const wrong = h("p", { class: "error", role: "alert" });
  const send = async (event) => {
    event.preventDefault();
    const [label, ms] = times[choice.value], wanted = { alarm: alarm.tag, why: why.value.trim() };
    try {
      const done = ms === null ? await post("/api/out-of-service", wanted) : await post("/api/shelve", { ...wanted, for_ms: ms });
      dialog.close();
      tell(said, shelfWords(done, ms === null ? label : "shelved for " + label));
    } catch (error) { tell(wrong, error.message); }
  };
  dialog.append(h("form", { onsubmit: send }, h("p", {}, question), h("label", {}, "For how long ", choice),
    h("label", {}, "Why ", why), wrong, h("div", { class: "tools" }, h("button", { class: "big" }, "Shelve"),
      h("button", { class: "big", type: "button", onclick: () => dialog.close() }, "Cancel"))));
  openDialog(dialog, () => {});
}
