"use strict";
// The view of one run: its head, the chart with marks, the tokens of the elements, the table of guards, the tabs.
// A pane is what a tab shows. It is a class with: static side ("left" or "right"), static key and title,
// constructor(view, box), show() for the row view.row and the element view.element, fit() after a change of size,
// theme, contact or zoom, close() before it is thrown away. Only the pane in view is called. `static of()` is false where it has nothing to show;
// a pane that is `static shared` shows both runs; one that is `static moves` draws motion, which a supervisor does not have.
const PANES = [];
const MARKS = { 1: "✓", 0: "✗", "-1": "?" };

class RunView {
  constructor(run) {
    Object.assign(this, { run, place: run.place, row: 0, element: 0, contact: run.contacts[0], panes: {}, open: {} });
    this.root = $("#run").content.cloneNode(true).firstElementChild;
    $("#runs").append(this.root);
    $("h2", this.root).textContent = (shownRuns().length > 1 ? `Run ${this.place + 1}: ` : "") + run.title;
    const trust = $(".trust", this.root), warned = run.trust.filter((text) => text.startsWith("warning")).length;
    trust.hidden = !run.trust.length;
    $("summary", trust).textContent = `trust: ${counted(warned, "warning")}, ${counted(run.trust.length - warned, "note")}`;
    for (const text of run.trust) make("li", $("ul", trust), text);
    $(".of", this.root).textContent = `Run ${this.place + 1}`;
    const which = $(".contact", this.root);
    const kinds = new Set(run.contacts.map(({ velocity }) => (velocity ? "contact" : "supervisor")));
    which.before(`${[...kinds].join(" or ")} `);
    run.contacts.forEach(({ name }) => make("option", which, name));
    $(".which", this.root).hidden = run.contacts.length < 2;
    which.addEventListener("change", () => { this.choose(run.contacts[which.selectedIndex], 0); show(frame); });
    $(".who", this.root).textContent = "";
  }

  // ---------------------------------------------------------------- tabs
  addTabs() {
    for (const side of ["left", "right"]) {
      const list = $(`.${side} .tabs`, this.root), boxes = $(`.${side} .panes`, this.root);
      for (const Pane of PANES.filter((each) => each.side === side && (each.of?.() ?? true) && (anyMoves() || !each.moves) && !(each.shared && this.place))) {
        const id = `run${this.place + 1}-${Pane.key}`, number = list.children.length;
        const tab = make("button", list, Pane.title, { role: "tab", id: `${id}-tab`, "aria-controls": id, "data-key": Pane.key });
        const box = make("div", boxes, "", { role: "tabpanel", id, "aria-labelledby": `${id}-tab`, class: `pane ${Pane.key}`, tabindex: 0 });
        box.hidden = true;
        tab.addEventListener("click", () => openPane(side, Pane.key));
        tab.addEventListener("keydown", (event) => {
          const way = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
          if (!way || event.shiftKey) return; // with Shift: the next transition
          event.preventDefault();
          event.stopPropagation();
          const tabs = [...list.children], to = tabs[(number + way + tabs.length) % tabs.length];
          to.click();
          to.focus();
        });
        this.panes[Pane.key] = { Pane, tab, box };
      }
      list.hidden = list.children.length < 2 || (side === "right" && this.place > 0); // there the tabs of the first run are for both
    }
  }

  openPane(side, key) {
    const each = this.panes[key];
    if (!each && !this.place) return;
    $(`.${side}`, this.root).hidden = !each; // shared, and shown by the first run
    if (side === "right") $(".of", this.root).hidden = shownRuns().length < 2 || Boolean(each?.Pane.shared);
    delete this.open[side];
    for (const { Pane, tab, box } of Object.values(this.panes)) {
      if (Pane.side !== side) continue;
      const on = Pane.key === key;
      tab.setAttribute("aria-selected", on);
      tab.tabIndex = on ? 0 : -1;
      box.hidden = !on;
    }
    if (each) this.open[side] = each.pane ??= new each.Pane(this, each.box); // made when first opened
    this.markStill();
  }

  // Panes of motion say so where a supervisor is chosen, and wait.
  markStill() {
    const { name, velocity } = this.contact;
    for (const { Pane, box } of Object.values(this.panes)) {
      if (Pane.moves && !velocity) box.dataset.still = `${name} is a supervisor: it does not move, so there is nothing to draw here.`;
      else delete box.dataset.still;
    }
  }

  get live() { return Object.values(this.open).filter(({ constructor }) => this.contact.velocity || !constructor.moves); }

  fit() {
    this.fitTable();
    for (const pane of this.live) { pane.fit?.(); pane.show(); }
  }

  close() { for (const { pane } of Object.values(this.panes)) pane?.close?.(); }

  // It is made anew when it is opened again.
  clearPane(each) {
    const box = each.box.cloneNode(false);
    each.pane.close?.();
    each.box.replaceWith(box);
    Object.assign(each, { box, pane: undefined });
  }

  // The run has other rows. A pane that cannot change is made anew, when it is in view.
  renew() {
    this.explained = "";
    for (const each of Object.values(this.panes)) {
      const { pane, box, Pane } = each;
      if (!pane || (this.open[Pane.side] === pane && pane.renew?.())) continue;
      pane.close?.();
      box.replaceChildren();
      each.pane = null;
    }
    for (const [side, pane] of Object.entries(this.open)) {
      const each = Object.values(this.panes).find(({ Pane }) => pane instanceof Pane);
      if (each.pane) continue;
      this.open[side] = each.pane = new each.Pane(this, each.box);
      each.pane.fit?.();
    }
  }

  // ---------------------------------------------------------------- the row
  choose(contact, element) {
    const other = contact !== this.contact;
    this.contact = contact;
    this.element = clamp(element, 0, contact.n - 1);
    if (other || !this.listed) {
      $(".contact", this.root).selectedIndex = this.run.contacts.indexOf(contact);
      this.makeTokens();
      this.listEdges();
    }
    if (other) this.markStill();
    for (const pane of this.live) { pane.choose?.(other); if (other) pane.fit?.(); }
  }

  show(row) {
    this.row = row;
    const { run } = this, fired = run.fired.get(row);
    if (fired && following) this.choose(fired.contact, fired.element);
    const { contact } = this;
    const ended = run.ended(frames.t[frame]) && `ended at ${timeText(run.t(row), 5)}`;
    say($(".values", this.root), [
      ...contact.shown.map((name) => `${name === contact.velocity ? "v" : name} = ${contact.tell(name, contact.value(name, 0, row), 5)}`),
      run.rowName(row) + (run.between[row] ? "" : ` of ${run.of}`),
      ended || (run.between[row] ? "" : `micro-step ${run.microstep[row]}`),
    ].filter(Boolean).join("   "));
    this.showTokens();
    this.explain();
    for (const pane of this.live) pane.show();
  }

  // Whether an element of the contact shown is in another state than in the other run, at the row shown.
  differs(element) {
    const other = views.find((each) => each !== this), { contact } = this;
    const same = other?.run.contacts.find(({ name, n }) => name === contact.name && n > element);
    if (!same || views.some(({ run }) => run.ended(frames.t[frame]))) return false;
    return same.states[same.modes[element][frames.rows[other.place][frame]]] !== contact.states[contact.modes[element][this.row]];
  }

  happened() {
    const { row, run } = this;
    if (run.t(row) !== frames.t[frame]) return []; // the other run is further on, and this one has no row there
    return [run.fired.get(row), ...(run.late.get(row) ?? [])].filter(Boolean);
  }

  // What happened at this row, and what the selected element waits for, if it did not just fire.
  verdict() {
    const { contact, element, row, run } = this;
    if (run.ended(frames.t[frame])) return "ended";
    const happened = this.happened();
    const own = happened.some((entry) => entry.contact === contact && entry.element === element);
    return [...happened.map((entry) => entry.contact.sentence(entry)), ...(own ? [] : [waiting(contact, element, row)])].join("; ");
  }

  // ---------------------------------------------------------------- tokens: the active state of every element
  makeTokens() {
    const box = $(".tokens", this.root), { contact } = this;
    box.replaceChildren();
    box.hidden = contact.n < 2;
    this.tokens = contact.modes.map((_, i) => {
      const token = make("button", box, "", { class: "token" });
      make("b", token, `E${i + 1}`, { class: `swatch e${elementStep(i, contact.n)}` });
      const track = make("span", token, "", { class: "track", "aria-hidden": "true" });
      contact.states.forEach(() => make("i", track));
      make("span", token, "", { class: "state" });
      token.addEventListener("click", () => chooseElement(i));
      return token;
    });
  }

  showTokens() {
    const { contact, row, run } = this, fired = run.fired.get(row);
    if (contact.n < 2) return;
    this.tokens.forEach((token, i) => {
      const mode = contact.modes[i][row], now = fired && fired.contact === contact && fired.element === i, differs = this.differs(i);
      const look = `${mode}/${Boolean(now)}/${i === this.element}/${differs}`;
      if (token.dataset.look === look) return;
      token.dataset.look = look;
      token.classList.toggle("fired", Boolean(now));
      token.classList.toggle("differs", differs);
      token.title = differs ? "in another state than in the other run" : "";
      token.setAttribute("aria-pressed", i === this.element);
      [...token.children[1].children].forEach((cell, k) => { cell.className = k === mode ? `on state${k % STATES}` : ""; });
      token.lastChild.textContent = contact.states[mode];
      if (i === this.element) reveal(token, $(".tokens", this.root));
    });
  }

  // ---------------------------------------------------------------- guards
  listEdges() { // once per contact, so that the focus stays in the table
    const table = $("table", this.root), { contact } = this;
    this.listed = contact;
    for (const body of $$("tbody", table)) body.remove();
    const bodies = contact.edges.map(() => make("tbody", table)); // a card each where the table has no room
    this.lines = contact.edges.map((edge, k) => edge.clauses.map((clause, c) => {
      const line = make("tr", bodies[k]), found = { line };
      if (c === 0) {
        const head = make("th", line, "", { rowspan: edge.clauses.length, scope: "rowgroup" });
        found.button = make("button", head, "○", { "aria-label": `Breakpoint on ${edge.name}` });
        found.button.addEventListener("click", () => toggleBreak(this, this.element, k));
        head.append(` ${edge.priority} ${edge.name}`);
        const small = make("small", head, `${contact.states[edge.source]} → ${contact.states[edge.target]}${contact.sends(k)} `);
        found.word = make("em", small);
      }
      hooks.clause(make("td", line, clause.event ? `event ${clause.event}` : clause.text), contact, clause);
      found.truth = make("td", line);
      found.sides = ["margin", "left", "right"].map((name) => make("td", line, "", { class: "number", "data-name": clause.compares ? name : "" }));
      return found;
    }));
    if (!contact.edges.length) make("td", make("tr", make("tbody", table)), "this chart has no edges", { colspan: 6 });
    this.explained = "";
  }

  explain() {
    const { contact, element } = this, { fired, row } = contact.asked(element, this.row);
    const key = [this.place, element, row, fired, breakpoints.size].join();
    if (this.explained === key) return;
    this.explained = key;
    const state = contact.modes[element][row], scope = contact.scope(element, row);
    say($(".who", this.root), `Guards of ${nameOf(contact, element)}`);
    say($(".fact", this.root), `in ${contact.states[contact.modes[element][this.row]]}${fired < 0 ? "" : `, when checked in ${contact.states[state]}`}`);
    contact.edges.forEach((edge, k) => contact.clauses(k, scope).forEach((clause, c) => {
      const { line, button, word, sides, truth } = this.lines[k][c], asked = edge.source === state;
      line.classList.toggle("asked", asked);
      line.classList.toggle("fired", k === fired);
      if (button) {
        const on = breakpoints.has(keyOf(this, contact, element, k));
        button.setAttribute("aria-pressed", on);
        say(button, on ? "●" : "○");
        say(word, k === fired ? "FIRED" : asked ? "" : "not checked");
      }
      const texts = [marginText(clause), inClause(clause, clause.left), inClause(clause, clause.right)];
      sides.forEach((cell, i) => say(cell, edge.clauses[c].compares ? texts[i] : ""));
      say(truth, { 1: "✓ true", 0: "✗ false" }[clause.truth] ?? "? unknown");
      truth.className = clause.truth === 1 ? "true" : "";
    }));
    const asked = [contact.name, element, state, fired].join();
    if (this.asked !== asked) this.fitTable();
    this.asked = asked;
  }

  // The rows of the edge that fired, or else of the first that is checked, are in view.
  fitTable() {
    const lines = $$("tbody tr", this.root), first = lines.find((line) => line.matches(".fired")) ?? lines.find((line) => line.matches(".asked"));
    if (first) reveal(first, $(".why", this.root), first.querySelector("th")?.rowSpan ?? 1, $("caption", this.root).offsetHeight);
  }
}

const anyMoves = () => runs.some(({ contacts }) => contacts.some(({ velocity }) => velocity));

// What an element waits for, in words.
function waiting(contact, element, row) {
  const state = contact.modes[element][row], leaving = contact.leaving(state);
  const who = `${nameOf(contact, element)} is in ${contact.states[state]}`;
  if (!leaving.length) return contact.edges.length ? `${who}; no edge leaves it` : who;
  const scope = contact.scope(element, row), next = contact.firesNext(state, scope);
  return `${who}; ${next >= 0 ? `${contact.edges[next].name} fires next` : heldBack(contact, leaving, scope)}`;
}

// Scrolls only the box, and only if needed: the page itself stays where it is.
function reveal(node, box, lines = 1, covered = 0) {
  const outer = box.getBoundingClientRect(), inner = node.getBoundingClientRect(), height = inner.height * lines, top = outer.top + covered * large;
  if (inner.top < top || inner.top + height > outer.bottom) box.scrollTop += (inner.top - top) / large - 2;
  if (inner.left < outer.left || inner.right > outer.right) box.scrollLeft += (inner.left - outer.left) / large;
}

// The clause that holds back an edge: the false one that is furthest from its boundary, relative to its sides. One without
// a margin is named only if all others are true, as in the race of plots/panels/guards/racing.py.
function worstClause(clauses) {
  const place = (clause) => (Number.isNaN(clause.margin) ? Infinity : relative(clause));
  return clauses.filter(({ truth }) => truth !== 1).reduce((worst, each) => (worst && place(worst) <= place(each) ? worst : each), null);
}
// From -1 to 1; a clause without a margin is further away than any other.
function relative(clause) {
  const { left, right, margin } = clause;
  if (Number.isNaN(margin)) return -Infinity;
  return isZero(clause) ? 0 : clamp(margin / Math.max(Math.abs(left), Math.abs(right)), -1, 1);
}
// A margin due to the clock and floats is zero, as in the debugger.
function isZero({ left, right, margin }) { return Number.isFinite(margin) && Math.abs(margin) <= (left && right ? data.rounding * Math.max(Math.abs(left), Math.abs(right)) : data.nothing); }
function marginText(clause) {
  const { margin } = clause;
  if (isZero(clause)) return "0";
  return `${margin > 0 ? "+" : ""}${inClause(clause, margin)}`;
}
// Both sides and the margin of a clause have one unit: that of the larger side, as in the debugger.
function inClause({ left, right, unit }, u, digits) { return inUnit(u, unit, powerOf(Math.max(Math.abs(left), Math.abs(right)), unit), digits); }
// In words, of the edge that is nearest to firing.
function heldBack(contact, leaving, scope) {
  const each = leaving.map((k) => ({ k, worst: worstClause(contact.clauses(k, scope)) })).sort((a, b) => relative(b.worst) - relative(a.worst));
  const { k, worst } = each[0], by = Number.isNaN(worst.margin) ? "" : ` by ${inClause(worst, Math.abs(worst.margin), 3)}`;
  const why = worst.event ? `it waits for the event ${worst.event}` : `${worst.text} is ${worst.truth < 0 ? "not computable" : `false${by}`}`;
  return `${contact.edges[k].name} does not fire: ${why}`;
}

// The lines of a guard take the room of marks that are not shown.
function closeUp(texts, marked) {
  const placeOf = (text) => Number(text.dataset.x ??= text.getAttribute("x"));
  for (let k = 0, shift = 0; k < texts.length; k++) {
    const [text, next] = [texts[k], texts[k + 1]];
    text.setAttribute("x", placeOf(text) - shift);
    if (next?.getAttribute("y") !== text.getAttribute("y")) shift = 0;
    else if (!marked && text.matches(".mark")) shift += placeOf(next) - placeOf(text);
  }
}

// ------------------------------------------------------------------ the chart: its SVG is laid out once and restyled
class ChartPane {
  static side = "left"; static key = "chart"; static title = "Chart";

  constructor(view, box) {
    Object.assign(this, { view, box, looks: [] });
    this.fill();
  }

  fill() {
    const { view, box } = this, { contact } = view;
    this.filled = contact;
    this.looks = [];
    box.replaceChildren($(`#chart${contact.chart}`).content.cloneNode(true));
    if (view.place > 0) for (const node of $$("[id]", box)) node.id = `run${view.place + 1}-${node.id}`;
    this.svg = $("svg", box);
    this.svg?.setAttribute("aria-label", `Chart of ${contact.name || "an element"}`);
    this.whole = this.svg?.getAttribute("viewBox");
    this.least = SMALLEST / Math.min(...$$("text", box).map((text) => Number(text.getAttribute("font-size")))); // scale
    this.parts = [];
    for (const node of $$("[data-slot]", box)) (this.parts[node.dataset.slot] ??= []).push(node);
    for (const guard of $$(".guard", box)) {
      const toggle = () => toggleBreak(view, this.elementIn(Number(guard.dataset.slot)), Number(guard.dataset.edge));
      guard.addEventListener("click", (event) => { event.stopPropagation(); toggle(); });
      guard.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        toggle();
      });
    }
    for (const region of $$(".region", box)) region.addEventListener("click", () => chooseElement(Number(region.dataset.slot)));
  }

  choose() { if (this.filled !== this.view.contact) this.fill(); this.fit(); }

  // A large bank is drawn as one chart, which shows the selected element.
  elementIn(slot) { return this.parts.length === this.view.contact.n ? slot : this.view.element; }

  show() {
    for (let slot = 0; slot < this.parts.length; slot++) if (this.light(slot)) this.moved = true;
    if (this.moved && this.scrolls) for (const node of $$(".state.active, .guard.fired", this.region ?? this.box)) reveal(node, this.box);
    this.moved = false;
  }

  // Whether it looks different from before.
  light(slot) {
    const { view } = this, { contact } = view, element = this.elementIn(slot), { fired, row } = contact.asked(element, view.row);
    const active = contact.modes[element][view.row], asked = contact.modes[element][row], scope = contact.scope(element, row);
    const truths = contact.edges.map((edge) => edge.clauses.map(({ holds }) => truthOf(holds, scope)));
    const stops = contact.edges.map((_, k) => breakpoints.has(keyOf(view, contact, element, k)));
    const differs = view.differs(element), look = [element, active, fired, truths, stops, view.element, differs].join();
    if (this.looks[slot] === look) return false; // most elements look the same as on the previous row
    this.looks[slot] = look;
    for (const node of this.parts[slot]) {
      const { state, edge } = node.dataset, on = (name, yes) => node.classList.toggle(name, yes);
      if (state) {
        on("active", Number(state) === active);
        on("differs", Number(state) === active && differs);
      } else if (!edge) {
        on("chosen", element === view.element);
        on("differs", differs);
      }
      else {
        const k = Number(edge), leaving = contact.edges[k].source === asked;
        on("pale", !leaving);
        on("fired", k === fired);
        if (!node.matches(".guard")) continue;
        if (node.dataset.marked !== String(leaving)) {
          node.dataset.marked = leaving;
          closeUp($$("text", node), leaving);
        }
        on("break", stops[k]);
        node.setAttribute("aria-pressed", stops[k]);
        node.setAttribute("aria-label", `Breakpoint: ${nameOf(contact, element)}, ${contact.edges[k].name}`);
        for (const text of $$("[data-clause]", node)) {
          const truth = truths[k][text.dataset.clause];
          text.classList.toggle("true", leaving && truth === 1);
          text.classList.toggle("false", leaving && truth !== 1);
          if (text.matches(".mark")) text.textContent = leaving ? MARKS[truth] : "";
        }
      }
    }
    return true;
  }

  renew() { return true; } // it shows a row, as always

  // Where all elements would be too small to read, only the selected one is in view; where that would be, too, the pane
  // scrolls, or on a narrow screen the page.
  fit() {
    if (!this.svg) return;
    const least = this.least * (presenting.on && views.length > 1 ? HALF : 1), across = this.box.clientWidth, high = isWide() ? this.box.clientHeight : SHARE * innerHeight;
    const region = $(`.region[data-slot="${this.view.element}"]`, this.svg), [, , width, height] = this.whole.split(" ").map(Number);
    const enough = region && isWide() && !presenting.on ? OVERVIEW : least;
    let shown = this.whole;
    this.region = region && Math.min(across / width, high / height) < enough ? region.parentNode : null;
    if (this.region) {
      const box = region.getBBox(), { e, f } = region.parentNode.transform.baseVal.consolidate().matrix;
      shown = [box.x + e - 4, box.y + f - 4, box.width + 8, box.height + 8].join(" ");
    }
    this.svg.setAttribute("viewBox", shown);
    const [, , w, h] = shown.split(" ").map(Number), scale = clamp(Math.min(across / w, high / h), this.region ? least : enough, LARGEST);
    place(this.svg, { width: w * scale, height: h * scale });
    this.moved = true;
    this.scrolls = w * scale > across + 1 || (isWide() && h * scale > high + 1);
  }
}
const SMALLEST = 11.01; // px of text: browsers round lengths down
const OVERVIEW = 0.85, LARGEST = 1.5; // px per point of the chart: of all elements on a wide screen, and of any chart
const HALF = 0.7; // times that, of two charts side by side in a presentation
const SHARE = 0.4; // of the height of a narrow screen
PANES.push(ChartPane);
