"use strict";
// A sweep: one number over its slider's range, 50 runs in a worker of their own. The picture has the extremes of a quantity
// in the second half of each run, and how often it switches; a click takes the value there.
const SWEPT = 50;
const SWEEPER = `
let latest = 0;
const engines = [];
onmessage = async ({ data }) => {
  const { id, number, numbers, words, values, kind, place } = data, engine = engines[number] ??= new Engine(ENGINES[number]);
  latest = id;
  for (const [k, value] of values.entries()) {
    const { count, fired, t, stopped, [kind]: table } = engine.run([...numbers, ...words.map((word) => [word, value])]);
    const width = engine.known.sizes[kind], half = (t[0] + t[count - 1]) / 2;
    let low = Infinity, high = -Infinity;
    for (let row = count - 1; row >= 0 && t[row] >= half; row--) {
      low = Math.min(low, table[row * width + place]);
      high = Math.max(high, table[row * width + place]);
    }
    postMessage({ id, k, value, low, high, fired, stopped });
    await new Promise((then) => setTimeout(then)); // another sweep may have been asked for
    if (latest !== id) return;
  }
};
`;

// A logarithmic axis.
class LogAxis extends Axis {
  scaled(u) { return Math.log10(u); }
  at(part) { return 10 ** (this.from + part * this.length); }
  marks() {
    const found = [];
    for (let e = Math.floor(this.from); e <= this.from + this.length; e++) {
      for (const u of [1, 2, 5].map((digit) => Number(`${digit}e${e}`))) if (u >= this.low && u <= this.high) found.push({ u, text: String(Number((u / 10 ** this.power).toPrecision(2))) });
    }
    return found.sort((a, b) => (String(a.text)[0] === "1" ? 0 : 1) - (String(b.text)[0] === "1" ? 0 : 1));
  }
}

class SweepPane {
  static side = "right"; static key = "sweep"; static title = "Sweep"; static shared = true;

  constructor(view, box) {
    Object.assign(this, { view, box, found: [], asked: "", id: 0 });
    box.classList.add("sweep");
    const head = make("p", box, "", { class: "sweep-of" }), choose = (title, names) => {
      const select = make("select", make("label", head, `${title} `), "");
      for (const name of names) make("option", select, name);
      select.addEventListener("change", () => { this.asked = ""; this.fit(); });
      return select;
    };
    this.over = choose("over", [...dials.values()].filter(({ value }) => !Number.isNaN(value)).map(({ name }) => name));
    this.of = choose("of", view.contact.shown);
    if (view.contact.velocity) this.of.value = view.contact.velocity;
    this.told = make("output", head);
    this.planes = [new Plane(box, { role: "img" }), new Plane(box, { role: "img" })];
    for (const plane of this.planes) {
      this.marks = [...(this.marks ?? []), draw("path", plane.above, { class: "swept-now" })];
      plane.svg.addEventListener("click", (event) => turn(this.dial, Number(plane.acrossAt(plane.point(event)[0]).toPrecision(4))));
    }
    this.bars = draw("path", this.planes[0].inside, { class: "swept" });
    this.dots = draw("path", this.planes[1].inside, { class: "swept dots" });
  }

  get dial() { return dials.get(this.over.value); }

  close() { this.worker?.terminate(); }

  choose(other) {
    if (!other) return;
    const { shown, velocity } = this.view.contact;
    this.of.replaceChildren();
    for (const name of shown) make("option", this.of, name);
    if (velocity) this.of.value = velocity;
    this.fit();
  }

  renew() { this.ask(); return true; }

  show() { this.markNow(); }

  fit() {
    const { box } = this, width = box.clientWidth;
    if (!width) return;
    const room = isWide() ? Math.max(box.clientHeight - box.firstChild.offsetHeight - 6, 200) : 420;
    this.sizes = [[width, Math.floor(0.6 * room)], [width, Math.floor(0.4 * room)]];
    this.ask();
    this.lay();
  }

  // The runs, if another number than the one swept is not that of the last time.
  ask() {
    const { dial, of, view } = this, [kind, place] = view.run.recipes[view.contact.values[of.value].all] ?? [];
    const swept = new Set(variant().engine[dial.name]), numbers = wordsNow().filter(([word]) => !swept.has(word));
    const key = JSON.stringify([dial.name, of.value, view.contact.name, numbers, live.number]);
    if (key === this.asked || !["y", "seen"].includes(kind)) return;
    Object.assign(this, { asked: key, id: this.id + 1, found: this.named === dial.name + of.value ? this.found : [], named: dial.name + of.value });
    this.worker ??= inWorker(SWEEPER, (each) => {
      if (each.id !== this.id) return;
      this.found[each.k] = each;
      if (each.k % 5 === 4 || each.k === SWEPT - 1) this.lay();
    });
    const { low, high, log } = dial, at = (part) => (log ? low * (high / low) ** part : low + part * (high - low));
    const values = Array.from({ length: SWEPT }, (_, k) => at(k / (SWEPT - 1))).filter((u) => !against(dial, u, dials));
    this.worker.postMessage({ id: this.id, number: live.number, numbers, words: [...swept], values, kind, place });
  }

  lay() {
    const { dial, of, view, planes, found } = this, { low, high, log, unit, name } = dial, known = found.filter((each) => each.low <= each.high);
    if (!this.sizes) return;
    const across = () => new (log ? LogAxis : Axis)({ name, unit, low, high });
    const ends = known.length ? [Math.min(...known.map((each) => each.low)), Math.max(...known.map((each) => each.high))] : [-1, 1];
    const quantity = of.value === view.contact.velocity ? "v" : of.value, most = Math.max(1, ...known.map(({ fired }) => fired));
    planes[0].lay(...this.sizes[0], across(), new Axis({ name: `${quantity}, lowest and highest`, unit: unitOf(view.contact, of.value), ...roomy(...ends) }));
    planes[1].lay(...this.sizes[1], across(), new Axis({ name: "transitions", low: 0, high: 1.1 * most }));
    const [above, below] = planes, dot = (x, y) => `M${x.toFixed(1)} ${y.toFixed(1)}h0`;
    place(this.bars, { d: known.map((each) => `M${above.x(each.value).toFixed(1)} ${above.y(each.low).toFixed(1)}V${above.y(each.high).toFixed(1)}${dot(above.x(each.value), above.y(each.low))}${dot(above.x(each.value), above.y(each.high))}`).join("") });
    place(this.dots, { d: known.map((each) => dot(below.x(each.value), below.y(each.fired))).join("") });
    const stopped = known.filter((each) => each.stopped).length;
    say(this.told, `${known.length} runs${stopped ? `, ${stopped} of them stopped` : ""}; second half of each`);
    for (const plane of planes) plane.svg.setAttribute("aria-label", `${plane.up.name} over ${name}: ${known.length} runs`);
    this.markNow();
  }

  markNow() {
    const { dial } = this;
    this.planes.forEach((plane, k) => { if (plane.across) place(this.marks[k], { d: dial.value >= dial.low && dial.value <= dial.high ? `M${plane.x(dial.value).toFixed(1)} ${MARGINS.top}v${plane.h}` : "" }); });
  }
}
PANES.push(SweepPane);
