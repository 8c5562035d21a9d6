"use strict";
// Shows what Python computed: truth values and margins of clauses are stored; no guard is evaluated here.
// All text from the data is inserted as textContent, never as HTML.
const data = JSON.parse(document.getElementById("data").textContent);
const $ = (query, root = document) => root.querySelector(query);
const $$ = (query, root = document) => [...root.querySelectorAll(query)];
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const AXIS = 62, GAP = 12; // px to the left and to the right of the plots
const DASHES = [[], [7, 4], [2, 3], [8, 3, 2, 3], [12, 4], [4, 2, 1, 2, 1, 2]];

function make(tag, parent, text = "", attributes = {}) {
  const node = document.createElement(tag);
  node.textContent = text;
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  parent.append(node);
  return node;
}

function written(u, digits = 5) {
  if (Number.isNaN(u)) return "not a number";
  if (!Number.isFinite(u)) return u > 0 ? "infinite" : "−infinite";
  const size = Math.abs(u), plain = size === 0 || (size >= 1e-3 && size < 1e6);
  return (plain ? u.toPrecision(digits) : u.toExponential(digits - 2)).replaceAll("-", "−");
}

// ------------------------------------------------------------------ a run and its view
class Run {
  constructor(stored, place) {
    Object.assign(this, stored, { place, plots: [], looks: [] });
    const pool = stored.pool.map((column) => column.map(Number)); // NaN and infinities are strings in JSON
    this.get = (column, row) => pool[column][pool[column].length === 1 ? 0 : row]; // one number: constant
    this.columns = Object.fromEntries(Object.entries(stored.names).map(([name, k]) => [name, (row) => this.get(k, row)]));
    this.n = this.mode.length;
    this.view = $("#run").content.cloneNode(true).firstElementChild;
    $("#runs").append(this.view);
    $("h2", this.view).textContent = (data.runs.length > 1 ? `Run ${place + 1}: ` : "") + stored.title;
    this.fillChart();
    const elements = $(".element", this.view), log = $(".log select", this.view);
    this.mode.forEach((_, i) => make("option", elements, String(i + 1)));
    elements.addEventListener("change", () => choose(elements.selectedIndex));
    $(".log span", this.view).textContent = `Transitions (${this.log.length})`;
    for (const { t, text } of this.log) make("option", log, `${written(t, 8)} s  ${text}`);
    log.addEventListener("change", () => go(this.log[log.selectedIndex].frame));
  }

  fillChart() {
    const box = $(".chart", this.view);
    box.setAttribute("aria-label", `Chart, ${this.title}`);
    box.append($(`#chart${this.chart}`).content.cloneNode(true));
    if (this.place > 0) for (const node of $$("[id]", box)) node.id = `run${this.place + 1}-${node.id}`;
    this.svg = $("svg", box);
    if (this.svg) this.svg.style.maxWidth = `${1.6 * this.svg.viewBox.baseVal.width}px`;
    this.slots = new Set($$("[data-slot]", box).map((node) => node.dataset.slot)).size;
    for (const guard of $$(".guard", box)) {
      const toggle = () => toggleBreak(this, this.elementIn(Number(guard.dataset.slot)), Number(guard.dataset.edge));
      guard.addEventListener("click", toggle);
      guard.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        toggle();
      });
    }
    for (const region of $$(".region", box)) region.addEventListener("click", () => choose(Number(region.dataset.slot)));
  }

  // A large bank is drawn as one chart, which shows the selected element.
  elementIn(slot) { return this.slots === this.n ? slot : this.chosen; }
  get chosen() { return Math.min(chosen, this.n - 1); }

  // The row to explain: if this element has just fired, the row at which its guards were checked.
  asked(element) {
    const [who, edge] = this.fired[this.row] ?? [];
    return who === element ? { fired: edge, row: this.row - 1 } : { fired: -1, row: this.row };
  }

  show(row) {
    this.row = row;
    const get = (name) => written(this.columns[name](row));
    $(".values", this.view).textContent = `F = ${get("F")} N   v = ${get("v")} m/s   x = ${get("x")} m   `
      + (this.between[row] ? "between two rows of the run" : `micro-step ${this.microstep[row]}`);
    for (let slot = 0; slot < this.slots; slot++) this.light(slot);
    this.explain();
    $(".log select", this.view).selectedIndex = this.log.findIndex((entry) => entry.row === row);
  }

  light(slot) {
    const element = this.elementIn(slot), { fired, row } = this.asked(element);
    const active = this.mode[element][this.row], asked = this.mode[element][row];
    const truths = this.truth[element].map((clauses) => clauses.map((clause) => clause[row]));
    const stops = this.edges.map((_, k) => breakpoints.has(keyOf(this, element, k)));
    const look = [element, active, fired, truths, stops, chosen].join();
    if (this.looks[slot] === look) return; // most elements look the same as on the previous row
    this.looks[slot] = look;
    for (const node of $$(`[data-slot="${slot}"]`, this.view)) {
      const { state, edge } = node.dataset, on = (name, yes) => node.classList.toggle(name, yes);
      if (state) on("active", Number(state) === active);
      else if (!edge) on("chosen", element === this.chosen);
      else {
        const k = Number(edge), leaving = this.edges[k].source === asked;
        on("pale", !leaving);
        on("fired", k === fired);
        if (!node.matches(".guard")) continue;
        on("break", stops[k]);
        node.setAttribute("aria-pressed", stops[k]);
        node.setAttribute("aria-label", `Breakpoint: element ${element + 1}, ${this.edges[k].name}`);
        for (const text of $$("[data-clause]", node)) {
          const truth = truths[k][text.dataset.clause];
          text.classList.toggle("true", leaving && truth === "1");
          text.classList.toggle("false", leaving && truth !== "1");
          if (text.matches(".mark")) text.textContent = leaving ? { 1: "✓", 0: "✗" }[truth] ?? "?" : "";
        }
      }
    }
  }

  explain() {
    const element = this.chosen, { fired, row } = this.asked(element), body = $("tbody", this.view);
    $(".element", this.view).selectedIndex = element;
    $(".fact", this.view).textContent = `in ${this.states[this.mode[element][this.row]]}${fired < 0 ? "" : ", when checked"}`;
    if (this.listed !== element) this.listEdges(body, element);
    const lines = $$("tr", body);
    this.edges.forEach((edge, k) => edge.clauses.forEach((_, c) => {
      const line = lines.shift(), truth = this.truth[element][k][c][row], asked = edge.source === this.mode[element][row];
      line.classList.toggle("asked", asked);
      if (c === 0) {
        const button = $("button", line), on = breakpoints.has(keyOf(this, element, k));
        button.setAttribute("aria-pressed", on);
        button.textContent = on ? "●" : "○";
        $("em", line).textContent = k === fired ? "FIRED" : asked ? "" : "not checked";
        $("em", line).classList.toggle("fired-word", k === fired);
      }
      const sides = this.sides[element][k][c], cells = $$(".number", line);
      cells.forEach((cell, i) => { cell.textContent = edge.compound[c] ? "" : written(this.get(sides[i], row)); });
      line.lastChild.textContent = { 1: "✓ true", 0: "✗ false" }[truth] ?? "? unknown";
      line.lastChild.className = truth === "1" ? "true" : "";
    }));
  }

  listEdges(body, element) { // once per element, so that the focus stays in the table
    this.listed = element;
    body.replaceChildren();
    this.edges.forEach((edge, k) => edge.clauses.forEach((clause, c) => {
      const line = make("tr", body);
      if (c === 0) {
        const head = make("th", line, "", { rowspan: edge.clauses.length, scope: "rowgroup" });
        make("button", head, "", { "aria-label": `Breakpoint on ${edge.name}` }).addEventListener("click", () => toggleBreak(this, element, k));
        head.append(` ${edge.priority} · ${this.states[edge.source]} → ${this.states[edge.target]} `);
        make("em", head);
        make("small", head, edge.name);
      }
      make("td", line, clause);
      for (let i = 0; i < 3; i++) make("td", line, "", { class: "number" });
      make("td", line);
    }));
    if (!this.edges.length) make("td", make("tr", body), "this chart has no edges", { colspan: 6 });
  }

  // ---------------------------------------------------------------- plots
  drawPlots() {
    const box = $(".plots", this.view), { t, rows, own } = data.frames;
    // Where a run has no row, its line continues (undefined); a value that is not a number is a gap.
    const along = (run, column) => t.map((_, k) => {
      const u = run.get(column, rows[run.place][k]);
      return own[run.place][k] ? (Number.isFinite(u) ? u : null) : undefined;
    });
    const beside = runs.filter((run) => run !== this);
    const note = beside.length ? "; dotted: the other run" : "";
    const inner = this.inner.columns.length ? [["inner", this.inner.title]] : []; // none without variables
    for (const [name, title] of [["F", "F [N]"], ...inner, ["v", "v [m/s]"], ["x", "x [m]"]]) {
      const lines = name === "inner"
        ? [...this.inner.bounds.map((u) => [t.map(() => u), "--line", []]),
          ...this.inner.columns.map((column, i) => [along(this, column), data.colours[i % data.colours.length], DASHES[i % DASHES.length]])]
        : [...beside.map((run) => [along(run, run.names[name]), "--soft", [2, 3]]), [along(this, this.names[name]), "--ink", []]];
      const head = make("h3", box, title + (name === "inner" ? "" : note));
      this.addPlot(box, title, lines);
      if (name === "inner") this.addLegend(head, lines.slice(this.inner.bounds.length).slice(0, 8));
    }
    this.ribbons = this.states.length > 1 ? make("div", box, "", { class: "ribbons", tabindex: 0, role: "group", "aria-label": "Active states over time" }) : null;
    this.tracks = this.pieces.map((_, i) => {
      const ribbon = make("div", this.ribbons ?? document.createElement("div"), "", { class: "ribbon", role: "img", "aria-label": `States of element ${i + 1} over time` });
      make("b", ribbon, `E${i + 1}`);
      return make("div", ribbon);
    });
  }

  addPlot(box, title, lines) {
    const ink = (name) => () => (name.startsWith("--") ? colour(name) : name);
    const axis = { stroke: ink("--ink"), grid: { stroke: ink("--grid"), width: 1 }, ticks: { show: false } };
    const values = (u, splits, _axis, _space, step) => {
      const digits = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11].find((d) => Math.abs(step * 10 ** d - Math.round(step * 10 ** d)) < 1e-6);
      return splits.map((s) => s.toFixed(digits ?? 12).replace("-", "−"));
    };
    const plot = new uPlot({
      width: 300, height: 118, padding: [8, GAP, 0, 0], pxAlign: false, legend: { show: false },
      scales: { x: { time: false } },
      axes: [{ ...axis, size: 22, values }, { ...axis, size: AXIS, values, space: 20 }],
      series: [{}, ...lines.map(([, name, dash]) => ({ stroke: ink(name), dash, width: 1.2, points: { size: 4 } }))],
      cursor: { y: false, points: { show: false } },
      hooks: { setScale: [(u, key) => key === "x" && zoomTo(u.scales.x.min, u.scales.x.max, u)] },
    }, [data.frames.t, ...lines.map(([u]) => u)], make("div", box, "", { role: "img", "aria-label": `${title}, over time` }));
    let down = 0;
    plot.over.addEventListener("mousedown", (event) => { down = event.clientX; });
    plot.over.addEventListener("click", (event) => { // the end of a drag is also a click
      const t = plot.posToVal(event.offsetX, "x");
      if (Math.abs(event.clientX - down) < 4) go(data.frames.t.findLastIndex((u) => u <= t));
    });
    this.plots.push(plot);
  }

  addLegend(head, lines) {
    lines.forEach(([, stroke, dash], i) => {
      const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
      const line = document.createElementNS(svg.namespaceURI, "path");
      for (const [name, u] of Object.entries({ d: "M0 4H26", stroke: stroke === "--ink" ? "currentColor" : stroke, "stroke-dasharray": dash.join(" ") })) line.setAttribute(name, u);
      svg.append(line);
      make("span", head, ` E${i + 1}`).prepend(svg);
    });
  }

  fit() {
    const width = $(".plots", this.view).clientWidth;
    for (const plot of this.plots) if (plot.width !== width) plot.setSize({ width, height: plot.height });
    // On a narrow screen only the selected element is in view, at a readable size.
    const region = this.svg && $(`.region[data-slot="${this.chosen}"]`, this.svg);
    if (!region) return;
    this.whole ??= this.svg.getAttribute("viewBox");
    const box = region.getBBox(), { e, f } = region.parentNode.transform.baseVal.consolidate().matrix;
    const near = [box.x + e - 4, box.y + f - 4, box.width + 8, box.height + 8].join(" ");
    this.svg.setAttribute("viewBox", this.view.clientWidth < 600 ? near : this.whole);
  }

  highlight() {
    const first = 1 + this.inner.bounds.length;
    if (this.inner.columns.length) {
      this.plots[1].series.forEach((line, k) => { line.width = k === first + this.chosen ? 2.4 : 1.2; });
      this.plots[1].redraw();
    }
    this.tracks.forEach((track, i) => track.parentNode.classList.toggle("chosen", i === this.chosen));
    this.fit();
  }

  drawRibbons() {
    const span = view.max - view.min;
    this.tracks.forEach((track, i) => {
      track.replaceChildren();
      for (const [state, from, to] of this.pieces[i]) {
        const left = Math.max(from, view.min), width = (Math.min(to, view.max) - left) / span;
        if (!(width > 5e-4)) continue;
        const [fill, edge, hatch] = data.fills[state % data.fills.length], piece = make("i", track);
        piece.style.left = `${(100 * (left - view.min)) / span}%`;
        piece.style.width = `${100 * width}%`;
        piece.style.background = hatch === null ? fill : `repeating-linear-gradient(${hatch}deg, ${edge} 0 1px, ${fill} 1px 6px)`;
        if (width > 0.06) make("span", piece, this.states[state]).style.background = fill;
      }
    });
  }

  placeCursor() {
    const part = (data.frames.t[frame] - view.min) / (view.max - view.min), cursor = $(".cursor", this.view);
    cursor.style.left = `${AXIS - 1 + part * ($(".plots", this.view).clientWidth - AXIS - GAP)}px`;
    cursor.hidden = part < 0 || part > 1;
  }
}

// ------------------------------------------------------------------ the page: a frame is a row of one run or both
let chosen = 0, frame = 0, timer = 0, zooming = false;
const breakpoints = new Map(), last = data.frames.t.length - 1;
const view = { min: data.frames.t[0], max: data.frames.t[last] }, whole = { ...view };
const runs = [];
for (const stored of data.runs) runs.push(new Run(stored, runs.length));
const keyOf = (run, element, edge) => `${run.place}/${element}/${edge}`;

function show(k, words = "") {
  frame = Math.min(Math.max(k, 0), last);
  const t = data.frames.t[frame], half = (view.max - view.min) / 2;
  if (t < view.min || t > view.max) zoomTo(t - half, t + half); // a zoomed window follows
  for (const run of runs) {
    run.show(data.frames.rows[run.place][frame]);
    run.placeCursor();
  }
  const place = `t = ${written(t, 9)} s   row ${frame + 1} of ${last + 1}`;
  $("#now").textContent = place;
  $("#scrubber").value = frame;
  $("#scrubber").setAttribute("aria-valuetext", place);
  const fired = runs.flatMap((run) => run.log.filter((entry) => entry.frame === frame)
    .map((entry) => (runs.length > 1 ? `run ${run.place + 1}: ` : "") + entry.text));
  $("#say").textContent = [timer ? "" : place, words, ...fired].filter(Boolean).join("; ");
}

function choose(element) {
  chosen = Math.min(element, Math.max(...runs.map((run) => run.n)) - 1);
  for (const run of runs) run.highlight();
  show(frame, `element ${chosen + 1}`);
}

function toggleBreak(run, element, edge) {
  const key = keyOf(run, element, edge), had = breakpoints.delete(key), text = `element ${element + 1}, ${run.edges[edge].name}`;
  if (!had) breakpoints.set(key, { text, frames: new Set(run.stops[element][edge]) });
  show(frame, `breakpoint ${had ? "removed" : "set"}: ${text}`);
}

function stopsAt(k) {
  const point = [...breakpoints.values()].find(({ frames }) => frames.has(k));
  return point ? `stopped at a breakpoint: ${point.text}` : "";
}

function readUntil() {
  const box = $("#until"), errors = [];
  const conditions = box.value.trim() === "" ? [] : runs.map((run) => {
    try { return parse(box.value, data.language, run.columns, run.states, run.mode); } catch (error) { errors.push(error.message); return () => false; }
  });
  const wrong = runs.length === errors.length; // two runs may have different names
  box.setAttribute("aria-invalid", wrong);
  if (wrong) $("#say").textContent = errors[0];
  return wrong ? null : (k) => conditions.some((f, i) => f(data.frames.rows[i][k]));
}

function proceed() {
  pause();
  const holds = readUntil(), text = $("#until").value.trim();
  for (let k = frame + 1; holds && k <= last; k++) {
    const stop = stopsAt(k) || (holds(k) && !holds(k - 1) && `stopped: ${text} became true at this row of the page`);
    if (stop) return show(k, stop);
  }
  return holds && show(last, breakpoints.size || text ? "end of the run: nothing stopped it" : "end of the run: no breakpoint or condition is set");
}

function zoomTo(min, max, origin = null) {
  if (zooming || !(max - min > 1e-9)) return;
  zooming = true; // the other plots also report their new scales
  Object.assign(view, { min, max });
  for (const run of runs) {
    for (const plot of run.plots) if (plot !== origin) plot.setScale("x", { min, max });
    if (run.tracks) run.drawRibbons();
    run.placeCursor();
  }
  zooming = false;
}

function zoom(factor) {
  const t = data.frames.t[frame], half = (factor * (view.max - view.min)) / 2;
  zoomTo(Math.max(t - half, whole.min), Math.min(t + half, whole.max));
}

function setPlaying(on) {
  clearInterval(timer);
  timer = on ? setInterval(tick, 1000 / Number($("#speed").value)) : 0;
  $("#play").setAttribute("aria-pressed", on);
  $("#play").lastChild.textContent = on ? " pause" : " play";
  $("#say").setAttribute("aria-live", on ? "off" : "polite"); // a screen reader would not keep up
}
const pause = () => setPlaying(false);

function tick() {
  const stop = frame < last ? stopsAt(frame + 1) : "end of the run";
  if (stop) pause();
  show(frame + 1, stop);
}

function play() {
  const running = timer !== 0;
  if (!running && frame === last) show(0);
  setPlaying(!running);
  if (running) show(frame, "paused");
}

const go = (k) => { pause(); show(k); };
const actions = {
  start: () => go(0), end: () => go(last), back: () => go(frame - 1), step: () => go(frame + 1),
  "back-transition": () => go(data.events.findLast((k) => k < frame) ?? 0),
  transition: () => go(data.events.find((k) => k > frame) ?? last),
  play, continue: proceed,
  "zoom-in": () => zoom(0.5), "zoom-out": () => zoom(2), "zoom-all": () => zoomTo(whole.min, whole.max),
};
const KEYS = {
  ArrowLeft: "back", ArrowRight: "step", "Shift ArrowLeft": "back-transition", "Shift ArrowRight": "transition",
  " ": "play", c: "continue", Home: "start", End: "end", "+": "zoom-in", "=": "zoom-in", "-": "zoom-out", 0: "zoom-all",
};
document.addEventListener("keydown", (event) => {
  if (event.altKey || event.ctrlKey || event.metaKey || event.target.closest("select, input[type=text]")) return;
  if (event.key === " " && event.target.closest("button, summary, [role=button]")) return;
  const action = KEYS[(event.shiftKey && event.key.startsWith("Arrow") ? "Shift " : "") + event.key];
  if (/^[1-9]$/.test(event.key)) choose(Number(event.key) - 1);
  else if (action) actions[action]();
  else return;
  event.preventDefault();
});
for (const button of $$("#buttons button")) button.addEventListener("click", actions[button.id]);
$("#scrubber").addEventListener("input", (event) => go(Number(event.target.value)));
$("#speed").addEventListener("change", () => timer && setPlaying(true));
$("#until").addEventListener("keydown", (event) => {
  if (event.key === "Enter") proceed();
  if (event.key === "Escape") event.target.blur();
});

document.title = $("#title").textContent = data.title;
$("#runs").className = runs.length > 1 ? "two" : "one";
$("#names").textContent = `${Object.keys(runs[0].names).join(", ")}, state(1) == ${runs[0].states.at(-1)}`;
$("#scrubber").max = last;
$("#ticks").setAttribute("viewBox", `0 0 ${Math.max(last, 1)} 1`);
$("#ticks path").setAttribute("d", data.events.map((k) => `M${k} 0V1`).join(""));
if (matchMedia("(prefers-reduced-motion: reduce)").matches) $("#speed").selectedIndex = 0;
for (const run of runs) run.drawPlots();
zoomTo(whole.min, whole.max);
new ResizeObserver(() => { for (const run of runs) { run.fit(); run.placeCursor(); } }).observe($("#runs"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => runs.forEach((run) => run.plots.forEach((plot) => plot.redraw())));
choose(0);
