"""Switches that the tolerances do not decide: grazing, close calls, order, ties.

Near a switch the flow of the state before it is followed a little further, as if nothing fired. The
margin that crossed zero there is, with its rate m' and curvature m'', m + m' h + m'' h^2 / 2: its
extremum m - m'^2 / (2 m'') tells whether an error of the size of the tolerances could undo the
crossing, and tolerance / m' by how much it shifts it in time. Edges that are enabled now and not
after this time, or only then, are decided by less than the tolerances.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gms_fsm.charts.parameters import FloatArray
from gms_fsm.session.trust._gathering import Gathering
from gms_fsm.session.trust._path import Track, shifted
from gms_fsm.traces.verdicts import Doubt

NEARBY = 0.05  # of the step before: how far the flow is followed to find rate and curvature
HOLLOW = 0.5  # of the margins beside it: lower minima are looked at closely
SHORTEST = 1e-6  # of the run: over less, the curvature is one of rounding
MOST_ROUNDS = 100
MOST_ROWS = 50  # within which an edge is only late
AS_LONG = 3.0  # steps: an extremum further away is not that of this crossing


def switches(path: Track) -> Iterator[Doubt]:
    """Yield the findings about the switches of a run, and about those that nearly were."""
    if not path.located or not path.program.layout.n or len(path.rows) < 2:
        return
    found, fired = Gathering(), _instants(path)
    for row in fired:
        _judge_ties(path, row, found)
        _judge_crossing(path, row, found)
    for row, relation in _unanswered(path, {*fired}):
        _judge_refusal(path, row, relation, found)
    for row, relation in _minima(path):
        _judge_minimum(path, row, relation, found)
    yield from found.doubts()


def _instants(path: Track) -> list[int]:
    """Return for each instant with firings the row before the first of them."""
    rows = path.rows
    first = (rows.microstep[1:] == 1) & (rows.microstep[:-1] == 0)
    found: list[int] = np.flatnonzero(first & (rows.t[1:] == rows.t[:-1])).tolist()
    return found


# --------------------------------------------------------------------------- order
def _judge_ties(path: Track, row: int, found: Gathering) -> None:
    t, y, mode = path.at(row)
    edges = path.enabled(t, y, mode)
    tied = tuple((i, edge) for i, edge in enumerate(edges) if edge >= 0)
    if len(tied) < 2:
        return
    same, machines = _order_is_free(path, t, y, mode), [i for i, _ in tied]
    text = f"several switch at the same instant, {{when}} ({_listed(path, machines)})"
    text += (
        "; the order makes no difference"
        if same
        else "; another order gives another result; this run asks all before it takes the first"
    )
    found.add("tie", same, t, text, severity="note" if same else "warning")


def _order_is_free(path: Track, t: float, y: list[float], mode: list[int]) -> bool:
    """Return whether the first and the last enabled edge may be taken first, with one result."""
    one, other = (_settled(path, t, y, mode, last) for last in (False, True))
    return one == other


def _settled(
    path: Track, t: float, y: list[float], mode: list[int], last: bool
) -> tuple[list[float], list[int]]:
    """Take enabled edges one by one, always the first or always the last, until there is none."""
    program, y, mode = path.program, list(y), list(mode)
    for _ in range(MOST_ROUNDS):
        edges = path.enabled(t, y, mode)
        machines = [i for i, edge in enumerate(edges) if edge >= 0]
        if not machines:
            break
        i = machines[-1 if last else 0]
        program.ieee["act"](edges[i], i, t, y, mode, program.p)
    return y, mode


def _listed(path: Track, machines: Sequence[int]) -> str:
    """Return the names of elements, a stretch of them as one."""
    low, high = path.bank(machines[0]), path.bank(machines[-1])
    if low[0] is high[0] and high[1] - low[1] == len(machines) - 1 and len(machines) > 2:
        whose = path.whose(machines[0])
        return f"{whose or 'elements'} {low[1] + 1} to {high[1] + 1}"
    *most, final = map(path.who, machines)
    return f"{', '.join(most)} and {final}" if most else final


# --------------------------------------------------------------------------- crossings
def _judge_crossing(path: Track, row: int, found: Gathering) -> None:
    """Judge a switch whose comparison has just become true."""
    rows = path.rows
    step = rows.t[row] - rows.t[row - 1] if row > 0 else 0.0
    if not step > 0.0:
        return
    t, y, mode = path.at(row)
    edges = path.enabled(t, y, mode)
    machines = [i for i, edge in enumerate(edges) if edge >= 0]
    crossed = np.flatnonzero(path.crossed[row] & path.watched[row - 1]).tolist()
    if not machines or not crossed:
        return
    i = machines[0]
    bank, element = path.bank(i)
    m, rate, bend = _shape(path, row, crossed, step)
    doubt = path.uncertainty(row, crossed)
    longest = 0.0
    for k, r in enumerate(crossed):
        if _is_undone(m[k], rate[k], bend[k], doubt[k], AS_LONG * step):
            name = path.program.relations[r]
            text = (
                f"{path.whose(i) or 'an element'} switches where {name} is reached by less than "
                f"the tolerances, {{when}} ({path.edge(edges[i])} of {path.who(i)}): an error of "
                "that size would leave the switch out; a smaller rtol tells"
            )
            where = {"contact": path.whose(i), "element": element}
            found.add("grazing", bank.name, t, text, **where)  # type: ignore[arg-type]
            return
        if rate[k] != 0.0:
            longest = max(longest, doubt[k] / abs(rate[k]))
    if not 0.0 < longest < step:
        return
    later = path.enabled(*path.moved(row, longest), mode)
    for j in machines:
        if later[j] != edges[j]:
            text = (
                f"{path.edge(edges[j])} of {path.who(j)} fires {{when}}, but its guard holds for "
                f"less time than the tolerances resolve ({longest:.2g} s)"
            )
            where = {"contact": path.whose(j), "element": path.bank(j)[1]}
            found.add("close call", path.whose(j), t, text, **where)  # type: ignore[arg-type]
    others = [j for j, each in enumerate(later) if each >= 0 and edges[j] < 0]
    if others:
        at, state = path.moved(row, longest)
        same = _order_is_free(path, at, state, list(mode))
        names = _listed(path, sorted([*machines, *others]))
        text = f"{names} switch closer together than the {longest:.2g} s to which their times are "
        text += "certain, {when}"
        text += (
            "; the order makes no difference" if same else "; another order gives another result"
        )
        found.add("order", same, t, text, severity="note" if same else "warning")


def _shape(
    path: Track, row: int, chosen: Sequence[int], step: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return some margins at a row, their rates and their curvatures along its flow."""
    h = NEARBY * max(step, SHORTEST * float(path.rows.t[-1] - path.rows.t[0]))
    mode = path.at(row)[2]
    before, after = (
        np.array(path.margins_at(*path.moved(row, by), mode))[list(chosen)] for by in (-h, h)
    )
    here = path.margins[row][list(chosen)]
    with np.errstate(all="ignore"):
        return here, (after - before) / (2.0 * h), (after - 2.0 * here + before) / h**2


def _is_undone(m: float, rate: float, bend: float, doubt: float, within: float) -> bool:
    """Return whether the extremum near a crossing is within the tolerances of zero."""
    if bend == 0.0:
        return False
    away = -rate / bend
    return abs(away) <= within and abs(m - 0.5 * rate**2 / bend) <= doubt


# --------------------------------------------------------------------------- not taken
def _unanswered(path: Track, fired: set[int]) -> Iterator[tuple[int, int]]:
    """Yield rows at which a comparison turned that kept a guard false, and nothing fired."""
    t, turned = path.rows.t, path.crossed[1:] & path.watched[:-1]
    for before, r in np.argwhere(turned & (t[1:] > t[:-1])[:, None]).tolist():
        if before + 1 not in fired:
            yield before + 1, r


def _judge_refusal(path: Track, row: int, relation: int, found: Gathering) -> None:
    """Judge by how much a guard is false although the comparison that kept it false has turned."""
    t, y, mode = path.at(row)
    for i, edge in _nearly_enabled(path, row, t, y, mode).items():
        if not _is_only_late(path, i, edge, row):
            _add_miss(path, i, edge, t, found, "close call", path.program.relations[relation])


def _is_only_late(path: Track, machine: int, edge: int, row: int) -> bool:
    """Return whether an edge fires a little later, nearly enabled all the time until then."""
    log, t = path.trace.firings, path.rows.t
    coming = np.flatnonzero((log.machine == machine) & (log.t >= t[row]))
    if not coming.size or log.edge[coming[0]] != edge:
        return False
    last = int(np.searchsorted(t, log.t[coming[0]]))
    return last - row <= MOST_ROWS and all(
        machine in _nearly_enabled(path, each, *path.at(each)) for each in range(row + 1, last)
    )


def _nearly_enabled(
    path: Track, row: int, t: float, y: list[float], mode: list[int]
) -> dict[int, int]:
    """Return the edges that errors of the size of the tolerances enable, by machine."""
    states = [y]
    for j, by in enumerate(path.tolerance[row].tolist()):
        if by > 0.0:
            states += (shifted(y, j, signed) for signed in (by, -by))
    every = (enumerate(path.enabled(t, each, mode)) for each in states)
    return {i: edge for edges in every for i, edge in edges if edge >= 0}


def _add_miss(
    path: Track, i: int, number: int, t: float, found: Gathering, kind: str, name: str
) -> None:
    bank, element = path.bank(i)
    text = (
        f"{path.edge(number)} of {path.who(i)} does not fire {{when}}, by less than the "
        f"tolerances ({name}): an error of that size would take it"
    )
    found.add(kind, (bank.name, "miss"), t, text, contact=path.whose(i), element=element)  # type: ignore[arg-type]


def _minima(path: Track) -> Iterator[tuple[int, int]]:
    """Yield rows at which a comparison that keeps a guard false is nearest to zero."""
    t, m, on = path.rows.t, np.abs(path.margins), path.watched
    if len(t) < 3:
        return
    arc = (t[:-2] < t[1:-1]) & (t[1:-1] < t[2:])
    same = np.sign(path.margins[:-2]) == np.sign(path.margins[2:])
    low = (m[1:-1] <= m[:-2]) & (m[1:-1] <= m[2:]) & same & on[1:-1] & arc[:, None]
    near = m[1:-1] < HOLLOW * np.maximum(m[:-2], m[2:])
    least = m[1:-1] <= 1e-2 * np.nanmax(m, axis=0)
    for row, relation in np.argwhere(low & (near | least)):
        yield int(row) + 1, int(relation)


def _judge_minimum(path: Track, row: int, relation: int, found: Gathering) -> None:
    """Judge a comparison that comes near to zero without crossing it."""
    t = float(path.rows.t[row])
    step = min(t - path.rows.t[row - 1], path.rows.t[row + 1] - t)
    _, rate, bend = _shape(path, row, [relation], step)
    if not bend[0] or abs(rate[0] / bend[0]) > AS_LONG * step:
        return
    at, y = path.moved(row, -rate[0] / bend[0])
    mode = path.at(row)[2]
    least = path.margins_at(at, y, mode)[relation]
    if abs(least) > path.uncertainty(row, [relation])[0]:
        return
    for i, edge in _nearly_enabled(path, row, at, y, mode).items():
        if not _is_only_late(path, i, edge, row):
            _add_miss(path, i, edge, at, found, "grazing", path.program.relations[relation])
