"use strict";
// The list of transitions.
const MOST_OPTIONS = 2000;

class LogPane {
  static side = "left"; static key = "log"; static title = "Transitions";

  constructor(view, box) {
    Object.assign(this, { view, first: -1 });
    box.classList.add("log");
    this.list = make("select", box, "", { size: 12, "aria-label": `Transitions (${view.run.log.length})` });
    this.list.addEventListener("change", () => go(frames.of[view.place][this.entries[this.list.selectedIndex].row]));
  }

  // A long list is cut to the part around the row.
  show() {
    const { run, row } = this.view, at = run.log.findLastIndex((entry) => entry.row <= row);
    const first = run.log.length <= MOST_OPTIONS ? 0 : clamp(Math.floor(at / 1000) * 1000 - 500, 0, run.log.length - MOST_OPTIONS);
    if (first !== this.first) {
      this.first = first;
      this.entries = run.log.slice(first, first + MOST_OPTIONS);
      this.list.replaceChildren();
      for (const entry of this.entries) make("option", this.list, `${timeText(entry.t, 8)}  ${entry.contact.sentence(entry)}`);
    }
    this.list.selectedIndex = run.log[at]?.row === row ? at - first : -1;
  }
}
PANES.push(LogPane);
