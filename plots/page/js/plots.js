"use strict";
// The plots over time, of one run or of two in the same plots. All share one time axis, a cursor at the row shown and a
// crosshair under the mouse; the head of each plot tells its value at the crosshair, or else at the cursor.
const AXIS = 58, GAP = 16, TIME_AXIS = 20; // px to the left and to the right of the plots, and below them
const LEAST = 46, PRESENTED = 30, BARE = 14; // px, of a plot, of one in a presentation, and of one that is an axis only
const DASHES = [[], [7, 4], [2, 3], [8, 3, 2, 3], [12, 4], [4, 2, 1, 2, 1, 2]];
const COLOURS = 7, STATES = 5; // of the style sheet: --e0 ..., --state0 ...
const elementStep = (i, n) => (n > 1 ? Math.round((i * (COLOURS - 1)) / (n - 1)) : 0); // of the ramp from the first element to the last
const RUNS = [{ stroke: "--ink" }, { stroke: "--soft", dash: [7, 4] }]; // lines of the first run and of the second
const MOST_POINTS = 60000; // of lines that are drawn again when another element is selected
const COARSE = 2; // px of a column
let sketching = false; // while the run changes with every picture
let pointed = null, pinned = null; // frames: under the mouse, and where two runs first differ

// Decimals that tell neighbouring marks of an axis apart.
function decimals(step) {
  for (let d = 0; d < 13; d++) if (Math.abs(step * 10 ** d - Math.round(step * 10 ** d)) < 1e-6 * Math.max(1, step * 10 ** d)) return d;
  return 13;
}

// A stack of plots and ribbons over time. A plot is { title, unit, lines, at, band }: lines as { get, stroke, dash, run },
// at(), what its head says, and whether the area between its two lines is filled.
class TimePlots {
  constructor(view, box) {
    Object.assign(this, { view, box });
    this.clear();
    box.classList.add("plots");
    this.body = make("div", box, "", { class: "stack" });
    this.body.addEventListener("mousemove", (event) => {
      const left = this.body.getBoundingClientRect().left + AXIS * large, part = (event.clientX - left) / (this.width() * large);
      pointAt(part >= 0 && part <= 1 ? lastAt(frames.t, span.min + part * (span.max - span.min)) : null);
    });
    this.body.addEventListener("mouseleave", () => pointAt(null));
  }

  clear() { Object.assign(this, { sketched: false, plots: [], tracks: [], wanted: [], marks: { cursor: [], hair: [], pin: [] } }); }

  width() { return this.across - AXIS - GAP; } // since it was fitted: to ask the page is a layout

  // The cursor, the crosshair and the pin in a plot or over ribbons: not where readings stand.
  mark(box) {
    for (const [name, all] of Object.entries(this.marks)) all.push(make("div", box, name === "pin" && !all.length ? "≠" : "", { class: name }));
  }

  // A plot of a value of both runs: `of` finds it in a run, undefined where there is none.
  compare(title, unit, of, { band = false, ...options } = {}) {
    const lines = runs.map((run, k) => ({ ...RUNS[k], run, get: of(run) })).filter(({ get }) => get);
    this.add({ title, unit, lines, band: band && lines.length > 1 && !runs[1].ghost, at: (power) => readings(lines, unit, power), ...options });
  }

  add(plot) { this.wanted.push(plot); }

  // Only the last plot has marks on its time axis; without plots there is this axis alone.
  addAll() {
    if (!this.wanted.length) this.add({ title: "", bare: true, lines: [{ get: () => 0, run: runs[0], stroke: "--paper" }], at: () => "" });
    this.plots = this.wanted.map((each, k) => this.made(each, k === this.wanted.length - 1));
    this.wanted = [];
  }

  made({ title, note = "", unit = "", lines, at, step = false, band = false, bare = false }, isLast) {
    const head = make("h3", this.body, ""), name = make("span", head), value = make("output", head);
    const power = powerFor(lines, unit);
    name.textContent = unit ? `${title} [${PREFIXES[power]}${unit}]` : title;
    const ink = (stroke) => () => colour(stroke);
    const axis = { stroke: ink("--ink"), grid: { stroke: ink("--grid"), width: 1 }, ticks: { show: false }, gap: 5 * large, font: `${Math.round(11 * large)}px system-ui, sans-serif` };
    const marks = (factor) => (u, splits, _axis, _space, gap) => splits.map((s) => (s / factor).toFixed(decimals(gap / factor)).replace("-", "−"));
    const plot = new uPlot({
      width: 300, height: 100, padding: [7, GAP, isLast ? 2 : 7, 0].map((u) => u * large), pxAlign: false, legend: { show: false },
      scales: { x: { time: false } },
      axes: [isLast ? { ...axis, size: TIME_AXIS * large, space: 50 * large, values: marks(10 ** TIME_POWER) } : { ...axis, size: 0, values: (u, splits) => splits.map(() => null) }, { ...axis, size: AXIS * large, values: marks(10 ** power), space: (presenting.on ? 14 : 20) * large, ...(bare && { values: () => [""], splits: () => [0] }) }],
      series: [{}, ...lines.map(({ stroke, dash = [], width = 1.3 }) => ({
        stroke: ink(stroke), dash: dash.map((u) => u * large), width: width * large, points: { size: 4 * large }, ...(step && { paths: uPlot.paths.stepped({ align: 1 }) }),
      }))],
      cursor: { y: false, x: false, points: { show: false } },
      hooks: { ...(band && { drawAxes: [(u) => fillBetween(u, lines)] }), setScale: [(u, key) => key === "x" && zoomTo(u.scales.x.min, u.scales.x.max, u)] },
    }, [frames.t, ...lines.map(alongFrames)], make("div", this.body, "", { role: "img", "aria-label": `${title || "Axis"} over time`, class: "plot" }));
    if (span.min !== whole.min || span.max !== whole.max) plot.setScale("x", { ...span }); // made while zoomed
    if (isLast) make("span", plot.root, `t [${PREFIXES[TIME_POWER]}s]`, { class: "time-unit" });
    let down = 0;
    this.mark(plot.over);
    plot.over.addEventListener("mousedown", (event) => { down = event.clientX; });
    plot.over.addEventListener("click", (event) => { // the end of a drag is also a click
      if (Math.abs(event.clientX - down) < 4) go(Math.max(lastAt(frames.t, plot.posToVal(event.offsetX, "x")), 0));
    });
    if (note) make("small", head, note);
    return { plot, value, at: () => at(power), bare, lines, unit, power };
  }

  // The runs have other rows. Where values need another unit, the plots are made anew.
  renew() {
    if (!sketching && this.plots.some(({ lines, unit, power }) => powerFor(lines, unit) !== power)) {
      this.close();
      this.fill();
      this.fit();
      return true;
    }
    zooming = true; // of its own accord
    this.sketch(sketching);
    const columns = sketching ? columnsOf(this.width() / COARSE) : null, t = columns ? Float64Array.from(columns.ends, (k) => frames.t[k]) : frames.t;
    for (const { plot, lines } of this.plots) {
      const along = (line, k) => (!columns ? alongFrames(line) : plot.series[k + 1].show ? alongColumns(line, columns) : []);
      plot.setData([t, ...lines.map(along)], false);
      plot.setScale("x", { ...span });
    }
    zooming = false;
    this.drawRibbons();
    return true;
  }

  // Lines as thin as they can be, solid, and with the extremes of each column of pixels only. Then as they should be again.
  // The ribbons are painted when they change, not with all else that does.
  sketch(on) {
    if (Boolean(this.sketched) === on) return;
    this.sketched = on;
    this.ribbons?.classList.toggle("sketched", on);
    for (const { plot } of this.plots) {
      for (const each of plot.series.slice(1)) {
        if (on) Object.assign(each, { fine: { width: each.width, dash: each.dash } }, { width: 1, dash: [] });
        else Object.assign(each, each.fine);
      }
    }
  }

  // The states of every element; of two runs both, one under the other.
  addRibbons(contacts) {
    const frame = make("div", this.body, "", { class: "ribbon-frame" }), several = contacts.length > runs.length;
    contacts = contacts.filter(({ run }) => !run.ghost);
    this.ribbons = make("div", frame, "", { class: "ribbons", tabindex: 0, role: "group", "aria-label": "Active states over time" });
    this.mark(make("div", frame, "", { class: "over-ribbons" }));
    const tracks = contacts.filter(({ states }) => states.length > 1).flatMap((contact) => contact.pieces.map((_, i) => ({ contact, i })));
    const names = contacts.map(({ name }) => name);
    tracks.sort((a, b) => names.indexOf(a.contact.name) - names.indexOf(b.contact.name) || a.i - b.i);
    for (const { contact, i } of tracks) {
      const { place } = contact.run, [short, long] = shownRuns().length > 1 ? [`${place + 1}: `, `run ${place + 1}, `] : ["", ""];
      const ribbon = make("div", this.ribbons, "", { class: "ribbon", role: "img", "aria-label": `States of ${long}${nameOf(contact, i)} over time` });
      make("b", ribbon, `${short}${several || !contact.velocity ? `${contact.name}${contact.n > 1 ? ` ${i + 1}` : ""}` : `E${i + 1}`}`, { title: nameOf(contact, i) });
      this.tracks.push({ contact, i, ribbon, track: make("div", ribbon) });
    }
  }

  // Where all panes are in view the plots share the height that is left.
  fit() {
    const width = this.body.clientWidth, last = this.plots.at(-1);
    if (!width || !this.plots.length) return;
    this.across = width;
    const heads = this.plots.reduce((sum, { value }) => sum + value.parentNode.offsetHeight, 0);
    const left = this.box.clientHeight - heads - (this.ribbons?.offsetHeight ?? 0) - TIME_AXIS - 2;
    const height = last.bare ? BARE : isWide() ? Math.max(Math.floor(left / this.plots.length), presenting.on ? PRESENTED : LEAST) : 92;
    for (const each of this.plots) {
      const own = each === last ? height + TIME_AXIS : height;
      const size = { width: Math.floor(width * large), height: Math.floor(own * large) }; // the style sheet shows it as it is
      if (each.plot.width !== size.width || each.plot.height !== size.height) each.plot.setSize(size);
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

  recolour() { colours = null; for (const { plot } of this.plots) plot.redraw(false, true); }

  show() { this.tell(); this.placeCursor(); }

  point() { this.show(); }

  tell() { for (const { value, at } of this.plots) say(value, at()); }

  drawRibbons() {
    const wide = span.max - span.min, across = this.width(), least = sketching ? 1 / across : 5e-4; // of a piece that is drawn
    const placed = (t) => { // in whole pixels while the run changes: most pieces stay where they are
      const part = (t - span.min) / wide;
      return 100 * (sketching ? Math.round(part * across) / across : part);
    };
    for (const { contact, i, track } of this.tracks) {
      $(".note", track)?.remove();
      const { run } = contact, pieces = contact.pieces[i], nodes = [...track.children];
      let count = 0;
      for (let k = 0, to = 0; k < pieces.length; k++) {
        const from = Math.max(k ? run.t(pieces[k].from) : -Infinity, span.min);
        to = k + 1 < pieces.length ? run.t(pieces[k + 1].from) : run.t(run.rows - 1);
        const end = Math.min(to, span.max), width = (end - from) / wide;
        if (!(width > least)) continue;
        const piece = nodes[count] ?? make("i", track), left = placed(from), look = [pieces[k].mode, left, placed(end) - left].join();
        count += 1;
        if (piece.look === look) continue; // as before
        piece.look = look;
        piece.className = `state${pieces[k].mode % STATES}`;
        [piece.style.left, piece.style.width] = look.split(",").slice(1).map((u) => `${u}%`);
        piece.replaceChildren();
        if (width > 0.06) make("span", piece, contact.states[pieces[k].mode]);
      }
      for (const node of nodes.slice(count)) node.remove();
      if (!count) make("span", track, "changes too often to be seen: zoom in", { class: "note" });
    }
  }

  // Nothing is laid out, so that a film can move it in every frame.
  placeCursor(t = frames.t[frame]) {
    this.put("cursor", t);
    this.put("hair", frames.t[pointed]);
    this.put("pin", frames.t[pinned]);
  }

  put(name, t) {
    const part = (t - span.min) / (span.max - span.min), seen = part >= 0 && part <= 1; // no time is NaN
    for (const line of this.marks[name]) {
      line.style.visibility = seen ? "visible" : "hidden";
      if (seen) line.style.transform = `translateX(${part * this.width()}px)`;
    }
  }
}

// The power of ten of the unit of some lines.
const powerFor = (lines, unit) => powerOf(largest(extent(lines.map(({ get, run }) => ({ get, rows: run.rows })))), unit);

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

// The frames of each column of pixels, as the first of each and the end of the last; null if no column has more than two.
function columnsOf(width) {
  const { t } = frames, from = [], ends = [], wide = (span.max - span.min) / width;
  for (let k = 0, column = NaN; k < t.length; k++) {
    const now = Math.floor(clamp(t[k] - span.min, -wide, span.max - span.min + wide) / wide);
    if (now === column) continue;
    if (k) ends.push(from.at(-1), k - 1);
    from.push(k);
    column = now;
  }
  ends.push(from.at(-1), t.length - 1);
  return 2 * from.length < t.length ? { from: [...from, t.length], ends } : null;
}

// The extremes of a line in each column of pixels, in their order: it looks as the whole line does.
function alongColumns({ get, run }, { from }) {
  const rows = frames.rows[run.place], found = new Array(2 * from.length - 2);
  for (let c = 0; c + 1 < from.length; c++) {
    let low = Infinity, high = -Infinity, rises = true, gap = false;
    const first = from[c], end = rows[from[c + 1] - 1];
    for (let row = rows[first] + (first > 0 && rows[first] === rows[first - 1]); row <= end; row++) {
      const u = get(row);
      if (!Number.isFinite(u)) { gap = true; continue; }
      if (u < low) { low = u; rises = false; }
      if (u > high) { high = u; rises = true; }
    }
    if (low > high) found[2 * c] = found[2 * c + 1] = gap ? null : undefined;
    else [found[2 * c], found[2 * c + 1]] = rises ? [low, high] : [high, low];
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

// The value of each run at the row shown, in the unit of the plot, and how far the second is from the first.
function readings(lines, unit, power) {
  const k = pointed ?? frame, t = frames.t[k], at = lines.map(({ get, run }) => inUnit(get(frames.rows[run.place][k]), unit, power, 5));
  if (runs.length < 2) return at[0];
  const texts = at.map((text, i) => `${lines[i].run.short}: ${text}`);
  if (lines.length < 2 || runs.some((each) => each.ended(t))) return texts.join("  ");
  const [one, two] = lines.map((line) => valueAt(line, k, t));
  return `${texts.join("  ")}  Δ ${inUnit(two - one, unit, power, 3)}`;
}

class TimePane extends TimePlots {
  static side = "right"; static key = "time"; static title = "Time"; static shared = true;

  constructor(view, box) { super(view, box); this.fill(); }

  fill() {
    this.body.replaceChildren();
    this.clear();
    this.lit = -1;
    const name = this.view.contact.name;
    this.contacts = runs.map(({ contacts }) => contacts.find((each) => each.name === name) ?? contacts[0]);
    const { contact } = this.view, [force, ...rest] = contact.shown;
    const compare = (name, note = "") => {
      const moves = name === contact.velocity, column = ({ place }) => this.contacts[place].column(moves ? this.contacts[place].velocity : name);
      this.compare(moves ? "v" : name, unitOf(contact, name), column, { band: !moves, note });
    };
    if (force) compare(force, runs.length > 1 ? `dashed: ${runs[1].label}` : "");
    const inner = contact.velocity && this.addInner();
    for (const name of rest) if (!(presenting.on && name === "x")) compare(name); // for which a large view has no room
    this.addAll();
    this.inner = inner && this.plots[1].plot;
    this.addRibbons(this.contacts);
    this.highlight();
  }

  // The first variable of every element, over its threshold if that is what its edges turn at; of two runs those of the
  // element chosen.
  addInner() {
    const { contact } = this.view, [name] = contact.variables;
    if (!name) return false;
    const over = contact.threshold && contact.columns.s;
    const get = (of, i) => {
      const [z, s] = [name, "s"].map((each) => [of.columns[each]].flat()[i] ?? ((row) => of.value(each, i, row)));
      return over ? (row) => z(row) / s(row) : z;
    };
    const lines = this.contacts.flatMap((of) => of.modes.map((_, i) => ({
      get: get(of, i), run: of.run, of, i, ...(shownRuns().length > 1 || of.run.ghost ? RUNS[of.run.place] : { stroke: `--e${elementStep(i, of.n)}`, dash: DASHES[i % DASHES.length] }),
    })));
    const { run } = contact, bounds = over ? [1, -1].map((u) => ({ get: () => u, run, stroke: "--line" })) : [];
    const unit = over ? "" : contact.units[name] ?? "";
    this.add({
      title: over ? `${name} / s(v), lines at ±1` : name, unit, lines: [...bounds, ...lines],
      at: (power) => `${contact.n > 1 ? `E${this.view.element + 1}: ` : ""}${readings(lines.filter(({ i }) => i === this.view.element), unit, power)}`,
    });
    this.innerLines = lines;
    return true;
  }

  choose(other) { if (other) this.fill(); else this.highlight(); }

  highlight() {
    const { element, contact } = this.view;
    if (this.inner && this.lit !== element) {
      this.lit = element;
      const alone = shownRuns().length < 2;
      const { series } = this.inner, first = series.length - this.innerLines.length;
      this.innerLines.forEach(({ i, of }, k) => {
        const on = i === element, each = series[first + k];
        if (alone && !of.run.ghost && of.n > 1) each.width = (on ? 2.6 : 1.2) * large;
        else if (runs.length > 1 && each.show !== on) this.inner.setSeries(first + k, { show: on });
      });
      if (this.sketched) this.renew(); // which leaves out what is not shown
      if (alone && contact.n > 1 && frames.t.length * contact.n < MOST_POINTS) this.inner.redraw(false, false); // else with the next zoom
    }
    this.tracks.forEach(({ ribbon, i }) => {
      const on = i === element;
      if (ribbon.classList.toggle("chosen", on) && this.ribbons.scrollHeight > this.ribbons.clientHeight) reveal(ribbon, this.ribbons);
    });
  }
}
PANES.push(TimePane);

// Bodies, further states, signals and sampled values of a system, what its contacts and supervisors give out, and all states.
class SystemPane extends TimePlots {
  static side = "right"; static key = "system"; static title = "System"; static shared = true;
  static of() { return runs.some(({ system }) => system); }

  constructor(view, box) { super(view, box); this.fill(); }

  fill() {
    this.body.replaceChildren();
    this.clear();
    const systems = runs.map(({ system }) => system ?? { bodies: [], values: [] });
    // What has a name in either run, and a column of it in each.
    const every = (list, act) => {
      const names = new Set(systems.flatMap((each) => each[list].map(({ name }) => name)));
      for (const name of names) {
        const found = systems.map((each) => each[list].find((one) => one.name === name));
        act(name, found.find(Boolean), (part) => ({ place }) => found[place] && runs[place].column(found[place][part]));
      }
    };
    every("bodies", (name, { unit }, column) => {
      this.compare(`${name}: x`, unit, column("x"));
      this.compare(`${name}: v`, `${unit}/s`, column("v"));
    });
    every("values", (name, { kind }, column) => {
      const step = kind !== "signal" && kind !== "state";
      this.compare(step ? `${name}, sampled by ${kind}` : `${name}, ${kind}`, "", column("column"), { step });
    });
    const contacts = runs.flatMap((run) => run.contacts), given = new Map(); // by title
    for (const each of contacts) for (const output of each.outputs) given.set(`${each.name}: ${output}`, { each, output });
    for (const [title, { each: { name, units }, output }] of given) {
      this.compare(title, units[output] ?? "", (run) => run.contacts.find((each) => each.name === name)?.columns[output]);
    }
    this.addAll();
    this.addRibbons(contacts);
  }
}
PANES.push(SystemPane);
