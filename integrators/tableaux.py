"""Butcher tableaux of the explicit methods, as frozen data with self-checks.

References
----------
E. Hairer, S. P. Norsett, G. Wanner, *Solving Ordinary Differential Equations I*, II.4-II.6.
J. R. Dormand, P. J. Prince (1980); P. Bogacki, L. F. Shampine (1989).
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["BS23", "DP45", "EULER", "HEUN", "METHODS", "RK4", "Tableau"]

Row = tuple[float, ...]


@dataclass(frozen=True)
class Tableau:
    """An explicit Runge-Kutta method.

    All methods share one dense output: the cubic Hermite polynomial through both ends and both
    slopes, plus ``theta^2 (1 - theta)^2 h sum(D_i k_i)`` where a method has coefficients D.

    Parameters
    ----------
    name : str
        The name that users write.
    order : int
        Order p of the solution that is propagated.
    A : tuple of tuple of float
        Row i contains the i coefficients of stage i.
    B, C : tuple of float
        Weights and nodes, one per stage.
    E : tuple of float
        Error weights, one per stage and one for the slope at the step's end; empty for a method
        without an error estimate.
    D : tuple of float
        Dense-output weights, like E; empty for plain Hermite.

    Raises
    ------
    ValueError
        If rows do not sum to C, or an order condition up to order 4 fails.

    Examples
    --------
    >>> DP45.order, len(DP45.B)
    (5, 6)
    """

    name: str
    order: int
    A: tuple[Row, ...]
    B: Row
    C: Row
    E: Row = ()
    D: Row = ()

    def __post_init__(self) -> None:
        stages = range(len(self.B))
        for i in stages:
            if len(self.A[i]) != i or abs(sum(self.A[i]) - self.C[i]) > 1e-14:
                raise ValueError(f"{self.name}: row {i} of A does not sum to C[{i}]")
        c, b, a = self.C, self.B, self.A
        inner = [sum(a[i][j] * c[j] for j in range(i)) for i in stages]
        inner2 = [sum(a[i][j] * c[j] ** 2 for j in range(i)) for i in stages]
        inner3 = [sum(a[i][j] * inner[j] for j in range(i)) for i in stages]
        conditions = [
            (1, sum(b), 1.0),
            (2, sum(b[i] * c[i] for i in stages), 1 / 2),
            (3, sum(b[i] * c[i] ** 2 for i in stages), 1 / 3),
            (3, sum(b[i] * inner[i] for i in stages), 1 / 6),
            (4, sum(b[i] * c[i] ** 3 for i in stages), 1 / 4),
            (4, sum(b[i] * c[i] * inner[i] for i in stages), 1 / 8),
            (4, sum(b[i] * inner2[i] for i in stages), 1 / 12),
            (4, sum(b[i] * inner3[i] for i in stages), 1 / 24),
        ]
        for order, value, wanted in conditions:
            if order <= self.order and abs(value - wanted) > 1e-14:
                raise ValueError(f"{self.name}: an order-{order} condition gives {value}")
        for name in ("E", "D"):
            row: Row = getattr(self, name)
            if row and (len(row) != len(b) + 1 or abs(sum(row)) > 1e-13):
                raise ValueError(f"{self.name}: {name} must have {len(b) + 1} weights, sum 0")

    @property
    def adaptive(self) -> bool:
        """Whether the method estimates its own error."""
        return bool(self.E)


EULER = Tableau("euler", 1, A=((),), B=(1.0,), C=(0.0,))
HEUN = Tableau("heun", 2, A=((), (1.0,)), B=(1 / 2, 1 / 2), C=(0.0, 1.0))
RK4 = Tableau(
    "rk4",
    4,
    A=((), (1 / 2,), (0.0, 1 / 2), (0.0, 0.0, 1.0)),
    B=(1 / 6, 1 / 3, 1 / 3, 1 / 6),
    C=(0.0, 1 / 2, 1 / 2, 1.0),
)
BS23 = Tableau(
    "bs23",
    3,
    A=((), (1 / 2,), (0.0, 3 / 4)),
    B=(2 / 9, 1 / 3, 4 / 9),
    C=(0.0, 1 / 2, 3 / 4),
    E=(5 / 72, -1 / 12, -1 / 9, 1 / 8),
)
DP45 = Tableau(
    "dp45",
    5,
    A=(
        (),
        (1 / 5,),
        (3 / 40, 9 / 40),
        (44 / 45, -56 / 15, 32 / 9),
        (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
        (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    ),
    B=(35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    C=(0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0),
    E=(-71 / 57600, 0.0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40),
    D=(
        -12715105075 / 11282082432,
        0.0,
        87487479700 / 32700410799,
        -10690763975 / 1880347072,
        701980252875 / 199316789632,
        -1453857185 / 822651844,
        69997945 / 29380423,
    ),
)
METHODS = {tableau.name: tableau for tableau in (EULER, HEUN, RK4, BS23, DP45)}
