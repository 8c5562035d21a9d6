"use strict";
// Presenting: one view fills the page in large type, for a projector. The lecturer's notes stand beside it, or in a window of
// their own: what to say, why the row is as it is, and what fires next.
const TYPE = 2.2, SCREEN = [1366, 600]; // the smallest texts have 11 px, so that they have 24 px on such a part of a screen
const BESIDE = 0.6; // of the width: the view beside the notes, as in the style sheet
const GUARDS = { side: "left", key: "guards", title: "Guards" }; // the table, which has no tab
const presenting = { on: false, key: "", notes: null, shown: "" }; // where the notes are: nowhere, beside, or in a window

const slides = () => [...Object.values(views[0].panes).map(({ Pane }) => Pane), GUARDS];

function present() {
  if (presenting.on) { leave(); return; }
  presenting.on = true;
  const list = $("#slides");
  list.replaceChildren();
  slides().forEach(({ title, key }, k) => {
    const button = make("button", list, `${k + 1} ${title}`, { "aria-keyshortcuts": k + 1, "data-key": key });
    button.addEventListener("click", ({ detail }) => { // after a click of the mouse the keys are for the view
      chooseSlide(k);
      if (detail) focusSlide();
    });
  });
  list.hidden = $("#notes-button").hidden = false;
  $("#present").setAttribute("aria-pressed", true);
  openSlide(views[0].open.right.constructor);
  focusSlide();
  show(frame, `presentation, ${slideName()}; Escape leaves it`);
}

function leave() {
  placeNotes(null);
  presenting.on = false;
  $("#slides").hidden = $("#notes-button").hidden = true;
  const button = $("#present");
  button.setAttribute("aria-pressed", false);
  const root = document.documentElement;
  delete root.dataset.slide;
  enlarge();
  button.focus();
  show(frame, "presentation left");
}

const slideNumber = () => slides().findIndex(({ key }) => key === presenting.key);
const slideName = () => `view ${slideNumber() + 1}, ${slides()[slideNumber()].title}`;

// The last there is, if the number is larger.
function chooseSlide(k) {
  const all = slides();
  openSlide(all[Math.min(k, all.length - 1)]);
  show(frame, slideName());
}

function openSlide({ side, key }) {
  presenting.key = key;
  Object.assign(document.documentElement.dataset, { slide: key, side: key === GUARDS.key ? "" : side });
  for (const button of $$("#slides button")) button.setAttribute("aria-pressed", button.dataset.key === key);
  if (key !== GUARDS.key) openPane(side, key);
  enlarge();
}

function focusSlide() { (views[0].panes[presenting.key]?.box ?? $(".why")).focus({ preventScroll: true }); }

// Large type by CSS; plots are drawn on canvases, and so made anew.
function enlarge() {
  const root = document.documentElement, beside = presenting.notes === "beside" ? BESIDE : 1, [width, height] = SCREEN;
  root.classList.toggle("presenting", presenting.on);
  root.classList.toggle("wide", isWide());
  const wanted = presenting.on ? Math.max(1, TYPE * beside * Math.min(innerWidth / width, innerHeight / height)) : 1;
  root.style.setProperty("--large", wanted);
  if (wanted !== large) {
    large = wanted;
    for (const view of views) for (const each of Object.values(view.panes)) if (each.pane instanceof TimePlots) view.clearPane(each);
    for (const { constructor: { side, key } } of Object.values(views[0].open)) openPane(side, key);
  }
  for (const view of views) view.fit();
}
addEventListener("resize", () => { if (presenting.on) enlarge(); });

// ------------------------------------------------------------------ the lecturer's notes
function notes() { if (!presenting.on) present(); placeNotes(presenting.notes ? null : "beside"); }
function notesWindow() { if (!presenting.on) present(); placeNotes(presenting.notes?.document ? "beside" : "window"); }

function placeNotes(where) {
  const box = presenting.box ??= $("#notes"), old = presenting.notes;
  if (!where && !old) return;
  const own = where === "window" ? open("", "", "popup,width=640,height=720") : null;
  presenting.notes = own ?? (where && "beside"); // a browser may refuse a window, in a frame for instance
  if (own) {
    const { document: page } = own, root = page.documentElement;
    page.title = `Notes: ${data.title}`;
    Object.assign(root.dataset, document.documentElement.dataset, { side: "", slide: "" });
    root.lang = "en";
    make("style", page.head, $("style").textContent); // the policy of this page holds there, too
    const main = make("main", page.body);
    make("h1", main, page.title);
    main.append(box);
    page.addEventListener("keydown", pressed);
    own.addEventListener("pagehide", () => { if (presenting.notes === own) placeNotes(null); });
  } else $("#controls").before(box);
  box.hidden = !presenting.notes;
  if (old?.document) old.close();
  $("#notes-button").setAttribute("aria-pressed", Boolean(presenting.notes));
  document.documentElement.classList.toggle("beside", presenting.notes === "beside");
  presenting.shown = "";
  if (presenting.on) enlarge();
  tellNotes();
}
addEventListener("pagehide", () => { if (presenting.notes?.document) presenting.notes.close(); });

// Frames where notes begin: at a time, or where an edge fires.
function noteFrames() {
  if (presenting.of !== frames) {
    const fires = (edge) => runs.flatMap(({ log, place }) => log.filter(({ contact, edge: k }) => contact.edges[k].name === edge).map(({ row }) => frames.of[place][row]));
    const begins = ({ at, edge }) => (edge !== undefined ? fires(edge) : at > frames.t[last] ? [] : [lastBefore(at) + 1]);
    presenting.of = frames;
    presenting.begins = data.notes.flatMap((note) => [...new Set(begins(note))].map((k) => ({ k, t: note.at ?? frames.t[k], text: note.text }))).sort((a, b) => a.k - b.k);
  }
  return presenting.begins;
}

// The last frame before a time; -1 if there is none.
function lastBefore(t) {
  let k = lastAt(frames.t, t);
  while (k >= 0 && frames.t[k] === t) k -= 1;
  return k;
}

function tellNotes() {
  const { box, shown } = presenting, key = `${frame}/${presenting.key}/${views.map(({ contact, element }) => `${contact.name}/${element}`).join()}`;
  if (!presenting.notes || shown === key) return;
  presenting.shown = key;
  box.replaceChildren();
  const all = noteFrames(), now = all.findLast(({ k }) => k <= frame), then = all.find(({ k }) => k > frame);
  make("h2", box, "Notes");
  for (const { text } of all.filter(({ k }) => k === now?.k)) make("p", box, text, { class: "note" });
  if (!now) make("p", box, data.notes.length ? "No note yet." : "This page has no notes.");
  if (then) make("p", box, `then, at t = ${timeText(then.t, 5)}: ${then.text}`, { class: "then" });
  make("h2", box, "Why");
  for (const view of views) tellWhy(view, box);
  make("h2", box, "Next transition");
  for (const { run } of views) {
    const entry = run.log.find(({ row }) => frames.of[run.place][row] > frame), after = entry && entry.t - frames.t[frame];
    make("p", box, `${runName(run)}${entry ? `${entry.contact.sentence(entry)} at t = ${timeText(entry.t, 7)}, ${after > 0 ? `in ${eng(after, "s", 3)}` : "at this instant"}` : "none"}`);
  }
  make("p", box, `${$("#now").textContent}, ${views[0].run.rowName(views[0].row)}, ${slideName()}`, { class: "place" });
}

const runName = ({ place }) => (runs.length > 1 ? `run ${place + 1}: ` : "");

// What happened, and the clauses of the edges that were asked.
function tellWhy(view, box) {
  const { contact, element, run } = view, { fired, row } = contact.asked(element, view.row), scope = contact.scope(element, row);
  make("p", box, `${runName(run)}${view.verdict()}`);
  const list = make("ul", box);
  for (const k of contact.leaving(contact.modes[element][row])) {
    const item = make("li", list, "");
    make(k === fired ? "b" : "span", item, `${contact.edges[k].name}${k === fired ? " fired" : ""}`);
    for (const clause of contact.clauses(k, scope)) {
      const by = Number.isNaN(clause.margin) ? "" : `, margin ${marginText(clause)}`;
      make("code", item, `${MARKS[clause.truth]} ${clause.event ? `event ${clause.event}` : clause.text}${by}`);
    }
  }
}
