
const ROWS = $ROWS, DONE = $DONE, FIRING = $FIRING, STEPS_AT_ONCE = 20000, MODES = $modes, SIZE = $size;
const GROWING = {
    rows: ["rows_t", "rows_y", "rows_microstep", "rows_mode"],
    firings: ["log_t", "log_machine", "log_edge", "log_numbers"],
};

/** Run from $t_start s to $t_end s. With `numbers` instead of those exported. */
export function run(numbers = {}) {
    const few = { rows: TIMES ?? 1024, firings: 256 }, rooms = {};
    for (const [name, column] of Object.entries(COLUMNS)) rooms[name] = column.rows;
    for (const [kind, names] of Object.entries(GROWING)) {
        for (const name of names) rooms[name] = few[kind];
    }
    let memory = new Memory(rooms), event = ROWS;
    memory.set(numbers);
    while (event === ROWS) {
        memory = withRoom(memory);
        event = memory.functions.record(BLOCK, STEPS_AT_ONCE, 0);
    }
    const made = found(memory);
    if (event === DONE) return made;
    const { F } = memory, t = F[BLOCK + $clock];
    const machine = F[BLOCK + $machine];
    const where = event === $livelock ? `$${ELEMENTS[machine]}: ` : "";
    throw new FrictionError(`t = $${t} s: $${where}$${FAILURES[event] ?? "it stopped"}`, { run: made });
}

/** Double the columns that are full. */
function withRoom(memory) {
    const { F, rooms } = memory, more = { ...rooms };
    const full = {
        rows: TIMES === undefined && F[BLOCK + $row] + 1 >= rooms.rows_t,
        firings: F[BLOCK + $firings] >= rooms.log_t,
    };
    for (const [kind, names] of Object.entries(GROWING)) {
        if (full[kind]) for (const name of names) more[name] = 2 * rooms[name];
    }
    return full.rows || full.firings ? new Memory(more, memory) : memory;
}

/** Everything that a run has found. */
function found(memory) {
    const count = memory.F[BLOCK + $row], fired = memory.F[BLOCK + $firings];
    const last = new Memory({ ...memory.rooms, table: count }, memory);
    last.functions.show(BLOCK, 0, count);
    const wide = { y: ["rows_y", SIZE], mode: ["rows_mode", MODES], seen: ["table", $observed] };
    const columnOf = (place, index) => {
        const [name, width] = wide[place], cells = last.column(name);
        return (place === "mode" ? Int32Array : Float64Array).from(
            { length: count }, (_, row) => cells[row * width + index]);
    };
    const outputs = {};
    for (const [name, { place, index, length }] of Object.entries(OUTPUTS)) {
        outputs[name] = length === undefined
            ? columnOf(place, index)
            : Array.from({ length }, (_, k) => columnOf(place, index + k));
    }
    const machines = last.column("log_machine"), kinds = last.column("log_edge");
    const times = last.column("log_t"), values = last.column("log_numbers");
    const log = Array.from({ length: fired }, (_, k) => {
        const [z, v, s, F_before, F_after] = values.subarray(5 * k, 5 * k + 5);
        const element = machines[k] - FIRST_ELEMENTS[edges[kinds[k]].contact] + 1;
        return { t: times[k], element, ...edges[kinds[k]], z, v, s, F_before, F_after };
    });
    return {
        t: last.column("rows_t").slice(0, count),
        microstep: Int32Array.from(last.column("rows_microstep").subarray(0, count)),
        outputs,
        log,
    };
}

const TIMES = $times; // number of requested rows; undefined if every step is one
const FIRST_ELEMENTS = $first_elements; // of each contact, among all elements
const ELEMENTS = $elements; // what the elements are called
