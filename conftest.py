"""Leave out the doctests of modules that need an extra that is not installed."""

from __future__ import annotations

import importlib.util

collect_ignore = []
# The classes of the full-screen debugger derive from those of Textual (extra: tui).
if not importlib.util.find_spec("textual"):
    collect_ignore += [f"gms_fsm/debugger/tui/{name}.py" for name in ("_app", "_widgets")]
# The examples compile (extra: fast).
if not importlib.util.find_spec("llvmlite"):
    collect_ignore += ["integrators/machine_code/objects.py"]
    collect_ignore += [f"gms_fsm/identification/{name}.py" for name in ("choose", "fit")]
# Adapters' examples and whole runs use the library that is served (extras of the same names).
collect_ignore += [
    path
    for name in ("control", "gymnasium", "mujoco", "pathsim")
    for path in (f"gms_fsm/adapters/{name}.py", f"tests/foreign/check_{name}.py")
    if not importlib.util.find_spec(name)
]
# Foreign tools that read exports (in dev or foreign).
collect_ignore += [
    path
    for name, paths in {
        "rumoca": ["tests/exporters/rumoca_runs.py", "tests/foreign/check_export_modelica.py"],
        "pymoca": ["tests/foreign/check_export_modelica.py"],
        "blark": ["tests/foreign/check_export_st.py"],
        "fmpy": [
            "tests/exporters/fmus.py",
            "tests/foreign/check_export_fmu.py",
        ],
    }.items()
    if not importlib.util.find_spec(name)
    for path in paths
]
