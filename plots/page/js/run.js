"use strict";
// A run as data: columns by row, and what each of its contacts and supervisors reads, switches and logs. Nothing is drawn
// here. A supervisor is a contact without a velocity.
const WIDTHS = { u1: Uint8Array, u2: Uint16Array, u4: Uint32Array, f4: Float32Array, f8: Float64Array };

function unpacked(kind, text) {
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k++) bytes[k] = letters.charCodeAt(k);
  return new WIDTHS[kind](bytes.buffer); // little-endian, as all browsers are today
}

function integers([kind, text]) {
  if (!kind.startsWith("+")) return unpacked(kind, text);
  const found = Uint32Array.from(unpacked(kind.slice(1), text));
  for (let k = 1; k < found.length; k++) found[k] += found[k - 1];
  return found;
}

const BETWEEN = ["", "after ", "before "]; // where a row of the page lies, seen from a row of the trace

class RunData {
  constructor(stored, place) {
    const { title, system, trust = [], ghost = false, label = `run ${place + 1}`, short = place + 1 } = stored;
    Object.assign(this, { place, title, system, trust, ghost, label, short });
    this.pool = stored.pool.map((each) => this.getter(each));
    this.t = this.column(stored.t);
    this.contacts = stored.contacts.map((each) => new Contact(each, this));
    this.names = Object.fromEntries(Object.entries(stored.names).map(([name, each]) => [name, this.column(each)]));
    this.take(this.read(stored));
  }

  // The rows that were written into the page.
  read({ rows, of, instants, number, between, microstep, contacts }) {
    const logs = contacts.map(({ log, switches, initial }) => ({ initial, switches: switches.map(integers), log: [...log.slice(0, 4).map(integers), log[4]] }));
    return { rows, of, contacts: logs, instants: integers(instants), number: integers(number), between: integers(between), microstep: integers(microstep) };
  }

  getter([kind, on, text]) {
    const values = unpacked(kind, text);
    if (on === "constant") return () => values[0];
    return on === "instants" ? (row) => values[this.instants[row]] : (row) => values[row];
  }

  // Rows with their states and firings, in the place of those before; what reads them stays.
  take({ contacts, ...rows }) {
    Object.assign(this, rows, { times: new Float64Array(rows.rows), order: new Uint16Array(rows.rows) });
    for (let row = 0; row < this.rows; row++) {
      this.times[row] = this.t(row);
      if (row && this.times[row] === this.times[row - 1]) this.order[row] = this.order[row - 1] + 1; // in its instant
    }
    contacts.forEach((each, k) => this.contacts[k].take(each));
    this.fired = new Map(); // by row: the firing that made it
    this.late = new Map(); // by row: firings between requested times, which have no row of their own
    this.log = this.contacts.flatMap((contact) => contact.log).sort((a, b) => a.row - b.row || a.t - b.t);
    for (const entry of this.log) {
      if (entry.made) this.fired.set(entry.row, entry);
      else this.late.set(entry.row, [...(this.late.get(entry.row) ?? []), entry]);
    }
  }

  rowName(row) { return `${BETWEEN[this.between[row]]}row ${this.number[row]}`; }

  // Whether a time is after the last row; the page of a longer run goes on, with the last values of this one.
  ended(t) { return t > this.t(this.rows - 1); }

  // A column by row: the number of a stored one, or that and a factor.
  column(each) {
    if (!Array.isArray(each)) return this.pool[each];
    const base = this.pool[each[0]];
    return (row) => each[1] * base(row);
  }
}

class Contact {
  constructor(stored, run) {
    Object.assign(this, stored, { run });
    this.columns = {};
    for (const [name, each] of Object.entries(stored.values)) this.columns[name] = each.by ? each.by.map((one) => run.column(one)) : run.column(each.all);
    this.forces = stored.forces.map((each) => run.column(each));
    this.edges = stored.edges.map((edge) => ({
      ...edge,
      tree: edge.guard,
      guard: compiled(edge.guard),
      clauses: edge.clauses.map((clause) => ({
        ...clause, holds: compiled(clause.tree),
        ...(clause.compares && { op: clause.tree[0], left: compiled(clause.tree[1]), right: compiled(clause.tree[2]) }),
      })),
    }));
    this.lets = Object.fromEntries(Object.entries(stored.let).map(([name, tree]) => [name, compiled(tree)]));
    this.flowTrees = stored.flows;
    this.flows = stored.flows.map((flows) => Object.fromEntries(Object.entries(flows).map(([name, tree]) => [name, compiled(tree)])));
    this.curveAt = stored.curve && compiled(stored.curve.tree);
    this.away = (row) => this.modes.reduce((count, mode) => count + (mode[row] !== 0), 0);
  }

  take({ initial, switches, log }) {
    const { run } = this, [fired, elements, edges, made, late] = log;
    Object.assign(this, { powers: {}, sizes: {} });
    this.readSwitches(initial, switches);
    let next = 0;
    this.log = Array.from(fired, (row, k) => ({
      row, contact: this, element: elements[k], edge: edges[k], made: made[k] === 1, t: made[k] ? run.t(row) : late[next++],
    }));
  }

  readSwitches(initial, [rows, elements, modes]) {
    this.pieces = initial.map((mode) => [{ mode, from: 0 }]); // constant state from this row on
    rows.forEach((row, k) => this.pieces[elements[k]].push({ mode: modes[k], from: row }));
    this.modes = this.pieces.map((pieces) => {
      const found = new Uint8Array(this.run.rows);
      pieces.forEach(({ mode, from }, k) => found.fill(mode, from, pieces[k + 1]?.from));
      return found;
    });
  }

  // A value of a quantity as text, in one unit for all rows and runs: a threshold in that of the variable it bounds.
  tell(name, u, digits) {
    const key = name === "s" ? this.variables[0] ?? name : name, unit = unitOf(this, name);
    this.powers[key] ??= powerOf(Math.max(...runs.flatMap(({ contacts }) => contacts).filter((each) => each.name === this.name && each.columns[key]).map((each) => each.size(key))), unit);
    return inUnit(u, unit, this.powers[key], digits);
  }

  // The largest size of a quantity that has columns.
  size(name) {
    const { run: { rows } } = this;
    return (this.sizes[name] ??= largest(extent([this.columns[name]].flat().map((get) => ({ get, rows })))));
  }

  parameter(name, element) {
    const value = this.parameters[name];
    return Array.isArray(value) ? value[element] : value;
  }

  value(name, element, row) {
    const column = this.columns[name];
    if (column === undefined) return Object.hasOwn(this.parameters, name) ? this.parameter(name, element) : undefined;
    return Array.isArray(column) ? column[element](row) : column(row);
  }

  // What is shown of it: the force and the motion; of a supervisor its outputs and variables, and the inputs that it reads.
  get shown() {
    if (this.velocity) return [...this.outputs, this.velocity, "x"];
    return [...this.outputs, ...this.variables, ...this.inputs.filter((name) => this.columns[name])];
  }

  // A column of its first element by row; undefined if there is none.
  column(name) { return [this.columns[name]].flat()[0]; }

  // What a guard of an element reads at a row of the run, bit for bit.
  scope(element, row) { return (name) => this.value(name, element, row); }

  // The same with other values for some names. The curve and named expressions follow them; all else stays.
  scopeWith(element, row, given) {
    const scope = (name) => {
      if (Object.hasOwn(given, name)) return given[name];
      if (name.startsWith("#")) return undefined; // not at a row of the run: computed from its tree
      if (name === "s" && this.curveAt) {
        return this.curve.weights[element] * this.curveAt((each) => (each === "v" ? scope(this.velocity) : this.curve.numbers[each]));
      }
      return Object.hasOwn(this.lets, name) ? this.lets[name](scope) : this.value(name, element, row);
    };
    return scope;
  }

  // The clauses of an edge with truth, sides and margin (negative on the false side).
  clauses(edge, scope) {
    return this.edges[edge].clauses.map(({ text, unit, event, holds, op, left, right }) => {
      const truth = truthOf(holds, scope), found = { text, unit, event, truth, left: NaN, right: NaN, margin: NaN };
      if (!op || truth < 0) return found;
      const a = left(scope), b = right(scope);
      return { ...found, left: a, right: b, margin: op.startsWith(">") ? a - b : b - a };
    });
  }

  // The row to explain: if this element has just fired, the row at which its guards were checked.
  asked(element, row) {
    const fired = this.run.fired.get(row);
    if (fired && fired.contact === this && fired.element === element) return { fired: fired.edge, row: row - 1 };
    return { fired: -1, row };
  }

  leaving(state) { return this.edges.map((_, k) => k).filter((k) => this.edges[k].source === state); }

  // Which edge fires next in a state, as the engine decides: the first whose guard is true; -1 for none.
  firesNext(state, scope) { return this.leaving(state).find((k) => truthOf(this.edges[k].guard, scope) === 1) ?? -1; }

  // The rows where a guard becomes true while its state is active. Such a row comes before every firing,
  // except where only requested times were stored; there the row that shows the firing is used.
  stops(element, edge) {
    const { guard, source } = this.edges[edge], mode = this.modes[element], found = new Set();
    for (let row = 0, before = false; row < this.run.rows; row++) {
      const now = mode[row] === source && truthOf(guard, this.scope(element, row)) === 1;
      if (now && !before) found.add(row);
      before = now;
    }
    for (const entry of this.log) if (!entry.made && entry.element === element && entry.edge === edge) found.add(entry.row);
    return found;
  }

  sends(edge) { const { emit } = this.edges[edge]; return emit.length ? `, sends ${emit.join(", ")}` : ""; }

  sentence({ element, edge }) {
    const { name, source, target } = this.edges[edge];
    return `${nameOf(this, element)} ${this.states[source]} → ${this.states[target]} (${name}${this.sends(edge)})`;
  }
}

// Rows of one or two runs on a common time. Rows of one instant are matched by their order, so that micro-steps
// are shown next to micro-steps.
class Frames {
  constructor(runs) {
    const most = runs.reduce((sum, { rows }) => sum + rows, 0), t = new Float64Array(most);
    const each = runs.map(({ times, order }) => ({ times, order, at: 0, rows: new Uint32Array(most) }));
    let count = 0;
    for (; ; count++) {
      let least = Infinity, first = 0;
      for (const { times, order, at } of each) {
        if (at < times.length && (times[at] < least || (times[at] === least && order[at] < first))) { least = times[at]; first = order[at]; }
      }
      if (least === Infinity) break;
      t[count] = least;
      for (const run of each) {
        if (run.at < run.times.length && run.times[run.at] === least && run.order[run.at] === first) run.at += 1;
        run.rows[count] = Math.max(run.at - 1, 0);
      }
    }
    this.t = t.slice(0, count);
    this.rows = each.map(({ rows }) => rows.slice(0, count));
    // The first frame that shows each row.
    this.of = runs.map((run, k) => {
      const found = new Uint32Array(run.rows), rows = this.rows[k];
      for (let frame = count - 1; frame >= 0; frame--) found[rows[frame]] = frame;
      return found;
    });
  }
}
