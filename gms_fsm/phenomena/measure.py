"""The bench as one function: models by phenomena."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from gms_fsm.errors import GMSError
from gms_fsm.foundation.arguments import checked_kind, listed, refusing, unknown
from gms_fsm.phenomena import _break_away, _sliding, presliding
from gms_fsm.phenomena._bench import Bench
from gms_fsm.phenomena.results import Cell, PhenomenaTable, Phenomenon, PhenomenonResult
from gms_fsm.phenomena.specimens import Specimen, specimens_of
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact

__all__ = ["PHENOMENA", "Bench", "PhenomenaTable", "chosen_phenomena", "measure_phenomena"]

_EVERY = (*_break_away.PHENOMENA, *presliding.PHENOMENA, *_sliding.PHENOMENA)
PHENOMENA: Mapping[str, Phenomenon] = {each.name: each for each in _EVERY}
Progress = Callable[[str, float], None]


@refusing()
def measure_phenomena(
    models: Iterable[str] | Mapping[str, str | Model | Contact] | None = None,
    phenomena: Iterable[str] | None = None,
    *,
    bench: Bench | None = None,
    progress: Progress | None = None,
) -> PhenomenaTable:
    """Put friction models on the bench and measure which phenomena they show.

    Parameters
    ----------
    models : iterable of str, or mapping of str to str, Model or Contact, optional
        Names of included charts, as in ``gms_fsm.charts.CHARTS``; or such names and models of your
        own, each by the name that it has in the table. All included charts if omitted.
    phenomena : iterable of str, optional
        Names from ``gms_fsm.phenomena.measure.PHENOMENA``; all if omitted.
    bench : Bench, optional
        Numbers of the signals: forces, speeds and lengths in them follow its F_s, v_s and sigma_0,
        which should be those of the models.
    progress : callable, optional
        ``progress(model, done)``, with the share of all experiments done.

    Returns
    -------
    PhenomenaTable
        A verdict with its numbers for each model and phenomenon.

    Raises
    ------
    ParameterError
        If a name is unknown, or a model of your own cannot be put on the bench.

    Examples
    --------
    >>> table = measure_phenomena(["stiction"], ["stick-slip"])
    >>> found = table.cell("stiction", "stick-slip")
    >>> found.verdict, [str(each) for each in found.numbers]
    ('shows', ['0.483 N', '7.26 s', '0.637'])
    """
    chosen = chosen_phenomena(phenomena)
    if bench is not None:
        checked_kind("bench", bench, Bench, "a Bench, for example Bench(F_s=1.5)")
    if progress is not None:
        checked_kind("progress", progress, Callable, "a function, or None")  # type: ignore[arg-type]
    specimens = specimens_of(models, bench or Bench())
    cells = []
    for specimen in specimens:
        for phenomenon in chosen:
            cells.append(Cell(specimen.name, phenomenon, _measured(specimen, phenomenon)))
            if progress is not None:
                progress(specimen.name, len(cells) / (len(specimens) * len(chosen)))
    return PhenomenaTable({each.name: each.title for each in specimens}, chosen, tuple(cells))


def chosen_phenomena(names: Iterable[str] | None) -> tuple[Phenomenon, ...]:
    """Return phenomena by name.

    Parameters
    ----------
    names : iterable of str, optional
        All if omitted.

    Returns
    -------
    tuple of Phenomenon
        In the order of `PHENOMENA`.

    Raises
    ------
    ParameterError
        If there is none of that name.

    Examples
    --------
    >>> [each.name for each in chosen_phenomena(["lag", "drift"])]
    ['drift', 'lag']
    """
    wanted = list(PHENOMENA)
    if names is not None:
        given = [names] if isinstance(names, str) else names
        wanted = listed("phenomena", given, "names of phenomena")
    for name in wanted:
        if not isinstance(name, str) or name not in PHENOMENA:
            raise unknown("phenomenon", name, PHENOMENA)
    return tuple(each for name, each in PHENOMENA.items() if name in wanted)


def _measured(specimen: Specimen, phenomenon: Phenomenon) -> PhenomenonResult:
    if specimen.contact is None:
        return PhenomenonResult("does not apply", (), specimen.why_not)
    try:
        return phenomenon.measure(specimen)
    except GMSError as error:  # the other experiments go on; the table says what happened
        return PhenomenonResult("failed", (), str(error))
