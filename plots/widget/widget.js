// The browser's side of plots.explore: sliders, the fork strip and pokes around the replay page. The page is in a
// sandboxed frame, so that its strict policy holds and it cannot touch the notebook; both exchange messages. All text
// is inserted as textContent.
const SVG = "http://www.w3.org/2000/svg";
const STEPS = 1000; // of a slider
const ROW = 24, LABEL = 210, RIGHT = 12, TOP = 16; // px, of the fork strip

function make(tag, parent, text = "", attributes = {}) {
  const node = document.createElement(tag);
  if (text) node.textContent = text;
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  parent?.append(node);
  return node;
}

function draw(tag, parent, attributes = {}, text = "") {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, typeof value === "number" ? String(Math.round(value * 10) / 10) : value);
  if (text) node.textContent = text;
  parent.append(node);
  return node;
}

const written = (u, digits = 6) => String(Number(Number(u).toPrecision(digits)));

// One request at a time. Of the values that sliders give meanwhile, the latest wins; other requests wait in a row.
class Requests {
  constructor(model, changed) {
    Object.assign(this, { model, changed, busy: "", waiting: [], values: {}, count: 0 });
    this.own = Math.random().toString(36).slice(2); // there may be several views of one widget
  }

  ask(request) { this.waiting.push(request); this.next(); }

  slide(name, value) { this.values[name] = value; this.next(); }

  next() {
    if (this.busy) return;
    const slid = Object.keys(this.values).length > 0;
    const request = this.waiting.shift() ?? (slid ? { do: "set", values: this.values } : null);
    if (request?.do === "set") this.values = {};
    if (request) {
      this.busy = `${this.own}-${this.count += 1}`;
      this.model.set("request", { ...request, id: this.busy });
      this.model.save_changes();
    }
    this.changed(Boolean(this.busy));
  }

  answered(id) {
    if (id !== this.busy) return;
    this.busy = "";
    this.next();
  }
}

// A slider with a box for the number; logarithmic over a positive range of two decades or more.
class Slider {
  constructor(box, { name, unit, meaning, low, high, log }, moved) {
    Object.assign(this, { name, low, high, log });
    const label = make("label", box, "", { class: "gms-slider", title: [meaning, `${written(low)} to ${written(high)}${log ? ", logarithmic" : ""}`].filter(Boolean).join("; ") });
    make("span", label, unit && unit !== "1" ? `${name} [${unit}]` : name);
    this.range = make("input", label, "", { type: "range", min: 0, max: STEPS, step: 1, "aria-label": `${name}${unit ? `, ${unit}` : ""}` });
    this.number = make("input", label, "", { type: "number", step: "any", min: low, max: high, "aria-label": `${name}, exact` });
    this.range.addEventListener("input", () => {
      const u = this.valueAt(Number(this.range.value));
      this.number.value = written(u);
      this.range.setAttribute("aria-valuetext", written(u));
      moved(name, Number(written(u)));
    });
    this.number.addEventListener("change", () => {
      const u = Number(this.number.value);
      if (this.number.value === "" || !Number.isFinite(u)) return;
      this.place(u);
      moved(name, u);
    });
  }

  valueAt(step) {
    if (step >= STEPS) return this.high;
    const part = step / STEPS;
    return this.log ? this.low * (this.high / this.low) ** part : this.low + part * (this.high - this.low);
  }

  place(u) {
    const part = this.log ? Math.log(u / this.low) / Math.log(this.high / this.low) : (u - this.low) / (this.high - this.low);
    this.range.value = Math.round(STEPS * part);
    this.range.setAttribute("aria-valuetext", written(u));
  }

  show(u) {
    this.place(u);
    this.number.value = written(u);
  }
}

// The branches as a tree over time.
class Strip {
  constructor(box, choose) {
    Object.assign(this, { choose });
    this.svg = draw("svg", box, { class: "gms-strip", role: "group", "aria-label": "Branches over time" });
    this.watch = new ResizeObserver(() => this.last && this.show(...this.last));
    this.watch.observe(box);
  }

  show(panel, now) {
    this.last = [panel, now];
    const focus = document.activeElement?.closest?.(".gms-branch")?.dataset.branch;
    const width = Math.max(this.svg.parentNode.clientWidth, 360), rows = this.ordered(panel.branches);
    const height = TOP + rows.length * ROW + 4, { t_start: from, t_end: to } = panel;
    this.svg.replaceChildren();
    for (const [name, value] of Object.entries({ width, height, viewBox: `0 0 ${width} ${height}` })) this.svg.setAttribute(name, value);
    const x = (t) => LABEL + ((width - LABEL - RIGHT) * (t - from)) / (to - from);
    const y = new Map(rows.map(({ branch }, k) => [branch.number, TOP + (k + 0.5) * ROW]));
    draw("text", this.svg, { x: x(from), y: 10, class: "gms-end" }, `${written(from)} s`);
    draw("text", this.svg, { x: x(to), y: 10, class: "gms-end", "text-anchor": "end" }, `${written(to)} s`);
    for (const { branch, depth } of rows) {
      const { number, name, text, parent, begin } = branch, at = y.get(number), place = panel.shown.indexOf(number);
      const looks = ["gms-branch", number === panel.current && "gms-current", place >= 0 && `gms-shown${place + 1}`].filter(Boolean).join(" ");
      const node = draw("g", this.svg, { class: looks, role: "button", tabindex: 0, "aria-pressed": place >= 0, "data-branch": number });
      node.setAttribute("aria-label", `Branch ${number}: ${name}${text && text !== name ? `, ${text}` : ""}; Enter shows it, Shift and Enter compares it`);
      draw("title", node, {}, `${text || "the original run"}. Click to show, Shift and click to compare with the current branch`);
      draw("rect", node, { x: 0, y: at - ROW / 2, width, height: ROW, class: "gms-ground" });
      const most = Math.floor((LABEL - 44 - 12 * depth) / 6.4), label = `${number} ${name}`;
      draw("text", node, { x: 24 + 12 * depth, y: at + 4 }, label.length > most ? `${label.slice(0, most - 1)}…` : label);
      if (place >= 0 && panel.shown.length > 1) draw("text", node, { x: 4, y: at + 4, class: "gms-run" }, `${place + 1}:`);
      if (parent !== null) draw("path", node, { class: "gms-line", d: `M${x(begin)} ${y.get(this.joint(panel.branches, branch))}V${at}` });
      draw("path", node, { class: "gms-line", d: `M${x(begin)} ${at}H${x(to)}` });
      draw("circle", node, { class: "gms-dot", cx: x(begin), cy: at, r: 3.5 });
      node.addEventListener("click", (event) => this.choose(number, event.shiftKey));
      node.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        event.stopPropagation();
        this.choose(number, event.shiftKey);
      });
      if (String(number) === focus) node.focus();
    }
    this.mark(x, now, height, panel.shown.map((number) => y.get(number)));
  }

  mark(x, now, height, lines) {
    if (!now) return;
    draw("path", this.svg, { class: "gms-now", d: `M${x(now.t)} ${TOP - 4}V${height}` });
    if (now.first?.t == null) return;
    for (const at of lines) draw("text", this.svg, { class: "gms-first", x: x(now.first.t), y: at + 4, "text-anchor": "middle" }, "≠");
  }

  // The nearest branch before this one whose line exists where this one begins.
  joint(branches, { parent, begin }) {
    const before = branches.find(({ number }) => number === parent);
    return before.begin <= begin || before.parent === null ? parent : this.joint(branches, { parent: before.parent, begin });
  }

  // Every branch after its parent.
  ordered(branches, parent = null, depth = 0) {
    return branches.filter((each) => each.parent === parent).flatMap((branch) => [{ branch, depth }, ...this.ordered(branches, branch.number, depth + 1)]);
  }
}

// What to poke: a variable or the state of an element, or another value of a system.
class Poke {
  constructor(box, ask) {
    Object.assign(this, { ask, now: null, key: "" });
    make("b", box, "poke");
    this.what = make("select", box, "", { "aria-label": "What to poke" });
    this.value = make("input", box, "", { type: "number", step: "any", "aria-label": "New value" });
    this.state = make("select", box, "", { "aria-label": "New state" });
    this.button = make("button", box, "poke");
    this.what.addEventListener("change", () => this.fill());
    this.button.addEventListener("click", () => this.poke());
    this.value.addEventListener("keydown", (event) => { if (event.key === "Enter") this.poke(); });
  }

  show({ contacts, others }, now) {
    const key = JSON.stringify([contacts, others]);
    if (key !== this.key) {
      this.key = key;
      this.list(contacts, others);
    }
    const place = JSON.stringify(now && [now.t, now.microstep, now.contacts]);
    if (place !== this.place) {
      this.now = now;
      this.fill();
    }
    this.place = place;
    this.button.disabled = !now;
    this.button.textContent = now ? `poke at ${written(now.t, 7)} s` : "poke";
  }

  list(contacts, others) {
    const names = contacts.flatMap((contact) => {
      const lead = contact.name ? `${contact.name} ` : "", each = Array.from({ length: contact.n }, (_, i) => i);
      return [
        ...contact.variables.flatMap(([what, unit]) => each.map((element) => ({ contact, what, element, unit, text: `${lead}${what}${contact.n > 1 ? element + 1 : ""}` }))),
        ...(contact.states.length > 1 ? each.map((element) => ({ contact, what: "", element, unit: "", text: `${lead}state ${element + 1}` })) : []),
      ];
    });
    this.options = [...names, ...others.map(([what, unit]) => ({ contact: { name: "", states: [] }, what, element: -1, unit, text: what }))];
    const before = this.what.selectedOptions[0]?.textContent;
    this.what.replaceChildren();
    for (const { text, unit } of this.options) make("option", this.what, unit ? `${text} [${unit}]` : text);
    this.what.selectedIndex = Math.max([...this.what.options].findIndex((each) => each.textContent === before), 0);
  }

  // The present value.
  fill() {
    const chosen = this.options[this.what.selectedIndex];
    if (!chosen) return;
    const { contact, what, element } = chosen, isState = what === "", here = this.now?.contacts.find(({ name }) => name === contact.name);
    [this.value.hidden, this.state.hidden] = [isState, !isState];
    if (isState) {
      this.state.replaceChildren();
      for (const name of contact.states) make("option", this.state, name);
      this.state.value = here?.states[element] ?? contact.states[0];
    } else {
      const u = element >= 0 ? here?.values[what]?.[element] : what === "v" ? this.now?.contacts[0].v : null;
      this.value.value = u == null ? "" : written(u);
    }
  }

  poke() {
    const { contact, what, element } = this.options[this.what.selectedIndex], { t, microstep, between } = this.now;
    const value = what === "" ? this.state.value : Number(this.value.value);
    if (what !== "" && (this.value.value === "" || !Number.isFinite(value))) return;
    this.ask({ do: "poke", contact: contact.name, what, element, value, t, microstep: between ? null : microstep });
  }
}

class Workbench {
  constructor(model, el) {
    Object.assign(this, { model, told: null, ready: false, exporting: false });
    // Keys are for the controls: JupyterLab would take the arrows of a slider, and a letter in a box would be a command.
    this.root = make("div", el, "", { class: "gms-explore", "data-lm-suppress-shortcuts": "true" });
    this.root.addEventListener("keydown", (event) => event.stopPropagation());
    this.requests = new Requests(model, (busy) => this.root.classList.toggle("gms-busy", busy));
    const ask = (request) => this.requests.ask(request), panel = model.get("panel");
    const top = make("div", this.root, "", { class: "gms-top" });
    this.sliders = panel.sliders.map((each) => new Slider(top, each, (name, value) => this.requests.slide(name, value)));
    this.took = make("output", top, "", { class: "gms-took" });
    this.strip = new Strip(make("div", this.root), (branch, compared) => {
      const { current } = model.get("panel");
      ask(compared && branch !== current ? { do: "compare", a: current, b: branch } : { do: "show", branch });
    });
    this.first = make("button", this.root, "", { class: "gms-pin", title: "go there" });
    this.first.addEventListener("click", () => this.post({ go: this.told.first.t }));
    const tools = make("div", this.root, "", { class: "gms-tools" });
    this.makeTools(tools, ask);
    this.poke = new Poke(make("span", tools, "", { class: "gms-poke" }), ask);
    this.said = make("p", this.root, "", { class: "gms-said", role: "status" });
    this.frame = make("iframe", this.root, "", { sandbox: "allow-scripts", title: "Replay of the run" });
    this.frame.style.height = `${model.get("height")}px`;
    this.frame.addEventListener("load", () => { this.ready = true; this.sendRuns(); });
    this.frame.srcdoc = model.get("page");
    this.show();
  }

  makeTools(box, ask) {
    const { model } = this, current = () => model.get("panel").current;
    this.law = make("select", make("label", box, "law "), "", { "aria-label": "Slip law; another one makes a branch" });
    this.law.addEventListener("change", () => ask({ do: "fork", law: this.law.value }));
    this.fork = make("button", box, "fork", { title: "A branch from the start of the run; sliders then change only it" });
    this.fork.addEventListener("click", () => ask({ do: "fork", name: `fork of ${current()}` }));
    this.other = make("select", make("label", box, "compare with "), "", { "aria-label": "Compare the current branch with" });
    this.other.addEventListener("change", () => {
      ask(this.other.value === "" ? { do: "show", branch: current() } : { do: "compare", a: Number(this.other.value), b: current() });
    });
    this.name = make("input", make("label", box, "name "), "", { type: "text", size: 16, "aria-label": "Name of the current branch" });
    this.name.addEventListener("change", () => ask({ do: "rename", branch: current(), name: this.name.value }));
    this.remove = make("button", box, "delete", { title: "Delete the current branch" });
    this.remove.addEventListener("click", () => ask({ do: "delete", branch: current() }));
    this.save = make("button", box, "export", { title: "The current branch as a scenario file" });
    this.save.addEventListener("click", () => { this.exporting = true; ask({ do: "export", branch: current() }); });
  }

  // ---------------------------------------------------------------- what Python has sent
  show() {
    const panel = this.model.get("panel"), { branches, current, shown } = panel;
    for (const slider of this.sliders) {
      const found = panel.sliders.find(({ name }) => name === slider.name);
      if (found && !(slider.name in this.requests.values)) slider.show(found.value);
    }
    this.took.textContent = `${written(panel.took, 2)} ms, ${panel.engine}`;
    this.showTools(panel, branches, current, shown);
    const said = [panel.said, panel.failed].filter(Boolean).join("; ");
    if (this.said.textContent !== said) this.said.textContent = said;
    this.said.hidden = !said;
    if (panel.file && this.exporting) this.download(panel.file);
    this.showNow();
    this.requests.answered(panel.done);
  }

  showTools({ law, laws }, branches, current, shown) {
    this.law.parentNode.hidden = !laws.length;
    this.law.replaceChildren();
    for (const each of laws) make("option", this.law, each);
    if (law) this.law.value = law;
    this.other.replaceChildren();
    make("option", this.other, "none", { value: "" });
    for (const { number, name } of branches) if (number !== current) make("option", this.other, `${number} ${name}`, { value: number });
    this.other.value = String(shown.find((each) => each !== current) ?? "");
    this.other.parentNode.hidden = branches.length < 2;
    this.remove.disabled = current === 0;
    this.name.value = branches.find(({ number }) => number === current).name;
  }

  download({ name, text }) {
    this.exporting = false;
    const link = make("a", null, "", { download: name, href: URL.createObjectURL(new Blob([text], { type: "application/toml" })) });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  // ---------------------------------------------------------------- the page
  post(message) { this.frame.contentWindow?.postMessage(message, "*"); } // its origin is opaque: it is sandboxed

  sendRuns() {
    if (this.ready) this.post({ load: { data: this.model.get("runs"), charts: this.model.get("charts") } });
  }

  heard({ source, data }) {
    if (source !== this.frame.contentWindow || !data?.told) return;
    this.told = data.told;
    this.showNow();
  }

  showNow() {
    const panel = this.model.get("panel"), { told } = this, place = panel.shown.indexOf(panel.current);
    this.strip.show(panel, told);
    this.poke.show(panel.pokes, told?.shown[place] && { ...told.shown[place], t: told.shown[place].t });
    this.first.hidden = !told?.first || panel.shown.length < 2;
    if (told?.first) {
      this.first.textContent = `≠ ${told.first.told}`;
      this.first.disabled = told.first.t === null;
    }
  }
}

function render({ model, el }) {
  const bench = new Workbench(model, el), heard = (event) => bench.heard(event);
  const show = () => bench.show(), send = () => bench.sendRuns();
  addEventListener("message", heard);
  model.on("change:panel", show);
  model.on("change:runs", send);
  return () => {
    removeEventListener("message", heard);
    model.off("change:panel", show);
    model.off("change:runs", send);
    bench.strip.watch.disconnect();
  };
}

export default { render };
