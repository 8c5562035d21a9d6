// $title. Written by gms-fsm $version; see README-${name}-js.md.
//
// Only + - * /, square roots and comparisons of doubles: the results are those of gms-fsm to the
// last bit, in every JavaScript engine. Everything is in SI units.

const TABLES = [$tables];
const BLOCK = TABLES.length, WORDS = $words;
// What is not zero at the start: words of the block, and single bytes that are true.
const IMAGE = [$image];
const TRUE = [$true_bytes];
// Columns outside the block: where it has the address and the lengths, and what is in them at first.
const COLUMNS = {$columns};

// F is the memory in words of eight bytes, B the same in bytes; addresses are numbers of words.
function functions(F, B) {
$code
    return { $entries };
}

/** Errors of an argument, or of a run that cannot go on. */
export class FrictionError extends Error {
    constructor(message, more = {}) {
        super(message);
        Object.assign(this, more);
        this.name = "FrictionError";
    }
}

class Memory {
    constructor(rooms, from = null) {
        this.rooms = rooms;
        this.places = {};
        let words = BLOCK + WORDS;
        for (const [name, column] of Object.entries(COLUMNS)) {
            this.places[name] = words;
            words += rooms[name] * column.width;
        }
        this.F = new Float64Array(words);
        this.B = new Uint8Array(this.F.buffer);
        this.F.set(from === null ? TABLES : from.F.subarray(0, BLOCK + WORDS));
        for (const [name, column] of Object.entries(COLUMNS)) {
            const { offset, width, data } = column, place = this.places[name];
            [place, rooms[name], width].slice(0, 1 + column.lengths).forEach((u, k) => {
                this.F[BLOCK + offset + k] = u;
            });
            const before = from === null ? data ?? [] : from.column(name);
            this.F.set(before, place);
        }
        if (from === null) {
            for (const [place, value] of IMAGE) this.F[BLOCK + place] = value;
            for (const place of TRUE) this.B[8 * BLOCK + place] = 1;
        }
        this.functions = functions(this.F, this.B);
    }

    /** All of a column. */
    column(name) {
        const place = this.places[name];
        return this.F.subarray(place, place + this.rooms[name] * COLUMNS[name].width);
    }

    /** The words of a quantity, in the block. */
    quantity({ place, length }) {
        return this.F.subarray(BLOCK + place, BLOCK + place + (length ?? 1));
    }

    /** Set numbers by name, and all that follows from them: tolerances, initial values. */
    set(numbers) {
        for (const [name, given] of Object.entries(numbers)) {
            const quantity = Object.hasOwn(NUMBERS, name) ? NUMBERS[name] : undefined;
            if (quantity === undefined) {
                const known = Object.keys(NUMBERS).join(", ") || "none";
                throw new FrictionError(`there is no number "$${name}"; there are: $${known}`);
            }
            const length = quantity.length ?? 1;
            const values = typeof given === "number" ? Array(length).fill(given) : Array.from(given);
            if (values.length !== length || !values.every(Number.isFinite)) {
                const what = quantity.length ? `$${length} finite numbers` : "a finite number";
                throw new FrictionError(`$${name} must be $${what}, not $${given}`);
            }
            this.quantity(quantity).set(values);
        }
        this.F[BLOCK + $time_scale] = this.functions.adapt(BLOCK);
    }
}

const NUMBERS = $numbers;
const OUTPUTS = $outputs;
const FAILURES = $failures;

/** The numbers that can be changed: unit, meaning and value. */
export const numbers = Object.fromEntries(Object.entries(NUMBERS).map(
    ([name, { unit, meaning, value }]) => [name, { unit, meaning, value }]));

/** The states of each contact, in the order in which the outputs count them. */
export const states = $states;

/** The edges: contact, name, source and target. */
export const edges = $edges;
$face
