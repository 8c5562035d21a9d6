"use strict";
// The `until` box: a condition on stored values, in the expression language of gms-fsm. It is the only text that
// Python has not seen. It becomes a tree like those that Python stores, so both are evaluated by the same function.
// Precedence, functions and constants come from Python; nothing is ever passed to `eval`.
const CURES = {
  "=": ": write == for a state, <= or >= for a number", "&": ": write and", "|": ": write or, or abs(...)", "!": ": write not",
  "^": ": write **", ",": ": a number has a decimal point", ";": ": write and between two conditions",
};

function parse(text, { levels, negation, sign, functions, constants, units }, names, owners, unitIn) {
  const known = Object.keys(units).sort((a, b) => b.length - a.length).join("|"); // mm/s before m
  const number = `(?<digits>(?:\\d+\\.?\\d*|\\.\\d+)(?:[eE][+-]?\\d+)?)(?:\\s*(?<unit>${known}))?(?!\\w)`;
  const pattern = new RegExp(`\\s*(?:${number}|(?<name>[A-Za-z_]\\w*(?:\\.[A-Za-z_]\\w*)*)|\\*\\*|[<>=!]=|[-+*/()<>,])`, "y");
  text = text.replace(/[µμ]/g, "u");
  const fail = (at, reason) => { throw new SyntaxError(`until, column ${at + 1}: ${reason}`); };
  const end = text.trimEnd().length, tokens = [];
  while (pattern.lastIndex < end) {
    const begin = pattern.lastIndex + text.slice(pattern.lastIndex).search(/\S/), found = pattern.exec(text);
    if (!found) fail(begin, `cannot read ${JSON.stringify(text[begin])}${CURES[text[begin]] ?? ""}`);
    const word = found[0].trim();
    tokens.push({ word, ...found.groups, at: pattern.lastIndex - word.length });
  }
  // A unit must be one of the quantity that its clause compares.
  const ends = (k) => !tokens[k] || ["and", "or", "not"].includes(tokens[k].word);
  tokens.forEach(({ unit, word, at }, k) => {
    if (!unit) return;
    let from = k, to = k;
    while (!ends(from - 1)) from -= 1;
    while (!ends(to + 1)) to += 1;
    const wanted = tokens.slice(from, to + 1).map(({ name }) => name && unitIn(name)).find(Boolean);
    if (wanted && wanted !== units[unit][1]) fail(at, `${word} is not in ${wanted}`);
  });
  let next = 0;
  const here = () => tokens[next] ?? { word: "", at: end };
  const take = (words, wanted) => (words.includes(here().word) ? tokens[next++].word : wanted && fail(here().at, `expected ${wanted}`));
  // A part is a truth value or a number; brackets may contain either, so it is checked where it is used.
  const as = (truth, part) => (Boolean(part.truth) === truth ? part.tree
    : fail(part.at, truth ? "a comparison is needed, for example v > 0" : "a number is needed"));

  function expression(level) {
    let left = prefix();
    for (;;) {
      const { word, at } = here(), own = levels[word];
      if (!(own >= level)) return left;
      next += 1;
      const right = expression(word === "**" ? sign : own + 1), logic = own < negation, compares = own === levels["<"];
      const chain = compares && left.last; // a < b < c is a < b and b < c
      const b = as(logic, right), a = chain ? left.last : as(logic, left);
      const now = word === "==" || word === "!=" ? equal(a, b, word, at) : [word, a, b];
      left = { at: left.at, truth: logic || compares, tree: chain ? ["and", left.tree, now] : now, last: compares && b };
    }
  }

  function prefix() {
    const { word, digits, unit, name, at } = here();
    next += 1;
    if (digits) return { at, tree: Number(digits) * (unit ? units[unit][0] : 1) };
    if (word === "-" || word === "+") {
      const tree = as(false, expression(sign));
      return { at, tree: word === "-" ? ["-", tree] : tree };
    }
    if (word === "not") return { at, truth: true, tree: ["not", as(true, expression(negation))] };
    if (word === "(") {
      const { truth, tree } = expression(1);
      take([")"], "a closing bracket");
      return { at, truth, tree };
    }
    if (Object.hasOwn(owners, word)) return inState(at, owners[word]);
    if (Object.hasOwn(constants, word)) return { at, tree: constants[word] };
    if (Object.hasOwn(functions, word)) return call(word, at);
    if (name && Object.hasOwn(names, name)) return { at, tree: name };
    const near = Object.keys(names).find((each) => each.toLowerCase() === word.toLowerCase());
    return fail(at, word ? `unknown ${JSON.stringify(word)}; ${near ? `did you mean ${JSON.stringify(near)}? ` : ""}names are ${Object.keys(names).join(", ")}` : "the text ends too early");
  }

  function call(name, at) {
    const parts = [];
    take(["("], `${name}(...)`);
    do parts.push(as(name === "if" && !parts.length, expression(1))); while (take([","]));
    take([")"], "a closing bracket");
    const right = functions[name] ? parts.length === functions[name] : parts.length > 1; // several
    if (!right) fail(at, `${name} got ${parts.length} arguments`);
    const [a, b, c] = parts;
    if (name === "mod") return { at, tree: ["-", a, ["*", b, ["floor", ["/", a, b]]]] };
    if (name === "quantise") return { at, tree: ["*", b, ["round", ["/", a, b]]] };
    if (name === "noise") return { at, tree: ["noise", ["floor", a], ["floor", b]] };
    if (name === "saturate") return { at, tree: ["min", ["max", a, b], c] };
    return { at, tree: [name, ...parts] };
  }

  const whole = (tree) => {
    if (!Array.isArray(tree)) return Number.isInteger(tree);
    const [op, ...parts] = tree;
    return ["floor", "round", "sgn"].includes(op)
      || (["+", "-", "*", "abs", "min", "max", "if"].includes(op) && parts.slice(op === "if" ? 1 : 0).every(whole));
  };

  function equal(a, b, word, at) {
    if (!whole(a) || !whole(b)) fail(at, "only < <= > >= compare numbers; == is for whole ones, as round(x) == 2, and state(1) == name");
    const same = ["and", ["<=", a, b], [">=", a, b]];
    return word === "==" ? same : ["not", same];
  }

  function inState(at, { place, n, states }) {
    take(["("], "state(1) == name");
    const numbers = Array.from({ length: n }, (_, i) => String(i + 1));
    const element = take(numbers, `an element, 1 to ${n}`) - 1;
    take([")"], "a closing bracket");
    const equal = take(["==", "!="], "== or !=") === "==", state = take(states, `a state: ${states.join(", ")}`);
    const tree = ["state", `${place}/${element}`, state];
    return { at, truth: true, tree: equal ? tree : ["not", tree] };
  }

  const tree = as(true, expression(1));
  return next < tokens.length ? fail(here().at, `cannot be read from ${JSON.stringify(here().word)}${CURES[here().word] ?? ""}`) : tree;
}

// A condition typed by the user, as a function of the row of a run; throws a SyntaxError with a message.
function condition(text, run) {
  const owners = {};
  run.contacts.forEach(({ name, n, states }, place) => {
    owners[name ? `${name}.state` : "state"] = { place, n, states };
    if (run.contacts.length === 1) owners.state = { place, n, states };
  });
  const unitIn = (name) => { // of bodies it is not declared
    const [last, ...owner] = name.split(".").reverse(), contact = run.contacts.find((each) => each.name === owner.join("."));
    return run.system && !owner.length ? "" : contact ? unitOf(contact, last) || unitOf(contact, last.replace(/\d+$/, "")) : "";
  };
  const f = compiled(parse(text, data.language, run.names, owners, unitIn));
  const scope = (row) => (name) => {
    const state = /^state\((\d+)\/(\d+)\)$/.exec(name);
    if (!state) return run.names[name](row);
    const contact = run.contacts[state[1]];
    return contact.states[contact.modes[state[2]][row]];
  };
  return (row) => truthOf(f, scope(row)) === 1;
}
