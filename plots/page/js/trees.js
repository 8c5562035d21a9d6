"use strict";
// Trees of the expression language, written by plots/page/_trees.py, as functions of a scope. A scope is a
// function from a name to its number. What Python cannot compute, such as 1/0, throws UNDEFINED here.
const UNDEFINED = new Error("cannot be computed");
const real = (u) => { if (Number.isNaN(u)) throw UNDEFINED; return u; };
const finite = (u, ...parts) => { // Python raises where a function leaves the finite numbers
  if (!Number.isFinite(u) && parts.every(Number.isFinite)) throw UNDEFINED;
  return u;
};

function product(u, whole) {
  if (whole === 0) return 1;
  let found = u;
  for (let k = 1; k < Math.abs(whole); k++) found *= u;
  return whole > 0 ? found : divided(1, found);
}
const divided = (a, b) => { if (b === 0) throw UNDEFINED; return a / b; };

const { exp, log, sin, cos, tanh, atan, asinh, pow, floor, round, tooth, noise } = ELEMENTARY; // the bits of Python, in every browser
const FUNCTIONS = {
  "+": (a, b) => a + b, "*": (a, b) => a * b, "/": divided,
  "-": (a, b) => (b === undefined ? -a : a - b),
  "**": (a, b) => finite(real(pow(a, b)), a, b),
  "<": (a, b) => a < b, "<=": (a, b) => a <= b, ">": (a, b) => a > b, ">=": (a, b) => a >= b,
  abs: Math.abs, sgn: (u) => (u > 0 ? 1 : u < 0 ? -1 : 0),
  sqrt: (u) => { if (u < 0) throw UNDEFINED; return Math.sqrt(u); },
  exp: (u) => finite(exp(u), u), log: (u) => { if (u <= 0) throw UNDEFINED; return log(u); },
  sin: (u) => finite(sin(u)), cos: (u) => finite(cos(u)), tanh, atan, asinh, floor, round, tooth, noise,
  min: (...all) => all.reduce((a, b) => (b < a ? b : a)), max: (...all) => all.reduce((a, b) => (b > a ? b : a)),
  product,
};
// Choices: only what is chosen is computed.
const CHOICES = { if_lt: "<", if_le: "<=", if_gt: ">", if_ge: ">=" };

function compiled(tree) {
  if (typeof tree === "number") return () => tree;
  if (typeof tree === "string") return (scope) => scope(tree);
  const [op, ...rest] = tree;
  if (op === "stored") { // the column at a row of the run, the tree elsewhere
    const inner = compiled(rest[1]);
    return (scope) => scope(rest[0]) ?? inner(scope);
  }
  if (op === "state") return (scope) => scope(`state(${rest[0]})`) === rest[1];
  if (op === "product") {
    const base = compiled(rest[0]);
    return (scope) => product(base(scope), rest[1]);
  }
  const parts = rest.map(compiled), f = FUNCTIONS[op];
  if (op === "and") return (scope) => parts.every((part) => part(scope));
  if (op === "or") return (scope) => parts.some((part) => part(scope));
  if (op in CHOICES) {
    const holds = FUNCTIONS[CHOICES[op]], [a, b, yes, no] = parts;
    return (scope) => (holds(a(scope), b(scope)) ? yes : no)(scope);
  }
  if (op === "if") return (scope) => (parts[0](scope) ? parts[1] : parts[2])(scope);
  if (op === "not") return (scope) => !parts[0](scope);
  if (parts.length === 1) return (scope) => f(parts[0](scope));
  if (parts.length === 2) return (scope) => f(parts[0](scope), parts[1](scope));
  return (scope) => f(...parts.map((part) => part(scope)));
}

// The value, or NaN where it cannot be computed.
function valueOf(f, scope) {
  try { return f(scope); } catch (error) { if (error === UNDEFINED) return NaN; throw error; }
}

// The truth of a condition: 1, 0, or -1 where it cannot be computed; then it counts as false.
function truthOf(f, scope) {
  try { return f(scope) ? 1 : 0; } catch (error) { if (error === UNDEFINED) return -1; throw error; }
}

// The names that a tree reads.
function namesIn(tree, found = new Set()) {
  if (typeof tree === "string") found.add(tree);
  if (!Array.isArray(tree)) return found;
  const [op, ...rest] = tree;
  if (op === "state") return found.add(`state(${rest[0]})`);
  const parts = op === "stored" ? [rest[1]] : op === "product" ? [rest[0]] : rest;
  for (const part of parts) namesIn(part, found);
  return found;
}

// The comparisons in a condition, as trees.
function comparisonsIn([op, ...rest]) {
  if (["<", "<=", ">", ">="].includes(op)) return [[op, ...rest]];
  return ["and", "or", "not"].includes(op) ? rest.flatMap(comparisonsIn) : [];
}
