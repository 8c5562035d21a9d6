"""Make the pages in docs/zoo, one per included chart, with their pictures in docs/images/zoo.

Everything on a page comes from the chart: text and references from the docstring of its file,
equations, parameters, picture, proofs, and a run. Run it with ``make gallery``.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import re
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import get_args

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import plots
from gms_fsm import Chart, Trace, prove
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts.parameters import ANY, Parameter, with_shared
from gms_fsm.charts.registry import Demonstration, Entry, registered_modules
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.foundation.files import write_whole
from gms_fsm.foundation.quantities import scale_of
from gms_fsm.language import latex_name
from gms_fsm.traces.failures import StepLimitError
from gms_fsm.verification.findings import Report, Status
from plots import figures, panels
from plots.style import INK, LINE_GREY, RC, compared_look

DOCS = Path(__file__).parent
PAGES = DOCS / "zoo"
PICTURES = DOCS / "images" / "zoo"

T_END = 12.0  # s: one cycle of stick-slip
MOST_STEPS = 100_000  # of a run
# m/s: two steps, a hold at rest, and sliding again
DRIVEN = "if(t < 2, 1e-4, if(t < 5, 1e-5, if(t < 7, 1e-4, if(t < 10, 0, 1e-4))))"
PULLED = "0.1 * t"  # m, the end of the spring
SWUNG = "2 * sin(0.7 * t)"  # m, for laws that differ for v < 0
GROWING = "5e-6 * t * cos(2 * t)"  # m/s
LOOPS = ("bouc-wen", "dahl")  # models of pre-sliding: strokes that grow, and F over x
WINDOWS = {  # s, shown of a run, and why
    "seven-parameter": (
        (7.0, 10.14),
        "Shown is the first slip: later the mass vibrates on its spring `k_t`, at about 50 Hz.",
    )
}
CURVE = Stribeck(1.0, 1.0, 1.0).text
INTRODUCTION = """# The friction zoo

Friction models from the literature, and other contacts that switch. Each is a chart in one file of
`gms_fsm/charts`. Its page says what it can show and what it cannot, and has its picture, equations
and parameters, a run, the proofs and the references.

`docs/make_zoo.py` makes these pages from the charts (`make gallery`).
[Add a model](../howto/add-a-model.md) shows how to add one.
"""


@dataclass(frozen=True, eq=False)
class Item:
    """A chart and what its page needs.

    Parameters
    ----------
    name : str
        Key in `gms_fsm.charts.CHARTS`.
    law : str
        Its law, if the entry has several.
    entry : Entry
        Entry in the registry.
    file : str
        File name in ``gms_fsm/charts``.
    text : str
        Docstring of that file.
    """

    name: str
    law: str
    entry: Entry
    file: str
    text: str

    @property
    def chart(self) -> Chart:
        """The chart."""
        return self.entry.chart(self.law)

    @property
    def title(self) -> str:
        """Heading of the page."""
        return self.entry.title + f", {self.law} law" * bool(self.law)

    @property
    def about(self) -> str:
        """Docstring without the references, as Markdown."""
        text = self.text.partition("\n\nReferences\n")[0]
        return re.sub(r"::\n\n(?= )", ":\n\n", text)  # a literal block

    @property
    def summary(self) -> str:
        """First sentence of the docstring."""
        return " ".join(self.about.partition("\n\n")[0].split())

    @property
    def references(self) -> str:
        """References of the docstring, as a list in Markdown."""
        found = self.text.partition("\n\nReferences\n")[2].partition("\n")[2]
        # A reference begins with [1], or with initials after the end of another sentence.
        parts = re.split(r"^\.\. \[\d+\] |\n\n|(?<=\.)\n(?=[A-Z]\.[ -])", found, flags=re.MULTILINE)
        return "\n".join(f"- {' '.join(part.split())}" for part in parts if part.strip())


@functools.cache
def items() -> tuple[Item, ...]:
    """Return the charts that are models, in the order of their names."""
    found = []
    for module in registered_modules():
        page = importlib.import_module(module)
        file = module.removeprefix("gms_fsm.charts.").replace(".", "/") + ".py"
        for each in getattr(page, "CHARTS", ()):
            if isinstance(each, Entry) and not each.wrong:
                for law in each.laws or ("",):
                    name = "-".join(filter(None, (each.name, law)))
                    text = inspect.getdoc(page) or ""
                    found.append(Item(name, law, each, file, text))
    return tuple(sorted(found, key=lambda item: item.name))


# --------------------------------------------------------------------------- parts of a page
def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> list[str]:
    """Return the lines of a table, without the columns that are empty in all rows."""
    names, body = tuple(head), [tuple(row) for row in rows]
    kept = [i for i in range(len(names)) if any(row[i] for row in body)]
    every = [names, ("---",) * len(names), *body]
    return [f"| {' | '.join(row[i].replace('|', chr(92) + '|') for i in kept)} |" for row in every]


def code(text: str) -> str:
    """Return a text as code; nothing for an empty one."""
    return f"`{text}`" if text else ""


def assigned(texts: Mapping[str, str], mark: str = "") -> str:
    """Return texts as equations."""
    return ", ".join(f"`{name}{mark} = {text}`" for name, text in texts.items())


def equations(chart: Chart) -> Iterator[str]:
    """Yield the lines of the tables of names, states and edges."""
    inputs = dict.fromkeys((*chart.inputs, *chart.velocities))
    known = [f"Inputs: {', '.join(map(code, inputs))}"]
    if chart.variables:
        known.append(f"variables: {', '.join(map(code, chart.variables))}")
    yield f"{'; '.join(known)}."
    if "s" in chart.inputs:
        yield f"`s` is the weight of an element times the Stribeck curve `{CURVE}`;"
        yield "the force of a contact is the sum over its elements, plus `sigma_2 * v`."
    named = [*chart.let.items(), *chart.outputs.items()]
    rows = [(code(name), code(text)) for name, text in named]
    rows += [(f"{code(name)}, total", code(text)) for name, text in chart.contact_outputs.items()]
    if rows:
        yield from ("", *table(("name", "expression"), rows))
    locked = f"`{chart.force_names[0]}` is whatever holds the contact at rest"
    yield from (
        "",
        *table(
            ("state", "flow", "force", "entry", "exit"),
            (
                (
                    f"{state.name}{' (default)' if state == chart.default_state else ''}",
                    assigned(state.flow, "'"),
                    locked if state.locked else assigned(state.outputs),
                    assigned(state.entry),
                    assigned(state.exit),
                )
                for state in chart.states
            ),
        ),
    )
    if not chart.transitions:
        yield from ("", "It has no edges: nothing switches.")
        return
    yield from (
        "",
        *table(
            ("edge", "from", "to", "guard", "action"),
            (
                (edge.name, edge.source, edge.target, code(edge.guard), assigned(edge.actions))
                for edge in chart.transitions
            ),
        ),
    )


def parameters(item: Item) -> Iterator[str]:
    """Yield the lines of the table of parameters, with their demonstration values."""
    given = item.entry.demonstration
    values = demonstrated(given)
    own = item.entry.parameters
    shared = with_shared(own, curve=True) if item.entry.curve else own
    if not shared:
        yield "It has no parameters."
        return
    yield from table(
        ("parameter", "unit", "rule", "meaning", "demonstration"),
        (
            (code(each.name), each.unit, rule(each), each.meaning, values.get(each.name, ""))
            for each in shared
            if each.name in values
        ),
    )
    yield from ("", f"Demonstration values: {given.source}.")
    if given.n > 1:
        yield f"A list has one number for each of the {given.n} elements."


def rule(parameter: Parameter) -> str:
    """Return the rule of a parameter; empty if any number will do."""
    return "" if parameter.rule == ANY else code(parameter.rule)


def demonstrated(given: Demonstration) -> dict[str, str]:
    """Return the demonstration values as texts."""
    values: dict[str, object] = {**given.values}
    if given.stribeck is not None:
        values |= {**asdict(given.stribeck), "sigma_2": given.sigma_2}
        if given.weights is not None:
            values["weights"] = given.weights
    return {name: _short(value) for name, value in values.items()}


def _short(value: object) -> str:
    if isinstance(value, tuple):
        return ", ".join(f"{each:.5g}" for each in value)
    return f"{value:.5g}"


# --------------------------------------------------------------------------- the run
def system_file(item: Item, velocity: str = "") -> str:
    """Return a scenario file: a mass pulled through a spring, or driven at a given velocity."""
    lines = [f'name = "{"driven" if velocity else "pulled"} mass, {item.name}"']
    for body, given in bodies(item, velocity).items():
        lines += ["", "[[body]]", f'name = "{body}"', *given]
    lines += ["", "[[contact]]", 'name = "pad"', *contact(item)]
    lines += ["", "[run]", f"t_end = {T_END}", "", "[output]", "figures = []"]
    return "\n".join(lines) + "\n"


def bodies(item: Item, velocity: str) -> dict[str, tuple[str, ...]]:
    """Return the lines of each body; there is one for each velocity of the chart."""
    if velocity:
        return {"mass": (f'velocity = "{velocity}"',)}
    if len(item.chart.velocities) == 1:
        end = SWUNG if item.law else PULLED
        return {"mass": ("inertia = 1.0", f'force = "2 * ({end} - x)"')}
    return {
        body: ("inertia = 1.0", f'force = "2 * ({V} * t - {x})"', f'x = "{x}"', f'v = "v_{x}"')
        for body, x, V in (("mass", "x", 0.1), ("side", "y", 0.05))
    }


def contact(item: Item) -> Iterator[str]:
    """Yield the lines of the contact after its name."""
    chart, given = item.chart, item.entry.demonstration
    if len(chart.velocities) > 1:
        yield 'v = ["v_x", "v_y"]'
    if given.inputs:
        texts = ", ".join(f'{name} = "{text}"' for name, text in given.inputs.items())
        yield f"inputs = {{ {texts} }}"
    if item.entry.curve:
        yield from ("", "[contact.model]", f'chart = "{item.entry.name}"')
        if item.law:
            yield f'law = "{item.law}"'
    else:
        yield f'chart = "{item.name}"'
        if given.n > 1:
            yield f"n = {given.n}"
        yield from ("", "[contact.values]")
    yield from (f"{name} = {_number(value)}" for name, value in given.values.items())
    if given.stribeck is not None:
        curve = ", ".join(f"{name} = {value!r}" for name, value in asdict(given.stribeck).items())
        yield from (f"stribeck = {{ {curve} }}", f"sigma_2 = {given.sigma_2!r}")
    if given.weights:
        yield f"weights = {_number(given.weights)}"


def _number(value: object) -> str:
    return (
        f"[{', '.join(repr(each) for each in value)}]" if isinstance(value, tuple) else repr(value)
    )


@dataclass(frozen=True, eq=False)
class Run:
    """The run of a page.

    Parameters
    ----------
    name : str
        File name of the scenario.
    text : str
        The scenario.
    trace : Trace
        The run.
    about : str
        What is run, in words.
    """

    name: str
    text: str
    trace: Trace
    about: str


@functools.cache
def run_of(item: Item) -> Run:
    """Run a chart: pulled, or driven for loops and where a pulled mass would take many steps."""
    if item.name in LOOPS:
        text = system_file(item, GROWING)
        about = f"The contact is driven at `v = {GROWING}`, in m/s: strokes that grow from"
        about += "\nmicrometres, in pre-sliding, to sliding."
        return Run("driven.toml", text, simulated(text), about)
    how = f"swings by {SWUNG}, in m: the laws differ for v < 0" if item.law else "moves at 0.1 m/s"
    about = f"A mass of 1 kg is pulled through a spring of 2 N/m, whose end {how}."
    if len(item.chart.velocities) > 1:
        about += "\nA second spring pulls it sideways, at 0.05 m/s."
    if item.chart.sets_velocity:
        about += "\nF has no value during an impact, which takes no time."
    if item.name in WINDOWS:
        about += "\n" + WINDOWS[item.name][1]
    text = system_file(item)
    try:
        return Run("pulled.toml", text, simulated(text), about)
    except StepLimitError:
        text = system_file(item, DRIVEN)
        about = """The contact is driven: its velocity steps down and up, it is held at rest from
7 to 10 s, and slides again. (A mass that is pulled makes this model stiff: `dp45` would need more
than a hundred thousand steps, Radau takes some hundreds, with the tolerances given above.)"""
        return Run("driven.toml", text, simulated(text), about)


def simulated(text: str) -> Trace:
    """Run a scenario file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.toml"
        path.write_text(text, encoding="utf-8")
        return load_scenario(path).simulate(max_steps=MOST_STEPS)


def run_figure(item: Item) -> Figure:
    """Draw forces, velocities and states of the run; of loops the force over x instead."""
    trace = run_of(item).trace
    window, _ = WINDOWS.get(item.name, ((0.0, T_END), ""))
    sampled = trace.sample(np.linspace(*window, 2001))
    pad = sampled.contact("pad")
    with rc_context(RC):
        if item.name in LOOPS:
            return loops_figure(pad, sampled.body("mass").x)
        tall = 0.5 + 0.2 * item.entry.demonstration.n  # inches, of the states
        heights = [1.6, 1.6, *([tall] if item.chart.transitions else [])]
        figure = Figure(figsize=(6.4, sum(heights)), layout="constrained")
        force, velocity, *states = figure.subplots(
            len(heights), 1, sharex=True, height_ratios=heights
        )
        over_time(force, pad, item.chart.force_names, "N")
        over_time(velocity, pad, item.chart.velocities, "m/s")
        velocity.set(xlim=window, xlabel="$t$ [s]")
        if item.chart.sets_velocity:
            force.set_title("between impacts; an impact takes no time, and $F$ has no value in it")
        for ax in states:
            panels.ribbons(ax, trace, window=window)
            velocity.set_xlabel("")
            ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=6, columnspacing=1.2)
    return figure


def over_time(ax: Axes, pad: Trace, names: Sequence[str], unit: str) -> None:
    """Draw quantities of a contact in one unit."""
    values = [np.asarray(pad.value(name)) for name in names]
    scale = scale_of(np.concatenate(values).tolist(), unit)
    for number, (name, each) in enumerate(zip(names, values, strict=True)):
        ax.plot(pad.t, scale.factor * each, label=f"${latex_name(name)}$", **compared_look(number))
    ax.set_ylabel(f"{', '.join(f'${latex_name(name)}$' for name in names)} [{scale.unit}]")
    if len(names) > 1:
        ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=len(names))
    if min(each.min() for each in values) < 0.5 * max(each.max() for each in values):
        ax.axhline(0, color=LINE_GREY, linewidth=0.8, zorder=0)


def loops_figure(pad: Trace, x: NDArray[np.float64]) -> Figure:
    """Draw velocity and friction force over time, and the force over the displacement."""
    figure = Figure(figsize=(6.4, 3.4), layout="constrained")
    axes = figure.subplot_mosaic([["v", "loop"], ["F", "loop"]], width_ratios=(1, 1.2))
    axes["v"].plot(pad.t, 1e6 * pad.v, color=INK)
    axes["v"].set(ylabel="$v$ [µm/s]", xlim=(0, T_END))
    axes["v"].tick_params(labelbottom=False)
    axes["F"].plot(pad.t, pad.F, color=INK)
    axes["F"].set(xlabel="$t$ [s]", ylabel="$F$ [N]", xlim=(0, T_END))
    axes["loop"].plot(1e6 * x, pad.F, color=INK)
    axes["loop"].set(xlabel="$x$ [µm]", ylabel="$F$ [N]")
    for ax in axes.values():
        ax.axhline(0, color=LINE_GREY, linewidth=0.8, zorder=0)
    return figure


def example(item: Item) -> Iterator[str]:
    """Yield the lines that run the chart, at the command line and in Python."""
    run = run_of(item)
    name, text, trace = run.name, run.text, run.trace
    yield run.about
    loops = item.name in LOOPS
    shown = "Velocity and force, and force over x" if loops else "Force, velocity and states"
    digits = ".4g" if loops else ".4f"  # x is in micrometres
    yield from ("", f"![{shown} of the run](../images/zoo/{item.name}_run.png)")
    yield from ("", f"<!-- file: {name} -->", "```toml", *text.splitlines(), "```")
    yield from (
        "",
        "```console",
        f"$ gms-fsm run {name} -o out",
        "...",
        "start with out/summary.md",
        "```",
        "",
        "The same in Python:",
        "",
        "```python",
        "from gms_fsm.app.scenario import load_scenario",
        "",
        f'trace = load_scenario("{name}").simulate()',
        "for r in trace.transitions[:5]:",
        '    print(f"{r.t:8.4f} s: {r.edge}")',
        'x, F = trace.body("mass").x[-1], trace.contact("pad").F[-1]',
        f'print(f"at {{trace.t[-1]:g}} s: x = {{x:{digits}}} m, F = {{F:.4f}} N")',
        "```",
        "",
        "```text",
    )
    for r in trace.transitions[:5]:
        yield f"{r.t:8.4f} s: {r.edge}"
    x, F = trace.body("mass").x[-1], trace.contact("pad").F[-1]
    yield f"at {trace.t[-1]:g} s: x = {x:{digits}} m, F = {F:.4f} N"
    yield "```"


# --------------------------------------------------------------------------- the proofs
def verb(item: Item) -> str:
    """Return the chart as the command line names it."""
    return f"{item.entry.name} --law {item.law}" if item.law else item.name


def proofs(item: Item, report: Report) -> Iterator[str]:
    """Yield the lines of the report in short."""
    count = Counter(finding.status for finding in report.findings)
    total = ", ".join(f"{count[status]} {status}" for status in get_args(Status))
    yield f"`gms-fsm check {verb(item)}`: {total}."
    yield from ("", f"Assumed: {', '.join(map(code, report.domain)) or 'nothing'}.")
    if count["undecided"]:
        yield ""
        yield "A function that is not encoded is one that the solver does not have"
        yield "([limitations](../howto/checking-charts.md#limitations))."
    yield ""
    for status in ("refuted", "settled by order", "undecided"):
        for finding in report.findings:
            if finding.status == status:
                where = ", ".join((*finding.where, *filter(None, (finding.case,))))
                yield f"- **{status}**, {finding.check}, {where or 'the chart'}: {finding.text}"
                if status == "refuted" and finding.counterexample:
                    yield f"  (for example at `{finding.example}`)"


# --------------------------------------------------------------------------- pages
def page(item: Item, report: Report) -> str:
    """Return the page of a chart."""
    lines = [
        f"# {item.title}",
        "",
        f'`gms_fsm.charts.CHARTS["{item.name}"]`, from `gms_fsm/charts/{item.file}`.',
        "",
        f"![The chart {item.title}](../images/zoo/{item.name}.png)",
        "",
        "## What it shows",
        "",
        item.about,
        "",
        "## Equations",
        "",
        *equations(item.chart),
        "",
        "## Parameters",
        "",
        *parameters(item),
        "",
        "## Run it",
        "",
        *example(item),
        "",
        "## Proofs",
        "",
        *proofs(item, report),
        "",
        "## References",
        "",
        item.references or item.chart.reference,
    ]
    return "\n".join(line.rstrip() for line in lines).rstrip() + "\n"


def index(reports: Mapping[Item, Report]) -> str:
    """Return the index: a table of all charts, and the gallery."""
    rows, gallery = list[tuple[str, ...]](), list[str]()
    for item, report in reports.items():
        chart = item.chart
        count = Counter(finding.status for finding in report.findings)
        rows.append(
            (
                f"[{item.name}]({item.name}.md)",
                item.title,
                str(len(chart.states)),
                str(len(chart.transitions)),
                " / ".join(str(count[status]) for status in get_args(Status)),
            )
        )
        gallery += ["", f"### {item.title}", "", item.summary, ""]
        gallery.append(f"[![{item.title}](../images/zoo/{item.name}.png)]({item.name}.md)")
    found = [finding for report in reports.values() for finding in report.findings]
    undecided = sum(finding.status == "undecided" for finding in found)
    lines = [
        INTRODUCTION,
        *table(
            ("name", "model", "states", "edges", "proved / settled / refuted / undecided"), rows
        ),
        "",
        f"{undecided} of {len(found)} findings are undecided "
        f"({100 * undecided / len(found):.1f} %); the page of a chart gives the reasons.",
        "*Settled* findings depend on the order of the edges",
        "([how charts are checked](../howto/checking-charts.md)).",
        "",
        "## Gallery",
        *gallery,
        "",
        "```{toctree}",
        ":hidden:",
        "",
        *(item.name for item in reports),
        "```",
    ]
    return "\n".join(lines) + "\n"


def pages() -> dict[str, str]:
    """Return all pages by their file names."""
    reports = {each: prove(each.chart, each.entry.domain) for each in items()}
    made = {f"{each.name}.md": page(each, report) for each, report in reports.items()}
    return {"index.md": index(reports), **made}


def main() -> None:
    """Write pages and pictures, and remove those of charts that are gone."""
    PAGES.mkdir(exist_ok=True)
    PICTURES.mkdir(exist_ok=True)
    made = pages()
    for name, text in made.items():
        write_whole(PAGES / name, lambda file, text=text: file.write(text.encode()))
    for item in items():
        plots.render(plots.statechart(item.chart), PICTURES / f"{item.name}.png")
        figures.save(run_figure(item), PICTURES / f"{item.name}_run.png")
    kept = {item.name for item in items()} | {"index"}
    for path in (*PAGES.glob("*.md"), *PICTURES.glob("*.png")):
        if path.stem.removesuffix("_run") not in kept:
            path.unlink()


if __name__ == "__main__":
    main()
