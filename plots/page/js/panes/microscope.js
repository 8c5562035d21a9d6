"use strict";
// The microscope: a time axis that unfolds at transitions. Every firing is a column of the same width, whatever the time
// between them; firings with other rows between them are separated by a gap with a broken axis. Columns are placed once
// for the whole run, so that nothing jumps while stepping; nodes exist only for those in view.
const COLUMN = { least: 82, most: 160, gap: 62, head: 18, foot: 34 }; // px
const LINE_HEIGHT = { least: 18, two: 28, most: 48, page: 30, count: 8 }; // px; from `two` on for names on two lines; where the page
// scrolls, `count` lines of height `page`
const STAIRS = { least: 96, most: 460, page: 150, above: 18, below: 8, step: 12 }; // px, with the head; the space for values above
const F_DIGITS = 5;

// Width of a text in the font of the drawings, px.
const pen = document.createElement("canvas").getContext("2d");
pen.font = "11px system-ui, sans-serif";
const widths = new Map(), BOLD = 1.1; // times as wide
function textWidth(text) {
  if (!widths.has(text)) {
    if (widths.size > 5000) widths.clear();
    widths.set(text, pen.measureText(text).width);
  }
  return widths.get(text);
}

// The name of an edge on two lines, divided at an underscore near its middle.
function folded(name) {
  const places = [...name.matchAll(/_./g)].map(({ index }) => index), middle = name.length / 2;
  if (!places.length || name.length < 9) return name;
  const at = places.reduce((best, each) => (Math.abs(each - middle) < Math.abs(best - middle) ? each : best));
  return `${name.slice(0, at)}\n${name.slice(at)}`;
}

// Heights for increasing values, from 0 to room: in proportion, but a step is at least so high that it can be seen.
function heights(values, room) {
  const count = values.length - 1, range = values[count] - values[0];
  if (count < 1) return values.map(() => room / 2);
  const least = Math.min(STAIRS.step, room / (2 * count));
  return values.map((u, k) => k * least + ((u - values[0]) / range) * (room - count * least));
}

// Where the firings of a run are on the unfolded axis. Column k is firing k; gap k is before it, the last one after all.
class Unfolded {
  constructor(run, pitch) {
    this.run = run;
    this.pitch = pitch;
    this.firings = [...run.fired.values()].sort((a, b) => a.row - b.row);
    this.rows = Uint32Array.from(this.firings, ({ row }) => row);
    const count = this.firings.length;
    this.gaps = new Float64Array(count + 1); // left edges
    this.lefts = new Float64Array(count + 1); // of columns, and the end
    let x = 0;
    for (let k = 0; k <= count; k++) {
      this.gaps[k] = x;
      if (this.apart(k)) x += COLUMN.gap;
      this.lefts[k] = x;
      if (k < count) x += pitch;
    }
    this.width = x;
  }

  // Whether there is time, or another row, between a firing and the one before.
  apart(k) { return k === 0 || k === this.rows.length || this.rows[k] !== this.rows[k - 1] + 1 || this.run.t(this.rows[k]) !== this.run.t(this.rows[k - 1]); }

  middle(k) { return this.lefts[k] + this.pitch / 2; }

  // The last column that begins at or before x, or -1; its gap begins before.
  at(x) { return Math.min(lastAt(this.gaps, x), this.rows.length); }

  // The place of a row: in the middle of the column of the firing that made it, or in a gap, where time runs evenly.
  place(row) {
    const { rows, run } = this, k = lastAt(rows, row);
    if (rows[k] === row) return this.middle(k);
    const from = k < 0 ? 0 : rows[k], to = rows[k + 1] ?? run.rows - 1, span = run.t(to) - run.t(from);
    const part = span > 0 ? (run.t(row) - run.t(from)) / span : (row - from) / Math.max(to - from, 1);
    return this.gaps[k + 1] + part * COLUMN.gap;
  }

  // The row to show for a place: of the firing, or the last row before it.
  rowAt(x) {
    const k = this.at(x), count = this.rows.length;
    if (k < count && x >= this.lefts[k]) return this.rows[k];
    return k < count ? this.rows[k] - 1 : this.run.rows - 1;
  }

  // The levels of a column by row, from gap to gap: { from, to, row, ends }; ends is true on both sides of a gap.
  levels(first, last) {
    const found = [], half = 0.44 * COLUMN.gap, count = this.rows.length;
    for (let k = first; k <= last; k++) {
      if (!this.apart(k)) found.push({ from: this.middle(k - 1), to: this.middle(k), row: this.rows[k - 1] });
      else {
        if (k > 0) found.push({ from: this.middle(k - 1), to: this.gaps[k] + half, row: this.rows[k - 1] });
        if (k < count) found.push({ from: this.lefts[k] - half, to: this.middle(k), row: this.rows[k] - 1, begins: true });
      }
    }
    return found;
  }
}

class MicroscopePane {
  static side = "right"; static key = "microscope"; static title = "Microscope";

  constructor(view, box) {
    const { run } = view;
    Object.assign(this, { view, box, nodes: new Map(), texts: [], row: -1, drawn: "" });
    box.classList.add("micro");
    if (!run.fired.size) {
      make("p", box, run.log.length ? "The rows of this run do not show its transitions one by one." : "This run has no transitions.", { class: "note" });
      return;
    }
    const many = run.contacts.length > 1 || !run.contacts[0].velocity, shown = run.contacts.filter(({ states, log }) => states.length > 1 || log.length);
    this.lines = shown.flatMap((contact) => contact.modes.map((_, element) => ({
      contact, element, label: many ? `${contact.name}${contact.n > 1 ? ` ${element + 1}` : ""}` : `E${element + 1}`,
    })));
    this.labels = Math.ceil(clamp(Math.max(...this.lines.map(({ label }) => textWidth(label) * BOLD)) + 10, 46, 120));
    this.names = shown.flatMap(({ edges }) => edges.map(({ name }) => name));
    this.build();
  }

  build() {
    const { box, view: { run } } = this;
    this.scroller = make("div", box, "", { class: "strip", tabindex: 0, role: "group", "aria-label": `Transitions one by one (${run.fired.size})` });
    this.scroller.style.setProperty("--labels", `${this.labels}px`);
    this.wide = make("div", this.scroller, "", { class: "wide" });
    this.svg = draw("svg", make("div", this.wide, "", { class: "top" }), { "aria-hidden": "true" });
    this.path = draw("path", this.svg, { class: "level" });
    this.through = draw("path", this.svg, { class: "through" });
    this.mark = draw("path", this.svg, { class: "mark" });
    this.cover = draw("rect", this.svg, { class: "cover", width: this.labels });
    this.title = draw("text", this.svg, { class: "title", x: 2, y: 13 });
    this.body = make("div", this.wide, "", { class: "rows" });
    this.here = make("div", this.body, "", { class: "here" });
    const names = make("div", this.body, "", { class: "names" });
    for (const line of this.lines) line.name = make("b", names, line.label, { title: nameOf(line.contact, line.element) });
    this.foot = make("div", this.wide, "", { class: "foot" });
    make("span", this.foot, `row\n${this.labels > 62 ? "micro-step" : "micro"}`, { class: "corner" });
    this.line = make("div", this.wide, "", { class: "line" });
    this.scroller.addEventListener("scroll", () => this.drawView());
    this.wide.addEventListener("click", (event) => {
      const x = (event.clientX - this.wide.getBoundingClientRect().left) / large - this.labels;
      if ((event.clientX - this.scroller.getBoundingClientRect().left) / large < this.labels) return;
      go(frames.of[this.view.place][this.strip.rowAt(x)]);
    });
  }

  // Where all panes are in view the stairs take the height that is left.
  fit() {
    if (!this.scroller || !this.box.clientWidth) return;
    const { run } = this.view, count = this.lines.length, rest = this.box.clientHeight - COLUMN.foot - 14; // 14: the bar to scroll
    const { least, two, most, page } = LINE_HEIGHT, fits = Math.floor((rest - STAIRS.page) / count);
    const height = fits < two && rest - count * two >= STAIRS.least ? two : clamp(fits, least, most);
    this.height = isWide() ? height : page;
    this.top = !run.contacts.some(({ shown }) => shown.length) ? COLUMN.head + 2 : isWide() ? clamp(rest - count * this.height, STAIRS.least, STAIRS.most) : STAIRS.page;
    this.unfold(this.height >= LINE_HEIGHT.two);
    for (const [name, value] of [["--row", this.height], ["--top", this.top], ["--foot", COLUMN.foot]]) this.scroller.style.setProperty(name, `${value}px`);
    this.scroller.style.height = isWide() ? "" : `${this.top + COLUMN.foot + 14 + Math.min(count, LINE_HEIGHT.count) * this.height}px`;
    this.across = this.scroller.clientWidth - this.labels;
    this.down = this.scroller.clientHeight - this.top - COLUMN.foot;
    place(this.svg, { width: this.scroller.clientWidth, height: this.top });
    place(this.cover, { height: this.top });
    this.drawn = "";
    this.row = -1;
    if (this.view.open.right === this) this.show();
  }

  // Columns as wide as the names of edges, which have two lines if there is room.
  unfold(two) {
    if (this.two === two) return;
    this.two = two;
    const lines = this.names.flatMap((name) => (two ? folded(name).split("\n") : [name]));
    const widest = Math.max(...lines.map((each) => textWidth(each))) * BOLD;
    this.strip = new Unfolded(this.view.run, Math.ceil(clamp(widest + 12, COLUMN.least, COLUMN.most)));
    for (const node of this.nodes.values()) for (const each of Object.values(node)) each.remove();
    this.nodes.clear();
    this.wide.style.width = `${this.labels + this.strip.width}px`;
  }

  choose() { if (this.strip) { this.drawn = ""; this.drawView(); this.markLine(); } }

  show() {
    if (!this.strip) return;
    const { view, strip, scroller } = this;
    if (this.row !== view.row) {
      this.row = view.row;
      const x = strip.place(view.row), k = strip.at(x), fired = strip.rows[k] === view.row;
      const left = clamp(x - this.across / 2, 0, Math.max(strip.width - this.across, 0));
      if (Math.abs((this.scrolled ?? -1) - left) > 0.5) { this.scrolled = left; scroller.scrollLeft = left; }
      this.here.hidden = !fired;
      this.here.style.transform = `translateX(${this.labels + strip.lefts[k]}px)`;
      this.here.style.width = `${strip.pitch}px`;
      this.line.hidden = fired;
      this.line.style.transform = `translateX(${this.labels + x}px)`;
      this.drawn = "";
      this.now?.classList.remove("now");
      this.drawView();
      this.now = fired ? this.nodes.get(k)?.foot : null;
      this.now?.classList.add("now");
    }
    this.markLine();
  }

  // The line of the element that fires, or of the selected one, is in view.
  markLine() {
    const { view } = this, fired = view.run.fired.get(view.row), about = fired ?? view;
    const k = this.lines.findIndex(({ contact, element }) => contact === about.contact && element === about.element);
    if (this.marked !== k) {
      this.lines[this.marked]?.name.classList.remove("chosen");
      this.lines[k]?.name.classList.add("chosen");
      this.marked = k;
    }
    const from = k * this.height, { scroller } = this;
    if (k < 0 || this.lines.length * this.height <= this.down) return;
    const to = clamp(this.lifted ?? 0, from + this.height - this.down, from);
    if (to !== this.lifted) { this.lifted = to; scroller.scrollTop = to; }
  }

  // ---------------------------------------------------------------- what is in view
  drawView() {
    const { strip, scroller, nodes } = this, left = scroller.scrollLeft;
    this.lifted = scroller.scrollTop;
    this.scrolled = left;
    const first = Math.max(strip.at(left), 0), last = strip.at(left + this.across);
    for (let k = first; k <= last; k++) if (!nodes.has(k)) nodes.set(k, this.column(k));
    for (const [k, node] of nodes) {
      if (k >= first - 12 && k <= last + 12) continue;
      for (const each of Object.values(node)) each.remove();
      nodes.delete(k);
    }
    const key = `${left}/${first}/${last}`;
    if (this.drawn !== key) this.drawTop(left, first, last);
    this.drawn = key;
  }

  // A column, the gap before it and its button.
  column(k) {
    const { strip, lines, body } = this, firing = strip.firings[k], found = {};
    const box = (x, width, kind) => {
      const node = make("div", body, "", { class: kind });
      node.style.left = `${this.labels + x}px`;
      node.style.width = `${width}px`;
      return node;
    };
    const apart = strip.apart(k), before = k < strip.rows.length ? strip.rows[k] - 1 : strip.rows[k - 1];
    if (apart) {
      found.gap = box(strip.gaps[k], COLUMN.gap, "gap");
      for (const { contact, element } of lines) make("i", found.gap, "", { class: `state${contact.modes[element][before] % STATES}` });
      make("s", found.gap);
    }
    if (!firing) return found;
    found.column = box(strip.lefts[k], strip.pitch, "column");
    const earlier = strip.firings[k - 1];
    for (const { contact, element } of lines) {
      const mode = contact.modes[element][firing.row], fires = firing.contact === contact && firing.element === element;
      const cell = make("i", found.column, "", { class: fires ? "fires" : `state${mode % STATES}` });
      if (fires) {
        make("i", cell, "", { class: `state${contact.modes[element][before] % STATES}` });
        make("i", cell, "", { class: `state${mode % STATES}` });
        const { name } = contact.edges[firing.edge];
        make("span", cell, this.two ? folded(name) : name);
      } else {
        // A name at the beginning of a ribbon, and again after some columns without one.
        const begins = apart || k % 6 === 0 || (earlier.contact === contact && earlier.element === element);
        if (begins && textWidth(contact.states[mode]) < strip.pitch - 6) make("span", cell, contact.states[mode]);
      }
    }
    found.foot = this.button(k, firing);
    return found;
  }

  button(k, { row, contact, element, edge }) {
    const { strip, view: { run } } = this, [name] = contact.shown, at = contact.column(name);
    const both = at ? `, ${name} ${contact.tell(name, at(row - 1), F_DIGITS)} before, ${contact.tell(name, at(row), F_DIGITS)} after` : "";
    const node = make("button", this.foot, `${BETWEEN[run.between[row]]}${run.number[row]}\n${run.microstep[row]}`, {
      tabindex: -1, "aria-label": `Row ${run.number[row]}, micro-step ${run.microstep[row]}: ${contact.sentence({ element, edge })}${both}`,
    });
    node.style.left = `${this.labels + strip.lefts[k]}px`;
    node.style.width = `${strip.pitch}px`;
    return node;
  }

  // The stairs of F, or of what is shown first of a supervisor, and the times above them, for the columns in view. A text
  // that would be cut off is left out.
  drawTop(left, first, last) {
    const { strip, labels, view } = this, told = [];
    const tell = (text, middle, level, kind) => {
      const half = (kind === "time first" ? BOLD : 1) * textWidth(text) / 2;
      if (middle - half >= left + 1 && middle + half <= left + this.across - 1) told.push([text, labels + middle - left, level, kind]);
    };
    for (let k = first; k <= last; k++) {
      const apart = strip.apart(k), { run } = view, t = run.t(strip.rows[k] ?? run.rows - 1);
      if (apart) tell(`+${eng(t - run.t(strip.rows[k - 1] ?? 0), "s", 3)}`, strip.gaps[k] + COLUMN.gap / 2, 13, "time");
      if (k < strip.rows.length) tell(apart ? timeText(t, 7) : "+0", strip.middle(k), 13, apart ? "time first" : "time");
    }
    this.drawStairs(left, strip.levels(first, last), tell);
    const here = strip.place(view.row) - left;
    place(this.mark, { d: this.line.hidden || here < 0 ? "" : `M${labels + here} ${COLUMN.head}V${this.top}` });
    told.forEach(([text, x, y, kind], k) => {
      const node = this.texts[k] ??= draw("text", this.svg, { "text-anchor": "middle" });
      place(node, { x, y, class: kind });
      say(node, text);
    });
    for (const node of this.texts.slice(told.length)) node.textContent = "";
  }

  drawStairs(left, levels, tell) {
    const { contact } = this.view, [name = ""] = contact.shown, at = contact.column(name), title = `${name} ${contact.name}`;
    this.title.textContent = textWidth(title) * BOLD < this.labels ? title : name;
    const values = levels.map(({ row }) => (at ? at(row) : NaN));
    const texts = values.map((u) => contact.tell(name, u, F_DIGITS)), floor = this.top - STAIRS.below;
    // Values that are written alike are drawn alike.
    const known = new Map(texts.map((text, k) => [text, values[k]]).filter(([, u]) => Number.isFinite(u)));
    const sorted = [...known].sort((a, b) => a[1] - b[1]), found = heights(sorted.map(([, u]) => u), floor - COLUMN.head - STAIRS.above);
    const y = new Map(sorted.map(([text], k) => [text, floor - found[k]])), x = (u) => (this.labels + u - left).toFixed(1);
    let path = "", through = "", before = null;
    levels.forEach(({ from, to, begins }, k) => {
      const level = y.get(texts[k]);
      if (level === undefined) { before = null; return; } // not a number
      if (begins && before) through += `M${x(before.to)} ${before.level.toFixed(1)}L${x(from)} ${level.toFixed(1)}`;
      path += begins || !before ? `M${x(from)} ${level.toFixed(1)}H${x(to)}` : `V${level.toFixed(1)}H${x(to)}`;
      before = { to, level };
      const shown = [texts[k], contact.tell(name, values[k], F_DIGITS - 1)].find((text) => textWidth(text) <= to - from - 4);
      if (shown) tell(shown, (from + to) / 2, level - 4, "value");
    });
    place(this.path, { d: path });
    place(this.through, { d: through });
  }
}
PANES.push(MicroscopePane);
