"use strict";
// A run computed in the page's worker: the memory of an engine that gms-fsm has printed.
const GROWING = { // columns by what there is one entry of
  rows: ["rows_t", "rows_y", "rows_microstep", "rows_mode", "table", "shown"],
  firings: ["log_t", "log_machine", "log_edge", "log_numbers"],
};

// Floats as gms_fsm.exporters.live has written them.
function floats(stored) {
  if (typeof stored !== "string") {
    const [first, step, unit, count] = stored;
    return new Float64Array(count).map((_, k) => (first + k * step) / unit);
  }
  const letters = stored.replace(/-(\d+)-/g, (_, count) => "A".repeat(count));
  const bytes = Uint8Array.fromBase64?.(letters) ?? Uint8Array.from(atob(letters), (letter) => letter.charCodeAt(0));
  return new Float64Array(bytes.buffer);
}

// Room at first, of rows at least. Functions that are made a second time, for a larger memory, are ten times slower in some
// browsers; what is not used of a memory costs nothing.
const ROOMS = { rows: 32768, firings: 8192 }, ROWS_IN_WORDS = 2 ** 22;

class Engine {
  constructor({ known, image, functions }) {
    Object.assign(this, { known, image, make: functions, tables: floats(known.tables), rooms: { ...ROOMS } });
    const width = GROWING.rows.reduce((sum, name) => sum + known.columns[name].width, 0);
    this.rooms.rows = Math.max(ROOMS.rows, Math.floor(ROWS_IN_WORDS / width));
    this.fixed = Object.fromEntries(Object.entries(known.columns).map(([name, { data = [] }]) => [name, data.map(floats)]));
    this.build();
  }

  // The memory with room for so many rows and firings, as it is before a run.
  build() {
    const { known: { words, columns, true: bytes }, tables, fixed, rooms } = this, places = {};
    const count = (name) => rooms[Object.keys(GROWING).find((kind) => GROWING[kind].includes(name))] ?? columns[name].rows;
    this.block = tables.length;
    let size = this.block + words;
    for (const name of Object.keys(columns)) {
      places[name] = size;
      size += count(name) * columns[name].width;
    }
    const F = new Float64Array(size), B = new Uint8Array(F.buffer);
    F.set(tables);
    for (const [name, { offset, width, lengths }] of Object.entries(columns)) {
      [places[name], count(name), width].slice(0, 1 + lengths).forEach((u, k) => { F[this.block + offset + k] = u; });
      let place = places[name];
      for (const part of fixed[name]) { F.set(part, place); place += part.length; }
    }
    for (let k = 0; k < this.image.length; k += 2) F[this.block + this.image[k]] = this.image[k + 1];
    for (const place of bytes) B[8 * this.block + place] = 1;
    Object.assign(this, { F, places, first: F.slice(0, this.block + words), functions: this.make(F, B) });
  }

  word(name) { return this.F[this.block + this.known.places[name]]; }

  get isFull() { return { rows: this.word("row") + 1 >= this.rooms.rows, firings: this.word("firings") >= this.rooms.firings }; }

  // A run with other numbers: [word, value] pairs. What it finds lies in the memory until the next run.
  run(numbers) {
    for (;;) {
      this.F.set(this.first);
      for (const [word, value] of numbers) this.F[this.block + word] = value;
      this.F[this.block + this.known.places.time_scale] = this.functions.adapt();
      const event = this.functions.record(Infinity, 0);
      if (event !== this.known.codes.ROWS) return this.found(event);
      const { rows, firings } = this.isFull;
      if (rows) this.rooms.rows *= 2;
      if (firings) this.rooms.firings *= 2;
      this.build(); // and again from the start: growing is rare, copying would be a second way
    }
  }

  found(event) {
    const { known: { codes, sizes, failures, elements }, F, places } = this, count = this.word("row"), fired = this.word("firings");
    this.functions.show(0, count);
    this.functions.values(count);
    const part = (name, length) => F.subarray(places[name], places[name] + length);
    const stopped = event === codes.DONE ? "" : `t = ${this.word("clock")} s: ${event === codes.LIVELOCK ? `${elements[this.word("machine")]}: ` : ""}${failures[event] ?? "it stopped"}`;
    return {
      count, fired, stopped,
      t: part("rows_t", count), microstep: part("rows_microstep", count),
      y: part("rows_y", count * sizes.y), mode: part("rows_mode", count * sizes.mode),
      seen: part("table", count * sizes.seen), shown: part("shown", count * sizes.shown),
      log_t: part("log_t", fired), log_machine: part("log_machine", fired), log_edge: part("log_edge", fired),
      words: F.subarray(this.block, this.block + this.known.words),
    };
  }
}

// What was found, in memory of its own.
const kept = (found) => Object.fromEntries(Object.entries(found).map(([name, each]) => [name, each instanceof Float64Array ? each.slice() : each]));
