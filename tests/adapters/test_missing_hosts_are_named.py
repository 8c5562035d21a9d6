"""Claim: without their host, adapters say what to install: when called, or when imported."""

from __future__ import annotations

import importlib
import sys

import pytest

from gms_fsm.adapters import pathsim
from gms_fsm.adapters.control import friction_system
from gms_fsm.adapters.mujoco import JointFriction
from gms_fsm.errors import MissingExtraError
from tests.helpers import pulled_mass


def test_pathsim(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pathsim.blocks", None)
    pathsim._block_class.cache_clear()
    with pytest.raises(MissingExtraError, match=r'pathsim.*pip install "gms-fsm\[pathsim\]"'):
        pathsim.friction_block(pulled_mass()[0], 1e-3)


def test_control(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(MissingExtraError, match=r'control.*pip install "gms-fsm\[control\]"'):
        friction_system(pulled_mass()[0], 1e-3)


def test_mujoco(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r'mujoco.*pip install "gms-fsm\[mujoco\]"'):
        JointFriction(None, None, {"hinge": pulled_mass()[0]})


def test_gymnasium(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.delitem(sys.modules, "gms_fsm.adapters.gymnasium", raising=False)
    with pytest.raises(MissingExtraError, match=r'gymnasium.*pip install "gms-fsm\[gymnasium\]"'):
        importlib.import_module("gms_fsm.adapters.gymnasium")
