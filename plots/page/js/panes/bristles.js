"use strict";
// Bristles: the slider and its elements, each a spring and a damper to a contact on the ground, as in
// plots/schematic.py. The slider stands still; contacts and ground move. They move by the same number of pixels per
// metre, so that a contact that sticks stays where it is on the ground.
const LENGTHS = new Set(["m", "rad"]);
const BRISTLE = { least: 26, two: 38, most: 64, page: 44, head: 42, slider: 26, arrow: 46, contact: 16, period: 60 }; // px

// A spring above a damper, 100 long and 1 high; it is stretched by a transform.
const SPRING = `M0 -7H8${[...Array(12).keys()].map((k) => `L${11 + 7 * k} ${k % 2 ? -3 : -11}`).join("")}L92 -7H100`;
const DAMPER = "M0 7H38M62 2H38V12H62M50 7H100M50 4V10";
const FRAME = "M0 -7V7M100 -7V7";

class BristlesPane {
  static side = "left"; static key = "bristles"; static title = "Bristles"; static moves = true;

  constructor(view, box) {
    Object.assign(this, { view, box });
    box.classList.add("bristles");
  }

  choose(other) { if (!other) this.show(); }

  // The variable that is a deflection: the first one in metres or radians, or z. Other variables are not drawn as springs.
  deflection() {
    const { variables, units } = this.view.contact;
    return variables.find((name) => LENGTHS.has(units[name])) ?? variables.find((name) => name === "z") ?? null;
  }

  // ---------------------------------------------------------------- what is drawn once per contact and size
  fit() {
    const { box, view } = this, { contact } = view, width = box.clientWidth;
    if (!width) return;
    const z = this.deflection(), label = Math.max(...contact.states.map((state) => textWidth(`E${contact.n} ${state}`))) * BOLD + 12;
    const value = z ? textWidth(`${z} −000.0 mm`) + 12 : 0;
    const room = Math.floor((box.clientHeight - BRISTLE.head - (this.note() ? 20 : 2)) / contact.n);
    this.height = isWide() ? clamp(room, BRISTLE.least, BRISTLE.most) : contact.n > 6 ? BRISTLE.least + 4 : BRISTLE.page;
    const two = this.height >= BRISTLE.two, forces = contact.n > 1 && width > 520;
    const right = forces ? 84 : BRISTLE.arrow;
    Object.assign(this, { z, two, left: two ? Math.max(label, value) : label + value, wall: width - right - BRISTLE.slider - 4, looks: [] });
    const space = this.wall - this.left;
    this.swing = 0.26 * space;
    this.rest = this.left + BRISTLE.contact / 2 + 6 + this.swing;
    this.largest = { v: this.most(contact.velocity), F: this.most("F"), z: z ? this.most(z) : 0 };
    // Pixels per metre; without springs the whole run is 20 periods of the ground.
    this.scale = LENGTHS.has(contact.units[z]) && this.largest.z > 0 ? this.swing / this.largest.z : (20 * BRISTLE.period) / (this.most("x") || 1);
    this.build(width, forces);
    this.show();
  }

  most(name) {
    const { contact, run } = this.view, column = contact.columns[name];
    return largest(extent((Array.isArray(column) ? column : [column]).map((get) => ({ get, rows: run.rows }))));
  }

  note() {
    const { velocities = [], velocity } = this.view.contact;
    return velocities.length > 1 ? `${velocity} is the first of the velocities ${velocities.join(", ")}; the others are not drawn.` : "";
  }

  build(width, forces) {
    const { box, view: { contact, place: number }, height, wall } = this, tall = contact.n * height, ground = `ground${number}`;
    box.replaceChildren();
    const top = make("div", box, "", { class: "motion" });
    if (this.note()) make("p", top, this.note());
    const head = draw("svg", top, { width, height: BRISTLE.head, "aria-hidden": "true" });
    const middle = wall + BRISTLE.slider / 2, from = middle - BRISTLE.arrow - 8;
    draw("path", head, { class: "slider", d: `M${wall} ${BRISTLE.head}V${BRISTLE.head - 8}H${wall + BRISTLE.slider}V${BRISTLE.head}` });
    this.speed = { text: draw("text", head, { x: from, y: 13, "text-anchor": "end" }), arrow: draw("path", head, { class: "arrow", transform: `translate(${middle} 9)` }) };
    this.push = { text: draw("text", head, { x: from, y: 29, "text-anchor": "end" }), arrow: draw("path", head, { class: "arrow", transform: `translate(${middle} 25)` }) };
    this.svg = draw("svg", box, {
      width, height: tall, role: "img", class: "elements",
      "aria-label": `${this.z ? "Springs, dampers and contacts" : "Contacts"} of ${contact.name || "the elements"} on the ground`,
    });
    const defs = draw("defs", this.svg);
    this.pattern = draw("pattern", defs, { id: ground, width: BRISTLE.period, height: 8, patternUnits: "userSpaceOnUse" });
    draw("path", this.pattern, { class: "stroke", d: [0, 1, 2, 3, 4, 5].map((k) => `M${k * 10} 8L${k * 10 + 6} 0`).join("") });
    draw("path", this.pattern, { class: "stone", d: "M3 8L9 0H16L10 8Z" }); // one in six tells how far it has moved
    // Grounds of states, as in the ribbons: the default one is plain and pale, the others are hatched.
    this.grounds = data.hatches.map((angle, k) => {
      const look = draw("pattern", defs, { id: `${ground}-state${k}`, width: 5, height: 5, patternUnits: "userSpaceOnUse", patternTransform: `rotate(${angle ?? 0})` });
      draw("rect", look, { width: 5, height: 5 }).style.fill = `var(--fill${k})`;
      if (angle !== null) draw("path", look, { d: "M0 0H5", "stroke-width": 1.6 }).style.stroke = `var(--hatch${k})`;
      return `url(#${look.id})`;
    });
    this.elements = contact.modes.map((_, i) => this.element(i, ground, forces));
    draw("path", this.svg, { class: "slider", d: `M${wall} 0V${tall - 2}H${wall + BRISTLE.slider}V0` });
    draw("text", this.svg, { class: "name", "text-anchor": "middle", transform: `translate(${middle + 4} ${Math.min(tall, this.box.clientHeight || tall) / 2}) rotate(-90)` }, tall > 60 ? "slider" : "");
  }

  element(i, ground, forces) {
    const { svg, height, left, wall, two, z, view: { contact } } = this, half = BRISTLE.contact / 2;
    const group = draw("g", svg, { class: "element", transform: `translate(0 ${i * height})` });
    const earth = two ? 8 : 4, floor = two ? height / 2 + 10 : height - 6, y = floor - (two ? 13 : 10), tall = two ? 1 : 0.75;
    draw("rect", group, { class: "back", x: 1, y: 1, width: wall - 6, height: height - 2, rx: 4 });
    group.addEventListener("click", () => chooseElement(i));
    const found = { group };
    found.label = draw("text", group, { class: "label", x: 6, y: two ? y - 1 : y + 4 });
    if (z) found.value = draw("text", group, two ? { x: 6, y: y + 14 } : { x: left - 8, y: y + 4, "text-anchor": "end" });
    if (forces) found.force = draw("text", group, { x: wall + BRISTLE.slider + 6, y: y + 5 });
    const strip = draw("svg", group, { x: left, y: 0, width: wall - left, height }); // cuts off what moves
    const inside = draw("g", strip, { transform: `translate(${-left} 0)` });
    draw("rect", inside, { x: left, y: 0, width: wall - left, height: earth, fill: `url(#${ground})`, transform: `translate(0 ${floor})` });
    draw("path", inside, { class: "floor", d: `M${left} ${floor}H${wall}` });
    if (z) draw("path", inside, { class: "rest", d: `M${this.rest} ${y - 10 * tall}V${floor}` });
    found.link = draw("g", inside, { class: `link e${elementStep(i, contact.n)}` });
    if (z) for (const d of [SPRING, DAMPER, FRAME]) draw("path", found.link, { d });
    else draw("path", found.link, { d: "M0 0H100" });
    Object.assign(found, { y, tall });
    found.contact = draw("g", inside, { class: "foot" });
    found.block = draw("rect", found.contact, { class: "block", x: -half, y: y - 9 * tall, width: BRISTLE.contact, height: floor - y + 9 * tall });
    draw("path", found.contact, { class: "peg", d: `M0 ${y + 3}V${floor + earth - 1}` });
    found.way = draw("path", found.contact, { class: "way", d: `M${-half + 3} ${y + 2}H${half - 3}m-4 -4l4 4l-4 4` });
    return found;
  }

  // ---------------------------------------------------------------- the row
  show() {
    if (!this.elements) return;
    const { view } = this, { contact, row, run } = view, v = contact.value(contact.velocity, 0, row), F = contact.value("F", 0, row);
    const fired = run.fired.get(row), shift = (-this.scale * contact.value("x", 0, row)) % BRISTLE.period;
    this.arrow(this.speed, `${contact.velocity} = ${contact.tell(contact.velocity, v)}`, v, this.largest.v);
    this.arrow(this.push, `F = ${contact.tell("F", F)}`, -F, this.largest.F); // positive friction pulls the slider back
    if (Number.isFinite(shift)) place(this.pattern, { patternTransform: `translate(${shift.toFixed(2)} 0)` });
    this.elements.forEach((each, i) => {
      const mode = contact.modes[i][row], now = fired && fired.contact === contact && fired.element === i;
      const look = `${mode}/${Boolean(now)}/${i === view.element}/${Math.sign(v)}`;
      if (this.looks[i] !== look) { this.looks[i] = look; this.restyle(each, i, mode, now, v); }
      const z = this.z ? contact.value(this.z, i, row) : 0;
      const at = this.rest - (this.largest.z > 0 && Number.isFinite(z) ? (this.swing * z) / this.largest.z : 0);
      if (each.at !== at) {
        each.at = at;
        const from = at + BRISTLE.contact / 2;
        each.contact.setAttribute("transform", `translate(${at.toFixed(2)} 0)`);
        each.link.setAttribute("transform", `translate(${from.toFixed(2)} ${each.y}) scale(${((this.wall - from) / 100).toFixed(5)} ${each.tall})`);
      }
      if (each.value) say(each.value, `${this.z} ${contact.tell(this.z, z)}`);
      if (each.force) say(each.force, contact.tell("F", contact.forces[i](row)));
    });
    this.reveal(fired?.contact === contact ? fired.element : view.element);
  }

  // Whether a contact does not move on the ground. A bristle sticks in the default state; without one, as in an end stop or
  // a block on a belt, only a state that locks the motion holds it.
  held(mode) { return this.z ? mode === 0 : this.view.contact.locked[mode]; }

  restyle({ group, label, way, block }, i, mode, now, v) {
    const { contact, element } = this.view, held = this.held(mode);
    group.setAttribute("class", ["element", `mode${mode % STATES}`, held ? "held" : "open", now && "fired", i === element && "chosen",
      !contact.edges.length && "alone"].filter(Boolean).join(" "));
    say(label, `E${i + 1} ${contact.states[mode]}`);
    Object.assign(block.style, contact.edges.length ? { fill: this.grounds[mode % STATES], stroke: `var(--hatch${mode % STATES})` } : {});
    way.setAttribute("visibility", held || v === 0 ? "hidden" : "inherit");
    way.setAttribute("transform", v < 0 ? "scale(-1 1)" : "");
  }

  arrow({ text, arrow }, words, u, largest) {
    say(text, words);
    const length = largest > 0 && Number.isFinite(u) && u !== 0 ? Math.max((BRISTLE.arrow * Math.abs(u)) / largest, 7) : 0;
    const d = length ? `M0 0H${(Math.sign(u) * length).toFixed(1)}m${-5 * Math.sign(u)} -4l${5 * Math.sign(u)} 4l${-5 * Math.sign(u)} 4` : "M0 -4V4";
    arrow.setAttribute("d", d);
  }

  // The element that fires, or the selected one, is in view.
  reveal(i) {
    const { box, height } = this, down = box.clientHeight - BRISTLE.head - (this.note() ? 18 : 0);
    if (this.elements.length * height <= down) return;
    const to = clamp(box.scrollTop, (i + 1) * height - down, i * height);
    if (Math.abs(to - box.scrollTop) > 0.5) box.scrollTop = to;
  }
}
PANES.push(BristlesPane);
