"""The command line executes its verbs, and reports a mistake with one message and exit code 2."""

from __future__ import annotations

import pytest

from gms_fsm import GMS, GMSParameters, Prescribed, __version__
from gms_fsm.lowering.program import lower
from tests.scenario_files import CommandLine


@pytest.mark.parametrize("law", ["signed", "published"])
def test_code_prints_the_generated_program(law: str, gms_fsm: CommandLine) -> None:
    done = gms_fsm("code", "--law", law)
    assert done.code == 0, done.err
    model = GMS(GMSParameters.paper("stick-slip"), law=law)  # type: ignore[arg-type]
    head, _, body = lower(model, Prescribed("0.15*sin(2*pi*t/25)")).source.partition("\n\n")
    assert done.out.startswith(head)
    assert body in done.out
    assert done.out.endswith('if __name__ == "__main__":\n    _main()\n')


def test_code_for_other_rigs(gms_fsm: CommandLine) -> None:
    assert (
        "stiffness * (speed * t - x)" in gms_fsm("code", "--law", "signed", "--rig", "pulled").out
    )
    assert "(F_a - F) / mass" in gms_fsm("code", "--law", "signed", "--rig", "slider").out


def test_version_and_help(gms_fsm: CommandLine) -> None:
    assert gms_fsm("--version").out == f"gms-fsm {__version__}\n"
    help_text = gms_fsm("--help").out
    assert "paper" in help_text
    assert "code" in help_text
