"""A widget: the replay page with sliders, and branches to poke and compare.

Python computes and draws; the browser shows, and sends requests. A request is answered by one
change of all traits, which carries its id, and the browser sends the next one only then: of the
values of a slider the latest wins.
"""

from __future__ import annotations

import importlib.util
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Unpack

import anywidget
import traitlets

from gms_fsm.charts.chart import Chart
from gms_fsm.charts.gms import GMS_ELEMENT
from gms_fsm.errors import GMSError, ParameterError, SessionError
from gms_fsm.foundation.arguments import checked_integer
from gms_fsm.run.settings import SettingOptions, Settings
from gms_fsm.session.results import BranchComparison
from gms_fsm.session.session import Session
from gms_fsm.session.tree.branches import Fork
from gms_fsm.session.tree.poking import pokeable
from gms_fsm.systems.models import Model
from gms_fsm.systems.numbers import law_of
from gms_fsm.systems.rigs import Rig
from gms_fsm.systems.system import System
from gms_fsm.traces.system_scope import units_of
from gms_fsm.traces.trace import Trace
from plots.page.chart import chart_svg
from plots.page.replay import page_data, page_html
from plots.style import Theme, colour
from plots.views.ranges import checked_ranges

__all__ = ["Explorer"]

HERE = Path(__file__).parent
WIDE = 100.0  # a positive range with such a ratio of its ends has a logarithmic slider
TIMER = "age"  # a variable that is not poked
COLOURS = ("ink", "soft", "paper", "panel", "line", "chosen", "now")  # roles in the style sheet


def _style() -> str:
    """Return the style sheet, with the colours of both themes as variables."""
    themes: list[Theme] = ["light", "dark"]
    light, dark = (
        "".join(f"--gms-{role}:{colour(role, theme)};" for role in COLOURS) for theme in themes
    )
    return (
        f".gms-explore{{{light}}}\n"
        f"@media(prefers-color-scheme:dark){{.gms-explore{{{dark}}}}}\n"
        + (HERE / "widget.css").read_text(encoding="utf-8")
    )


class Explorer(anywidget.AnyWidget):
    """The widget that `plots.explore` returns; see there for the parameters.

    Its methods do what its controls do, also without a browser. Branches are numbered from 0, the
    original run.
    """

    _esm = HERE / "widget.js"
    _css = _style()
    page = traitlets.Unicode().tag(sync=True)
    runs = traitlets.Dict().tag(sync=True)
    charts: traitlets.List[str] = traitlets.List().tag(sync=True)
    panel = traitlets.Dict().tag(sync=True)
    height = traitlets.Int().tag(sync=True)
    request = traitlets.Dict().tag(sync=True)

    def __init__(
        self,
        model: Model | System,
        rig: Rig | float,
        t_end: float | None = None,
        *,
        sliders: Mapping[str, tuple[float, float]],
        t_start: float = 0.0,
        initial: Mapping[str, Any] | None = None,
        settings: Settings | None = None,
        height: int = 720,
        **options: Unpack[SettingOptions],
    ) -> None:
        if settings is None and "engine" not in options:
            fast = importlib.util.find_spec("llvmlite") is not None
            options["engine"] = "compiled" if fast else "ifelse"
        self._tree = Session(
            model, rig, t_end, t_start=t_start, initial=initial, settings=settings, **options
        ).tree
        self._sliders = checked_ranges("sliders", sliders, lambda name: self._tree.number(name, 0))
        self._shown: tuple[int, ...] = (0,)
        self._pictures: list[tuple[Chart, int, str]] = []
        self._answer: dict[str, Any] = {"done": "", "said": "", "file": None}
        self._took = 0.0
        data, charts = self._drawn()
        super().__init__(
            page=page_html(data, charts),
            runs=data,
            charts=charts,
            panel=self._described(),
            height=checked_integer("height", height, 200, ParameterError),
        )

    # ------------------------------------------------------------------ branches
    @property
    def branches(self) -> dict[int, Fork]:
        """The branches by number; `Fork.text` is what differs from the parent."""
        return dict(self._tree.forks)

    @property
    def current(self) -> int:
        """Number of the branch that sliders, pokes and forks refer to."""
        return self._tree.current

    @property
    def shown(self) -> tuple[int, ...]:
        """Numbers of the branches on the page: one, or the two that are compared."""
        return self._shown

    @property
    def values(self) -> dict[str, float]:
        """The numbers of the current branch that have a slider."""
        numbers = self._tree.numbers()
        return {name: numbers[name].value for name in self._sliders if name in numbers}

    def trace(self, branch: int | None = None) -> Trace:
        """Return the run of a branch, by default of the current one."""
        return self._tree.trace(branch)

    # ------------------------------------------------------------------ changes
    def set(self, values: Mapping[str, float] | None = None, /, **more: float) -> None:
        """Change numbers of the current branch and run it again.

        Parameters
        ----------
        values : mapping of str to float, optional
            By name; those of a system have names such as ``"numbers.m"`` and ``"pad.F_s"``.
        **more
            The same: ``set(F_s=1.8)``. They need no slider.

        Raises
        ------
        ParameterError
            If there is no such number, or a value violates its rule.
        """
        with self._changing():
            self._tree.set({**(values or {}), **more})

    def fork(
        self, *, law: str | None = None, values: Mapping[str, float] | None = None, name: str = ""
    ) -> int:
        """Begin a branch with another law or other numbers, and compare it with the current one.

        Parameters
        ----------
        law : {"published", "signed"}, optional
            Of a GMS model.
        values : mapping of str to float, optional
            As for `set`.
        name : str, optional
            By default what differs.

        Returns
        -------
        int
            Its number.
        """
        with self._changing():
            before = self.current
            number = self._tree.fork(law=law, values=values, name=name)
            self._shown = before, number
        return number

    def poke(
        self,
        variables: Mapping[str, Any] | None = None,
        v: float | None = None,
        state: Mapping[Any, str] | None = None,
        *,
        t: float,
        microstep: int | None = None,
        name: str = "",
    ) -> int:
        """Begin a branch in which values change at one time; compare it with the current one.

        Parameters
        ----------
        variables, v, state
            As for `gms_fsm.Session.poke`.
        t : float
            When, s.
        microstep : int, optional
            After the row of this time with this micro-step; by default after the last.
        name : str, optional
            By default what is changed.

        Returns
        -------
        int
            Its number.

        Raises
        ------
        SessionError
            If there is nothing to change, no such variable or element, or no such time.
        """
        with self._changing():
            before = self.current
            number = self._tree.poke(variables, v, state, t=t, microstep=microstep, name=name)
            self._shown = before, number
        return number

    def show(self, branch: int) -> None:
        """Show one branch, which becomes the current one."""
        with self._changing():
            self._tree.trace(branch)
            self._tree.current, self._shown = branch, (branch,)

    def compare(self, a: int, b: int) -> BranchComparison:
        """Show two branches side by side; the second becomes the current one.

        Parameters
        ----------
        a, b : int
            Their numbers.

        Returns
        -------
        BranchComparison
            Transitions, first difference, largest differences.
        """
        with self._changing():
            if a == b:
                raise SessionError("give two branches", place="b", value=b)
            found = self._tree.compare(a, b)
            self._tree.current, self._shown = b, (a, b)
        return found

    def rename(self, branch: int, name: str) -> None:
        """Give a branch another name."""
        with self._changing():
            self._tree.rename(branch, name)

    def delete(self, branch: int) -> None:
        """Remove a branch that no other comes from."""
        with self._changing():
            self._tree.delete(branch)
            if branch in self._shown:
                self._shown = (self.current,)

    def export(self, path: str | Path, branch: int | None = None) -> Path:
        """Write a branch as a scenario file; see `Tree.save_scenario`.

        Parameters
        ----------
        path : str or Path
            Its ending must be ``.toml``.
        branch : int, optional
            By default the current one.

        Returns
        -------
        Path
            The file.
        """
        return self._tree.save_scenario(path, branch)

    # ------------------------------------------------------------------ what the browser shows
    @contextmanager
    def _changing(self) -> Iterator[None]:
        """Send what has changed at the end, all at once."""
        self._answer = {**self._answer, "said": "", "file": None}
        before = time.perf_counter()
        yield
        for number in self._shown:
            self._tree.trace(number)
        self._took = time.perf_counter() - before
        data, charts = self._drawn()
        with self.hold_sync():
            self.runs, self.charts, self.panel = data, charts, self._described()

    def _drawn(self) -> tuple[dict[str, Any], list[str]]:
        tree = self._tree
        traces = [tree.trace(number) for number in self._shown]
        names = [tree.forks[number].name for number in self._shown]
        return page_data(traces, names=names, draw=self._picture)

    def _picture(self, chart: Chart, n: int) -> str:
        for known, elements, picture in self._pictures:
            if elements == n and known == chart:
                return picture
        self._pictures.append((chart, n, chart_svg(chart, n)))
        return self._pictures[-1][2]

    def _described(self) -> dict[str, Any]:
        """Return what the controls show."""
        tree = self._tree
        numbers, law = tree.numbers(), law_of(tree.made_of())
        sliders = [
            {
                "name": name,
                "unit": numbers[name].parameter.unit,
                "meaning": numbers[name].parameter.meaning,
                "low": low,
                "high": high,
                "log": low > 0 and high / low >= WIDE,
                "value": numbers[name].value,
            }
            for name, (low, high) in self._sliders.items()
            if name in numbers
        ]
        branches = [
            {
                "number": number,
                "name": fork.name,
                "text": fork.text,
                "parent": fork.parent,
                "begin": tree.beginning(number),
            }
            for number, fork in tree.forks.items()
        ]
        failures = [tree.failure(number) for number in self._shown]
        return {
            "sliders": sliders,
            "law": law,
            "laws": [] if law is None else list(GMS_ELEMENT),
            "branches": branches,
            "current": tree.current,
            "shown": list(self._shown),
            "t_start": tree.t_start,
            "t_end": tree.t_end,
            "took": 1e3 * self._took,
            "engine": tree.settings.engine,
            "failed": "; ".join(str(each) for each in failures if each is not None),
            "pokes": self._pokes(),
            **self._answer,
        }

    def _pokes(self) -> dict[str, Any]:
        """Return what can be poked: of each contact, and other names of a system."""
        start = self._tree.branch().start
        contacts = []
        own: list[str] = []
        for bank in start.program.layout.banks:
            contact = start.system.contact(bank.name)
            names = [name for name in contact.chart.variables if name != TIMER]
            own += [bank.of(name) for name in names]
            contacts.append(
                {
                    "name": start.what.whose(bank.name),
                    "n": bank.n,
                    "variables": [[name, contact.chart.unit(name)] for name in names],
                    "states": [state.name for state in contact.chart.states],
                }
            )
        if not start.what.named:
            free = any(not body.driven for body in start.system.bodies)
            others = ["v"] if free else []
        else:
            others = [name for name in pokeable(start) if name not in own]
        units = units_of(start.what, others)
        return {"contacts": contacts, "others": [[name, units.get(name, "")] for name in others]}

    # ------------------------------------------------------------------ requests of the browser
    @traitlets.observe("request")
    def _requested(self, change: Any) -> None:
        """Answer a request: do it, or say why not; in both cases its id is sent back."""
        request = dict(change.new)
        if not request:
            return
        self._answer = {"done": request.pop("id", ""), "said": "", "file": None}
        try:
            self._do(**request)
        except GMSError as error:
            self._answer["said"] = str(error)
        finally:
            self.panel = self._described()

    def _do(self, do: str, **given: Any) -> None:
        match do:
            case "set" | "fork" | "show" | "compare" | "rename" | "delete":
                getattr(self, do)(**given) if do != "set" else self.set(given["values"])
            case "poke":
                self._poked(**given)
            case "export":
                branch = given["branch"]
                with tempfile.TemporaryDirectory() as folder:
                    path = self.export(Path(folder, "branch.toml"), branch)
                    text = path.read_text(encoding="utf-8")
                name = f"branch-{branch}.toml"
                self._answer["file"] = {"name": name, "text": text}
            case _:
                raise ParameterError("the page asked for it", place="request", value=do)

    def _poked(
        self, contact: str, what: str, element: int, value: Any, t: float, microstep: int | None
    ) -> None:
        """Poke one value, named as the page names it; `what` is empty for a state."""
        who: Any = f"{contact} {element + 1}" if contact else element
        edits: dict[str, Any]
        if not what:
            edits = {"state": {who: value}}
        elif element >= 0:
            edits = {"variables": {f"{contact}.{what}" if contact else what: {element: value}}}
        else:
            named = self._tree.branch().start.what.named
            edits = {"variables": {what: value}} if named else {"v": value}
        self.poke(**edits, t=t, microstep=microstep)
