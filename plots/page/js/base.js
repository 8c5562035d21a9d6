"use strict";
// Shared by all parts of the page. All text from the data is inserted as textContent, never as HTML.
let data = JSON.parse(document.getElementById("data").textContent); // a host may send other data later
const $ = (query, root = document) => root.querySelector(query);
const $$ = (query, root = document) => [...root.querySelectorAll(query)];
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

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

const PREFIXES = { "-12": "p", "-9": "n", "-6": "µ", "-3": "m", 0: "", 3: "k", 6: "M", 9: "G" };
const SCALED = new Set(["s", "m", "m/s", "m/s^2", "N", "N/m", "N s/m", "W", "J"]);

// The exponent, a multiple of 3, that suits a size in a unit; 0 for units without prefixes.
function powerOf(size, unit) {
  if (!SCALED.has(unit) || !(size > 0) || !Number.isFinite(size)) return 0;
  return clamp(3 * Math.floor(Math.log10(size * (1 + 1e-12)) / 3), -12, 9);
}

// A value in engineering units: 3.2140 mm.
function eng(u, unit = "", digits = 4) {
  if (!Number.isFinite(u) || u === 0 || !SCALED.has(unit)) return `${u === 0 ? "0" : written(u, digits)} ${unit}`.trim();
  const rounded = Number(u.toPrecision(digits)), power = powerOf(Math.abs(rounded), unit);
  const scaled = rounded / 10 ** power;
  if (Math.abs(scaled) < 1 || Math.abs(scaled) >= 1000) return `${written(u, digits)} ${unit}`; // beyond the prefixes
  return `${scaled.toPrecision(digits).replace("-", "−")} ${PREFIXES[power]}${unit}`;
}

// Names of elements count from 1, as in the log and the debugger.
const nameOf = (contact, element) => `${contact.name || "element"} ${element + 1}`;
