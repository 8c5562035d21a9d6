"use strict";
// A page inside another document, its host, for example a notebook's widget: the host sends data to show and times to go
// to, and is told what is shown. Nothing is told before the host has sent one of these. A host may also choose the theme.
let hosted = false, told = "";

// A picture is read as XML, and the policy of the page keeps scripts in it from running.
function adopt(pictures) {
  for (const old of $$("template[id^=chart]")) old.remove();
  pictures.forEach((text, k) => {
    const template = make("template", document.body, "", { id: `chart${k}` });
    const { documentElement: svg } = new DOMParser().parseFromString(text, "image/svg+xml");
    if (svg.localName === "svg") template.content.append(document.adoptNode(svg));
    else make("p", template.content, svg.textContent);
  });
}

addEventListener("message", ({ source, data: sent }) => {
  if (source !== parent || parent === window) return;
  if (sent?.theme === "light" || sent?.theme === "dark") {
    document.documentElement.dataset.theme = sent.theme;
    eachPlots((pane) => pane.recolour());
  }
  if (!sent?.load && !Number.isFinite(sent?.go)) return;
  if (sent?.load) {
    adopt(sent.load.charts);
    load(sent.load.data);
  }
  if (Number.isFinite(sent?.go)) go(Math.max(lastAt(frames.t, sent.go), 0));
  hosted = true;
  told = "";
  tell();
});

// What is shown, of each run: where, and the values that can be changed there.
function tell() {
  if (!hosted || play.on) return;
  const shown = views.map(({ run, row, contact, element }) => ({
    number: run.number[row], between: run.between[row] !== 0, microstep: run.microstep[row], t: run.t(row), contact: contact.name, element,
    contacts: run.contacts.map((each) => ({
      name: each.name, states: each.modes.map((mode) => each.states[mode[row]]), v: each.value(each.velocity, 0, row) ?? null,
      values: Object.fromEntries(each.variables.map((name) => [name, each.modes.map((_, i) => each.value(name, i, row))])),
    })),
  }));
  const now = { t: frames.t[frame], shown, first: runs.length > 1 ? { t: first.frame === null ? null : frames.t[first.frame], told: first.told } : null };
  const text = JSON.stringify(now);
  if (text === told) return;
  told = text;
  parent.postMessage({ told: now }, "*"); // a sandboxed page does not know its host's origin
}
