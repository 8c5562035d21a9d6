"""A lesson as data: a page of words, runs with numbers, and panels; what is made from them."""

from __future__ import annotations

import re
import string
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib.util import find_spec
from inspect import cleandoc
from itertools import permutations
from typing import TYPE_CHECKING, Any

import numpy as np

from gms_fsm.app.lessons.engine.predict import Question
from gms_fsm.traces.trace import Trace
from plots.style import INK, LINE_GREY, PALE_GREY, TEXT_GREY, compared_look

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAGE = re.compile(
    r"Lesson (?P<number>\d+): (?P<title>.+?)\.\n\n(?P<question>[^\n]+\?)\n\n"
    r"(?P<explanation>.+?)\n\n## Predict\n\n(?P<before>.+?)\n\n"
    r"## Measure\n\n(?P<said>.+?)\n\n## Why\n\n(?P<why>.+?)\n\n"
    r"(?P<after>.*?)## Try\n\n(?P<tasks>.+?)(?:\n\n## Solutions\n\n(?P<solutions>.+))?",
    re.DOTALL,
)
LEVELS = ("school", "undergraduate", "graduate")
FACTORS = {"m": 1e3, "u": 1e6, "p": 100.0, "k": 1e-3}  # {x!m} is x in thousandths; p: percent

FASTEST = "compiled" if find_spec("llvmlite") else "ifelse"  # the same bits, forty times faster
# Looks: two things compared, lines that guide the eye, the ideal behind, single points.
FIRST, SECOND = compared_look(0), compared_look(1)
GUIDE: dict[str, Any] = {"color": LINE_GREY, "linewidth": 0.9, "zorder": 0}
BROAD: dict[str, Any] = {"color": PALE_GREY, "linewidth": 6.0, "zorder": 1}
DOTS: dict[str, Any] = {"color": INK, "linestyle": "", "marker": "o", "markersize": 5.0}

Panel = Callable[[Any, Any], str]  # draws a result on axes, and returns the panel's title
Live = Callable[
    [], tuple[tuple[Any, ...], Mapping[str, tuple[float, float] | None], dict[str, Any]]
]
Sheet = Callable[[str, Any], tuple[Any, Sequence[Any]]]  # a figure with a heading, and its axes


class _Words(string.Formatter):
    """Fills in numbers: ``{x!u:.1f}`` times 10⁶, and all of a sequence with commas between."""

    def convert_field(self, value: Any, conversion: Any) -> Any:
        if conversion in FACTORS:
            return np.multiply(FACTORS[conversion], value)
        return super().convert_field(value, conversion)

    def format_field(self, value: Any, format_spec: str) -> str:
        if isinstance(value, (tuple, list, np.ndarray)) and np.ndim(value):
            return ", ".join(format(each, format_spec) for each in value)
        return format(value, format_spec)


@dataclass(frozen=True, eq=False)
class Lesson:
    """A question that is answered by a run.

    Its words are the docstring of its module: a title, a question and what happens, then sections
    *Predict* (its numbered items are the questions), *Measure*, *Why*, others, *Try*, and
    *Solutions* of what to try, if it has them. *Measure* is four paragraphs: the runs, two with
    measured values, the conclusion. The numbers in braces are those of the run, or of the module.

    Parameters
    ----------
    module : str
        Name of the module.
    measure : callable
        Makes the runs. Returns values by name; ``replayed`` is the one or two runs for the replay
        page, by name.
    panels : tuple of callable
        ``panel(axes, result)`` draws, and returns the title of the panel.
    sheet : callable
        Makes the figure, for example `grid`.
    level : {"school", "undergraduate", "graduate"}
        For whom it is.
    questions : tuple of Question
        What is predicted, in the order of the items of *Predict*.
    live : callable, optional
        Makes the run of the live page: the first arguments of `plots.play`, the numbers with a
        slider, as its ``vary``, and its options.
    """

    module: str
    measure: Callable[[], Mapping[str, Any]]
    panels: tuple[Panel, ...]
    sheet: Sheet
    level: str = field(kw_only=True)
    questions: tuple[Question, ...] = field(kw_only=True)
    live: Live | None = field(default=None, kw_only=True)

    @cached_property
    def words(self) -> Mapping[str, str]:
        """The parts of the page by name: number, title, question, explanation, before, why ..."""
        found = PAGE.fullmatch(cleandoc(sys.modules[self.module].__doc__ or ""))
        if not found:
            raise ValueError(f"{self.module}: its docstring is not the page of a lesson")
        return {name: text or "" for name, text in found.groupdict().items()}

    @property
    def title(self) -> str:
        """A few words."""
        return self.words["title"]

    @property
    def question(self) -> str:
        """What the lesson answers."""
        return self.words["question"]

    @property
    def heading(self) -> str:
        """Number and question."""
        return f"Lesson {self.words['number']}: {self.question}"

    def run(self) -> Result:
        """Make the runs and measure."""
        return Result(self, self.measure())

    def figure(self, result: Result) -> Figure:
        """Draw the figure of the result."""
        from plots import panels  # isort: skip  first: it names a missing extra
        from matplotlib import rc_context

        from plots.style import RC

        with rc_context(RC):
            figure, axes = self.sheet(self.heading.replace("v_c", "$v_c$"), result)
            for letter, ax, draw in zip("abcdef", axes, self.panels, strict=False):
                panels.lettered(ax, letter, draw(ax, result))
            for upper, lower in permutations(axes, 2):
                if _continues(upper, lower):
                    upper.set_xlabel("")
                    upper.tick_params(labelbottom=False)
        drawn: Figure = figure
        return drawn


@dataclass(frozen=True, eq=False)
class Result:
    """The runs of a lesson and what was measured in them; values are attributes, too.

    Parameters
    ----------
    lesson : Lesson
        Which was run.
    values : mapping of str to object
        From its ``measure``.
    """

    lesson: Lesson
    values: Mapping[str, Any]

    def __getattr__(self, name: str) -> Any:
        try:
            return self.__dict__["values"][name]
        except KeyError:
            raise AttributeError(f"nothing named {name} was measured") from None

    @property
    def replayed(self) -> dict[str, Trace]:
        """One or two runs for the replay page, by name."""
        return dict(self.values["replayed"])

    def lines(self) -> tuple[str, ...]:
        """Return the question, the runs, two lines of measured values, and the conclusion."""
        said = (" ".join(each.split()) for each in self.lesson.words["said"].split("\n\n"))
        return (f"Question: {self.lesson.question}", *map(self.filled, said))

    def filled(self, text: str) -> str:
        """Fill the numbers of the run, and of the lesson's module, into a text with braces."""
        known = {**vars(sys.modules[self.lesson.module]), **self.values}
        return _Words().vformat(text, (), known)


def grid(
    mosaic: str,
    size: tuple[float, float],
    heights: Sequence[float] | None = None,
    widths: Sequence[float] | None = None,
) -> Sheet:
    """Return a sheet of panels, arranged as the letters of a text such as ``"ab;cc"``."""

    def sheet(heading: str, _: Result) -> tuple[Figure, list[Axes]]:
        from matplotlib.figure import Figure

        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplot_mosaic(mosaic, height_ratios=heights, width_ratios=widths)
        figure.suptitle(heading, x=0.01, ha="left", fontsize=12)
        return figure, [axes[letter] for letter in sorted(axes)]

    return sheet


def draw(name: str, ax: Axes, *data: Any, **options: Any) -> Any:
    """Draw a panel of `plots.panels`, which is loaded when a figure is drawn."""
    from plots import panels

    return getattr(panels, name)(ax, *data, **options)


def shown(name: str, run: str, title: str, **options: Any) -> Panel:
    """Return a panel of `plots.panels` about one run; the title is a text with braces."""

    def panel(ax: Axes, result: Result) -> str:
        draw(name, ax, result.values[run], **options)
        return result.filled(title)

    return panel


def forces(ax: Axes, result: Result) -> str:
    """Draw the forces of both runs of the replay page."""
    for (name, trace), look in zip(result.replayed.items(), (FIRST, SECOND), strict=True):
        draw("force", ax, trace)[0].set(label=name, **look)
    ax.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2)
    return f"friction, {trace.model.title}"


def note(
    ax: Axes,
    text: str,
    at: tuple[Any, Any],
    shift: tuple[float, float] = (0, 0),
    *,
    inside: bool = False,
    **look: Any,
) -> None:
    """Write next to a point, on the side of a shift in points; `inside`: shares of the panel."""
    x, y = (0.5 - at[0], 0.5 - at[1]) if inside else shift
    sides = {
        "ha": "right" if x < 0 else "left",
        "va": "top" if y < 0 else "bottom" if y else "baseline",
    }
    place = "axes fraction" if inside else "data"
    options: dict[str, Any] = {"color": TEXT_GREY, "fontsize": 8, **sides, **look}
    ax.annotate(text, at, shift, xycoords=place, textcoords="offset points", **options)


def ticks(ax: Axes, axis: str, places: Iterable[Any], texts: Iterable[str] = ()) -> None:
    """Set the ticks of an axis, and no minor ones."""
    chosen = ax.xaxis if axis == "x" else ax.yaxis
    at = list(places)
    chosen.set_ticks(at, list(texts) or [f"{place:g}" for place in at])
    chosen.set_ticks([], minor=True)


def _continues(upper: Axes, lower: Axes) -> bool:
    """Whether the panel below has the same axis, so that one of them needs no numbers."""
    above, below = upper.get_subplotspec(), lower.get_subplotspec()
    return (
        above is not None
        and below is not None
        and above.colspan == below.colspan
        and above.rowspan.stop == below.rowspan.start
        and upper.get_xlabel() in ("", lower.get_xlabel())
        and upper.get_xlim() == lower.get_xlim()
    )
