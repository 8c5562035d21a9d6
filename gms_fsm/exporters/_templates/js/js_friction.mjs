
const LATEST = $latest, FULL_LOG = $full_log;

/** Friction that the caller moves: its inputs run on straight lines during each call. */
export class Friction {
    #memory = new Memory({});

    /** Begin at t = $t_start s, with `numbers` instead of those exported. */
    constructor(numbers = {}) {
        /** Switches since the beginning. */
        this.switches = 0;
        /** Those of the last call. */
        this.log = [];
        this.#memory.set(numbers);
    }

    /** s: the time reached. */
    get t() {
        return this.#memory.F[BLOCK + $clock];
    }

    /** Advance by dt >= 0, from the inputs at the start ($inputs) to those at the end. With dt = 0
     * the outputs are those at the end. After an error nothing has changed. Returns the outputs. */
    advance(start, end, dt) {
        const { F, functions } = this.#memory, before = F.slice(), t = this.t + dt;
        const given = INPUTS.flatMap((name) => [start[name], end[name]]);
        if (!given.every(Number.isFinite)) {
            throw new FrictionError("start and end must have finite numbers: $inputs");
        }
        if (!(dt >= 0 && t <= LATEST) || (dt > 0 && t === this.t)) {
            throw new FrictionError(`dt is $${dt} s: it must not be negative, nor below the clock's resolution`);
        }
        F[BLOCK + $end] = t;
        F.set(given, BLOCK + $given);
        F[BLOCK + $resumed] = 0;
        const log = [];
        let code = FULL_LOG;
        while (code === FULL_LOG) {
            code = functions.step(BLOCK);
            for (let k = 0; k < F[BLOCK + $switches]; k++) {
                const [t, element, edge] = [$log_t, $log_element, $log_edge].map((u) => F[BLOCK + u + k]);
                log.push({ t, element: element + 1, ...edges[edge] });
            }
            if (code === FULL_LOG) {
                F[BLOCK + $switches] = 0;
                F[BLOCK + $resumed] = 1;
            }
        }
        if (code !== 0) {
            const at = this.t;
            F.set(before);
            throw new FrictionError(`t = $${at} s: $${FAILURES[code] ?? "it stopped"}`);
        }
        this.log = log;
        this.switches += log.length;
        return this.outputs;
    }

    /** What the friction shows now, by name; of one per element an array. */
    get outputs() {
        const found = {};
        for (const [name, quantity] of Object.entries(OUTPUTS)) {
            const words = this.#memory.quantity(quantity);
            found[name] = quantity.length === undefined ? words[0] : Array.from(words);
        }
        return found;
    }

    /** A friction in the same state, with a life of its own. */
    copy() {
        const other = new Friction();
        other.#memory.F.set(this.#memory.F);
        other.switches = this.switches;
        other.log = [...this.log];
        return other;
    }
}

const INPUTS = $input_names;
