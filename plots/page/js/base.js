"use strict";
// Shared by all parts of the page. All text from the data is inserted as textContent, never as HTML.
let data = JSON.parse(document.getElementById("data").textContent); // a host may send other data later
const $ = (query, root = document) => root.querySelector(query);
const $$ = (query, root = document) => [...root.querySelectorAll(query)];

// A colour of the style sheet. To ask for one may compute all styles anew: each is asked for once a picture, and while a run
// changes with every picture once.
let colours = null;
function colour(name) {
  if (!colours) {
    colours = new Map();
    if (!sketching) setTimeout(() => { colours = null; });
  }
  if (!colours.has(name)) colours.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return colours.get(name);
}

function make(tag, parent, text = "", attributes = {}) {
  const node = document.createElement(tag);
  node.textContent = text;
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  parent.append(node);
  return node;
}

// An SVG node; numbers are rounded to a hundredth of a pixel.
function draw(tag, parent, attributes = {}, text = "") {
  const node = document.createElementNS("http://www.w3.org/2000/svg", tag);
  place(node, attributes);
  if (text) node.textContent = text;
  parent.append(node);
  return node;
}

function place(node, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    node.setAttribute(name, typeof value === "number" ? String(Math.round(value * 100) / 100) : value);
  }
}

// Changes a text only if it is another one: a change costs a layout, and is read aloud where a node is live.
function say(node, text) { if (node.textContent !== text) node.textContent = text; }

// What a page with more scripts adds to a clause in the table of guards.
const hooks = { clause: () => {} };

const counted = (number, noun) => `${number} ${noun}${number === 1 ? "" : "s"}`;

// How many times as large a presentation shows what is in `main`, by CSS: sizes of nodes are in px before, places of the mouse
// in px after.
let large = 1;

const clamp = (u, low, high) => Math.min(Math.max(u, low), high);

// The last index whose value is not above u, in an increasing array; -1 if there is none.
function lastAt(values, u) {
  let low = -1, high = values.length;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (values[middle] <= u) low = middle;
    else high = middle;
  }
  return low;
}

// ------------------------------------------------------------------ numbers as text
function written(u, digits = 5) {
  if (Number.isNaN(u)) return "not a number";
  if (!Number.isFinite(u)) return u > 0 ? "infinite" : "−infinite";
  const size = Math.abs(u), plain = size === 0 || (size >= 1e-3 && size < 1e6);
  return (plain ? u.toPrecision(digits) : u.toExponential(digits - 2)).replaceAll("-", "−");
}

// Prefixes by power of ten, and the units that take one: those of gms_fsm.foundation.quantities, as is the rule below.
const { prefixes: PREFIXES, smallest: LEAST_POWER } = data.quantities, PREFIXED = new RegExp(`^(?:${data.quantities.prefixed})`);

// The power of ten, a multiple of 3, that suits a size in a unit; 0 for units without prefixes, and beyond the prefixes.
function powerOf(size, unit) {
  if (!PREFIXED.test(unit) || !(size > 0) || !Number.isFinite(size)) return 0;
  const power = 3 * Math.floor((Math.log10(Number(size.toPrecision(4))) + 1e-12) / 3);
  return power in PREFIXES ? power : 0;
}

// A value in the unit of its place, with the prefix of a power of ten: 3.214 mm.
function inUnit(u, unit, power, digits = 4) {
  const named = `${PREFIXES[power]}${unit}`;
  if (!Number.isFinite(u) || u === 0) return `${u === 0 ? "0" : written(u)} ${named}`.trim();
  const scaled = Number(u.toPrecision(digits)) / 10 ** power, size = Math.floor(Math.log10(Math.abs(scaled)) + 1e-12);
  const plain = size >= LEAST_POWER && size < Math.max(digits, power ? 3 : 0);
  return `${plain ? scaled.toFixed(Math.max(0, digits - 1 - size)) : scaled.toExponential(digits - 1)} ${named}`.replaceAll("-", "−").trim();
}

// A value that stands alone, in the unit that suits it.
const eng = (u, unit = "", digits = 4) => inUnit(u, unit, powerOf(Math.abs(u), unit), digits);

// Names of elements count from 1, as in the log and the debugger.
const nameOf = (contact, element) => `${contact.name || "element"} ${element + 1}`;
