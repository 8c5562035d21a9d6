"""Claim: friction in PathSim is that of `simulate`, sampled; it can be reset and saved."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gms_fsm import Contact, Prescribed, simulate
from gms_fsm.adapters.pathsim import friction_block
from gms_fsm.charts import CHARTS
from gms_fsm.errors import ParameterError
from tests.adapters.loops import LOAD, loaded_pad, sequence, servo_in_pathsim
from tests.helpers import pulled_mass

pathsim = pytest.importorskip("pathsim", reason="PathSim blocks are extra pathsim")
from pathsim.blocks import Scope, Source  # noqa: E402

DT = 1.0 / 128.0  # s: steps add up without rounding


def driven(block: Any, *sources: Any, **options: Any) -> Any:
    """Return a simulation that gives a block its inputs."""
    blocks = [Source(each) for each in sources]
    wires = [pathsim.Connection(source, block[port]) for port, source in enumerate(blocks)]
    return pathsim.Simulation([*blocks, block], wires, dt=DT, log=False, **options)


def speed(t: float) -> float:
    return 0.1 * float(np.sin(t))


def test_on_the_same_samples_it_is_simulate_to_the_bit() -> None:
    model, _ = pulled_mass()
    block, scope, t = friction_block(model, DT), Scope(), DT * np.arange(1281)
    simulation = driven(block, speed)
    simulation.add_block(scope)
    simulation.add_connection(pathsim.Connection(block["F"], scope))
    simulation.run(10.0)
    expected = simulate(model, Prescribed((t, [speed(each) for each in t])), 10.0, t_eval=t)
    times, (F,) = scope.read()
    assert times.tolist() == t.tolist()
    assert F[1:].tolist() == expected.F[1:].tolist()
    assert sequence(block.switches) == sequence(expected.transitions)
    assert [each.t for each in block.switches] == expected.transitions.t.tolist()
    assert len(block.switches) >= 8


def test_the_servo_at_1_khz_stops_where_it_should() -> None:
    simulation, friction, x_l = servo_in_pathsim(1e-3)
    simulation.run(0.2)
    assert x_l.state[0] == pytest.approx(LOAD, rel=5e-3)
    assert len(friction.switches) == 24


def test_a_reset_begins_again() -> None:
    simulation, friction, x_l = servo_in_pathsim(1e-3)
    simulation.run(0.05)
    first, switches = x_l.state[0], friction.switches
    assert switches
    simulation.run(0.05, reset=True)
    assert (x_l.state[0], friction.switches) == (first, switches)
    assert friction.switches is not switches


def test_a_run_can_be_continued() -> None:
    (one, whole, _), (two, parts, _) = servo_in_pathsim(1e-3), servo_in_pathsim(1e-3)
    one.run(0.1)
    two.run(0.04)
    two.run(0.06)
    assert parts.outputs["F"] == pytest.approx(whole.outputs["F"], rel=1e-9)
    assert sequence(parts.switches) == sequence(whole.switches)


def test_blocks_with_their_own_periods_do_not_disturb_each_other() -> None:
    model, _ = pulled_mass()
    fine, coarse, alone = (friction_block(model, period) for period in (DT, 4 * DT, 4 * DT))
    source = Source(speed)
    wires = [pathsim.Connection(source, fine, coarse)]
    both = pathsim.Simulation([source, fine, coarse], wires, dt=DT, log=False)
    both.run(10.0)
    driven(alone, speed).run(10.0)
    assert coarse.switches == alone.switches
    assert sequence(fine.switches) == sequence(coarse.switches)
    assert fine.switches != coarse.switches


def test_between_two_samples_the_force_is_that_of_the_present_velocity() -> None:
    model, _ = pulled_mass()
    held, fine = friction_block(model, 64 * DT), friction_block(model, DT)
    for block in (held, fine):
        driven(block, lambda t: 0.01 * t).run(48 * DT)
    assert held.friction.t == 0.0
    assert held.outputs["F"] == pytest.approx(fine.outputs["F"], rel=1e-9)


def test_a_step_that_does_not_divide_the_period_samples_late_but_right() -> None:
    model, _ = pulled_mass()
    block = friction_block(model, 1.5 * DT)
    driven(block, lambda t: 0.01 * t).run(3.0)
    exact = simulate(model, Prescribed("0.01*t"), 3.0)
    assert block.outputs["F"] == pytest.approx(exact.F[-1], rel=1e-6)


def test_a_checkpoint_holds_the_friction(tmp_path: Path) -> None:
    model, _ = pulled_mass()
    there, here = friction_block(model, DT), friction_block(model, DT)
    before = driven(there, speed)
    before.run(5.0)
    before.save_checkpoint(str(tmp_path / "run"))
    after = driven(here, speed)
    after.load_checkpoint(str(tmp_path / "run"))
    before.run(5.0)
    after.run(5.0)
    assert here.outputs["F"] == there.outputs["F"]
    assert here.friction.t == there.friction.t == 10.0
    assert here.switches == [each for each in there.switches if each.t > 5.0]


def test_what_a_contact_names_are_further_ports() -> None:
    block = friction_block(loaded_pad(), DT)
    assert block.input_port_labels == {"v": 0, "load": 1}
    driven(block, lambda t: 0.1, lambda t: 2.0 + t).run(1.0)
    assert block.outputs["F"] == pytest.approx(0.9)


@pytest.mark.parametrize("period", [0.0, -1e-3, float("nan"), "1 ms"])
def test_a_wrong_period_is_refused(period: Any) -> None:
    with pytest.raises(ParameterError, match="period"):
        friction_block(pulled_mass()[0], period)


def test_a_lock_is_refused_before_anything_runs() -> None:
    pad = Contact("pad", CHARTS["stiction"], {"F_c": 1.0, "F_s": 1.5, "b": 0.1})
    with pytest.raises(ParameterError, match="locks the contact"):
        friction_block(pad, 1e-3)


def test_a_velocity_that_is_not_finite_is_named() -> None:
    block = friction_block(pulled_mass()[0], DT)
    with pytest.raises(ParameterError, match="v1"):
        driven(block, lambda t: 0.0 if t < 1.0 else float("inf")).run(2.0)
    assert block.friction.t == pytest.approx(1.0 - DT)
