"use strict";
// The guards of the selected element as regions of a plane, with the flow and the path of the run. The dot is at the
// row; where it is moved away, the page says what would fire there. Everything that does not span the plane is as at the row.
const ARROW = 13; // px, the length of an arrow of the flow
const PIXELS = 5, FAR = 30; // a step of the dot by an arrow key; with Shift
const MOST = 80; // drawings that are kept
const KEPT = 300; // ms between new regions while the run is playing
const LETTERS = { "clause-name": 6.8, "curve-name": 6.2, "edge-name": 7.8 }; // px, mean widths
const HATCHING = [45, 135, 0, 90, 20]; // degrees, of the edges of a state in order of priority

class LandscapePane {
  static side = "right"; static key = "landscape"; static title = "Landscape"; static moves = true;

  constructor(view, box) {
    Object.assign(this, { view, box, moved: null, at: -1, drawnAt: 0, layouts: new Map(), drawings: new Map() });
    this.none = make("p", box, "This chart has no plane to draw: it has no variables, and its guards read nothing but the velocity.", { class: "note" });
    this.body = make("div", box, "", { class: "beside" });
    const left = make("div", this.body, "", { class: "ground-plan" });
    this.plane = new Plane(left, { role: "group" });
    this.right = make("div", this.body, "", { class: "race-side" });
    this.ask = make("p", this.right, "", { class: "answer", "aria-live": "polite" });
    this.fact = make("p", this.right, "", { class: "answer" });
    this.race = new Race(this.right, this.plane.id);
    this.caption = make("p", this.right, "", { class: "note" });
    this.pinList = make("ol", this.right, "", { class: "pins" });
    this.makeLayers();
    this.listen();
  }

  makeLayers() {
    const { inside, above, defs, id } = this.plane, layer = (name) => draw("path", inside, { class: name });
    HATCHING.forEach((angle, k) => {
      const pattern = draw("pattern", defs, { id: `${id}-hatch${k}`, width: 7, height: 7, patternUnits: "userSpaceOnUse", patternTransform: `rotate(${angle})` });
      draw("rect", pattern, { width: 7, height: 7, class: `tint tint${k}` });
      draw("path", pattern, { d: "M0 0V7", class: `hatch hatch${k}` });
    });
    this.regions = draw("g", inside);
    this.flow = layer("flow");
    this.lines = draw("g", inside);
    this.trail = layer("trail");
    this.pins = draw("g", above);
    this.origin = draw("circle", above, { class: "origin", r: 5 });
    this.dot = draw("g", above, { class: "probe", role: "slider", tabindex: 0 });
    draw("circle", this.dot, { class: "hold", r: 17 });
    draw("circle", this.dot, { class: "here", r: 7 });
  }

  // ---------------------------------------------------------------- moving the dot
  listen() {
    const { dot, plane } = this;
    let held = false;
    const follow = (event) => this.moveTo(...plane.point(event));
    dot.addEventListener("pointerdown", (event) => { held = true; dot.setPointerCapture(event.pointerId); event.preventDefault(); dot.focus({ preventScroll: true }); });
    dot.addEventListener("touchstart", (event) => event.preventDefault(), { passive: false }); // else the page scrolls
    dot.addEventListener("pointermove", (event) => { if (held) follow(event); });
    for (const end of ["pointerup", "pointercancel"]) dot.addEventListener(end, () => { held = false; });
    for (const each of [plane.ground, plane.inside]) each.addEventListener("click", follow);
    dot.addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (event.key === "Escape") { this.moved = null; this.show(); }
    else if (way && !event.ctrlKey && !event.altKey && !event.metaKey) {
      const [x, y] = this.placeOfDot(), step = event.shiftKey ? FAR : PIXELS;
      this.moveTo(x + step * way[0], y + step * way[1], way[0] === 0, way[1] === 0);
    } else return;
    event.preventDefault(); // the keys of the page are for rows
  }

  // To a point of the drawing; a quantity that is kept stays the same number.
  moveTo(x, y, keepAcross = false, keepUp = false) {
    if (!this.points) return;
    if (play.on) pause(); // else the next row would put the dot back
    const { plane, points, moved } = this, [v, z] = moved ?? [points.v0, points.z0];
    this.moved = [keepAcross ? v : plane.acrossAt(x), keepUp ? z : plane.upAt(y)];
    this.show();
  }

  placeOfDot() {
    const { plane, points, moved } = this, [v, z] = moved ?? [points.v0, points.z0];
    return [plane.x(v), plane.y(z)];
  }

  // ---------------------------------------------------------------- size and axes
  choose(other) { if (!other && this.known) this.lay(); }

  fit() {
    const { view, box, body, plane } = this, { plane: named } = view.contact;
    this.known = named !== null && view.contact.value(named.names[1], 0, 0) !== undefined;
    this.none.hidden = this.known;
    body.hidden = !this.known;
    if (!this.known) return;
    const across = box.clientWidth, beside = across >= 540, width = beside ? Math.floor(Math.min(across * 0.6, across - 250)) : across;
    body.classList.toggle("narrow", !beside);
    plane.svg.parentNode.style.width = `${width}px`;
    const height = isWide() && beside ? Math.max(box.clientHeight - 4, 180) : Math.min(width * 0.85, 400), key = `${view.contact.name}/${width}/${height}`;
    if (this.fitted !== key) { // a page that scrolls also asks when only its texts grow
      Object.assign(this, { fitted: key, size: [width, height], laid: "" });
      this.layouts.clear();
      this.drawings.clear();
    }
    this.lay();
    this.show();
  }

  // The run has other rows. While a threshold is dragged the axes stay.
  renew() {
    const { layouts } = this;
    if (document.body.classList.contains("dragging")) for (const layout of layouts.values()) layout.track = null;
    else layouts.clear();
    this.drawings.clear();
    Object.assign(this, { laid: "", drawn: "", at: -1 });
    this.fit();
    return true;
  }

  // The axes of the selected element.
  lay() {
    const { view, plane, layouts } = this, { contact, element } = view, key = `${contact.name}/${element}`, [v, z] = contact.plane.names;
    if (this.laid === key) return;
    if (this.of !== key) this.moved = null;
    Object.assign(this, { laid: key, of: key, drawn: "" });
    if (!layouts.has(key)) layouts.set(key, { axes: this.axes() });
    const layout = layouts.get(key);
    plane.lay(...this.size, ...layout.axes);
    layout.track ??= new Track(plane, (row) => contact.value(v, element, row), (row) => contact.value(z, element, row), contact.run);
    this.track = layout.track;
    this.drawPins();
  }

  // Pins and places where guards turn are in view, except those far away from the run.
  axes() {
    const { contact, element } = this.view, { names: [v, z], threshold, pins } = contact.plane, { rows } = contact.run;
    const speeds = extent([{ get: (row) => contact.value(v, element, row), rows }]), top = largest(speeds);
    const fastest = Math.max(3 * top, 100 * threshold, ...pins.map(({ at }) => 1.5 * Math.abs(at[0])).filter((speed) => speed <= 100 * top));
    const seen = extent([{ get: (row) => contact.value(z, element, row), rows }]), widest = largest(seen) || 1;
    const all = [seen.low, seen.high, ...pins.map(({ at }) => at[1]).filter((u) => Math.abs(u) <= 4 * widest)];
    const wide = { h: 1600, up: new Axis({ name: z, low: -4 * widest, high: 4 * widest }) };
    for (const state of contact.states.keys()) {
      for (const part of [0, 0.25, 0.5, 0.75, 1]) { // what is held may move them
        const points = new PlaneScope(contact, element, Math.round(part * (rows - 1)), state);
        all.push(...this.turns(points, wide, [0.5 * threshold, fastest, -fastest]));
        if (!points.key) break;
      }
    }
    return [
      new Axis({ name: v, unit: unitOf(contact, v), low: -fastest, high: fastest, linear: threshold }),
      new Axis({ name: z, unit: unitOf(contact, z), ...roomy(Math.min(...all), Math.max(...all), 0.14) }),
    ];
  }

  // Values of the second quantity at which guards turn, at some velocities.
  turns(points, plane, speeds) {
    const trees = points.edges.flatMap((k) => comparisonsIn(points.contact.edges[k].tree)), found = [];
    for (const each of trees.map((tree) => new Comparison(tree, points)).filter(({ up }) => up)) {
      for (const speed of speeds) {
        points.column(speed);
        found.push(...each.cuts(plane).parts.map((part) => plane.up.at(part)));
      }
    }
    return found;
  }

  // ---------------------------------------------------------------- the row
  show() {
    const { view, plane } = this, { contact, element, row } = view;
    if (!this.known) return;
    const asked = contact.asked(element, row), state = contact.modes[element][asked.row];
    if (this.at !== row) Object.assign(this, { at: row, moved: null });
    const points = new PlaneScope(contact, element, asked.row, state);
    Object.assign(this, { points, asked, state });
    this.drawGuards();
    this.drawFlow();
    place(this.trail, { d: this.track.before(asked.row, RECENT * (whole.max - whole.min)) });
    const at = this.placeOfDot(), here = [plane.x(points.v0), plane.y(points.z0)], known = (point) => point.every(Number.isFinite);
    place(this.dot, { visibility: known(at) ? "inherit" : "hidden", ...(known(at) && { transform: `translate(${at.map((u) => u.toFixed(2)).join(" ")})` }) });
    place(this.origin, { opacity: this.moved && known(here) ? 1 : 0, ...(known(here) && { cx: here[0], cy: here[1] }) });
    this.dot.classList.toggle("moved", this.moved !== null);
    this.tell();
  }

  tell() {
    const { view, points, asked, state, moved } = this, { contact, element } = view, [v, z] = moved ?? [points.v0, points.z0];
    const scope = moved ? contact.scopeWith(element, asked.row, { [points.v]: v, [points.z]: z }) : contact.scope(element, asked.row);
    const next = contact.firesNext(state, scope), leaving = points.edges, name = (k) => contact.edges[k].name;
    const texts = [`${points.v} = ${contact.tell(points.v, v)}`, `${points.z} = ${contact.tell(points.z, z)}`];
    say(this.ask, !moved ? "" : next >= 0 ? `${name(next)} would fire` : leaving.length ? `nothing would fire: ${heldBack(contact, leaving, scope)}` : `no edge leaves ${contact.states[state]}`);
    say(this.fact, moved ? `at ${texts.join(", ")}; Esc puts the dot back`
      : asked.fired >= 0 ? `${name(asked.fired)} has fired; shown as it was checked, in ${contact.states[state]}`
        : `${nameOf(contact, element)} in ${contact.states[state]}: ${next >= 0 ? `${name(next)} fires next` : leaving.length ? heldBack(contact, leaving, scope) : "no edge leaves it"}`);
    this.ask.hidden = !moved;
    place(this.dot, {
      "aria-valuenow": String(z), "aria-valuemin": String(this.plane.up.low), "aria-valuemax": String(this.plane.up.high),
      "aria-valuetext": texts.join(", "), "aria-label": `Point in the plane of ${points.v} and ${points.z}: arrow keys move it, Escape puts it back`,
    });
    this.race.show(contact, element, leaving, scope, moved ? { edge: next, word: "would fire" } : asked.fired >= 0 ? { edge: asked.fired, word: "FIRED" } : { edge: next, word: "fires next" });
  }

  // ---------------------------------------------------------------- what is drawn anew when it changes
  drawGuards() {
    const { points, state, view, plane } = this, key = `${this.laid}/${state}/${points.key}`, now = performance.now();
    if (this.drawn === key) return;
    if (play.on && this.drawn.startsWith(`${this.laid}/${state}/`) && now - this.drawnAt < KEPT) return;
    Object.assign(this, { drawn: key, drawnAt: now });
    plane.svg.setAttribute("aria-label", `Plane of ${points.v} and ${points.z}: guards of the edges that leave ${view.contact.states[state]}`);
    if (this.drawings.size > MOST) this.drawings.clear();
    const known = this.drawings.get(key);
    if (!known) this.drawings.set(key, this.drawAnew());
    else { this.regions.replaceChildren(known.below); this.lines.replaceChildren(known.above); }
    this.boxes = this.drawings.get(key).boxes;
  }

  drawAnew() {
    const { points, plane, view } = this, { edges } = view.contact;
    for (const layer of [this.regions, this.lines]) layer.replaceChildren();
    const map = new GuardMap(plane, points), boxes = new Boxes(), below = draw("g", this.regions), above = draw("g", this.lines);
    this.names = above;
    map.regions.forEach(({ d }, i) => draw("path", below, { d, class: `guarded edge${i % HATCHING.length}`, "data-edge": points.edges[i], fill: `url(#${plane.id}-hatch${i % HATCHING.length})` }));
    const lines = [...map.lines].map(([text, d]) => ({ text, d, node: draw("path", above, { d, class: "clause" }) }));
    for (const { text, d, node } of lines) if (d) this.nameLine(node, text, "clause-name", boxes);
    this.drawCurves(boxes);
    map.regions.forEach(({ places }, i) => this.nameRegion(edges[points.edges[i]].name, places, boxes));
    points.at(points.v0, points.z0);
    return { below, above, boxes };
  }

  // A text where it covers no other; without a free place it is left out.
  nameAt(text, kind, boxes, candidates) {
    const width = text.length * LETTERS[kind] + 4, { left, top } = MARGINS, { w, h } = this.plane;
    for (const [x, y] of candidates) {
      const from = x - width / 2;
      if (from < left || from + width > left + w || y - 12 < top || y + 3 > top + h || !boxes.take(from, y - 12, width, 15)) continue;
      draw("text", this.names, { x, y, "text-anchor": "middle", class: kind }, text);
      return;
    }
  }

  nameLine(line, text, kind, boxes) {
    const length = line.getTotalLength(), half = (text.length * LETTERS[kind]) / 2 + 6, found = [];
    for (const part of [0.97, 0.03, 0.9, 0.1, 0.8, 0.2, 0.5, 0.7, 0.3, 0.6, 0.4]) {
      const { x, y } = line.getPointAtLength(part * length), next = line.getPointAtLength(part * length + 1);
      const steep = Math.abs(next.y - y) > Math.abs(next.x - x), inward = x < MARGINS.left + half ? half : 0;
      if (steep) found.push([x + half, y + 4], [x - half, y + 4]);
      else found.push([x + inward, y - 5], [x + inward, y + 14], [x - half, y - 5], [x - half, y + 14]);
    }
    this.nameAt(text, kind, boxes, found);
  }

  nameRegion(text, places, boxes) {
    const half = (text.length * LETTERS["edge-name"]) / 2, tall = places.filter(({ height }) => height > 18), all = [];
    const covers = (x, y) => places.some((each) => Math.abs(each.x - x) < 1.5 && Math.abs(each.y - y) < each.height / 2 - 8);
    for (const part of [0.5, 0.75, 0.25, 0.62, 0.38, 0.85, 0.15, 0.95, 0.05]) {
      const each = tall[Math.floor(part * tall.length)];
      if (each) for (const shift of [0, 0.25, -0.25]) all.push([each.x, each.y + shift * each.height + 4]);
    }
    const inner = all.filter(([x, y]) => [x - half, x, x + half].every((at) => covers(at, y - 4)));
    this.nameAt(text, "edge-name", boxes, [...inner, ...all]);
  }

  // s(v) and -s(v), where edges turn at them.
  drawCurves(boxes) {
    const { plane, points, view, names } = this, { contact } = view;
    const shown = contact.curveAt !== null && contact.threshold && contact.variables.includes(points.z);
    [1, -1].forEach((sign, k) => {
      const found = [];
      for (let x = 0; shown && x <= plane.w; x += 2) {
        const s = valueOf(points.at(plane.across.at(x / plane.w), points.z0), "s");
        if (Number.isFinite(s)) found.push([MARGINS.left + x, plane.y(sign * s)]);
      }
      if (!found.length) return;
      const curve = draw("path", names, { d: pathOf(found), class: "curve" });
      this.nameLine(curve, k ? "−s(v)" : "s(v)", "curve-name", boxes);
    });
  }

  // What is computed at each point and what is as at the row.
  tellHeld(faster) {
    const { points, view, state } = this, { contact } = view, { z } = points;
    const held = points.held.map((name) => `${name} = ${contact.tell(name, points.given[name])}`);
    say(this.caption, [
      points.again.length ? `${points.again.join(", ")} computed at each point.` : "",
      points.flow ? `Arrows: d${z}/dt of ${contact.states[state]} at each point, d${points.v}/dt = ${eng(faster, `${contact.units[points.v]}^2`, 3)} of the run near the row.` : `No arrows: the chart has no flow of ${z}.`,
      held.length ? `As at the row: ${held.join(", ")}.` : "",
    ].filter(Boolean).join(" "));
  }

  // The direction of the flow.
  drawFlow() {
    const { plane, points, view } = this, { contact, element } = view, faster = slopeAt(contact, element, this.asked.row, points.v);
    this.tellHeld(faster);
    let d = "";
    const { w, h } = plane, columns = Math.max(Math.floor(w / 30), 2), rows = Math.max(Math.floor(h / 32), 2);
    for (let i = 0; points.flow && i < columns; i++) {
      const v = plane.across.at((i + 0.5) / columns), dx = faster * plane.across.rate(v) * w;
      points.column(v);
      for (let k = 0; k < rows; k++) {
        const z = plane.up.at((k + 0.5) / rows);
        points.given[points.z] = z;
        const dy = -valueOf(points.flow, points.scope) * plane.up.rate(z) * h, length = Math.hypot(dx, dy);
        if (!Number.isFinite(length)) continue;
        const x = MARGINS.left + ((i + 0.5) / columns) * w, y = MARGINS.top + (1 - (k + 0.5) / rows) * h;
        if (!this.boxes.free(x - 5, y - 5, 10, 10)) continue; // not through a text
        d += length === 0 ? `M${x - 1} ${y}h2` : arrowAt(x, y, dx / length, dy / length);
      }
    }
    place(this.flow, { d });
  }

  drawPins() {
    const { pins, plane, pinList, view } = this, { contact } = view;
    pins.replaceChildren();
    pinList.replaceChildren();
    pinList.hidden = !contact.plane.pins.length;
    contact.plane.pins.forEach(({ at: [v, z], text, status, where }, k) => {
      const x = clamp(plane.x(v), MARGINS.left, MARGINS.left + plane.w), y = clamp(plane.y(z), MARGINS.top, MARGINS.top + plane.h);
      const mark = draw("g", pins, { class: "pinned-at", transform: `translate(${x.toFixed(1)} ${y.toFixed(1)})` });
      draw("title", mark, {}, `${status}: ${text}`);
      draw("circle", mark, { r: 8 });
      draw("text", mark, { y: 4, "text-anchor": "middle" }, `${k + 1}`);
      const at = `${plane.across.name} = ${contact.tell(plane.across.name, v)}, ${plane.up.name} = ${contact.tell(plane.up.name, z)}`, out = Math.abs(plane.x(v) - x) + Math.abs(plane.y(z) - y) > 0.1;
      make("li", pinList, `${status}: ${text} (${[where.join(", "), at, out ? "outside of the plane" : ""].filter(Boolean).join("; ")})`);
    });
  }
}
PANES.push(LandscapePane);

function arrowAt(x, y, cos, sin) {
  const at = (u, w) => `${(x + u * cos - w * sin).toFixed(1)} ${(y + u * sin + w * cos).toFixed(1)}`, end = ARROW / 2;
  return `M${at(-end, 0)}L${at(end, 0)}M${at(end - 4, 2.5)}L${at(end, 0)}L${at(end - 4, -2.5)}`;
}

// The rate of change of a value in the run, between the instants before and after a row.
function slopeAt(contact, element, row, name) {
  const { run } = contact, t = run.t(row);
  let from = row, to = row;
  while (from > 0 && run.t(from) === t) from -= 1;
  while (to < run.rows - 1 && run.t(to) === t) to += 1;
  return run.t(to) > run.t(from) ? (contact.value(name, element, to) - contact.value(name, element, from)) / (run.t(to) - run.t(from)) : 0;
}

// One lane per edge, one bar per clause: from -1 (false) over 0 to +1 (true), relative to the larger side.
class Race {
  constructor(box, planeId) {
    Object.assign(this, { planeId, lanes: [], listed: "" });
    this.box = make("div", box, "", { class: "race", role: "group", "aria-label": "Race to fire: margins of the clauses" });
  }

  list(contact, leaving) {
    this.box.replaceChildren();
    this.lanes = leaving.map((k, i) => {
      const edge = contact.edges[k], lane = make("div", this.box, "", { class: "lane" }), head = make("h3", lane);
      const swatch = draw("svg", head, { width: 16, height: 12, "aria-hidden": "true" });
      draw("rect", swatch, { width: 16, height: 12, class: `guarded edge${i % HATCHING.length}`, fill: `url(#${this.planeId}-hatch${i % HATCHING.length})` });
      make("span", head, `${edge.priority} ${edge.name}`);
      make("small", head, `→ ${contact.states[edge.target]}`);
      const word = make("em", head), list = make("ul", lane);
      const rows = edge.clauses.map(({ text }) => {
        const row = make("li", list), mark = make("span", row, "", { class: "mark" });
        make("span", row, text, { class: "text" });
        const bar = make("i", make("span", row, "", { class: "bar", "aria-hidden": "true" }));
        return { row, mark, bar, margin: make("span", row, "", { class: "margin" }) };
      });
      return { k, lane, word, rows };
    });
  }

  show(contact, element, leaving, scope, told) {
    const key = `${contact.name}/${leaving}`;
    if (this.listed !== key) { this.listed = key; this.list(contact, leaving); }
    for (const { k, lane, word, rows } of this.lanes) {
      const clauses = contact.clauses(k, scope), fires = truthOf(contact.edges[k].guard, scope) === 1, worst = fires ? null : worstClause(clauses);
      say(word, k === told.edge ? told.word : fires ? "true, after the first" : "");
      lane.classList.toggle("fires", k === told.edge);
      clauses.forEach((clause, c) => {
        const { row, mark, bar, margin } = rows[c], compared = !Number.isNaN(clause.margin), part = compared ? relative(clause) : 0;
        say(mark, `${MARKS[clause.truth]}`);
        say(margin, compared ? marginText(clause) : { 1: "true", 0: "false" }[clause.truth] ?? "not computable");
        row.className = `${clause.truth === 1 ? "true" : "false"}${clause === worst ? " worst" : ""}`;
        row.title = clause === worst ? "holds the edge back" : "";
        bar.style.left = `${50 + 50 * Math.min(part, 0)}%`;
        bar.style.width = `${50 * Math.abs(part)}%`;
      });
    }
  }
}
