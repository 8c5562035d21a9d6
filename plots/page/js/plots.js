"use strict";
// The plots over time. All share one time axis, a cursor at the row shown and a crosshair under the mouse; the head of
// each plot tells its value at the crosshair, or else at the cursor.
const AXIS = 58, GAP = 10, TIME_AXIS = 20; // px to the left and to the right of the plots, and below them
const LEAST = { 1: 46, 2: 34 }; // px, of a plot of one run or of two, so that the time axis stays in view
const DASHES = [[], [7, 4], [2, 3], [8, 3, 2, 3], [12, 4], [4, 2, 1, 2, 1, 2]];
const COLOURS = 7, STATES = 5; // of the style sheet: --e0 ..., --state0 ...
const elementStep = (i, n) => (n > 1 ? Math.round((i * (COLOURS - 1)) / (n - 1)) : 0); // of the ramp from the first element to the last
const WIDE = matchMedia("(min-width: 1000px)"); // there the page fills the screen and does not scroll
const MOST_POINTS = 60000; // of lines that are drawn again when another element is selected
let pointed = null, pinned = null; // frames: under the mouse, and where two runs first differ

// Decimals that tell neighbouring marks of an axis apart.
function decimals(step) {
  for (let d = 0; d < 13; d++) if (Math.abs(step * 10 ** d - Math.round(step * 10 ** d)) < 1e-6 * Math.max(1, step * 10 ** d)) return d;
  return 13;
}

// A stack of plots and ribbons over time. A plot is { title, unit, lines, at, band }: lines as { get, stroke, dash, run },
// at(row), its value for the head, and whether the area between its two lines is filled.
class TimePlots {
  constructor(view, box) {
    Object.assign(this, { view, box, plots: [], tracks: [], wanted: [] });
    box.classList.add("plots");
    this.body = make("div", box, "", { class: "stack" });
    this.cursor = make("div", box, "", { class: "cursor" });
    this.hair = make("div", box, "", { class: "hair" });
    this.hair.hidden = true;
    this.pin = make("div", box, "≠", { class: "pin" });
    this.pin.hidden = pinned === null;
    box.addEventListener("mousemove", (event) => {
      const left = this.body.getBoundingClientRect().left + AXIS, part = (event.clientX - left) / this.width();
      pointAt(part >= 0 && part <= 1 ? lastAt(frames.t, span.min + part * (span.max - span.min)) : null);
    });
    box.addEventListener("mouseleave", () => pointAt(null));
  }

  width() { return this.body.clientWidth - AXIS - GAP; }

  add(plot) { this.wanted.push(plot); }

  // Only the last plot has marks on its time axis.
  addAll() {
    this.plots = this.wanted.map((each, k) => this.made(each, k === this.wanted.length - 1));
    this.wanted = [];
  }

  made({ title, note = "", unit = "", lines, at, digits = 5, step = false, band = false }, isLast) {
    const head = make("h3", this.body, ""), name = make("span", head), value = make("output", head);
    const power = powerOf(largest(extent(lines.map(({ get, run }) => ({ get, rows: run.rows })))), unit);
    name.textContent = unit ? `${title} [${PREFIXES[power]}${unit}]` : title;
    const ink = (stroke) => () => colour(stroke);
    const axis = { stroke: ink("--ink"), grid: { stroke: ink("--grid"), width: 1 }, ticks: { show: false }, font: "11px system-ui, sans-serif" };
    const marks = (factor) => (u, splits, _axis, _space, gap) => splits.map((s) => (s / factor).toFixed(decimals(gap / factor)).replace("-", "−"));
    const plot = new uPlot({
      width: 300, height: 100, padding: [7, GAP, isLast ? 2 : 7, 0], pxAlign: false, legend: { show: false },
      scales: { x: { time: false } },
      axes: [isLast ? { ...axis, size: TIME_AXIS, values: marks(10 ** TIME_POWER) } : { ...axis, size: 0, values: (u, splits) => splits.map(() => "") }, { ...axis, size: AXIS, values: marks(10 ** power), space: 20 }],
      series: [{}, ...lines.map(({ stroke, dash = [], width = 1.3 }) => ({
        stroke: ink(stroke), dash, width, points: { size: 4 }, ...(step && { paths: uPlot.paths.stepped({ align: 1 }) }),
      }))],
      cursor: { y: false, x: false, points: { show: false } },
      hooks: { ...(band && { drawAxes: [(u) => fillBetween(u, lines)] }), setScale: [(u, key) => key === "x" && zoomTo(u.scales.x.min, u.scales.x.max, u)] },
    }, [frames.t, ...lines.map(alongFrames)], make("div", this.body, "", { role: "img", "aria-label": `${title} over time`, class: "plot" }));
    if (span.min !== whole.min || span.max !== whole.max) plot.setScale("x", { ...span }); // made while zoomed
    if (isLast) make("span", plot.root, `t [${PREFIXES[TIME_POWER]}s]`, { class: "time-unit" });
    let down = 0;
    plot.over.addEventListener("mousedown", (event) => { down = event.clientX; });
    plot.over.addEventListener("click", (event) => { // the end of a drag is also a click
      if (Math.abs(event.clientX - down) < 4) go(Math.max(lastAt(frames.t, plot.posToVal(event.offsetX, "x")), 0));
    });
    if (note) make("small", head, note);
    return { plot, value, at, unit, digits };
  }

  addRibbons(contacts) {
    this.ribbons = make("div", this.body, "", { class: "ribbons", tabindex: 0, role: "group", "aria-label": "Active states over time" });
    for (const contact of contacts) {
      if (contact.states.length < 2) continue;
      contact.pieces.forEach((pieces, i) => {
        const ribbon = make("div", this.ribbons, "", { class: "ribbon", role: "img", "aria-label": `States of ${nameOf(contact, i)} over time` });
        make("b", ribbon, contacts.length > 1 ? `${contact.name}${contact.n > 1 ? ` ${i + 1}` : ""}` : `E${i + 1}`);
        this.tracks.push({ contact, i, pieces, ribbon, track: make("div", ribbon) });
      });
    }
  }

  // Where all panes are in view the plots share the height that is left.
  fit() {
    const width = this.body.clientWidth, last = this.plots.at(-1);
    if (!width || !this.plots.length) return;
    const heads = this.plots.reduce((sum, { value }) => sum + value.parentNode.offsetHeight, 0);
    const left = this.box.clientHeight - heads - (this.ribbons?.offsetHeight ?? 0) - TIME_AXIS - 2;
    const height = WIDE.matches ? Math.max(Math.floor(left / this.plots.length), LEAST[runs.length]) : 92;
    for (const each of this.plots) {
      const own = each === last ? height + TIME_AXIS : height;
      if (each.plot.width !== width || each.plot.height !== own) each.plot.setSize({ width, height: own });
    }
    this.drawRibbons();
    this.placeCursor();
  }

  zoom(origin) {
    for (const { plot } of this.plots) if (plot !== origin) plot.setScale("x", { ...span });
    this.drawRibbons();
    this.placeCursor();
  }

  close() { for (const { plot } of this.plots) plot.destroy(); }

  recolour() { for (const { plot } of this.plots) plot.redraw(false, true); }

  show() { this.tell(); this.placeCursor(); }

  point() { this.show(); }

  tell() {
    const row = pointed === null ? this.view.row : frames.rows[this.view.place][pointed];
    for (const { value, at, unit, digits } of this.plots) {
      const u = at(row), text = typeof u === "string" ? u : eng(u, unit, digits);
      say(value, text);
    }
  }

  drawRibbons() {
    const wide = span.max - span.min, { run } = this.view;
    for (const { contact, pieces, track } of this.tracks) {
      track.replaceChildren();
      for (let k = 0, to = 0; k < pieces.length; k++) {
        const from = Math.max(k ? run.t(pieces[k].from) : -Infinity, span.min);
        to = k + 1 < pieces.length ? run.t(pieces[k + 1].from) : run.t(run.rows - 1);
        const width = (Math.min(to, span.max) - from) / wide;
        if (!(width > 5e-4)) continue;
        const piece = make("i", track, "", { class: `state${pieces[k].mode % STATES}` });
        piece.style.left = `${(100 * (from - span.min)) / wide}%`;
        piece.style.width = `${100 * width}%`;
        if (width > 0.06) make("span", piece, contact.states[pieces[k].mode]);
      }
      if (!track.children.length) make("span", track, "changes too often to be seen: zoom in", { class: "note" });
    }
  }

  // x of a time, px from the left of the pane; nothing is laid out, so that a film can move it in every frame.
  placeCursor(t = frames.t[frame]) {
    this.put(this.cursor, t);
    this.hair.hidden = pointed === null;
    if (pointed !== null) this.put(this.hair, frames.t[pointed]);
    if (pinned !== null) this.put(this.pin, frames.t[pinned]);
  }

  put(line, t) {
    const part = (t - span.min) / (span.max - span.min);
    line.style.visibility = part < 0 || part > 1 ? "hidden" : "visible";
    line.style.transform = `translateX(${AXIS + part * this.width()}px)`;
  }
}

// A line by frame. Where its run has no row, it continues (undefined); a value that is not a number is a gap (null).
function alongFrames({ get, run }) {
  const rows = frames.rows[run.place], found = new Array(rows.length);
  for (let k = 0; k < rows.length; k++) {
    if (k > 0 && rows[k] === rows[k - 1]) continue;
    const u = get(rows[k]);
    found[k] = Number.isFinite(u) ? u : null;
  }
  return found;
}

// The area between two lines, behind both: forward along one and back along the other.
function fillBetween(plot, [one, two]) {
  const { ctx, bbox } = plot, path = new Path2D();
  const rowsOf = ({ run }) => Array.from({ length: run.rows }, (_, row) => row);
  for (const [line, rows] of [[one, rowsOf(one)], [two, rowsOf(two).reverse()]]) {
    for (const row of rows) {
      const u = line.get(row);
      if (Number.isFinite(u)) path.lineTo(plot.valToPos(line.run.t(row), "x", true), plot.valToPos(u, "y", true));
    }
  }
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.fillStyle = colour("--pale");
  ctx.fill(path);
  ctx.restore();
}

// The value of a line at a time, on a straight line between two rows.
function valueAt({ get, run }, frame, t) {
  const row = frames.rows[run.place][frame], next = Math.min(row + 1, run.rows - 1), from = run.t(row), to = run.t(next);
  return to > from && t > from ? get(row) + ((get(next) - get(row)) * (t - from)) / (to - from) : get(row);
}

class TimePane extends TimePlots {
  static side = "right"; static key = "time"; static title = "Time";

  constructor(view, box) { super(view, box); this.fill(); }

  fill() {
    const { view } = this, { contact, run } = view;
    this.body.replaceChildren();
    Object.assign(this, { tracks: [], lit: -1 });
    const others = views.filter((each) => each !== view).map((each) => ({
      run: each.run, contact: each.run.contacts.find(({ name }) => name === contact.name) ?? each.run.contacts[0],
    }));
    const column = (of, name) => { const each = of.columns[name === "v" ? of.velocity : name]; return Array.isArray(each) ? each[0] : each; };
    const one = (title, name, unit) => {
      const own = { get: column(contact, name), run, stroke: "--ink" };
      const lines = [...others.map((each) => ({ get: column(each.contact, name), run: each.run, stroke: "--soft", dash: [2, 3] })), own];
      const band = others.length > 0 && name !== "v";
      const at = (row) => { // of the second run also how far it is from the first
        const k = pointed ?? frame, t = frames.t[k];
        if (!band || view.place === 0 || runs.some((each) => each.ended(t))) return own.get(row);
        return `${eng(own.get(row), unit, 5)}  Δ ${eng(valueAt(own, k, t) - valueAt(lines[0], k, t), unit, 3)}`;
      };
      this.add({ title, note: others.length ? "dotted: the other run" : "", unit, lines, at, band });
    };
    one("F", "F", "N");
    const inner = this.addInner();
    one("v", "v", "m/s");
    one("x", "x", "m");
    this.addAll();
    this.inner = inner && this.plots[1].plot;
    this.addRibbons([contact]);
    this.highlight();
  }

  // The first variable of every element, over its threshold if that is what its edges turn at.
  addInner() {
    const { contact, run } = this.view, [name] = contact.variables;
    if (!name) return false;
    const over = contact.threshold && contact.columns.s;
    const get = (i) => (over ? (row) => contact.value(name, i, row) / contact.value("s", i, row) : (row) => contact.value(name, i, row));
    const lines = contact.modes.map((_, i) => ({ get: get(i), run, stroke: `--e${elementStep(i, contact.n)}`, dash: DASHES[i % DASHES.length] }));
    const bounds = over ? [1, -1].map((u) => ({ get: () => u, run, stroke: "--line" })) : [];
    this.add({
      title: over ? `${name} / s(v), lines at ±1` : name, unit: over ? "" : contact.units[name] ?? "", lines: [...bounds, ...lines],
      at: (row) => {
        const i = this.view.element, u = get(i)(row);
        return `${contact.n > 1 ? `E${i + 1}: ` : ""}${over ? written(u) : eng(u, contact.units[name] ?? "", 5)}`;
      },
    });
    return true;
  }

  choose(other) { if (other) this.fill(); else this.highlight(); }

  highlight() {
    const { element, contact } = this.view;
    if (this.inner && contact.n > 1 && this.lit !== element) {
      this.lit = element;
      const { series } = this.inner, first = series.length - contact.n;
      for (let i = 0; i < contact.n; i++) series[first + i].width = i === element ? 2.6 : 1.2;
      if (frames.t.length * contact.n < MOST_POINTS) this.inner.redraw(false, false); // else with the next zoom
    }
    this.tracks.forEach(({ ribbon, i }) => {
      const on = i === element;
      if (ribbon.classList.toggle("chosen", on) && this.ribbons.scrollHeight > this.ribbons.clientHeight) reveal(ribbon, this.ribbons);
    });
  }
}
PANES.push(TimePane);

// Bodies, further states, signals and sampled values of a system, and the states of all its contacts.
class SystemPane extends TimePlots {
  static side = "right"; static key = "system"; static title = "System";
  static of(view) { return view.run.system !== null; }

  constructor(view, box) {
    super(view, box);
    const { run } = view, { bodies, values } = run.system;
    const one = (title, number, unit, step) => {
      const get = run.column(number);
      this.add({ title, unit, lines: [{ get, run, stroke: "--ink" }], at: get, step });
    };
    for (const body of bodies) {
      one(`${body.name}: x`, body.x, "m");
      one(`${body.name}: v`, body.v, "m/s");
    }
    for (const { name, column, kind } of values) {
      const sampled = kind !== "signal" && kind !== "state";
      one(sampled ? `${name}, sampled by ${kind}` : `${name}, ${kind}`, column, "", sampled);
    }
    for (const contact of run.contacts) {
      const get = contact.columns.F;
      this.add({ title: `${contact.name}: F`, unit: "N", lines: [{ get, run, stroke: "--ink" }], at: get });
    }
    this.addAll();
    this.addRibbons(run.contacts);
  }
}
PANES.push(SystemPane);
