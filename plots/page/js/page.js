"use strict";
// The page: rows of one run or both on a common time, playing, breakpoints, keys. A frame is a row of either run.
let runs, frames, last, events, eventFrames, first, TIME_POWER; // of the data shown, see `load`
const whole = {}, span = {};
const breakpoints = new Map();
let frame = 0, following = true, zooming = false;
const views = [];
// The runs with a view of their own: not one that is only drawn behind another.
const shownRuns = () => (runs ?? []).filter(({ ghost }) => !ghost);
// A wide screen: the page fills it and does not scroll; two runs need more of it than one.
const isWide = () => presenting.on || (innerHeight >= 520 && innerWidth >= (shownRuns().length > 1 ? 1240 : 1000));
const keyOf = (view, contact, element, edge) => `${view.place}/${contact.name}/${element}/${edge}`;

function show(k, words = "") {
  frame = clamp(k, 0, last);
  const t = frames.t[frame], half = (span.max - span.min) / 2;
  if (t < span.min || t > span.max) zoomTo(t - half, t + half); // a zoomed window follows
  for (const view of views) view.show(frames.rows[view.place][frame]);
  const place = `t = ${timeText(t, 9)}`;
  say($("#now"), place);
  const scrubber = $("#scrubber");
  scrubber.value = inTime ? t : frame;
  const verdicts = views.map((view) => (views.length > 1 ? `run ${view.place + 1}: ` : "") + view.verdict());
  if (!play.on) scrubber.setAttribute("aria-valuetext", `${place}, ${runs[0].rowName(frames.rows[0][frame])}`);
  say($("#say"), words && views.length > 1 ? words : [words, ...verdicts].filter(Boolean).join("; "));
  $("#say").classList.toggle("fired", views.some((view) => view.happened().length));
  tell();
  tellNotes();
}

function pointAt(k) {
  if (pointed === k) return;
  pointed = k;
  for (const view of views) for (const pane of view.live) pane.point?.();
}

function eachPlots(act) {
  for (const view of views) for (const pane of Object.values(view.open)) if (pane instanceof TimePlots) act(pane);
}

function chooseElement(element) {
  for (const view of views) view.choose(view.contact, element);
  show(frame);
}

function openPane(side, key) {
  for (const view of views) view.openPane(side, key);
  for (const view of views) view.fit(); // once all are in place
}

function nextPane(side) {
  if (presenting.on) { chooseSlide((slideNumber() + (side === "right" ? 1 : slides().length - 1)) % slides().length); return; }
  const tabs = $$(`.${side} [role=tab]`, views[0].root), at = tabs.findIndex((tab) => tab.getAttribute("aria-selected") === "true");
  openPane(side, tabs[(at + 1) % tabs.length].dataset.key);
}

// ------------------------------------------------------------------ breakpoints and until
function toggleBreak(view, element, edge) {
  const { contact } = view, key = keyOf(view, contact, element, edge), had = breakpoints.delete(key);
  const text = `${nameOf(contact, element)}, ${contact.edges[edge].name}`;
  if (!had) breakpoints.set(key, { text, place: view.place, name: contact.name, element, edge, frames: framesOf(view.place, contact, element, edge) });
  view.explained = "";
  show(frame, `breakpoint ${had ? "removed" : "set"}: ${text}`);
}

const framesOf = (place, contact, element, edge) => new Set([...contact.stops(element, edge)].map((row) => frames.of[place][row]));

function stopsAt(k) {
  const point = [...breakpoints.values()].find((each) => each.frames.has(k));
  return point ? `stopped at a breakpoint: ${point.text}` : "";
}

function readUntil() {
  const box = $("#until"), errors = [];
  const conditions = box.value.trim() === "" ? [] : runs.map((run) => {
    try { return condition(box.value, run); } catch (error) { errors.push(error.message); return () => false; }
  });
  const wrong = runs.length === errors.length; // two runs may have different names
  box.setAttribute("aria-invalid", wrong);
  if (wrong) $("#say").textContent = errors[0];
  return wrong ? null : (k) => conditions.some((f, i) => f(frames.rows[i][k]));
}

function proceed() {
  pause();
  const holds = readUntil(), text = $("#until").value.trim();
  if (!holds) return;
  let before = holds(frame);
  for (let k = frame + 1; k <= last; k++) {
    const now = holds(k), stop = stopsAt(k) || (now && !before && `stopped: ${text} became true at this row of the page`);
    before = now;
    if (stop) { show(k, stop); return; }
  }
  show(last, breakpoints.size || text ? "end of the run: nothing stopped it" : "end of the run: no breakpoint or condition is set");
}

// ------------------------------------------------------------------ zoom
function zoomTo(min, max, origin = null) {
  if (zooming || !(max - min > 1e-12 * Math.max(Math.abs(min), Math.abs(max)))) return;
  zooming = true; // the other plots also report their new scales
  Object.assign(span, { min, max });
  eachPlots((pane) => pane.zoom(origin));
  zooming = false;
}

function zoom(factor) {
  const t = frames.t[frame], half = (factor * (span.max - span.min)) / 2;
  zoomTo(Math.max(t - half, whole.min), Math.min(t + half, whole.max));
}

// ------------------------------------------------------------------ playing
// The clock of the run moves on by the time since the last picture. At a transition it stays for a moment at every
// micro-step, so that each can be seen; in a run with many transitions for a shorter one, or not at all where that
// would be less than a picture.
const HOLD = 400, PICTURE = 1000 / 60; // ms
const play = { on: false, t: 0, held: 0, at: 0 };

function setPlaying(on) {
  play.on = on;
  const button = $("#play");
  button.setAttribute("aria-pressed", on);
  button.setAttribute("aria-label", on ? "Pause" : "Play");
  button.textContent = on ? "❚❚ pause" : "▶ play";
  $("#say").setAttribute("aria-live", on ? "off" : "polite"); // a screen reader would not keep up
  if (!on) return;
  Object.assign(play, { t: frames.t[frame], held: 0, at: performance.now() });
  requestAnimationFrame(tick);
}
const pause = () => { if (play.on) { setPlaying(false); show(frame); } };

function tick(now) {
  if (!play.on) return;
  const passed = clamp(now - play.at, 0, 100), speed = $("#speed").value;
  play.at = now;
  play.held -= passed;
  if (play.held <= 0) move(passed, speed);
  if (play.on) requestAnimationFrame(tick);
}

function move(passed, speed) {
  const slowly = speed === "rows", duration = Number(speed) * 1000, hold = slowly ? 500 : Math.min(HOLD, duration / events.length);
  const target = slowly ? Infinity : play.t + (passed * (whole.max - whole.min)) / duration;
  const stays = (row) => slowly || (hold >= PICTURE && eventFrames.has(row));
  let k = frame;
  while (k < last && (slowly || frames.t[k + 1] <= target)) { // to the last row before the clock
    k += 1;
    if (stays(k)) play.held = hold;
    if (stays(k) || stopsAt(k)) break;
  }
  play.t = slowly || play.held > 0 ? frames.t[k] : Math.min(target, frames.t[last]);
  const stop = k !== frame && stopsAt(k), ended = k === last && !(play.held > 0);
  if (stop || ended) setPlaying(false);
  if (k !== frame || stop || ended) show(k, stop || (ended ? "end of the run" : ""));
  else eachPlots((pane) => pane.placeCursor(play.t));
}

function playOrPause() {
  if (!play.on && frame === last) show(0);
  setPlaying(!play.on);
  if (!play.on) show(frame, "paused");
}

// ------------------------------------------------------------------ keys and buttons
const go = (k) => { if (play.on) setPlaying(false); show(k); };
const setFollowing = () => {
  following = !following;
  $("#follow").setAttribute("aria-pressed", following);
  show(frame, following ? "the element that fires is selected" : "the selected element stays selected");
};
const actions = {
  start: () => go(0), end: () => go(last), back: () => go(frame - 1), step: () => go(frame + 1),
  "back-transition": () => go(events.findLast((k) => k < frame) ?? 0),
  transition: () => go(events.find((k) => k > frame) ?? last),
  play: playOrPause, continue: proceed, follow: setFollowing,
  "zoom-in": () => zoom(0.5), "zoom-out": () => zoom(2), "zoom-all": () => zoomTo(whole.min, whole.max),
  "next-element": () => chooseElement((views[0].element + 1) % views[0].contact.n),
  "last-element": () => chooseElement((views[0].element + views[0].contact.n - 1) % views[0].contact.n),
  right: () => nextPane("right"), left: () => nextPane("left"),
  help: () => $("#keys").showModal(),
  difference: firstDifference,
  present, "notes-button": notes, "notes-window": notesWindow,
  more: () => {
    const on = document.body.classList.toggle("more");
    $("#more").setAttribute("aria-expanded", on);
  },
};
const KEYS = {
  ArrowLeft: "back", ArrowRight: "step", "Shift ArrowLeft": "back-transition", "Shift ArrowRight": "transition",
  " ": "play", c: "continue", f: "follow", Home: "start", End: "end", "+": "zoom-in", "=": "zoom-in", "-": "zoom-out", 0: "zoom-all",
  "]": "next-element", "[": "last-element", v: "right", V: "left", "?": "help", d: "difference",
  p: "present", n: "notes-button", N: "notes-window",
};
function pressed(event) {
  if (event.altKey || event.ctrlKey || event.metaKey || event.defaultPrevented || $("#keys").open) return;
  if (event.target.closest("select, input:not(#scrubber)")) return;
  if (event.key === " " && event.target.closest("button, summary, [role=button]")) return;
  const action = KEYS[(event.shiftKey && event.key.startsWith("Arrow") ? "Shift " : "") + event.key];
  if (/^[1-9]$/.test(event.key)) (presenting.on ? chooseSlide : chooseElement)(Number(event.key) - 1);
  else if (event.key === "Escape" && presenting.on) leave();
  else if (action) actions[action]();
  else return;
  event.preventDefault();
}
document.addEventListener("keydown", pressed);
for (const button of $$("#controls button")) button.addEventListener("click", actions[button.id]);

// ------------------------------------------------------------------ the scrubber, in time or in rows
const TICKS = 2000; // places
let inTime = true;
function setScale(scale) {
  inTime = scale === "t";
  const scrubber = $("#scrubber"), { min, max } = inTime ? whole : { min: 0, max: last };
  Object.assign(scrubber, { min, max, step: inTime ? "any" : 1 });
  const at = (k) => Math.round(((inTime ? frames.t[k] - min : k) / Math.max(max - min, Number.MIN_VALUE)) * TICKS);
  $("#ticks").setAttribute("viewBox", `0 0 ${TICKS} 1`);
  const marks = [...new Set(events.map(at))]; // as many as can be told apart
  $("#ticks path").setAttribute("d", marks.map((x) => `M${x} 0V1`).join(""));
  $("#ticks .pinned").setAttribute("d", pinned === null ? "" : `M${at(pinned)} 0V1`);
  scrubber.value = inTime ? frames.t[frame] : frame;
}
$("#scrubber").addEventListener("input", ({ target }) => go(inTime ? Math.max(lastAt(frames.t, Number(target.value)), 0) : Number(target.value)));
$("#scrubber").addEventListener("keydown", (event) => { // in time, too, an arrow is a row
  const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
  if (!way) return;
  event.preventDefault();
  go(frame + way);
});
$("#scale").addEventListener("change", ({ target }) => setScale(target.value));
$("#until").addEventListener("keydown", (event) => {
  if (event.key === "Enter") proceed();
  if (event.key === "Escape") event.target.blur();
});

// ------------------------------------------------------------------ two runs: where they first differ
// The first transition that only one run makes, or that the runs make in another order, stays pinned in the plots.
function difference() {
  const [a, b] = runs.map(({ log }) => log), text = (entry) => entry && entry.contact.sentence(entry);
  let k = 0;
  while (k < Math.min(a.length, b.length) && text(a[k]) === text(b[k])) k += 1;
  if (k === Math.max(a.length, b.length)) return { frame: null, told: "both runs make the same transitions in the same order" };
  const entries = [a[k], b[k]], at = entries.map((entry, i) => (entry ? frames.of[i][entry.row] : Infinity)), least = Math.min(...at);
  const told = entries.map((entry, i) => `${runs[i].label}: ${entry ? `${text(entry)} at ${timeText(entry.t, 7)}` : "no further transition"}`);
  // Why the later run did not do the same then; of two at one time, the one that was held back.
  const words = entries.map((entry, i) => (frames.t[at[i]] === frames.t[least] ? heldInOther(entry, i, at[i]) : ""));
  const why = words.find((each) => each && !each.endsWith("fires next")) ?? words.find(Boolean);
  return { frame: least, told: `first difference, transition ${k + 1}: ${told.join("; ")}${why ? `; ${why}` : ""}` };
}

// What the element of a firing waits for in the other run, at the row where it fired.
function heldInOther({ contact, element }, i, at) {
  const same = runs[1 - i].contacts.find(({ name, n }) => name === contact.name && n > element);
  return same && !runs[1 - i].ended(frames.t[at]) ? `in ${runs[1 - i].label} ${waiting(same, element, frames.rows[1 - i][at])}` : "";
}

function firstDifference() {
  if (first.frame !== null) go(first.frame);
  show(frame, first.told);
}

// ------------------------------------------------------------------ start
// A time, in the unit of the time axis.
function timeText(t, digits) { return inUnit(t, "s", TIME_POWER, digits); }

// What follows from the rows of the runs; the time shown, the zoom and breakpoints stay.
function measure() {
  const t = frames?.t[frame] ?? -Infinity, zoomed = frames && (span.min !== whole.min || span.max !== whole.max) && { ...span };
  frames = new Frames(runs);
  last = frames.t.length - 1;
  Object.assign(whole, { min: frames.t[0], max: frames.t[last] });
  Object.assign(span, zoomed && zoomed.min < whole.max && zoomed.max > whole.min ? zoomed : whole);
  TIME_POWER = powerOf(Math.max(Math.abs(whole.min), Math.abs(whole.max)), "s");
  events = [...new Set(runs.flatMap((run, k) => run.log.map(({ row }) => frames.of[k][row])))].sort((a, b) => a - b);
  eventFrames = new Set(events);
  first = runs.length > 1 ? difference() : { frame: null, told: "there is one run only" };
  [pointed, pinned, frame] = [null, first.frame, clamp(lastAt(frames.t, t), 0, last)];
  for (const [key, { place, name, element, edge, ...point }] of breakpoints) {
    const contact = runs[place]?.contacts.find((each) => each.name === name);
    if (!(contact?.n > element && contact.edges[edge])) breakpoints.delete(key);
    else breakpoints.set(key, { ...point, place, name, element, edge, frames: framesOf(place, contact, element, edge) });
  }
  say($("#facts"), runs.map((run) => `${run.title}: ${run.of} rows, ${run.rows} on this page; ${run.log.length} transitions.`).join(" "));
}

// Shows other data in the place of those shown, if any; selection and open tabs stay.
function load(given) {
  const kept = views.map(({ contact, element, panes }) => ({ name: contact.name, element, panes }));
  const tabs = Object.values(kept[0]?.panes ?? {}).filter(({ tab }) => tab.getAttribute("aria-selected") === "true").map(({ Pane }) => [Pane.side, Pane.key]);
  for (const view of views.splice(0)) { view.close(); view.root.remove(); }
  data = given;
  runs = data.runs.map((stored, place) => (stored instanceof RunData ? stored : new RunData(stored, place)));
  measure();
  document.title = $("#title").textContent = data.title;
  $("#runs").className = shownRuns().length > 1 ? "two" : "one";
  document.documentElement.classList.toggle("wide", isWide());
  const [{ name, states }, another] = runs[0].contacts;
  $("#names").textContent = `${Object.keys(runs[0].names).join(", ")}, ${another ? `${name}.` : ""}state(1) == ${states.at(-1)}`;
  for (const run of shownRuns()) views.push(new RunView(run));
  views.forEach((view, place) => {
    const { name, element } = kept[place] ?? kept[0] ?? { name: "", element: 0 };
    view.choose(view.run.contacts.find((each) => each.name === name) ?? view.contact, element);
    view.addTabs();
  });
  $("#difference").hidden = runs.length < 2;
  setScale($("#scale").value);
  for (const [side, key] of [["left", "chart"], ["right", "time"], ...tabs]) openPane(side, key);
  show(frame);
}

// Shows other rows of the same runs.
function renew(words = () => "") {
  measure();
  for (const view of views) view.renew();
  setScale($("#scale").value);
  show(frame, words());
}

if (matchMedia("(prefers-reduced-motion: reduce)").matches) $("#speed").value = "rows";
addEventListener("resize", () => document.documentElement.classList.toggle("wide", isWide()));
new ResizeObserver(() => { for (const view of views) view.fit(); }).observe($("#runs"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => eachPlots((pane) => pane.recolour()));
