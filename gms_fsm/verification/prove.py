"""Prove statements about a chart from its guards and flows, or refute them by an example.

Theory of operation. Every text of the chart becomes a formula over the real numbers, and the solver
z3 searches for a point where the statement fails. *Proved* means that there is none within the
domain. *Refuted* comes with one such point; its numbers are exact in floats, and every guard named
was evaluated there. *Settled by order*: two edges are enabled at the same time, as such a point
shows, and the machine takes the earlier one in the chart. This is not a fault, but a different
order would be a different model.
*Undecided* comes with the reason.

- Over the reals, not floats: a proof says nothing about rounding.
- Over points, not trajectories: a refuting point need not lie on the trajectory of any run.
- Inputs (``s``, ``v``) and their rates (``ds/dt``, ``dv/dt``) are free symbols: that s is a
  function of v is not used, so no transcendental function is needed. The rates are the same in
  both states of a switch: a chart alone, or a model, is moved as prescribed.
- ``sgn``, ``abs``, ``min`` and ``max`` are split by case, integer powers are products. ``exp``,
  ``sqrt``, ``sin``, ``cos``, ``tanh`` and other powers are not encoded: undecided. A quotient
  is accepted only if the domain proves its denominator nonzero.
- A chart that reads F or a, locks the contact, or sets its velocity is read for a contact on any
  system; so is one that reads v, if a free body of its system moves the contact. H, the force that
  would hold v where it is, and its rate are free, and so is W > 0, the inverse of the inertia that
  the contact feels. While the contact moves, ``a = (H - F) W`` is the rate of v; while it is
  locked, ``F = H`` and ``a = v = 0``. H and its rate are the same on both sides of a switch, of an
  impulse too.
- A chart alone is read for one element. Of a model or a contact the number of elements counts: F is
  the sum over them, and R, the force of the others, is one that states and values of theirs give.
  Elements that share a force are followed together, up to four.
- With a period a machine takes one edge at a tick at most: it has no livelock, does not chatter,
  and is not pushed back at once.
- Where other contacts move the same bodies, a statement about one instant is also tried with other
  values of H, W and v after each switch; where an impulse changes what an input follows, with
  others of that input. What then fails is undecided.
- Switches are located: an edge that waits for a time in the state is taken at that time, or with a
  period at the next tick. Of the edges that leave a state the earlier one is taken. Edges into a
  lock that take no impulse have precedence only where the velocity does not jump.

The checks. *determinism*: no two edges of one state are enabled at the same time, or their
order decides which is taken. *livelock*: no cycle of edges is taken at one point, nor cycles by
turns, nor by several elements together. *reachability*, from the graph and the guards alone: every
state can be entered and left, and every guard can hold where no earlier edge takes precedence, and
before a time in the state has ended the stay. *chattering*: no two states have flows that cross the
surfaces of the guards between them in opposite directions, each into the other's guard (to first
order in time; edges that assign variables are undecided, unless their inputs exclude each other).
*stability*: no state has an unstable equilibrium, for flows linear in the variable. *release*, for
charts with locked states: whoever lets go is not pushed back at once, into the guard of an edge
that locks it again (to first order in time). If it could be, the contact would chatter between
stuck and moving. *zeno*, for edges from a state to itself that set the velocity: impacts do not
follow each other ever sooner, infinitely many in a finite time, as those of a ball without a rest
speed. It is refuted for impacts that leave a share of the velocity under a constant load, and
proved where the guard is out of reach just after an impact; else undecided.
"""

from __future__ import annotations

from collections.abc import Sequence

from gms_fsm.charts.chart import Chart
from gms_fsm.foundation.arguments import listed, refusing
from gms_fsm.systems.models import Model
from gms_fsm.systems.parts import Contact
from gms_fsm.systems.system import System
from gms_fsm.verification._chattering import chattering
from gms_fsm.verification._checks import determinism, livelock, reachability, stability
from gms_fsm.verification._prover import Prover
from gms_fsm.verification._release import release
from gms_fsm.verification._subject import ChartSubject, subject_of
from gms_fsm.verification._zeno import zeno
from gms_fsm.verification.facts import ContactFacts, facts_of
from gms_fsm.verification.findings import CHECKS, Check, Finding, Report, Status

__all__ = ["CHECKS", "Check", "Finding", "Report", "Status", "default_domain", "prove"]


def default_domain(chart: Chart) -> tuple[str, ...]:
    """Return the conditions assumed of a chart by default.

    Parameters
    ----------
    chart : Chart
        The chart.

    Returns
    -------
    tuple of str
        The rule (`gms_fsm.Parameter`) of each input and parameter used in its guards, flows or
        assignments, if it has one.

    Examples
    --------
    >>> from gms_fsm.charts import LUGRE, gms_element
    >>> default_domain(gms_element("signed")), default_domain(LUGRE)
    (('s > 0', 'C > 0', 'v_c > 0'), ('s > 0', 'sigma_0 > 0'))
    """
    return _rules(subject_of(ContactFacts(chart)))


def _rules(subject: ChartSubject) -> tuple[str, ...]:
    used, chart = subject.used, subject.chart
    declared = chart.declared
    return tuple(
        condition
        for name in chart.inputs + chart.parameter_names
        if name in declared and name in used
        for condition in declared[name].conditions
    )


@refusing()
def prove(
    chart: Chart | Model | Contact | System,
    domain: Sequence[str] | None = None,
    *,
    contact: str = "",
) -> Report:
    """Check a chart at all points of a domain.

    Parameters
    ----------
    chart : Chart, Model, Contact or System
        The chart; only its texts are used. Of a model or a contact also the number of elements and
        the period, of a system also whether other contacts move the same bodies.
    domain : sequence of str, optional
        Conditions on its names to assume, for example ``["s >= 0", "v_c > 0"]``. The default is
        `default_domain`.
    contact : str
        The contact, in a system with several.

    Returns
    -------
    Report
        Findings, each proved, refuted by an example, or undecided with the reason.

    Raises
    ------
    MissingExtraError
        If z3 is not installed.
    ExpressionError
        If a condition cannot be parsed.
    ParameterError
        If the domain is empty, or uses a function that is not encoded.

    Examples
    --------
    >>> from gms_fsm.charts import gms_element
    >>> report = prove(gms_element("published"))  # doctest: +SKIP
    >>> finding, = report.refuted  # doctest: +SKIP
    >>> finding.check, finding.where, finding.counterexample  # doctest: +SKIP
    ('stability', ('slip',), {'C': 1.0, 'v': -1.0, 's': 1.0, 'z': 1.0})
    """
    return prove_facts(facts_of(chart, contact), domain)


def prove_facts(facts: ContactFacts, domain: Sequence[str] | None = None) -> Report:
    """Check a chart, given what a run makes of it."""
    subject = subject_of(facts)
    if domain is None:
        domain = _rules(subject)
    domain = (
        (domain,)
        if isinstance(domain, str)
        else tuple(listed("domain", domain, "a list of conditions"))
    )
    domain = (*domain, *subject.assumed)
    prover = Prover(subject, domain)
    found = tuple(finding for check in ALL for finding in check(prover))
    return Report(facts.chart, domain, found, subject.about)


ALL = (determinism, livelock, reachability, chattering, stability, release, zeno)
