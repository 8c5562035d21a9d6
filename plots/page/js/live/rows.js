"use strict";
// A run that the engine of this page has computed, as the data that the page reads. Its columns are recipes: where a value
// lies in the rows that the engine has found.

// A table's value at a time, as gms_fsm.systems.signals.piecewise_linear has it.
function between(times, values, t) {
  const high = lastAt(times, t) + 1;
  if (high === 0) return values[0];
  if (high === times.length) return values[high - 1];
  const t0 = times[high - 1], end = times[high], halfway = t + 0.5 * (end - t);
  if (t0 < t && (halfway <= t || halfway >= end)) return values[high]; // no number lies between them
  return values[high - 1] + ((t - t0) / (end - t0)) * (values[high] - values[high - 1]);
}

class LiveRun extends RunData {
  // Its rows lie in `found`, or in the memory of the engine until the next run.
  constructor(stored, place, engine, found) {
    const contacts = stored.contacts.map((each) => ({ ...each, parameters: structuredClone(each.parameters), curve: structuredClone(each.curve) }));
    super({ ...stored, contacts, engine, found }, place);
  }

  read({ engine, found, pool, terms = {} }) {
    Object.assign(this, { engine, recipes: pool, terms: Object.fromEntries(Object.entries(terms).map(([name, each]) => [name, this.column(each)])) });
    return this.rowsOf(found);
  }

  getter([kind, ...rest]) {
    const [place, more] = rest;
    switch (kind) {
      case "t": return (row) => this.found.t[row];
      case "constant": return () => place;
      case "word": return () => this.found.words[place];
      case "over": return (row) => this.pool[place](row) / this.found.words[more];
      case "tree": {
        const f = compiled(place);
        return (row) => valueOf(f, (name) => this.terms[name](row));
      }
      case "corners": {
        const [times, values] = rest.map(floats);
        return (row) => between(times, values, this.found.t[row]);
      }
      default: // y, seen, shown; each with a function of its own: one for all is many times slower
        if (place < 0) return () => NaN;
        if (kind === "y") return (row) => this.found.y[row * this.width.y + place];
        if (kind === "seen") return (row) => this.found.seen[row * this.width.seen + place];
        return (row) => this.found.shown[row * this.width.shown + place];
    }
  }

  rowsOf(found) {
    const { sizes, banks } = this.engine.known, numbers = this.contacts.map(({ edgeNumbers }) => edgeNumbers), { count, mode } = found, same = new Uint32Array(count);
    for (let row = 0; row < count; row++) same[row] = row;
    Object.assign(this, { found, width: sizes, rows: count });
    const steps = this.made(found), contacts = banks.map(([first, edges, n], bank) => {
      const rows = [], elements = [], modes = [];
      for (let row = 1; row < count; row++) {
        for (let i = 0, at = row * sizes.mode + first; i < n; i++, at++) {
          if (mode[at] === mode[at - sizes.mode]) continue;
          rows.push(row);
          elements.push(i);
          modes.push(mode[at]);
        }
      }
      const own = [...found.log_machine.keys()].filter((k) => found.log_machine[k] >= first && found.log_machine[k] < first + n);
      const log = [own.map((k) => steps[k]), own.map((k) => found.log_machine[k] - first), own.map((k) => numbers[bank][found.log_edge[k] - edges]), own.map(() => 1), []];
      return { initial: Array.from({ length: n }, (_, i) => mode[first + i]), switches: [rows, elements, modes], log };
    });
    this.takeNumbers(found.words);
    return { rows: count, of: count, instants: same, number: same, between: new Uint8Array(count), microstep: found.microstep, contacts };
  }

  // The row that each firing made: that of its instant with its micro-step.
  made({ t, microstep, count, fired, log_t: at }) {
    const rows = new Uint32Array(fired);
    for (let k = 0, row = 0, step = 0; k < fired; k++) {
      step = k > 0 && at[k] === at[k - 1] ? step + 1 : 1;
      while (row < count && (t[row] < at[k] || (t[row] === at[k] && microstep[row] !== step))) row += 1;
      rows[k] = Math.min(row, count - 1);
    }
    return rows;
  }

  // The numbers that guards and the curve read.
  takeNumbers(words) {
    for (const contact of this.contacts) {
      const { parameters, curve, weights } = contact.words;
      for (const [name, [word, n]] of Object.entries(parameters)) contact.parameters[name] = n ? Array.from(words.subarray(word, word + n)) : words[word];
      if (!contact.curve) continue;
      for (const [name, word] of Object.entries(curve)) contact.curve.numbers[name] = words[word];
      contact.curve.weights = Array.from(words.subarray(weights, weights + contact.n));
    }
  }

  // Other rows, of the same engine.
  renew(found) { this.take(this.rowsOf(found)); }
}
