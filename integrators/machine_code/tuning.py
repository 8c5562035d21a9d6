"""Which functions of the loop machine code puts inline, and on which it spends most care."""

from __future__ import annotations

import platform

# Functions that run once per arc, once per event, or never in most runs, and one that is long. Not
# putting them inline saves a third of the compilation and costs nothing; with those of the bracket
# it does.
NOT_INLINE = [
    "arm", "normal", "switch", "tick", "solve", "slope_on", "seize", "look",
    "scaled_size", "starting_step", "retry_factor", "next_on_grid", "longest_next",
    "_search", "_put_firing", "_put_stop", "_begin_arc", "_choose_stop", "_fired",
    "_finish", "_jump", "_list", "_make_due", "_no_progress", "_often_changed",
    "only_new", "cut", "only_let_go", "_pick", "jolted", "arrived", "jolts", "_act",
    "_refuse", "_count", "_rearm", "_reset_counts", "_reset_if_advanced", "_start",
    "advance", "_begin", "_impulse", "step_to",
    "arm_on", "drop", "entangled", "let_go", "look_back", "look_held", "release", "_ask", "_bears",
    "_along", "arrive", "fix", "observe_alike", "slide_in_lanes", "margins_in_lanes", "_await",
    "_combine", "crossed", "_is_far", "leave", "let_go_in_time", "_values",
    "aimed_step", "_changed", "_close_few", "_first_step", "steps_to_change",
]  # fmt: skip
# A step calls the flow seven times. Inline, the slopes stay in registers: a tenth of the time. Each
# row is observed: a tenth of the time, too.
ALWAYS = (
    "flow", "flow_live", "flow_on", "observe", "weighted_sum",
    "copy_words", "keep_words", "take_words",  # there it is known that they do not overlap
)  # fmt: skip
INLINE = dict.fromkeys(NOT_INLINE, False) | dict.fromkeys(ALWAYS, True)
# Arrays that nothing else that these functions are given overlaps: what is read stays in registers.
APART = {"observe_alike": ("seen", "table")}
# Every step calls these. If the first entry of an object is among them, all its functions are.
HOT = {
    "advance", "advance_by", "peek_by", "_along", "first_change", "_bracket", "_error",
    "interpolate", "margins", "observe_free", "_probe", "rate_in_lanes", "_search",
    "slope_in_lanes", "switch", "take_step",
}  # fmt: skip
# It is called in the midst of a step and saves the registers it uses: its callers use nearly all.
# Other processors have no such calls.
HAS_SUCH = platform.machine().lower() in ("x86_64", "amd64", "aarch64", "arm64")
KEEPING = {"exp"} if HAS_SUCH else set[str]()
# What these compute side by side is side by side in all loops over the state.
FLOWS = {"flow", "flow_live"}
# These read at once what a flow has just stored: side by side where it has stored it so.
WITH_FLOWS = {"take_step", "weighted_sum"}
# In these it is rows that are side by side; LLVM finds that itself.
IN_ROWS = {"observe", "observe_alike"}
# Here arrays of different names are different arrays, also where that cannot be seen.
DISTINCT = {"fit_dense", "interpolate", "margins"} | FLOWS | WITH_FLOWS
