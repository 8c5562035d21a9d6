// Types of ${name}.mjs. Written by gms-fsm $version. Everything is in SI units.

export declare class FrictionError extends Error {$error_fields}

/** What can be changed; tolerances and initial values follow. Rules are not checked here. */
export interface Numbers {
$numbers
}

export declare const numbers: Readonly<Record<keyof Numbers, {
    unit: string;
    meaning: string;
    value: number | readonly number[];
}>>;

export declare const states: Readonly<Record<string, readonly string[]>>;

export interface Edge {
    readonly contact: string;
    readonly edge: string;
    readonly source: string;
    readonly target: string;
}

export declare const edges: readonly Edge[];

/** A switch; elements are counted from 1 in each contact. */
export interface Switch extends Edge {
    readonly t: number;
    readonly element: number;
$switch_fields}

$types
