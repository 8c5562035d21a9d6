"use strict";
// The force over position and over velocity. The path shows how many elements are out of the default state.
const RECENT = 1 / 30; // of the run: the part of the path that is shown behind the dot
const LEVELS = 7; // looks of the path

class PhasePane {
  static side = "right"; static key = "phase"; static title = "Phase"; static moves = true;

  constructor(view, box) {
    Object.assign(this, { view, box });
    this.legend = make("p", box, "", { class: "legend" });
    this.row = make("div", box, "", { class: "planes" });
    this.plots = ["x", "v"].map((name) => new PhasePlot(view, this.row, name));
  }

  choose(other) { if (other) this.fit(); }

  fit() {
    const { box, plots } = this;
    this.listLevels();
    this.told = make("output", this.legend);
    const width = box.clientWidth, beside = width >= 560, head = this.legend.offsetHeight;
    const each = beside ? Math.floor(width / 2) - 4 : width;
    const height = isWide() ? Math.max(box.clientHeight - head - 6, 150) / (beside ? 1 : 2) : Math.min(each * 0.8, 420);
    for (const plot of plots) plot.fit(each, Math.floor(height));
    this.show();
  }

  listLevels() {
    const { contact } = this.view, { n, states } = contact, step = Math.ceil(n / (LEVELS - 1));
    this.legend.replaceChildren();
    if (states.length < 2) return;
    make("span", this.legend, n > 1 ? `elements not in ${states[0]}:` : "state:");
    for (let level = 0, from = 0; from <= n; level++) {
      const to = Math.min(level * step, n), item = make("span", this.legend, "", { class: "item" });
      const line = draw("svg", item, { width: 34, height: 10, "aria-hidden": "true" });
      draw("path", line, { d: "M1 5H33", class: `level level${levelOf(to, n)}` });
      item.append(n === 1 ? [states[0], `not ${states[0]}`][to] : from === to ? `${to}` : `${from}–${to}`);
      from = to + 1;
    }
    if (views.length > 1) {
      const item = make("span", this.legend, "", { class: "item" });
      draw("path", draw("svg", item, { width: 34, height: 10, "aria-hidden": "true" }), { d: "M1 5H33", class: "other" });
      item.append("the other run");
    }
  }

  show() { for (const plot of this.plots) plot.show(); }

  // The row under the mouse, here or in the pane of the other run.
  point() {
    const { contact, run, place: at } = this.view, row = pointed === null ? -1 : frames.rows[at][pointed];
    for (const plot of this.plots) plot.show();
    say(this.told, row < 0 ? "" : `t = ${timeText(run.t(row), 6)}, F = ${contact.tell("F", contact.value("F", 0, row))}`);
  }
}
PANES.push(PhasePane);

// Counts share looks if there are more of them than looks; the last look is that of all elements.
const levelOf = (count, n) => (n < LEVELS ? Math.round((count * (LEVELS - 1)) / n) : Math.ceil(count / Math.ceil(n / (LEVELS - 1))));

class PhasePlot {
  constructor(view, box, name) {
    Object.assign(this, { view, name });
    this.plane = new Plane(box, { role: "img" });
    const { inside, svg } = this.plane;
    this.other = draw("path", inside, { class: "other" });
    this.paths = Array.from({ length: LEVELS }, (_, level) => draw("path", inside, { class: `level level${level}` }));
    this.arrows = draw("path", inside, { class: "heads" });
    this.trail = draw("path", inside, { class: "trail" });
    this.dot = draw("circle", inside, { class: "here", r: 6 });
    this.hair = draw("circle", inside, { class: "hair-dot", r: 6 });
    const rowAt = (event) => this.track.nearest(...this.plane.point(event), view.row);
    svg.addEventListener("click", (event) => go(frames.of[view.place][rowAt(event)]));
    svg.addEventListener("mousemove", (event) => pointAt(frames.of[view.place][rowAt(event)]));
    svg.addEventListener("mouseleave", () => pointAt(null));
  }

  fit(width, height) {
    const { plane, view, name } = this, { contact } = view;
    const same = runs.map((run) => (run === view.run ? contact : run.contacts.find((each) => each.name === contact.name) ?? run.contacts[0]));
    const column = (of, key) => (row) => of.value(key === "v" ? of.velocity : key, 0, row);
    const axis = (key) => {
      const { low, high } = extent(same.map((of) => ({ get: column(of, key), rows: of.run.rows })));
      return new Axis({ name: key === "v" ? contact.velocity : key, unit: unitOf(contact, key === "v" ? contact.velocity : key), ...roomy(low, high) });
    };
    plane.lay(width, height, axis(name), axis("F"));
    plane.svg.setAttribute("aria-label", `F over ${plane.across.name}. The values at the row are in the line above; rows are chosen by keys.`);
    const [track, other] = [contact, ...same.filter((of) => of !== contact)].map((of) => new Track(plane, column(of, name), column(of, "F"), of.run));
    this.track = track;
    track.pieces(LEVELS, (row) => levelOf(contact.away(row), contact.n)).forEach((d, level) => place(this.paths[level], { d }));
    place(this.arrows, { d: track.heads(52, 60) });
    place(this.other, { d: other ? other.pieces(1, () => 0)[0] : "" });
  }

  show() {
    const { track, view } = this;
    if (!track) return;
    put(this.dot, track, view.row);
    place(this.trail, { d: track.before(view.row, RECENT * (whole.max - whole.min)) });
    this.hair.style.visibility = pointed === null ? "hidden" : "visible";
    if (pointed !== null) put(this.hair, track, frames.rows[view.place][pointed]);
  }
}

function put(node, track, row) {
  const known = Number.isFinite(track.x[row]) && Number.isFinite(track.y[row]);
  place(node, known ? { cx: track.x[row], cy: track.y[row], opacity: 1 } : { opacity: 0 });
}
