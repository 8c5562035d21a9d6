/** One entry per row. */
export interface Outputs {
$outputs
}

export interface Run {
    readonly t: Float64Array;
    readonly microstep: Int32Array;
    readonly outputs: Outputs;
    readonly log: readonly Switch[];
}

export declare function run(numbers?: Numbers): Run;
