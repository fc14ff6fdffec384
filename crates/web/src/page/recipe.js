"use strict";
// A recipe of a panel: the values of a record array as a table. Changes are collected, shown, and sent as
// one, which one scan takes whole. A file of a recipe is that of `rungd read --file`. Loaded before panel.js.

// A name as `recipes[2].sugar`: its row and its column.
function cellOf(recipe, operand) {
  const rest = operand.slice(recipe.length), found = rest.match(/^\[(\d+)\]\.?(.*)$/);
  return found ? { row: found[1], column: found[2] || "value" } : { row: "", column: rest.replace(/^\./, "") };
}

function recipePart(part, label) {
  const said = h("p", { role: "status", class: "soft" }), place = h("div", { class: "scroll" }), tools = h("div", { class: "tools" });
  const ofRecipe = (name) => name.startsWith(part.operand) && ".[".includes(name[part.operand.length] || "-");
  const may = part.write && state.session.write.some(ofRecipe);
  // The values of the controller, the changes that are not written, and the reasons of refused ones.
  let values = [], file = "", changes = new Map(), mistakes = new Map();
  const chosen = h("input", { type: "file", accept: ".toml,text/plain", class: "skip", tabindex: "-1", "aria-hidden": "true", onchange: () => load() });
  const act = (name, run, disabled) => h("button", { class: "big", disabled, onclick: run }, name);

  async function refresh() {
    try {
      const got = await get("/api/recipe", { operand: part.operand });
      [values, file] = [got.values, got.file];
      show();
    } catch (error) { tell(said, error.message, "error"); }
  }
  // The value of a cell with its change, and as the controller takes it.
  const shownOf = (of) => {
    const given = changes.has(of.operand) ? changes.get(of.operand) : of.value;
    return typeof given === "boolean" ? text(given) : String(given);
  };
  function change(of, value) {
    const same = String(value) === String(of.value);
    if (same) changes.delete(of.operand); else changes.set(of.operand, value);
    mistakes.delete(of.operand);
    show();
  }
  async function edit(of, title) {
    if (!of.takes) { change(of, !(changes.has(of.operand) ? changes.get(of.operand) : of.value)); return; }
    const value = await entered({ ...of, decimals: null }, title);
    if (value !== null) change(of, value);
  }
  async function write() {
    const reason = part.reason ? await askReason(`Write ${changes.size} values of ${label}: why?`) : undefined;
    if (reason === null || !part.reason && !await confirmed(`Write ${changes.size} values of ${label}?`, "Write")) return;
    tell(said, "…", "soft");
    const writes = [...changes].map(([operand, value]) => ({ operand, value }));
    try {
      await post("/api/recipe", { operand: part.operand, writes, reason });
      changes = new Map(); mistakes = new Map();
      tell(said, `written as one change, ${clockOf(Date.now())}`, "taken");
      refresh();
    } catch (error) {
      mistakes = new Map((error.mistakes || []).map((of) => [of.operand, of.message]));
      tell(said, error.message, "error");
      show();
    }
  }
  async function load() {
    const [of] = chosen.files;
    if (!of) return;
    try {
      const got = await post("/api/recipe/read", { operand: part.operand, file: await of.text() });
      const known = new Map(values.map((one) => [one.operand, one]));
      const unknown = got.writes.filter((one) => !known.has(one.operand));
      if (unknown.length) throw new Error(`the file has \`${unknown[0].operand}\`, which this recipe does not have: nothing is loaded`);
      changes = new Map(); mistakes = new Map();
      // A file has all values as texts; those that differ are changes.
      for (const { operand, value } of got.writes) {
        const now = known.get(operand), bit = typeof now.value === "boolean";
        const given = bit ? value === "true" : value;
        if (bit ? given !== now.value : Number(given) !== Number(now.value)) changes.set(operand, given);
      }
      tell(said, `${of.name}: ${changes.size} values differ. Look at them, then write them.`, "soft");
      show();
    } catch (error) { tell(said, error.message, "error"); }
    chosen.value = "";
  }
  function save() {
    const link = h("a", { href: URL.createObjectURL(new Blob([file], { type: "text/plain" })), download: label.replace(/[^\p{L}\p{N}_-]+/gu, "-") + ".toml" });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }
  function cell(of, row, column) {
    if (!of) return h("td", {});
    const title = row ? `${label} ${row}, ${column}` : `${label}, ${column}`, why = mistakes.get(of.operand);
    const kind = why ? "cell wrong" : changes.has(of.operand) ? "cell changed" : "cell";
    const inside = may ? h("button", { class: kind, "aria-label": `${title}: ${shownOf(of)}`, title: why, onclick: () => edit(of, title) }, shownOf(of)) : h("span", {}, shownOf(of));
    return h("td", { class: "num" }, inside, why ? h("p", { class: "error" }, why) : null);
  }
  function show() {
    const cells = values.map((of) => ({ of, ...cellOf(part.operand, of.operand) }));
    const columns = [...new Set(cells.map((of) => of.column))], rows = [...new Set(cells.map((of) => of.row))];
    const units = new Map(cells.map((of) => [of.column, of.of.unit]));
    const at = new Map(cells.map((of) => [of.row + "." + of.column, of.of]));
    place.replaceChildren(h("table", {}, h("thead", {}, h("tr", {}, rows[0] ? h("th", { scope: "col" }, "no.") : null,
      ...columns.map((name) => h("th", { scope: "col" }, name + (units.get(name) ? `, ${units.get(name)}` : ""))))),
    h("tbody", {}, ...rows.map((row) => h("tr", {}, row ? h("th", { scope: "row" }, row) : null,
      ...columns.map((name) => cell(at.get(row + "." + name), row, name)))))));
    tools.replaceChildren(...(may ? [act(changes.size ? `Write ${changes.size} changes` : "Write", write, !changes.size),
      act("Undo", () => { changes = new Map(); mistakes = new Map(); tell(said, "", "soft"); refresh(); }, !changes.size),
      act("Load a file", () => chosen.click(), false)] : []),
    act("Save a file", save, false), act("Refresh", refresh, !!changes.size));
  }
  refresh();
  return { card: h("section", { class: "card wide" }, h("h3", {}, label), place, tools, chosen, said) };
}
