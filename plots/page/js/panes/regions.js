"use strict";
// Where guards are true in the plane of a velocity and a second quantity. All truths come from the compiled guards.
// In each column of pixels the values of the second quantity at which a comparison changes are found by bisection;
// between them a guard is constant, so it is asked once.
const SAMPLES = 2; // px between the points at which a comparison is asked along a column
const HALVINGS = 14;

// What guards see at points of the plane. Names that do not vary are read only once, for speed.
class PlaneScope {
  constructor(contact, element, row, state) {
    const [v, z] = contact.plane.names;
    Object.assign(this, { contact, v, z, edges: contact.leaving(state), flow: contact.flows[state][z], given: {} });
    const guards = this.readBy(this.edges.map((k) => contact.edges[k].tree));
    this.read = this.flow ? new Set([...guards, ...this.readBy([contact.flowTrees[state][z]])]) : guards;
    this.scope = contact.scopeWith(element, row, this.given);
    this.again = [...this.read].filter((name) => this.inner(name) && [v, z].some((each) => this.readBy([name]).has(each)));
    this.byColumn = this.again.filter((name) => !this.readBy([name]).has(z));
    const fixed = [...this.read].filter((name) => !this.inner(name) && name !== v && name !== z);
    for (const name of fixed) this.given[name] = contact.value(name, element, row);
    for (const name of this.read) if (this.inner(name) && !this.again.includes(name)) this.keep(name);
    this.held = fixed.filter((name) => !Object.hasOwn(contact.parameters, name));
    this.key = this.held.filter((name) => guards.has(name)).map((name) => this.given[name]).join();
    this.v0 = contact.value(v, element, row);
    this.z0 = contact.value(z, element, row);
    this.column(this.v0);
    this.given[z] = this.z0;
  }

  // Named expressions and the curve are computed from other names.
  inner(name) { return Object.hasOwn(this.contact.lets, name) || (name === "s" && this.contact.curveAt !== null); }

  // All names that trees read, also through named expressions and the curve.
  readBy(trees) {
    const found = new Set(), todo = trees.flatMap((tree) => [...namesIn(tree)]);
    while (todo.length) {
      const name = todo.pop();
      if (found.has(name)) continue;
      found.add(name);
      if (Object.hasOwn(this.contact.lets, name)) todo.push(...namesIn(this.contact.let[name]));
      else if (this.inner(name)) todo.push(this.contact.velocity);
    }
    return found;
  }

  // A name that cannot be computed fails where it is read.
  keep(name) {
    const u = valueOf(this.scope, name);
    if (!Number.isNaN(u)) this.given[name] = u;
  }

  column(v) {
    for (const name of this.byColumn) delete this.given[name];
    this.given[this.v] = v;
    for (const name of this.byColumn) this.keep(name);
  }

  at(v, z) { this.column(v); this.given[this.z] = z; return this.scope; }
}

// A comparison in a guard; its truth is 1, 0 or -1, as in truthOf.
class Comparison {
  constructor(tree, points) {
    const names = points.readBy([tree]);
    Object.assign(this, { key: JSON.stringify(tree), holds: compiled(tree), points, across: names.has(points.v), up: names.has(points.z) });
  }

  truth(z) { this.points.given[this.points.z] = z; return truthOf(this.holds, this.points.scope); }

  // Its truth from the bottom to the top of the column: the first one, and the parts of the way where it changes.
  cuts(plane) {
    const steps = Math.max(Math.ceil(plane.h / SAMPLES), 2), truth = (part) => this.truth(plane.up.at(part));
    const first = truth(0), parts = [], truths = [first];
    if (!this.up) return { parts, truths };
    for (let k = 1; k <= steps; k++) {
      const now = truth(k / steps);
      if (now === truths.at(-1)) continue;
      parts.push(halved(truth, (k - 1) / steps, k / steps));
      truths.push(now);
    }
    return { parts, truths };
  }

  // Parts of the way from left to right where it changes, of one that does not read the second quantity.
  turns(plane) {
    const truth = (part) => { this.points.column(plane.across.at(part)); return this.truth(0); }, found = [];
    for (let k = 1, before = truth(0), steps = Math.ceil(plane.w); k <= steps; k++) {
      const now = truth(k / steps);
      if (now !== before) found.push(halved(truth, (k - 1) / steps, k / steps));
      before = now;
    }
    return found;
  }
}

// Where a function of a part changes, between two parts.
function halved(truth, low, high) {
  const before = truth(low);
  let [a, b] = [low, high];
  for (let k = 0; k < HALVINGS; k++) {
    const middle = (a + b) / 2;
    if (truth(middle) === before) a = middle;
    else b = middle;
  }
  return (a + b) / 2;
}

// The regions and lines of the edges that leave a state, in px.
class GuardMap {
  constructor(plane, points) {
    Object.assign(this, { plane, points, comparisons: new Map() });
    const { contact, edges } = points;
    const parts = edges.map((k) => comparisonsIn(contact.edges[k].tree).map((tree) => this.comparison(tree)));
    this.makeColumns();
    this.regions = edges.map((k, i) => this.region(contact.edges[k].guard, parts[i]));
    this.lines = new Map(); // by text: of each clause, once
    for (const k of edges) {
      for (const { text, tree } of contact.edges[k].clauses) {
        if (!this.lines.has(text)) this.lines.set(text, comparisonsIn(tree).map((each) => this.line(this.comparison(each))).join(""));
      }
    }
  }

  comparison(tree) {
    const key = JSON.stringify(tree);
    if (!this.comparisons.has(key)) this.comparisons.set(key, new Comparison(tree, this.points));
    return this.comparisons.get(key);
  }

  // One column per pixel; sides of columns are also where comparisons of the velocity alone change.
  makeColumns() {
    const { plane, points } = this, sides = Array.from({ length: Math.ceil(plane.w) + 1 }, (_, k) => Math.min(k / plane.w, 1)), level = new Map();
    for (const each of this.comparisons.values()) {
      if (each.across && !each.up) { each.sides = each.turns(plane); sides.push(...each.sides); }
      if (!each.across) level.set(each, each.cuts(plane));
    }
    sides.sort((a, b) => a - b);
    this.columns = [];
    for (let k = 1; k < sides.length; k++) {
      if (!(sides[k] > sides[k - 1])) continue;
      const middle = (sides[k - 1] + sides[k]) / 2, v = plane.across.at(middle);
      points.column(v);
      const cuts = new Map([...this.comparisons.values()].map((each) => [each, level.get(each) ?? each.cuts(plane)]));
      this.columns.push({ from: MARGINS.left + sides[k - 1] * plane.w, x: MARGINS.left + middle * plane.w, to: MARGINS.left + sides[k] * plane.w, v, cuts });
    }
  }

  yOf(part) { return MARGINS.top + (1 - part) * this.plane.h; }

  // Spans of a column, in px, where a guard is true.
  spans(column, guard, parts) {
    const { plane, points } = this, at = [0, ...parts.flatMap((each) => column.cuts.get(each).parts), 1].sort((a, b) => a - b), found = [];
    points.column(column.v);
    for (let k = 1; k < at.length; k++) {
      if (at[k] === at[k - 1]) continue;
      points.given[points.z] = plane.up.at((at[k - 1] + at[k]) / 2);
      if (truthOf(guard, points.scope) !== 1) continue;
      const bottom = this.yOf(at[k - 1]), top = this.yOf(at[k]);
      if (found.length && found.at(-1)[1] === bottom) found.at(-1)[1] = top;
      else found.push([bottom, top]);
    }
    return found;
  }

  // A path around the area where a guard is true, and the places where its name may stand.
  region(guard, parts) {
    const done = [], places = [];
    let open = [];
    const close = () => { for (const strip of open) done.push(strip.path()); open = []; };
    let before = null;
    for (const column of this.columns) {
      const spans = this.spans(column, guard, parts);
      const goesOn = before && spans.length === open.length && spans.every(([bottom, top], i) => top < open[i].bottom && open[i].top < bottom);
      if (!goesOn) {
        close();
        open = spans.map((span) => new Strip(column.from, span));
      }
      open.forEach((strip, i) => strip.add(column, spans[i]));
      const widest = spans.reduce((best, span) => (best && best[0] - best[1] >= span[0] - span[1] ? best : span), null);
      if (widest) places.push({ x: column.x, y: (widest[0] + widest[1]) / 2, height: widest[0] - widest[1] });
      before = column;
    }
    close();
    return { d: done.join(""), places };
  }

  // The line along which a comparison changes.
  line(comparison) {
    const { plane } = this, { top } = MARGINS;
    if (comparison.sides) return comparison.sides.map((part) => `M${(MARGINS.left + part * plane.w).toFixed(2)} ${top}V${top + plane.h}`).join("");
    let d = "", before = null, open = [];
    const close = (x) => { for (const points of open) d += pathOf([...points, [x, points.at(-1)[1]]]); };
    for (const column of this.columns) {
      const cuts = column.cuts.get(comparison), ys = cuts.parts.map((part) => this.yOf(part));
      const goesOn = before && open.length === ys.length && before.truths[0] === cuts.truths[0] && ys.every((y, i) => Math.abs(y - open[i].at(-1)[1]) < 20);
      if (!goesOn) {
        close(column.from);
        if (before) d += this.steps(column.from, before, cuts);
        open = ys.map((y) => [[column.from, y]]);
      }
      open.forEach((points, i) => extend(points, column.x, ys[i]));
      before = cuts;
    }
    close(MARGINS.left + plane.w);
    return d;
  }

  // Upright pieces between two columns whose truths differ.
  steps(x, one, two) {
    const at = [0, ...one.parts, ...two.parts, 1].sort((a, b) => a - b);
    const truth = ({ parts, truths }, part) => truths[lastAt(parts, part) + 1];
    let d = "";
    for (let k = 1; k < at.length; k++) {
      const middle = (at[k - 1] + at[k]) / 2;
      if (at[k] > at[k - 1] && truth(one, middle) !== truth(two, middle)) d += `M${x.toFixed(1)} ${this.yOf(at[k - 1]).toFixed(1)}V${this.yOf(at[k]).toFixed(1)}`;
    }
    return d;
  }
}

// A connected part of a region while its columns are added from left to right.
class Strip {
  constructor(x, [bottom, top]) {
    this.tops = [[x, top]];
    this.bottoms = [[x, bottom]];
    this.end = x;
  }

  add(column, [bottom, top]) {
    Object.assign(this, { bottom, top, end: column.to });
    extend(this.tops, column.x, top);
    extend(this.bottoms, column.x, bottom);
  }

  path() {
    const around = [...this.tops, [this.end, this.top], [this.end, this.bottom], ...this.bottoms.reverse()];
    return `${pathOf(around)}Z`;
  }
}

const pathOf = (points) => `M${points.map(([x, y]) => `${x.toFixed(2)} ${y.toFixed(2)}`).join("L")}`;

// Adds a point; a level piece needs only its ends.
function extend(points, x, y) {
  if (points.length > 1 && points.at(-1)[1] === y && points.at(-2)[1] === y) points.pop();
  points.push([x, y]);
}
