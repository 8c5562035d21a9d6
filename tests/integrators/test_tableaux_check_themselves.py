"""A Butcher tableau with a wrong coefficient cannot be built, and the built-in ones are correct.

Beyond the tableaux's own checks, the fifth-order conditions, the error weights and the
dense-output weights are checked here against the theory (Hairer, Norsett & Wanner II).
"""

from __future__ import annotations

import dataclasses
import math

import pytest

from integrators import DP45, METHODS, Tableau

ALL = list(METHODS.values())
NAMED = pytest.mark.parametrize("method", ALL, ids=lambda method: method.name)


def _changed(row: tuple[float, ...], j: int, by: float) -> tuple[float, ...]:
    return (*row[:j], row[j] + by, *row[j + 1 :])


def test_methods_are_found_by_their_names() -> None:
    orders = {"euler": 1, "heun": 2, "rk4": 4, "bs23": 3, "dp45": 5}
    assert {name: method.order for name, method in METHODS.items()} == orders
    assert {m.name for m in ALL if m.adaptive} == {"bs23", "dp45"}


@NAMED
@pytest.mark.parametrize("by", [1e-9, -1e-3])
@pytest.mark.parametrize("field", ["B", "C", "E", "D"])
def test_one_wrong_coefficient_is_refused(method: Tableau, field: str, by: float) -> None:
    row = getattr(method, field)
    for j in range(len(row)):
        with pytest.raises(ValueError, match=method.name):
            dataclasses.replace(method, **{field: _changed(row, j, by)})


@NAMED
def test_one_wrong_stage_coefficient_is_refused(method: Tableau) -> None:
    for i, row in enumerate(method.A):
        for j in range(len(row)):
            wrong = (*method.A[:i], _changed(row, j, 1e-9), *method.A[i + 1 :])
            with pytest.raises(ValueError, match=rf"row {i} of A"):
                dataclasses.replace(method, A=wrong)


@NAMED
def test_two_wrong_coefficients_that_keep_the_sums_are_refused(method: Tableau) -> None:
    if len(method.B) > 1:
        wrong = _changed(_changed(method.B, 0, 1e-6), len(method.B) - 1, -1e-6)
        with pytest.raises(ValueError, match="order-2 condition"):
            dataclasses.replace(method, B=wrong)
    for i, row in enumerate(method.A):
        if len(row) >= 2:
            shifted = _changed(_changed(row, 0, 1e-6), 1, -1e-6)
            with pytest.raises(ValueError, match="condition"):
                dataclasses.replace(method, A=(*method.A[:i], shifted, *method.A[i + 1 :]))


@NAMED
def test_a_higher_order_cannot_be_claimed(method: Tableau) -> None:
    if method.order < 4:
        with pytest.raises(ValueError, match=f"order-{method.order + 1} condition"):
            dataclasses.replace(method, order=method.order + 1)


@NAMED
def test_rows_of_the_wrong_length_are_refused(method: Tableau) -> None:
    for field in ("E", "D"):
        row = getattr(method, field)
        if row:
            with pytest.raises(ValueError, match=rf"{field} must have {len(method.B) + 1} weights"):
                dataclasses.replace(method, **{field: (*row, 0.0)})
    with pytest.raises(ValueError, match="of A"):
        dataclasses.replace(method, A=(*method.A[:-1], (*method.A[-1], 0.0)))


def test_dormand_prince_has_order_five() -> None:
    a, b, c = DP45.A, DP45.B, DP45.C
    stages = range(len(b))

    def inner(values: list[float]) -> list[float]:
        return [math.fsum(a[i][j] * values[j] for j in range(i)) for i in stages]

    c1, c2, c3 = (list(power) for power in zip(*[(u, u**2, u**3) for u in c], strict=True))
    ac, ac2, ac3 = inner(c1), inner(c2), inner(c3)
    trees = {
        "c^4": ([u**4 for u in c], 1 / 5),
        "c^2 Ac": ([c[i] ** 2 * ac[i] for i in stages], 1 / 10),
        "(Ac)^2": ([ac[i] ** 2 for i in stages], 1 / 20),
        "c Ac^2": ([c[i] * ac2[i] for i in stages], 1 / 15),
        "Ac^3": (ac3, 1 / 20),
        "c A Ac": ([c[i] * inner(ac)[i] for i in stages], 1 / 30),
        "A (c Ac)": (inner([c[i] * ac[i] for i in stages]), 1 / 40),
        "A Ac^2": (inner(ac2), 1 / 60),
        "A A Ac": (inner(inner(ac)), 1 / 120),
    }
    for tree, (values, wanted) in trees.items():
        found = math.fsum(weight * value for weight, value in zip(b, values, strict=True))
        assert found == pytest.approx(wanted, abs=1e-14), tree


@pytest.mark.parametrize("method", [m for m in ALL if m.adaptive], ids=lambda m: m.name)
def test_the_error_weights_belong_to_a_method_one_order_lower(method: Tableau) -> None:
    nodes = (*method.C, 1.0)
    for power in range(method.order):
        moment = math.fsum(e * c**power for e, c in zip(method.E, nodes, strict=True))
        if power < method.order - 1:
            assert moment == pytest.approx(0.0, abs=1e-14)
        else:
            assert abs(moment) > 1e-4, "an error estimate that is always zero estimates nothing"


def test_the_dense_output_of_dormand_prince_is_exact_on_fourth_powers() -> None:
    # For y' = t^3 on [0, 1], y = t^4/4; Hermite misses it by (3/16 - ...) theta^2 (1 - theta)^2.
    nodes = (*DP45.C, 1.0)
    bump = math.fsum(d * c**3 for d, c in zip(DP45.D, nodes, strict=True))
    for theta in (0.25, 0.5, 0.9):
        hermite = 0.25 * (3 * theta**2 - 2 * theta**3) + 1.0 * (theta**3 - theta**2)
        value = hermite + theta**2 * (1 - theta) ** 2 * bump
        assert value == pytest.approx(theta**4 / 4, abs=1e-14)
