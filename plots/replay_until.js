"use strict";
// The `until` box: a condition on stored values, in the expression language of gms-fsm. It is the only
// text that Python has not seen. Precedence, functions and constants come from Python and are stored
// in the page. Closures are built from checked text; nothing is ever passed to `eval`, and no guard is read here.
const OPERATIONS = {
  or: (a, b) => a || b, and: (a, b) => a && b, "<": (a, b) => a < b, "<=": (a, b) => a <= b,
  ">": (a, b) => a > b, ">=": (a, b) => a >= b, "+": (a, b) => a + b, "-": (a, b) => a - b,
  "*": (a, b) => a * b, "/": (a, b) => (b === 0 ? NaN : a / b), "**": (a, b) => a ** b,
};

function parse(text, { levels, negation, sign, functions, constants }, names, states, modes) {
  const pattern = /\s*(?:(?<digits>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?!\w)|(?<name>[A-Za-z_]\w*)|\*\*|[<>=!]=|[-+*/()<>,])/y;
  const fail = (at, reason) => { throw new Error(`until, column ${at + 1}: ${reason}`); };
  const end = text.trimEnd().length, tokens = [];
  while (pattern.lastIndex < end) {
    const begin = pattern.lastIndex + text.slice(pattern.lastIndex).search(/\S/), found = pattern.exec(text);
    if (!found) fail(begin, `cannot read ${JSON.stringify(text[begin])}`);
    const word = found[0].trim();
    tokens.push({ word, ...found.groups, at: pattern.lastIndex - word.length });
  }
  let next = 0;
  const here = () => tokens[next] ?? { word: "", at: end };
  const take = (words, wanted) => (words.includes(here().word) ? tokens[next++].word : wanted && fail(here().at, `expected ${wanted}`));
  // A part is a truth value or a number; brackets may contain either, so it is checked where it is used.
  const as = (truth, part) => (Boolean(part.truth) === truth ? part.f
    : fail(part.at, truth ? "a comparison is needed, for example v > 0" : "a number is needed"));

  function expression(level) {
    let left = prefix();
    for (;;) {
      const { word, at } = here(), own = levels[word];
      if (word === "==" || word === "!=") fail(at, "only < <= > >= compare numbers; == is for state(1) == name");
      if (!(own >= level)) return left;
      next += 1;
      const right = expression(word === "**" ? sign : own + 1), f = OPERATIONS[word], logic = own < negation;
      const compares = own === levels["<"], before = compares && left.last && left.f; // a < b < c is a < b and b < c
      const a = before ? left.last : as(logic, left), b = as(logic, right);
      const now = (row) => f(a(row), b(row));
      left = { at: left.at, truth: logic || compares, f: before ? (row) => before(row) && now(row) : now, last: compares && b };
    }
  }

  function prefix() {
    const { word, digits, name, at } = here();
    next += 1;
    if (digits) return { at, truth: false, f: () => Number(digits) };
    if (word === "-" || word === "+") {
      const f = as(false, expression(sign));
      return { at, truth: false, f: word === "-" ? (row) => -f(row) : f };
    }
    if (word === "not") {
      const f = as(true, expression(negation));
      return { at, truth: true, f: (row) => !f(row) };
    }
    if (word === "(") {
      const { truth, f } = expression(1);
      take([")"], "a closing bracket");
      return { at, truth, f };
    }
    if (word === "state") return inState(at);
    if (Object.hasOwn(constants, word)) return { at, truth: false, f: () => constants[word] };
    if (Object.hasOwn(functions, word)) return call(word, at);
    if (name && Object.hasOwn(names, name)) return { at, truth: false, f: names[name] };
    return fail(at, word ? `unknown ${JSON.stringify(word)}; names are ${Object.keys(names).join(", ")}` : "the text ends too early");
  }

  function call(name, at) {
    const parts = [], f = name === "sgn" ? Math.sign : Math[name];
    take(["("], `${name}(...)`);
    do parts.push(as(false, expression(1))); while (take([","]));
    take([")"], "a closing bracket");
    if ((functions[name] === "one") !== (parts.length === 1)) fail(at, `${name} got ${parts.length} arguments`);
    return { at, truth: false, f: (row) => f(...parts.map((part) => part(row))) };
  }

  function inState(at) {
    take(["("], "state(1) == name");
    const mode = modes[take(modes.map((_, i) => String(i + 1)), `an element, 1 to ${modes.length}`) - 1];
    take([")"], "a closing bracket");
    const equal = take(["==", "!="], "== or !=") === "==", state = states.indexOf(take(states, `a state: ${states.join(", ")}`));
    return { at, truth: true, f: (row) => (mode[row] === state) === equal };
  }

  const f = as(true, expression(1));
  return next < tokens.length ? fail(here().at, `cannot be read from ${JSON.stringify(here().word)}`) : f;
}
