"""The energy balance of every element is right, and shows which laws create energy.

Heat = energy taken from the motion - rise of k z**2 / 2. In stick it grows by sigma v**2. In slip
it grows by k z (v - dz) + sigma dz v: the signed law keeps that positive while the deflection
follows the motion, but not while a spring winds up faster than it is moved (dz > v). Then it
creates energy, in one phase of slip at most what the rise of the Stribeck curve from F_c to F_s
stores, k w**2 (F_s**2 - F_c**2) / 2; with F_s = F_c none. The published law has no such bound for
v < 0.
"""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gms_fsm import (
    GMS,
    Body,
    Chart,
    ChartModel,
    Contact,
    GMSParameters,
    Prescribed,
    State,
    Stribeck,
    System,
    Trace,
    simulate,
)
from gms_fsm.traces.failures import SimulationError
from gms_fsm.traces.monitors import Passivity
from gms_fsm.traces.verdicts import PassivityVerdict
from tests.helpers import FASTEST, FIG4_SINE, one_element, stick_slip

FINE = {"rtol": 1e-9, "atol": 1e-12, "max_step": 0.05}


def passivity(trace: Trace) -> PassivityVerdict:
    found = trace.monitors["passivity"]
    assert isinstance(found, PassivityVerdict)
    return found


# --------------------------------------------------------------------------- closed forms


def slip(law: str, v: float, z0: float, t: float) -> tuple[float, float]:
    """Return the energies taken and stored for C = 0.1, s = 1, k = 2, sigma = 0.3 at constant v."""
    C, k, sigma, sign = 0.1, 2.0, 0.3, math.copysign(1.0, v)
    rest, rate = (sign, -C) if law == "signed" else (1.0, -sign * C)
    growth = math.exp(rate * t)
    z = rest + (z0 - rest) * growth
    area = rest * t + (z0 - rest) * (growth - 1.0) / rate  # integral of z
    return k * v * area + sigma * v * (z - z0), 0.5 * k * (z**2 - z0**2)


@pytest.mark.parametrize(
    ("law", "v", "z0"),
    [
        ("signed", 0.3, -0.5),
        ("signed", 0.02, 0.0),  # slower than C: a start in slip creates energy
        ("published", 0.3, 0.5),
        ("published", -0.3, 0.0),
    ],
)
def test_slip_at_constant_velocity(law: str, v: float, z0: float) -> None:
    model = one_element(law, k=2.0, sigma=0.3, F_c=1.0, F_s=1.5, v_s=1e-3, C=0.1)
    start = {"z": [z0], "states": ["slip"]}
    trace = simulate(model, Prescribed(v), 8.0, initial=start, monitors="passivity", **FINE)  # type: ignore[arg-type]
    found = passivity(trace)
    taken, stored = slip(law, v, z0, 8.0)
    assert found.taken[0] == pytest.approx(taken, abs=1e-7)
    assert found.stored[0] == pytest.approx(stored, abs=1e-7)
    heat = [taken - stored for taken, stored in (slip(law, v, z0, t) for t in trace.t.tolist())]
    assert found.deficit[0] == pytest.approx(max(0.0, -min(heat)), abs=1e-7)
    assert found.deficit[0] == 0.0 or found.t_deficit[0] == trace.t[int(np.argmin(heat))]


# --------------------------------------------------------------------------- the signed law
def motion(parts: list[tuple[float, float, float]]) -> Prescribed:
    """A sum of sines."""
    return Prescribed(" + ".join(f"{a!r}*sin({w!r}*t + {phi!r})" for a, w, phi in parts))


MOTIONS = st.lists(
    st.tuples(st.floats(0.05, 0.5), st.floats(0.3, 3.0), st.floats(0.0, 6.0)),
    min_size=1,
    max_size=3,
)


def bank(F_s: float, v_s: float, C: float) -> GMS:
    """Two elements with sigma C <= k w F_c: the damper force never exceeds the spring force."""
    parameters = GMSParameters(
        [2.0, 5.0],
        [0.2, 0.4],
        [C, 0.5 * C],
        sigma_2=0.0,
        v_c=1e-6,
        weights=[0.3, 0.1],
        stribeck=Stribeck(1.0, F_s, v_s),
    )
    return GMS(parameters, law="signed")


@pytest.mark.slow
@settings(max_examples=12, deadline=None, derandomize=True)
@given(parts=MOTIONS, C=st.floats(0.02, 1.0))
def test_with_plain_coulomb_friction_no_element_creates_energy(
    parts: list[tuple[float, float, float]], C: float
) -> None:
    """Not only overall, but between any two times."""
    found = passivity(simulate(bank(1.0, 0.05, C), motion(parts), 15.0, monitors="passivity"))
    assert found.ok
    for made, tolerance, taken in zip(found.made, found.tolerance, found.taken, strict=True):
        assert made <= tolerance
        assert tolerance < 0.02 * max(taken, 0.01)


@pytest.mark.slow
@settings(max_examples=12, deadline=None, derandomize=True)
@given(parts=MOTIONS, C=st.floats(0.02, 1.0), F_s=st.floats(1.05, 2.0), v_s=st.floats(1e-3, 0.1))
def test_a_phase_of_slip_creates_at_most_what_the_stribeck_rise_stores(
    parts: list[tuple[float, float, float]], C: float, F_s: float, v_s: float
) -> None:
    model = bank(F_s, v_s, C)
    trace = simulate(model, motion(parts), 15.0, monitors="passivity")
    found, log = passivity(trace), trace.transitions
    rise = 0.5 * np.asarray(model.values["k"]) * model.weights**2 * (F_s**2 - 1.0)
    for i in range(model.n):
        phases = int(((log.element == i) & (log.target == "slip")).sum())
        assert found.made[i] <= phases * rise[i] + found.tolerance[i]


@pytest.mark.slow
@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    stroke=st.floats(3.0, 30.0),
    w=st.floats(0.2, 2.0),
    C=st.floats(0.02, 1.0),
    F_s=st.floats(1.0, 2.0),
    v_s=st.floats(1e-3, 0.1),
)
def test_strokes_longer_than_the_pre_sliding_are_passive(
    stroke: float, w: float, C: float, F_s: float, v_s: float
) -> None:
    """Each half period slides so far that its heat exceeds the energy of the spring."""
    model = bank(F_s, v_s, C)
    amplitude = stroke * w * F_s * 0.3  # a stroke is 2 amplitude / w
    rig = Prescribed(f"{amplitude!r}*sin({w!r}*t)")
    found = passivity(simulate(model, rig, 25.0, monitors="passivity"))
    assert found.ok
    assert found.deficit == (0.0, 0.0)


def test_the_signed_law_can_create_that_much() -> None:
    """Break away fast at w F_c, stop at once, creep: the spring winds itself up to w F_s."""
    model = one_element("signed", F_c=0.5, F_s=1.5, v_s=1e-3, C=1.0, sigma=0.0)
    corners = [(0.0, 0.2), (2.6, 0.2), (2.601, 1e-5), (30.0, 1e-5)]
    found = passivity(simulate(model, Prescribed(corners), 30.0, monitors="passivity"))
    assert not found.ok
    rise = 0.5 * (1.5**2 - 0.5**2)
    slid = 0.5 * 0.1 * 0.2  # heat of the last 0.02 m before the stop
    assert found.deficit[0] == pytest.approx(rise - slid, rel=0.01)
    assert found.made[0] <= rise
    assert "mostly in slip, where dz = C * (sgn(v) - z / s)" in found.text
    assert "published" not in found.text


# --------------------------------------------------------------------------- the published law
@pytest.mark.slow
def test_the_published_law_creates_energy_in_fig_4() -> None:
    """2.16 J by element 1; checked on a fine grid from the forces, by the trapezoid rule."""
    model, rig = stick_slip("published"), Prescribed(FIG4_SINE)
    found = passivity(simulate(model, rig, 100.0, monitors="passivity"))
    times = np.linspace(0.0, 100.0, 100_001)
    fine = simulate(model, rig, 100.0, t_eval=times, engine=FASTEST)
    power = fine.F_elements * fine.v[:, np.newaxis]
    taken = np.cumsum(0.5e-3 * (power[1:] + power[:-1]), axis=0)
    heat = taken - 0.5 * model.values["k"] * fine.z[1:] ** 2
    np.testing.assert_allclose(found.deficit, np.maximum(0.0, -heat.min(axis=0)), atol=1e-4)
    assert found.deficit[0] == pytest.approx(2.1585, abs=1e-3)
    assert found.deficit[1] == pytest.approx(0.9922, abs=1e-3)
    assert found.deficit[2:] == (0.0, 0.0)
    assert not found.ok
    for part in (
        "element 1 (element 2 too) had created 2.15852 J by t = 75 s",
        "mostly in slip, where dz = sgn(v) * C * (1 - z / s)",
        "try law='signed'",
    ):
        assert part in found.text
    signed = passivity(simulate(stick_slip("signed"), rig, 100.0, monitors="passivity"))
    assert (signed.ok, signed.deficit) == (True, (0.0,) * 4)
    assert "no element gave back more energy than it had taken" in signed.text
    # Between two times it does, because the springs wind up before each arrest.
    assert signed.made[0] == pytest.approx(6.58e-4, rel=0.01)


# --------------------------------------------------------------------------- what it applies to


@pytest.mark.parametrize(
    ("force", "applicable"),
    [
        ("k * z", True),
        ("k * z + c * dz", True),
        ("k * z**3", False),
        ("k * z + c * v", False),
        ("c * dz + k * z", False),
        ("z", False),
        ("k * z + c * dz + v", False),
    ],
)
def test_other_forces_are_not_applicable(force: str, applicable: bool) -> None:
    chart = Chart(
        "own",
        inputs=("v",),
        variables=("z",),
        parameters=("k", "c"),
        states=(State("only", flow={"z": "v"}),),
        transitions=(),
        outputs={"F": force},
    )
    model = ChartModel(chart, {"k": 1.0, "c": 0.5}, n=2, stribeck=Stribeck(1.0, 1.0, 1.0))
    found = passivity(simulate(model, Prescribed("sin(t)"), 3.0, monitors="passivity"))
    assert found.ok
    assert found.applicable == applicable
    assert ("not applicable: F = " in found.text) != applicable
    assert len(found.taken) == (2 if applicable else 0)


# --------------------------------------------------------------------------- how sure it is
@functools.cache
def exactly() -> PassivityVerdict:
    """The energies of the Fig. 4 run, from fine steps."""
    model, rig = stick_slip("published"), Prescribed(FIG4_SINE)
    fine = {"rtol": 1e-10, "atol": 1e-13, "max_step": 0.02, "engine": FASTEST}
    return passivity(simulate(model, rig, 60.0, monitors="passivity", **fine))  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [{"rtol": 3e-5}, {"method": "rk4", "step": 0.01}, {"t_eval": np.linspace(0.0, 60.0, 301)}],
    ids=str,
)
def test_the_tolerance_covers_the_error_of_the_sums(options: dict[str, object]) -> None:
    """Coarse steps or few rows give the same energies as fine ones, within the stated tolerance.

    Steps that are coarser still give another motion.
    """
    model, rig = stick_slip("published"), Prescribed(FIG4_SINE)
    fine = exactly()
    options = {"engine": FASTEST, "monitors": [Passivity(1e-3)], **options}
    found = passivity(simulate(model, rig, 60.0, **options))  # type: ignore[arg-type]
    for name in ("deficit", "made"):
        for value, right, tolerance in zip(
            getattr(found, name), getattr(fine, name), found.tolerance, strict=True
        ):
            assert abs(value - right) <= tolerance, name


def test_too_few_rows_are_reported() -> None:
    model, rig = stick_slip("published"), Prescribed(FIG4_SINE)
    few = passivity(simulate(model, rig, 100.0, t_eval=[0.0, 50.0, 100.0], monitors="passivity"))
    assert "the rows are too far apart for these sums" in few.text
    assert max(few.tolerance) > 0.01
    all_of_them = passivity(simulate(model, rig, 100.0, monitors="passivity"))
    assert "far apart" not in all_of_them.text


def test_rest_is_passive() -> None:
    still = passivity(simulate(stick_slip("signed"), Prescribed(0.0), 5.0, monitors="passivity"))
    assert still.ok
    assert still.taken == still.stored == still.deficit == (0.0,) * 4


def test_a_run_that_grows_without_bound_is_checked_while_it_is_finite() -> None:
    model = one_element("published", C=50.0, F_c=1.0, F_s=1.5, v_s=1e-3)
    start = {"z": [0.5], "states": ["slip"]}
    try:
        trace = simulate(model, Prescribed(-0.1), 60.0, initial=start, monitors="passivity")
    except SimulationError as error:
        trace = error.trace
    found = passivity(trace)
    assert not found.ok
    assert "values are not finite after t = " in found.text
    assert all(math.isfinite(value) for value in (*found.taken, *found.made, *found.tolerance))


def test_a_contact_that_is_always_locked_has_no_spring() -> None:
    weld = Contact("weld", Chart("weld", ("v",), states=(State("on", locked=True),)), {})
    body = Body("one", inertia=1.0, force="1")
    trace = simulate(System("held", bodies=(body,), contacts=(weld,)), 1.0, monitors=["passivity"])
    assert "F is what holds the contact, not a spring force" in trace.monitors["passivity"].text
