"use strict";
// The live page: a change of a number computes the run again, and the page shows its rows. The run as it was written stays
// behind it. Runs are computed in a worker, beside the drawing; of the changes meanwhile the latest wins.
const LATE = 200; // ms, after which a run is said to take long
const SETTLED = 400; // ms without a change, after which the address is written and what changed is read aloud
const THOUSANDS = new Intl.NumberFormat("en");
const live = { number: 0, busy: false, waiting: null, took: 0 };
const variant = () => data.live.variants[live.number];

// ------------------------------------------------------------------ runs
// The words of the numbers that are not those written.
function wordsNow() {
  const words = variant().engine;
  return [...dials.values()].filter((dial) => !dial.parts && dial.value !== dial.given.value).flatMap(({ name, value }) => words[name].map((word) => [word, value]));
}

// Computes a run, or waits for one that is computed, and hands it over with the number of its engine.
function compute(numbers, then, run = null) {
  live.waiting = { number: live.number, numbers, then, run };
  if (!live.busy) ask();
}

function ask() {
  const { number, numbers, then, run } = live.waiting;
  Object.assign(live, { waiting: null, busy: true });
  const late = setTimeout(() => $("#numbers").classList.add("busy"), LATE);
  (run ?? computed(number, numbers)).then(({ found, took }) => (document.hidden ? setTimeout : requestAnimationFrame)(() => {
    clearTimeout(late);
    $("#numbers").classList.remove("busy");
    Object.assign(live, { busy: false, took });
    if (live.waiting) ask(); // while this one is drawn
    then(found, number);
  }));
}

// ------------------------------------------------------------------ changes
let settling = 0;
function changed(t = NaN) {
  for (const dial of dials.values()) dial.show();
  settle();
  compute(wordsNow(), (found, number) => {
    showRun(found, number);
    if (!Number.isFinite(t)) return;
    goAt(t, wordsOf(found));
    settle(); // the address has the time only now
  });
}

// The last row at a time, if one is given.
function goAt(t, words = "") {
  if (Number.isFinite(t)) show(Math.max(lastAt(frames.t, t), 0), words);
}

// What is said of a run at first.
const wordsOf = (found) => found.stopped || (isChanged() ? first.told : "");

// A start in a state that holds a velocity, and it moves: Python refuses it, too.
function movesLocked(run) {
  const fastest = Math.max(0, ...variant().velocities.map((place) => Math.abs(run.found.y[place])));
  for (const contact of run.contacts) {
    for (const mode of contact.modes) {
      const name = contact.locked[mode[0]] && contact.velocities.find((each) => Math.abs(contact.value(each, 0, 0)) > data.live.still * fastest);
      if (name) return `${contact.name || "the element"} starts in ${contact.states[mode[0]]}, which holds ${name} at 0, with ${name} = ${eng(contact.value(name, 0, 0), unitOf(contact, name))}`;
    }
  }
  return "";
}

// The run that was computed: other rows, or those of another engine.
function showRun(found, number) {
  if (runs[0].engineNumber === number) {
    runs[0].renew(found);
    renew(() => wordsOf(found));
  } else {
    load({ ...data, runs: [runOf(number, found, { label: "this run", short: "now" }, 0), runs[1]] });
    show(frame, found.stopped || first.told);
  }
  tellRun();
}

// What is said of the run that is shown.
function tellRun() {
  const wrong = movesLocked(runs[0]);
  if (wrong || $("#refused").dataset.of === "start") say($("#refused"), wrong);
  $("#refused").dataset.of = wrong ? "start" : "";
  say($("#took"), `${THOUSANDS.format(runs[0].rows)} rows, ${counted(runs[0].log.length, "transition")}, in ${live.took.toFixed(1)} ms`);
}

function runOf(number, found, more, place) {
  const run = new LiveRun({ ...data.live.variants[number].run, ...more }, place, ENGINES[number], found);
  return Object.assign(run, { engineNumber: number });
}

const isChanged = () => live.number > 0 || [...dials.values()].some(({ value, given }) => value !== given.value);

// A number that its rules allow; of all elements it is that of each.
function turn(dial, u) {
  const wrong = against(dial, u, dials);
  refuse(dial, wrong);
  if (wrong) return;
  setValue(dial, u);
  changed();
}

function setValue(dial, u) {
  for (const each of dial.parts ?? []) each.value = u;
  dial.value = u;
  const { all } = dial;
  if (all) all.value = all.parts.every(({ value }) => value === u) ? u : NaN;
}

function refuse(dial, words) {
  for (const each of dials.values()) each.box.removeAttribute("aria-invalid");
  if (words) dial.box.setAttribute("aria-invalid", "true");
  say($("#refused"), words);
}

function settle() {
  $("#say").setAttribute("aria-live", "off"); // a screen reader would not keep up
  sketching = true;
  clearTimeout(settling);
  settling = setTimeout(() => {
    $("#say").setAttribute("aria-live", "polite");
    sketching = false;
    eachPlots((pane) => { if (pane.sketched) pane.renew(); });
    writeAddress();
  }, SETTLED);
}

// ------------------------------------------------------------------ the state in the address, exactly
function stateText() {
  const state = new URLSearchParams(), written = data.live.variants[0];
  for (const name of ["law", "elements"]) if (variant()[name] !== written[name]) state.set(`@${name}`, variant()[name]);
  for (const { name, value, given, parts, all } of dials.values()) {
    if (Number.isNaN(value) || value === given.value || (all && !Number.isNaN(all.value))) continue;
    if (!parts || parts.every((each) => each.value === value)) state.set(name, String(value));
  }
  if (frame > 0) state.set("@t", String(frames.t[frame]));
  return state.toString();
}

function writeAddress() {
  try { history.replaceState(null, "", `#${stateText()}`); } catch { /* a page inside another has no address of its own */ }
}

// Takes the numbers of an address; what is not understood is named.
function readAddress() {
  const state = new URLSearchParams(location.hash.slice(1)), wrong = [], written = data.live.variants[0];
  const law = state.get("@law") ?? written.law, elements = Number(state.get("@elements") ?? written.elements);
  live.number = Math.max(live.law ? find(law, elements) : 0, 0);
  fillDials();
  for (const dial of dials.values()) setValue(dial, dial.given.value);
  for (const [name, text] of state) {
    if (name.startsWith("@")) continue;
    const dial = dials.get(name), u = text === "" ? NaN : Number(text);
    if (dial && Number.isFinite(u)) setValue(dial, u);
    else wrong.push(`${name}=${text}`);
  }
  for (const dial of dials.values()) {
    const words = dial.parts || dial.value === dial.given.value ? "" : against(dial, dial.value, dials);
    if (words) { wrong.push(words); setValue(dial, dial.given.value); }
  }
  say($("#refused"), wrong.length ? `not taken from the address: ${wrong.join("; ")}` : "");
  return Number(state.get("@t") ?? NaN);
}

async function share() {
  writeAddress();
  const link = location.href.split("#")[0] + `#${stateText()}`, box = $("#link");
  box.hidden = false;
  box.value = link;
  box.focus();
  box.select();
  const copied = await navigator.clipboard?.writeText(link).then(() => true, () => false);
  $("#say").textContent = copied ? "the link is copied: it has all numbers, exactly" : "copy the link: it has all numbers, exactly";
}

// ------------------------------------------------------------------ the scenario
function scenarioText() {
  const number = (u) => (Number.isInteger(u) && Math.abs(u) < 1e21 ? `${u}.0` : String(u));
  const values = (name, wide) => {
    const dial = dials.get(name), parts = dial?.parts ?? [...dials.values()].filter((each) => each.whole === name && each.element !== null);
    if (dial && !wide) return number(dial.value);
    return `[${(parts.length ? parts : [dial]).map(({ value }) => number(value)).join(", ")}]`;
  };
  return variant().scenario.map((part) => (typeof part === "string" ? part : part.text && !knows(part.number) ? part.text : values(part.number, part.wide))).join("");
}
const knows = (name) => dials.has(name) || [...dials.values()].some(({ whole }) => whole === name);

function save(text, name) {
  const address = URL.createObjectURL(new Blob([text], { type: "application/toml" }));
  const link = make("a", document.body, "", { href: address, download: name });
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

// ------------------------------------------------------------------ start
function buildPanel() {
  const panel = make("section", document.body, "", { id: "numbers", "aria-label": "Numbers" });
  $("#top").after(panel);
  live.boxes = [make("div", panel, "", { class: "dials" })];
  const more = make("details", panel);
  make("summary", more, "more numbers");
  live.boxes.push(make("div", more, "", { class: "dials" }));
  const acts = make("div", panel, "", { class: "acts" });
  const act = (name, title, action) => {
    const button = make("button", acts, name, { title });
    button.addEventListener("click", action);
    return button;
  };
  const { law, elements } = variant();
  if (data.live.variants.length > 1) {
    live.law = make("select", make("label", acts, "law "), "", { title: "Slip law" });
    for (const each of new Set(data.live.variants.map((one) => one.law))) make("option", live.law, each);
    live.law.addEventListener("change", () => take(live.law.value, variant().elements));
    const group = make("span", acts, "elements ", { role: "group", "aria-label": "Elements" });
    const step = (way, name) => {
      const button = make("button", group, way > 0 ? "+" : "−", { "aria-label": name, title: name });
      button.addEventListener("click", () => take(variant().law, variant().elements + way));
      return button;
    };
    live.fewer = step(-1, "Remove the last element");
    live.count = make("output", group, "");
    live.more = step(1, "Add an element like the last");
  }
  act("reset", "All as it was written", reset);
  act("share", "A link with all numbers", share);
  if (variant().scenario.length) act("scenario", "The scenario with these numbers, a TOML file for gms-fsm run", () => save(scenarioText(), "scenario.toml"));
  make("input", acts, "", { id: "link", type: "text", readonly: "", "aria-label": "Link to this state", size: 30 }).hidden = true;
  make("output", acts, "", { id: "took" });
  make("p", panel, "", { id: "refused", role: "alert" });
  $("#say").tabIndex = 0; // what it says may be longer than its place
  fillDials();
}

// The dials of the present engine; those that are changed stay so.
function fillDials() {
  const changes = [...dials.values()].filter((dial) => !dial.parts && dial.value !== dial.given.value).map(({ name, value }) => [name, value]);
  dials.clear();
  for (const box of live.boxes) box.replaceChildren();
  for (const given of variant().numbers) dials.set(given.name, new Dial(live.boxes[given.first ? 0 : 1], given, turn));
  for (const dial of dials.values()) {
    if (dial.element !== null) continue;
    const parts = [...dials.values()].filter(({ whole, element }) => whole === dial.whole && element !== null);
    if (!parts.length) continue;
    dial.parts = parts;
    for (const each of parts) each.all = dial;
  }
  for (const [name, value] of changes) if (dials.has(name)) setValue(dials.get(name), value);
  live.boxes[1].parentNode.hidden = !live.boxes[1].children.length;
  if (!live.law) return;
  const { law, elements } = variant(), has = (way) => find(law, elements + way) >= 0;
  live.law.value = law;
  say(live.count, String(elements));
  live.fewer.disabled = !has(-1);
  live.more.disabled = !has(1);
}

// ------------------------------------------------------------------ another law, or an element more or less
const find = (law, elements) => data.live.variants.findIndex((each) => each.law === law && each.elements === elements);

// Where there is no engine for both, the law that is asked for has as many elements as were written, and the reverse.
function take(law, elements) {
  const written = data.live.variants[0], at = [find(law, elements), law === variant().law ? find(written.law, elements) : find(law, written.elements)].find((k) => k >= 0);
  live.number = at ?? live.number;
  fillDials();
  changed();
}

function reset() {
  live.number = 0;
  for (const dial of dials.values()) setValue(dial, dial.given.value);
  fillDials();
  refuse(null, "");
  changed();
}

function beginLive() {
  compute([], (found) => {
    const base = runOf(0, found, { label: "base run", short: "base", ghost: true }, 1);
    load({ ...data, runs: [runOf(0, found, { label: "this run", short: "now" }, 0), base] });
    if (isChanged()) { changed(t); return; }
    goAt(t);
    if (found.stopped) show(frame, found.stopped);
    tellRun();
  }, begun);
  buildPanel(); // meanwhile
  const t = readAddress();
  addEventListener("hashchange", () => {
    changed(readAddress());
  });
}

beginLive();
