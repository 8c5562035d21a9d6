"use strict";
// Thresholds and masses are dragged in the pictures: what moves is the number behind them. What a threshold depends on is
// asked of the guards; nothing here knows a rule.
const NEAR = 8; // px from the boundary of a clause
const DECADE = 300; // px that change a mass tenfold
const drag = { with: null }; // what follows the pointer

// ------------------------------------------------------------------ thresholds, in the landscape
// Calls a function while numbers have other values for guards and the curve.
function meanwhile(contact, name, value, f) {
  const curve = contact.curve?.numbers, inCurve = curve && Object.hasOwn(curve, name), before = inCurve && curve[name];
  if (inCurve) curve[name] = value;
  try { return f(inCurve ? {} : { [name]: value }); } finally { if (inCurve) curve[name] = before; }
}

// The margin of a clause at a point, with another value of one number.
function marginAt(pane, clause, [x, y], name = "", value = 0) {
  const { plane, points, view: { contact, element }, asked } = pane;
  return meanwhile(contact, name, value, (given) => {
    const scope = contact.scopeWith(element, asked.row, { ...given, [points.v]: plane.acrossAt(x), [points.z]: plane.upAt(y) });
    return valueOf((each) => clause.left(each) - clause.right(each), scope);
  });
}

const dialOf = (contact, name, element) => {
  const whole = `${contact.name ? `${contact.name}.` : ""}${name}`, own = dials.get(`${whole}${/[\d_]$/.test(whole) ? "_" : ""}${element + 1}`);
  return own && !own.all ? own : dials.get(whole) && !Number.isNaN(dials.get(whole).value) ? dials.get(whole) : own;
};

// The clause whose boundary is near a point, with the number that moves it most.
function thresholdAt(pane, at) {
  const { points, view: { contact, element } } = pane;
  if (!points) return null;
  for (const clause of points.edges.flatMap((k) => contact.edges[k].clauses).filter(({ op }) => op)) {
    const sides = [[0, NEAR], [NEAR, 0]].map(([dx, dy]) => [[-dx, -dy], [dx, dy]].map(([a, b]) => marginAt(pane, clause, [at[0] + a, at[1] + b])));
    if (!sides.some(([a, b]) => a * b <= 0)) continue;
    const names = points.readBy([clause.tree]), curve = names.has("s") ? Object.keys(contact.curve?.numbers ?? {}) : [];
    const found = [...names, ...curve].map((name) => ({ name, dial: dialOf(contact, name, element) })).filter(({ dial }) => dial && dial.value !== 0)
      .map((each) => ({ ...each, clause, effect: Math.abs(marginAt(pane, clause, at, each.name, 1.01 * each.dial.value) - marginAt(pane, clause, at, each.name, each.dial.value)) }))
      .filter(({ effect }) => effect > 0).sort((a, b) => b.effect - a.effect);
    if (found.length) return found[0];
  }
  return null;
}

// The value of the number for which the boundary passes through a point: a secant, kept within the slider.
function through(pane, { clause, name, dial }, at) {
  const margin = (u) => marginAt(pane, clause, at, name, u);
  let [a, b] = [dial.value, 1.01 * dial.value], [fa, fb] = [margin(a), margin(b)];
  for (let k = 0; k < 30 && fb !== fa && Number.isFinite(fb); k++) [a, b, fa, fb] = [b, clamp(b - (fb * (b - a)) / (fb - fa), dial.low, dial.high), fb, NaN].map((u, i, all) => (i === 3 ? margin(all[1]) : u));
  return Number(b.toPrecision(4));
}

const landscapeOf = (target) => (target.closest?.(".pane.landscape .plane") && !target.closest(".probe") ? views[0].open.right : null);

// ------------------------------------------------------------------ the mass, in the bristles
function massAt(target) {
  const name = target.closest?.(".pane.bristles .slider") && variant().masses[views[0].contact.name];
  return name && dials.get(name);
}

// ------------------------------------------------------------------ the pointer; panes may be made anew meanwhile
function pick(event) {
  const pane = landscapeOf(event.target), mass = massAt(event.target);
  if (mass) return { name: mass.name, to: ({ clientX }) => clamp(Number((mass.value0 * 10 ** ((clientX - event.clientX) / DECADE)).toPrecision(4)), mass.low, mass.high), dial: Object.assign(mass, { value0: mass.value }) };
  const found = pane && thresholdAt(pane, pane.plane.point(event));
  return found && { ...found, to: (moved) => { const now = views[0].open.right; return through(now, found, now.plane.point(moved)); } };
}

addEventListener("pointerdown", (event) => {
  if (!runs || event.button) return;
  drag.with = pick(event);
  if (!drag.with) return;
  document.body.classList.add("dragging");
  event.preventDefault();
  event.stopPropagation();
}, true);
addEventListener("pointermove", (event) => {
  if (!drag.with) {
    const pane = runs && landscapeOf(event.target);
    if (pane) pane.plane.svg.style.cursor = thresholdAt(pane, pane.plane.point(event)) ? "move" : "";
    return;
  }
  turn(dials.get(drag.with.dial.name), drag.with.to(event));
}, true);
for (const end of ["pointerup", "pointercancel"]) {
  addEventListener(end, () => {
    if (!drag.with) return;
    drag.with = null;
    document.body.classList.remove("dragging");
    changed();
    addEventListener("click", (event) => event.stopPropagation(), { capture: true, once: true }); // that ends the drag
    setTimeout(() => dispatchEvent(new Event("click")));
  }, true);
}
addEventListener("touchstart", (event) => { if (drag.with) event.preventDefault(); }, { passive: false, capture: true }); // else the page scrolls
