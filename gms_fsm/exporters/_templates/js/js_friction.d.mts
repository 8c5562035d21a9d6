export interface Inputs {
$inputs
}

export interface Outputs {
$outputs
}

export declare class Friction {
    constructor(numbers?: Numbers);
    readonly t: number;
    readonly switches: number;
    readonly log: readonly Switch[];
    readonly outputs: Outputs;
    advance(start: Inputs, end: Inputs, dt: number): Outputs;
    copy(): Friction;
}
