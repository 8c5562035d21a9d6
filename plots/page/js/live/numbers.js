"use strict";
// The numbers that can be changed: a slider each, and a box that takes a number with a unit. A value is the number written,
// exactly; of a slider it has four digits.
const dials = new Map(); // by name
const SLIDER_STEPS = 1000;
const HOLDS = { ">": (a, b) => a > b, ">=": (a, b) => a >= b, "<": (a, b) => a < b, "<=": (a, b) => a <= b };
const IN_WORDS = { ">": "greater than", ">=": "at least", "<": "less than", "<=": "at most" };

// A number as typed, in SI; NaN if it is none, or in a unit of something else.
function typed(text, unit) {
  const found = /^\s*([-+−]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+−]?\d+)?)\s*([^\d\s].*)?$/.exec(text);
  if (!found) return NaN;
  const u = Number(found[1].replaceAll("−", "-")), name = found[2]?.trim().replace(/[µμ]/g, "u");
  if (!name || name === unit) return u;
  const known = data.language.units[name];
  return known && known[1] === unit ? u * known[0] : NaN;
}

// A number exactly, in few letters.
const exactly = (u) => (u !== 0 && (Math.abs(u) < 1e-3 || Math.abs(u) >= 1e6) ? u.toExponential().replace("e+", "e") : String(u));

class Dial {
  constructor(box, given, changed) {
    Object.assign(this, given, { given, changed, value: given.value });
    const { name, unit, meaning } = given, named = unit && unit !== "1" ? `${name} [${unit}]` : name;
    this.root = make("div", box, "", { class: "dial", "data-name": name });
    const id = `dial-${name}`;
    make("label", this.root, named, { for: id, title: [meaning, ...this.limits()].filter(Boolean).join("; ") });
    this.box = make("input", this.root, "", { type: "text", size: 9, inputmode: "decimal", spellcheck: "false", autocomplete: "off", "aria-label": `${named}, exact`, "aria-describedby": "refused" });
    this.range = make("input", this.root, "", { type: "range", min: 0, max: SLIDER_STEPS, step: 1, id, "aria-describedby": "refused" });
    this.range.addEventListener("input", () => this.turn(this.valueAt(Number(this.range.value))));
    this.box.addEventListener("change", () => this.type(this.box.value));
    this.show();
  }

  // Another box for the number, in a guard.
  link(box) { this.linked = [...(this.linked ?? []).filter((each) => each.isConnected), box]; this.renewed = true; this.show(); }

  limits() { return this.rule.map(([op, limit]) => `${IN_WORDS[op]} ${limit}`); }

  valueAt(step) {
    if (step >= SLIDER_STEPS) return this.high;
    if (step <= 0) return this.low;
    const part = step / SLIDER_STEPS, u = this.log ? this.low * (this.high / this.low) ** part : this.low + part * (this.high - this.low);
    return Number(u.toPrecision(4));
  }

  turn(u) { this.changed(this, u); }

  type(text) {
    const { name, unit } = this, u = typed(text, unit);
    if (Number.isNaN(u)) refuse(this, `${name}: ${JSON.stringify(text)} is not a number${unit && unit !== "1" ? `, or not in ${unit}` : ""}${/^\s*-?\d+,\d+/.test(text) ? `: a number has a decimal point, ${text.trim().replace(",", ".")}` : ""}`);
    else this.turn(u);
  }

  // The value, where the slider has it and the box names it.
  show() {
    const { value: u, low, high, log, unit } = this;
    if (Object.is(this.told, u) && this.box.value === this.text && !this.renewed) return;
    const part = log ? Math.log(u / low) / Math.log(high / low) : (u - low) / (high - low);
    this.range.value = Math.round(SLIDER_STEPS * clamp(Number.isNaN(part) ? 0 : part, 0, 1));
    this.range.setAttribute("aria-valuetext", eng(u, unit === "1" ? "" : unit, 4));
    if (document.activeElement !== this.box || this.box.getAttribute("aria-invalid") !== "true") this.box.value = Number.isNaN(u) ? "" : exactly(u);
    for (const box of this.linked ?? []) box.value = exactly(u);
    this.root.classList.toggle("changed", u !== this.given.value);
    Object.assign(this, { told: u, text: this.box.value, renewed: false });
  }
}

// What a rule says against a value, in words; empty if it holds. Other numbers are named by rules as their owner names them.
function against(dial, u, numbers) {
  const { name, owner, element, rule } = dial;
  if (!Number.isFinite(u)) return `${name} must be a finite number`;
  for (const [op, limit] of rule) {
    const other = typeof limit === "number" ? limit : limitOf(numbers, owner, limit, element);
    if (other !== undefined && !HOLDS[op](u, other)) return `${name} must be ${IN_WORDS[op]} ${typeof limit === "number" ? limit : `${limit}, ${other}`}`;
  }
  for (const [, each] of numbers) { // rules of others that name this one
    if (each.owner !== owner) continue;
    for (const [op, limit] of each.rule) {
      if (typeof limit === "string" && limitOf(numbers, owner, limit, null, true) === dial && !HOLDS[op](each.value, u)) return `${each.name} must be ${IN_WORDS[op]} ${name}, and is ${each.value}`;
    }
  }
  return "";
}

function limitOf(numbers, owner, limit, element, whole = false) {
  const found = numbers.get(owner ? `${owner}.${limit}` : limit) ?? numbers.get(`${owner ? `${owner}.` : ""}${limit}${(element ?? 0) + 1}`);
  return whole ? found : found?.value;
}

// The numbers that a clause of a guard reads can be changed where they stand.
hooks.clause = (cell, contact, clause) => {
  const dialFor = (name) => (Object.hasOwn(contact.parameters, name) ? dials.get(contact.name ? `${contact.name}.${name}` : name) : undefined);
  const known = [...namesIn(clause.tree)].filter((name) => dialFor(name) && !Number.isNaN(dialFor(name).value));
  for (const name of known) {
    make("wbr", cell);
    const dial = dialFor(name), label = make("label", cell, known.length > 1 ? ` ${name} ` : " ", { class: "in-guard" });
    const box = make("input", label, "", { type: "text", size: 7, inputmode: "decimal", spellcheck: "false", autocomplete: "off", "aria-label": `${name} in this guard` });
    box.addEventListener("change", () => dials.get(dial.name).type(box.value));
    dial.link(box);
  }
};
