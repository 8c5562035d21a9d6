"use strict";
// What matters here: a bar at each slider says how the first quantity shown of a contact, at the time that is shown, changes
// with its number: p dF/dp, from two runs of this page's engine with a little less and a little more of it. They are made in
// a worker of their own, while nothing moves.
const IDLE = 700; // ms without an input
const LITTLE = 5e-3; // of a number
const MATTERING = `
let latest = 0;
const engines = [];
// The value at a time: a cubic through the rows around it, or what is between two of them where something switches.
function valueAt({ t, microstep, count, fired, log_t, log_machine, log_edge, [data.kind]: table }, width) {
  const at = lastAt(t, data.t), first = Math.min(Math.max(at - 1, 0), Math.max(count - 4, 0)), near = [0, 1, 2, 3].map((k) => first + k);
  const smooth = count > 4 && near.every((row) => microstep[row] === 0 && (row === first || t[row] > t[row - 1]));
  const rows = smooth ? near : [at, Math.min(at + 1, count - 1)].filter((row, k, all) => !k || t[row] > t[all[0]]);
  const part = (row) => rows.reduce((made, other) => (other === row ? made : (made * (data.t - t[other])) / (t[row] - t[other])), 1);
  const switches = log_t.reduce((made, u, k) => (u <= data.t && k < fired ? made + log_machine[k] + "," + log_edge[k] + ";" : made), "");
  return { u: rows.reduce((sum, row) => sum + part(row) * table[row * width + data.place], 0), switches };
}
const lastAt = (values, u) => { let [low, high] = [0, values.length]; while (high - low > 1) { const k = (low + high) >> 1; if (values[k] <= u) low = k; else high = k; } return low; };
let data;
onmessage = async ({ data: asked }) => {
  latest = asked.id;
  const engine = engines[asked.number] ??= new Engine(ENGINES[asked.number]);
  for (const { name, words, value } of asked.dials) {
    const [less, more] = [-1, 1].map((way) => {
      const found = engine.run([...asked.numbers, ...words.map((word) => [word, value * (1 + way * asked.little)])]);
      data = asked;
      return found.stopped ? { u: NaN } : valueAt(found, engine.known.sizes[asked.kind]);
    });
    postMessage({ id: asked.id, name, slope: (more.u - less.u) / (2 * asked.little), same: less.switches === more.switches });
    await new Promise((then) => setTimeout(then)); // something may have changed
    if (latest !== asked.id) return;
  }
  postMessage({ id: asked.id, name: null });
};
`;

const matters = { id: 0, asked: "", found: new Map(), timer: 0, worker: null };

function lookLater() {
  clearTimeout(matters.timer);
  matters.timer = setTimeout(lookNow, IDLE);
}

// Asks for the bars, if something else is shown than when they were asked for last.
function lookNow() {
  if (!runs || live.busy || play.on || drag.with) { lookLater(); return; }
  const [view] = views, name = view.contact.shown[0], [kind, at] = runs[0].recipes[view.contact.values[name]?.all] ?? [], t = frames.t[frame], numbers = wordsNow();
  const key = JSON.stringify([view.contact.name, numbers, live.number, t]);
  if (key === matters.asked) return;
  const { engine } = variant(), tried = [...dials.values()].filter((dial) => dial.first && dial.value && against(dial, dial.value * (1 - LITTLE), dials) + against(dial, dial.value * (1 + LITTLE), dials) === "");
  Object.assign(matters, { asked: key, id: matters.id + 1, found: new Map(), of: { name, t, unit: unitOf(view.contact, name) } });
  showMatters(false);
  if (!["y", "seen"].includes(kind)) return;
  matters.worker ??= inWorker(MATTERING, heardOf);
  const of = ({ name: each, value }) => ({ name: each, words: engine[each], value });
  const changed = tried.map(of), swept = new Set(changed.flatMap(({ words }) => words));
  matters.worker.postMessage({ id: matters.id, number: live.number, numbers: numbers.filter(([word]) => !swept.has(word)).concat(changed.flatMap(({ words, value }) => words.map((word) => [word, value]))), dials: changed, kind, place: at, t, little: LITTLE });
}

function heardOf({ id, name, slope, same }) {
  if (id !== matters.id) return;
  if (name === null) showMatters(true);
  else matters.found.set(name, { slope, same });
}

// The longest bar is that of the largest change; what is less goes to the left.
function showMatters(known) {
  const most = Math.max(0, ...[...matters.found.values()].map(({ slope }) => Math.abs(slope) || 0)), { of: { name: quantity, t, unit } } = matters;
  let largest = "";
  for (const dial of dials.values()) {
    const found = known && matters.found.get(dial.name), bar = (dial.matter ??= make("div", dial.root, "", { class: "matter", role: "img" }));
    bar.hidden = !found || !(most > 0);
    if (bar.hidden) continue;
    const part = (found.slope || 0) / most, [line] = bar.children.length ? bar.children : [make("i", bar)];
    const text = `${dial.name}: ${Number.isFinite(found.slope) ? `${found.slope > 0 ? "+" : ""}${eng(found.slope, unit, 3)}` : "a run stopped"}${found.same ? "" : "; the two runs switch differently"}`;
    bar.setAttribute("aria-label", text);
    bar.title = text;
    bar.classList.toggle("switches", !found.same);
    line.style.left = `${50 + 50 * Math.min(part, 0)}%`;
    line.style.width = `${50 * Math.abs(part)}%`;
    if (Math.abs(part) === 1) largest = text;
  }
  say($("#matters"), largest && `what matters here: p d${quantity}/dp at t = ${timeText(t, 4)}, most ${largest}`);
}

make("output", $("#numbers .acts"), "", { id: "matters", title: "Bars below the sliders: how the quantity changes with each number p, as p times its derivative, to the left where it falls. They are central differences: two runs, with 0.5 % less and more. Hatched where these two switch differently: the difference is one across a switch." });
for (const each of ["input", "change", "pointerup", "keyup", "hashchange"]) addEventListener(each, lookLater);
lookLater();
