"use strict";
// An SVG plane with two axes. Each axis is linear, or linear near zero and logarithmic beyond.
const MARGINS = { left: 62, right: 20, top: 8, bottom: 34 }; // px
const LETTER = 6.2; // px, the mean width of a letter of a mark
const STEPS = [1, 2, 5, 10];
let planes = 0; // so that each has its own ids

class Axis {
  // From low to high. With a linear part, the axis is linear within ±linear and logarithmic beyond.
  constructor({ name, unit = "", low, high, linear = 0 }) {
    Object.assign(this, { name, unit, low, high, linear });
    this.from = this.scaled(low);
    this.length = this.scaled(high) - this.from;
    this.power = linear ? 0 : powerOf(Math.max(Math.abs(low), Math.abs(high)), unit);
  }

  scaled(u) {
    if (!this.linear) return u;
    const over = Math.abs(u) / this.linear;
    return over <= 1 ? u / this.linear : Math.sign(u) * (1 + Math.log10(over));
  }

  // Which part of the way from low to high a value is, and back.
  part(u) { return (this.scaled(u) - this.from) / this.length; }

  at(part) {
    const w = this.from + part * this.length;
    if (!this.linear) return w;
    return Math.abs(w) <= 1 ? w * this.linear : Math.sign(w) * this.linear * 10 ** (Math.abs(w) - 1);
  }

  // The derivative of part(u).
  rate(u) {
    if (!this.linear) return 1 / this.length;
    return 1 / (this.length * (Math.abs(u) <= this.linear ? this.linear : Math.abs(u) * Math.LN10));
  }

  get title() {
    if (this.linear) return `${this.name}, linear within ±${eng(this.linear, this.unit, 3).replace(/\.0+(?=\s)/, "")}`;
    return this.unit ? `${this.name} [${PREFIXES[this.power]}${this.unit}]` : this.name;
  }

  // Values with grid lines, and the texts of those that get one, most important first.
  marks(pixels, space) {
    return this.linear ? this.decades(pixels / this.length < space ? 3 : 1) : this.steps((this.length * space) / pixels);
  }

  steps(least) {
    const base = 10 ** Math.floor(Math.log10(least)), step = STEPS.map((k) => k * base).find((each) => each >= least * (1 - 1e-9));
    const factor = 10 ** this.power, digits = decimals(step / factor), found = [];
    for (let k = Math.ceil(this.low / step); k * step <= this.high; k++) {
      found.push({ u: k * step, text: ((k * step) / factor).toFixed(digits).replace("-", "−") });
    }
    return found.sort((a, b) => Math.abs(a.u) - Math.abs(b.u));
  }

  // Every decade has a grid line, and every so many a text.
  decades(apart) {
    const found = [{ u: 0, text: "0" }], first = Math.round(Math.log10(this.linear)), last = Math.floor(Math.log10(Math.max(-this.low, this.high)) + 1e-9);
    for (let e = last; e >= first; e--) {
      const power = powerOf(10 ** e, this.unit), text = e % apart ? "" : `${10 ** (e - power)} ${PREFIXES[power]}${this.unit}`.trim();
      for (const [u, sign] of [[10 ** e, ""], [-(10 ** e), "−"]]) if (u >= this.low && u <= this.high) found.push({ u, text: text && sign + text });
    }
    return found;
  }
}

class Plane {
  constructor(box, attributes = {}) {
    this.id = `plane${planes++}`;
    this.svg = draw("svg", box, { class: "plane", ...attributes });
    this.defs = draw("defs", this.svg);
    this.clip = draw("rect", draw("clipPath", this.defs, { id: this.id }));
    this.ground = draw("rect", this.svg, { class: "ground" });
    this.grid = draw("path", this.svg, { class: "grid" });
    this.inside = draw("g", this.svg, { "clip-path": `url(#${this.id})` });
    this.texts = draw("g", this.svg, { class: "marks" });
    this.above = draw("g", this.svg); // not clipped
  }

  lay(width, height, across, up) {
    const { left, right, top, bottom } = MARGINS;
    Object.assign(this, { width, height, across, up, w: Math.max(width - left - right, 20), h: Math.max(height - top - bottom, 20) });
    place(this.svg, { width, height });
    for (const node of [this.clip, this.ground]) place(node, { x: left, y: top, width: this.w, height: this.h });
    this.drawMarks();
  }

  x(u) { return MARGINS.left + this.across.part(u) * this.w; }
  y(u) { return MARGINS.top + (1 - this.up.part(u)) * this.h; }
  acrossAt(x) { return this.across.at(clamp((x - MARGINS.left) / this.w, 0, 1)); }
  upAt(y) { return this.up.at(1 - clamp((y - MARGINS.top) / this.h, 0, 1)); }

  // Of a pointer event, in px of the drawing.
  point(event) {
    const box = this.svg.getBoundingClientRect();
    return [(event.clientX - box.left) / large, (event.clientY - box.top) / large];
  }

  drawMarks() {
    const { left, top } = MARGINS, { texts, w, h, width, height } = this, base = top + h, lines = [];
    texts.replaceChildren();
    const free = new Boxes();
    for (const { u, text } of this.across.marks(w, 64)) {
      const x = this.x(u), half = (text.length * LETTER) / 2;
      lines.push(`M${x.toFixed(1)} ${top}V${base}`);
      if (text && x - half > left - 20 && x + half < width + 2 && free.take(x - half - 5, 0, 2 * half + 10, 1)) draw("text", texts, { x, y: base + 14, "text-anchor": "middle" }, text);
    }
    for (const { u, text } of this.up.marks(h, 34)) {
      const y = this.y(u);
      lines.push(`M${left} ${y.toFixed(1)}H${left + w}`);
      if (free.take(-100, y - 7, 1, 14)) draw("text", texts, { x: left - 5, y: y + 4, "text-anchor": "end" }, text);
    }
    place(this.grid, { d: lines.join("") });
    draw("text", texts, { x: left + w / 2, y: height - 5, "text-anchor": "middle", class: "name" }, this.across.title);
    draw("text", texts, { transform: `translate(13 ${top + h / 2}) rotate(-90)`, "text-anchor": "middle", class: "name" }, this.up.title);
  }
}

// Places that texts have taken.
class Boxes {
  constructor() { this.taken = []; }

  free(x, y, width, height) {
    return this.taken.every((each) => x >= each.x + each.width || x + width <= each.x || y >= each.y + each.height || y + height <= each.y);
  }

  take(x, y, width, height) {
    const free = this.free(x, y, width, height);
    if (free) this.taken.push({ x, y, width, height });
    return free;
  }
}

// The unit of a name in guards.
function unitOf(contact, name) {
  return contact.units[name] ?? (name === "s" ? contact.units[contact.variables[0]] : undefined) ?? "";
}

// A range with some room at both ends.
function roomy(low, high, room = 0.06) {
  const pad = room * (high - low) || 0.5 * Math.abs(high) || 1;
  return { low: low - pad, high: high + pad };
}

// The least and the largest finite value of columns of runs.
function extent(columns) {
  let low = Infinity, high = -Infinity;
  for (const { get, rows } of columns) {
    for (let row = 0; row < rows; row++) {
      const u = get(row);
      if (u < low && u > -Infinity) low = u;
      if (u > high && u < Infinity) high = u;
    }
  }
  return low <= high ? { low, high } : { low: -1, high: 1 };
}

// The largest distance from 0 in a range.
const largest = ({ low, high }) => Math.max(Math.abs(low), Math.abs(high));

// The path of a run in a plane, in px, by row.
class Track {
  constructor(plane, across, up, run) {
    Object.assign(this, { run, x: new Float32Array(run.rows), y: new Float32Array(run.rows) });
    for (let row = 0; row < run.rows; row++) {
      this.x[row] = plane.x(across(row));
      this.y[row] = plane.y(up(row));
    }
  }

  // Paths between rows, apart by a level at each row; what cannot be seen is left out.
  pieces(levels, levelAt) {
    const { x, y } = this, found = Array.from({ length: levels }, () => []);
    for (let row = 0, last = -1, level = -1; row < x.length; row++) {
      if (!Number.isFinite(x[row]) || !Number.isFinite(y[row])) { level = -1; continue; }
      const now = levelAt(row), point = `${x[row].toFixed(1)} ${y[row].toFixed(1)}`;
      if (now === level && Math.abs(x[row] - x[last]) + Math.abs(y[row] - y[last]) < 0.7) continue;
      if (level >= 0) found[level].push(`L${point}`);
      if (now !== level) found[now].push(`M${point}`);
      [last, level] = [row, now];
    }
    return found.map((each) => each.join(""));
  }

  // The path before a row, back to a time, at most some hundred points.
  before(row, time) {
    const { x, y, run } = this, from = run.t(row) - time;
    let d = "", last = row;
    for (let k = row, points = 0; k >= 0 && points < 300 && run.t(k) >= from; k--) {
      if (!Number.isFinite(x[k]) || !Number.isFinite(y[k])) break;
      if (k !== row && Math.abs(x[k] - x[last]) + Math.abs(y[k] - y[last]) < 1) continue;
      d += `${d ? "L" : "M"}${x[k].toFixed(1)} ${y[k].toFixed(1)}`;
      last = k;
      points += 1;
    }
    return d;
  }

  // Arrow heads along the way, as one path; few enough that each can be told from the next.
  heads(every, most) {
    const { x, y } = this, seen = new Set(), found = [];
    for (let row = 1, way = every / 2; row < x.length && found.length < most; row++) {
      const dx = x[row] - x[row - 1], dy = y[row] - y[row - 1], length = Math.hypot(dx, dy);
      if (!(length > 0 && length < Infinity)) continue;
      way += length;
      const cell = `${Math.round(x[row] / every)} ${Math.round(y[row] / every)} ${Math.round((2 * Math.atan2(dy, dx)) / Math.PI)}`;
      if (way < every || seen.has(cell)) continue;
      seen.add(cell);
      way = 0;
      found.push(headAt(x[row - 1] + dx / 2, y[row - 1] + dy / 2, dx / length, dy / length, 5.5));
    }
    return found.join("");
  }

  // The row at a point; of several, the one nearest to a row.
  nearest(px, py, row) {
    const { x, y } = this;
    let least = Infinity, best = row;
    for (let k = 0; k < x.length; k++) {
      const far = (x[k] - px) ** 2 + (y[k] - py) ** 2;
      if (far < least) least = far;
    }
    const limit = (Math.sqrt(least) + 2) ** 2;
    for (let k = 0, apart = Infinity; k < x.length; k++) {
      if ((x[k] - px) ** 2 + (y[k] - py) ** 2 <= limit && Math.abs(k - row) < apart) [best, apart] = [k, Math.abs(k - row)];
    }
    return best;
  }
}

// A triangle that points along (cos, sin).
function headAt(x, y, cos, sin, size) {
  const at = (u, w) => `${(x + u * cos - w * sin).toFixed(1)} ${(y + u * sin + w * cos).toFixed(1)}`;
  return `M${at(size, 0)}L${at(-size, 0.62 * size)}L${at(-size, -0.62 * size)}Z`;
}
