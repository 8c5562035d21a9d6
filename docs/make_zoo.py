"""Make the pages in docs/zoo, one per included chart, with their pictures in docs/images/zoo.

Everything on a page comes from the chart: text and references from the docstring of its file,
equations, parameters, picture, proofs, and a run. Run it with ``make gallery``.
"""

from __future__ import annotations

import importlib
import inspect
import os
import pkgutil
import re
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import gms_fsm.charts
import plots
from gms_fsm import Chart, Trace, prove
from gms_fsm._files import write_whole
from gms_fsm.app.scenario import load_scenario
from gms_fsm.charts.parameters import ANY, Parameter, with_shared
from gms_fsm.charts.registry import Demonstration, Entry
from gms_fsm.charts.stribeck import Stribeck
from gms_fsm.inspection._findings import Report, Status

DOCS = Path(__file__).parent
PAGES = DOCS / "zoo"
PICTURES = DOCS / "images" / "zoo"

SUPPLIED = ("t", "x", "v", "s")  # inputs that every system has
BINDINGS = {"N": "10"}  # for other inputs, a text over the names of the pulled mass
T_END = 20.0  # s
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
        return self.text.partition("\n\nReferences\n")[0]

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


def items() -> tuple[Item, ...]:
    """Return the charts that are models, in the order of their names."""
    found = []
    for module in pkgutil.iter_modules(gms_fsm.charts.__path__):
        page = importlib.import_module(f"gms_fsm.charts.{module.name}")
        for each in getattr(page, "CHARTS", ()) if not module.name.startswith("_") else ():
            if isinstance(each, Entry) and not each.wrong:
                for law in each.laws or ("",):
                    name = "-".join(filter(None, (each.name, law)))
                    text = inspect.getdoc(page) or ""
                    found.append(Item(name, law, each, f"{module.name}.py", text))
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
        curve = given.stribeck
        values |= {"F_c": curve.F_c, "F_s": curve.F_s, "v_s": curve.v_s, "sigma_2": given.sigma_2}
        if given.weights is not None:
            values["weights"] = given.weights
    return {name: _short(value) for name, value in values.items()}


def _short(value: object) -> str:
    if isinstance(value, tuple):
        return ", ".join(f"{each:.5g}" for each in value)
    return f"{value:.5g}"


# --------------------------------------------------------------------------- the run
def bodies(item: Item) -> tuple[str, ...]:
    """Return the names of the pulled bodies: one per velocity of the chart."""
    return ("mass", "side")[: len(item.chart.velocities)]


def system_file(item: Item) -> str:
    """Return a scenario file: a mass of 1 kg, pulled through a spring of 2 N/m at 0.1 m/s."""
    chart, given = item.chart, item.entry.demonstration
    lines = [f'name = "pulled mass, {item.name}"']
    if len(chart.velocities) == 1:
        lines += ["", "[[body]]", 'name = "mass"', "inertia = 1.0", 'force = "2 * (0.1 * t - x)"']
    else:
        for body, x, v, force in (
            ("mass", "x", "v_x", "2 * (0.1 * t - x)"),
            ("side", "y", "v_y", "2 * (0.05 * t - y)"),
        ):
            lines += ["", "[[body]]", f'name = "{body}"', "inertia = 1.0", f'force = "{force}"']
            lines += [f'x = "{x}"', f'v = "{v}"']
    lines += ["", "[[contact]]", 'name = "pad"']
    if len(chart.velocities) > 1:
        lines.append('v = ["v_x", "v_y"]')
    bound = {name: BINDINGS.get(name, "1") for name in chart.inputs if name not in supplied(chart)}
    if bound:
        texts = ", ".join(f'{name} = "{text}"' for name, text in bound.items())
        lines.append(f"inputs = {{ {texts} }}")
    if item.entry.curve:
        lines += ["", "[contact.model]", f'chart = "{item.entry.name}"']
        lines += [f'law = "{item.law}"'] * bool(item.law)
        lines += [f"{name} = {_number(value)}" for name, value in given.values.items()]
        assert given.stribeck is not None
        curve = {name: getattr(given.stribeck, name) for name in ("F_c", "F_s", "v_s")}
        inside = ", ".join(f"{name} = {value!r}" for name, value in curve.items())
        lines += [f"stribeck = {{ {inside} }}", f"sigma_2 = {given.sigma_2!r}"]
        lines += [f"weights = {_number(given.weights)}"] if given.weights else []
    else:
        lines.append(f'chart = "{item.name}"')
        lines += [f"n = {given.n}"] if given.n > 1 else []
        lines += ["", "[contact.values]"]
        lines += [f"{name} = {_number(value)}" for name, value in given.values.items()]
    lines += ["", "[run]", f"t_end = {T_END}", "", "[output]", "figures = []"]
    return "\n".join(lines) + "\n"


def supplied(chart: Chart) -> tuple[str, ...]:
    """Return the inputs that need no text."""
    return (*SUPPLIED, *chart.velocities)


def _number(value: object) -> str:
    return (
        f"[{', '.join(repr(each) for each in value)}]" if isinstance(value, tuple) else repr(value)
    )


def pulled(text: str) -> Trace:
    """Run a scenario file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pulled.toml"
        path.write_text(text, encoding="utf-8")
        return load_scenario(path).simulate()


def example(item: Item) -> Iterator[str]:
    """Yield the lines that run the chart, in Python and at the command line."""
    text = system_file(item)
    trace = pulled(text)
    count = len(trace.transitions)
    yield "A mass of 1 kg is pulled through a spring of 2 N/m, whose end moves at 0.1 m/s."
    yield from ("", "<!-- file: pulled.toml -->", "```toml", *text.splitlines(), "```")
    yield from (
        "",
        "```console",
        "$ gms-fsm run pulled.toml -o out",
        f"{count} transitions; 3 files in out",
        "start with out/summary.md",
        "```",
        "",
        "The same in Python:",
        "",
        "```python",
        "from gms_fsm.app.scenario import load_scenario",
        "",
        'trace = load_scenario("pulled.toml").simulate()',
        "for r in trace.transitions[:5]:",
        '    print(f"{r.t:8.4f} s: {r.edge}")',
        'x = trace.body("mass").x',
        'print(f"at {trace.t[-1]:g} s: x = {x[-1]:.4f} m")',
        "```",
        "",
        "```text",
    )
    for r in trace.transitions[:5]:
        yield f"{r.t:8.4f} s: {r.edge}"
    yield f"at {trace.t[-1]:g} s: x = {trace.body('mass').x[-1]:.4f} m"
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
    for status in ("refuted", "settled by order", "undecided"):
        for finding in report.findings:
            if finding.status == status:
                where = ", ".join((*finding.where, *filter(None, (finding.case,))))
                yield from ("", f"- **{status}**, {finding.check}, {where or 'the chart'}: ")
                yield f"  {finding.text}"
                if finding.counterexample:
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
        proved = count["proved"] + count["settled by order"]
        rows.append(
            (
                f"[{item.name}]({item.name}.md)",
                item.title,
                str(len(chart.states)),
                str(len(chart.transitions)),
                f"{proved} / {count['refuted']} / {count['undecided']}",
            )
        )
        gallery += ["", f"### {item.title}", "", item.summary, ""]
        gallery.append(f"[![{item.title}](../images/zoo/{item.name}.png)]({item.name}.md)")
    found = [finding for report in reports.values() for finding in report.findings]
    undecided = sum(finding.status == "undecided" for finding in found)
    lines = [
        INTRODUCTION,
        *table(("name", "model", "states", "edges", "proved / refuted / undecided"), rows),
        "",
        f"{undecided} of {len(found)} findings are undecided "
        f"({100 * undecided / len(found):.1f} %); the page of a chart gives the reasons.",
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
    kept = {item.name for item in items()} | {"index"}
    for path in (*PAGES.glob("*.md"), *PICTURES.glob("*.png")):
        if path.stem not in kept:
            os.remove(path)


if __name__ == "__main__":
    main()
