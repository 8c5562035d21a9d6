"""Friction in the joints of a MuJoCo model, by its callback for passive forces."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, NamedTuple, Self, TypeAlias

from gms_fsm.coupling.stepping import FrictionState, Snapshot
from gms_fsm.errors import GMSError, ParameterError
from gms_fsm.foundation.arguments import checked_kind, unknown
from gms_fsm.foundation.extras import require
from gms_fsm.run.stepped.going_back import content_of
from gms_fsm.systems.models import Model
from gms_fsm.systems.system import Contact

__all__ = ["JointFriction", "JointSwitch"]

_Callback: TypeAlias = Callable[[Any, Any], object]
_Sample: TypeAlias = tuple[float, list[float], list[Mapping[str, float]]]  # t, velocities, inputs


class JointSwitch(NamedTuple):
    """An edge that was taken in a joint."""

    t: float  # s
    joint: str
    element: int
    edge: str


def _lines(begin: Mapping[str, float], end: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Return inputs as straight lines; one that is not known before begins as it ends."""
    return {name: (begin.get(name, value), value) for name, value in end.items()}


class JointFriction:
    """Friction of joints while a block ``with`` runs, in ``mj_step`` and all that calls it.

    In each time step the velocity of a joint is a straight line, along which every switch is
    located. A time step is committed once the next one has begun, so that the stages of RK4,
    ``mj_forward`` and ``mjd_transitionFD`` may look ahead and go back.

    It replaces the joints' ``frictionloss``, which is zero inside the block and restored after it.
    Their ``damping`` remains. Other `MjData` are not changed, and a callback that was installed
    before goes on being called. MuJoCo compiles no model while any callback of Python is installed:
    compile before the block.

    If time goes back (``mj_resetData``), friction starts over as it began. To return to a state
    inside a run, take `snapshot` with ``mj_getState``, and `restore` with ``mj_setState``.

    Parameters
    ----------
    model : mujoco.MjModel
        With the joints.
    data : mujoco.MjData
        Of this model: the state to which friction is applied.
    frictions : mapping of str to Model or Contact
        By the names of hinges and slides. In a slide, friction is in N and m/s. In a hinge it is in
        Nm and rad/s: every N of its parameters is read as Nm and every m as rad.
    inputs : mapping of str to callable, optional
        By the names of joints whose friction has further inputs, such as a load or a temperature:
        a function of the data that returns their values by name. They are straight lines within a
        time step, as the velocity is.
    rtol : float
        Relative tolerance of the deflections within a time step.
    engine : {"compiled", "ifelse"}, optional
        As for `gms_fsm.FrictionState`.

    Raises
    ------
    MissingExtraError
        If MuJoCo is not installed.
    ParameterError
        If a joint is unknown or has more than one degree of freedom, or its friction cannot be
        stepped.

    Examples
    --------
    >>> import mujoco
    >>> from gms_fsm import GMS, GMSParameters
    >>> door = '''<mujoco><worldbody><body><joint name="hinge" axis="0 0 1"/>
    ...   <geom size=".1" pos=".3 0 0" mass="1"/></body></worldbody></mujoco>'''
    >>> model = mujoco.MjModel.from_xml_string(door)
    >>> data = mujoco.MjData(model)
    >>> friction = GMS(GMSParameters.paper("stick-slip"), law="signed")
    >>> data.qfrc_applied[0] = 1.0  # Nm
    >>> with JointFriction(model, data, {"hinge": friction}) as joints:
    ...     mujoco.mj_step(model, data, 500)
    >>> joints.states["hinge"]
    ('stick', 'stick', 'stick', 'stick')
    """

    def __init__(
        self,
        model: Any,
        data: Any,
        frictions: Mapping[str, Model | Contact],
        *,
        inputs: Mapping[str, Callable[[Any], Mapping[str, float]]] | None = None,
        rtol: float = 1e-6,
        engine: str | None = None,
    ) -> None:
        self._mujoco = require("mujoco", "mujoco")
        checked_kind("model", model, self._mujoco.MjModel, "a mujoco.MjModel")
        checked_kind("data", data, self._mujoco.MjData, "a mujoco.MjData")
        if data.model is not model:
            raise ParameterError(
                "it is of another model", place="data", advice="make it by mujoco.MjData(model)"
            )
        self.model, self.data = model, data
        self._frictions = dict(checked_kind("frictions", frictions, Mapping, "a mapping"))
        if not self._frictions:
            raise ParameterError(
                "it is empty", place="frictions", advice="give {'name of a joint': friction}"
            )
        self._dofs = [self._dof(name) for name in self._frictions]
        self._given = dict(checked_kind("inputs", inputs or {}, Mapping, "a mapping"))
        for name in self._given:
            if name not in self._frictions:
                raise unknown("joint", name, self._frictions, place="inputs")
        self._settings: dict[str, Any] = {"rtol": rtol, "engine": engine}
        self._active = False
        self._previous: _Callback | None = None
        self._start_over(data.time)

    def _dof(self, name: object) -> int:
        """Return the degree of freedom of a joint, or refuse it."""
        kinds, model = self._mujoco.mjtJoint, self.model
        names = [model.joint(i).name for i in range(model.njnt)]
        if name not in names:
            raise unknown("joint", name, filter(None, names), place="frictions")
        joint = model.joint(name)
        if joint.type[0] not in (int(kinds.mjJNT_HINGE), int(kinds.mjJNT_SLIDE)):
            raise ParameterError(
                "this joint has more than one degree of freedom",
                place="frictions",
                value=name,
                advice="give friction to hinges and slides",
            )
        return int(joint.dofadr[0])

    def _start_over(self, t: float) -> None:
        self._steppers = []
        for name, friction in self._frictions.items():
            try:
                stepper = FrictionState(friction, t=t, **self._settings)
                if stepper.inputs and name not in self._given:
                    raise ParameterError(
                        f"it needs the inputs {', '.join(stepper.inputs)}",
                        advice="give inputs={joint: function of the data}, or write them as "
                        "numbers: a joint gives its velocity only",
                    )
            except GMSError as error:
                raise error.inside(f"joint {name!r}") from None
            self._steppers.append(stepper)
        self._t = t  # of the last sample that was committed
        self._v, self._u = self._velocities(), self._inputs()
        self._seen = t, self._v, self._u  # by the last call
        self._forces = [0.0] * len(self._dofs)
        self._switches: list[JointSwitch] = []

    def _velocities(self) -> list[float]:
        qvel = self.data.qvel
        return [float(qvel[dof]) for dof in self._dofs]

    def _inputs(self) -> list[Mapping[str, float]]:
        """Return what each friction reads besides its velocity."""
        found = []
        for name in self._frictions:
            values = self._given[name](self.data) if name in self._given else {}
            found.append(checked_kind(f"inputs[{name!r}]", values, Mapping, "a mapping"))
        return found

    # ------------------------------------------------------------------ the block
    def __enter__(self) -> Self:
        if self._active:
            raise ParameterError("its block is running", advice="enter it once at a time")
        self._loss = self.model.dof_frictionloss[self._dofs].copy()
        self.model.dof_frictionloss[self._dofs] = 0.0
        self._previous = self._mujoco.get_mjcb_passive()
        self._mujoco.set_mjcb_passive(self._passive)
        self._active = True
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._mujoco.set_mjcb_passive(self._previous)
        self.model.dof_frictionloss[self._dofs] = self._loss
        try:
            if kind is None:
                self._catch_up()
        finally:
            self._active, self._previous = False, None

    def _passive(self, model: Any, data: Any) -> None:
        """Add the forces at the present velocities; MuJoCo calls it."""
        if self._previous is not None:
            self._previous(model, data)
        if data is not self.data:
            return
        t, v, u = self._arrive()
        dt, forces, qfrc = t - self._t, self._forces, data.qfrc_passive
        for i, dof in enumerate(self._dofs):
            forces[i] = self._steppers[i].peek(self._v[i], v[i], dt, **_lines(self._u[i], u[i]))
            qfrc[dof] -= forces[i]

    def _arrive(self) -> _Sample:
        """Commit what lies before the present step, and return time, velocities and inputs."""
        t = self.data.time
        if t < self._t:
            self._start_over(t)
        v, u, latest = self._velocities(), self._inputs(), self._seen
        if t > self._t + self.model.opt.timestep and self._t < latest[0] < t:
            self._commit(*latest)
        if t == self._t:  # a velocity may be set before the first step, or by an impact
            self._v, self._u = v, u
        self._seen = t, v, u
        return self._seen

    def _commit(self, t: float, v: list[float], u: list[Mapping[str, float]]) -> None:
        for i, (name, stepper) in enumerate(zip(self._frictions, self._steppers, strict=True)):
            stepper.advance_to(self._v[i], v[i], t, **_lines(self._u[i], u[i]))
            self._switches += [
                JointSwitch(each.t, name, each.element, each.edge) for each in stepper.switches
            ]
        self._t, self._v, self._u = t, v, u

    def _catch_up(self) -> None:
        """Commit up to the present time of the data."""
        if self._active:
            t, v, u = self._arrive()
            if t > self._t:
                self._commit(t, v, u)

    # ------------------------------------------------------------------ what it found
    @property
    def forces(self) -> dict[str, float]:
        """The force on each joint that MuJoCo was given last, N or Nm; positive against v > 0."""
        return dict(zip(self._frictions, self._forces, strict=True))

    @property
    def states(self) -> dict[str, tuple[str, ...]]:
        """Of each joint the states of its elements."""
        self._catch_up()
        return {
            name: stepper.states
            for name, stepper in zip(self._frictions, self._steppers, strict=True)
        }

    @property
    def switches(self) -> tuple[JointSwitch, ...]:
        """The edges taken since the beginning, in order of time."""
        self._catch_up()
        return tuple(sorted(self._switches, key=lambda switch: switch.t))

    # ------------------------------------------------------------------ going back
    @functools.cached_property
    def _identity(self) -> tuple[str, str]:
        """What snapshots can be exchanged with."""
        stamps, engines = zip(*(each.snapshot().of for each in self._steppers), strict=True)
        return repr(("joints", *zip(self._frictions, stamps, strict=True))), engines[0]

    def snapshot(self) -> Snapshot:
        """Return the present state of friction, to return to it with `restore`.

        Returns
        -------
        Snapshot
            For the same joints with the same frictions. The state of MuJoCo is not in it.
        """
        self._catch_up()
        parts = [stepper.snapshot() for stepper in self._steppers]
        content = list(self._v), list(self._u), parts, list(self._switches), list(self._forces)
        return Snapshot(self._t, self._identity, content)

    def restore(self, snapshot: Snapshot) -> None:
        """Return to a snapshot; call ``mj_setState`` for the state of MuJoCo.

        Parameters
        ----------
        snapshot : Snapshot
            What `snapshot` returned.

        Raises
        ------
        ParameterError
            If it is of other joints or frictions; the state stays as it was.
        """
        v, u, parts, switches, forces = content_of(snapshot, Snapshot, self._identity)
        t = snapshot.t
        for stepper, part in zip(self._steppers, parts, strict=True):
            stepper.restore(part)
        self._t, self._v, self._u, self._seen = t, list(v), list(u), (t, list(v), list(u))
        self._switches, self._forces = list(switches), list(forces)
