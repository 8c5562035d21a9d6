"""FMI 3.0: friction, or a system, as an FMU for Model Exchange and Co-Simulation."""

from __future__ import annotations

from gms_fsm._version import __version__
from gms_fsm.exporters._c import TAKES, WORDS
from gms_fsm.exporters._fmu import FLAGS, Described, fmu, tag, units_of
from gms_fsm.exporters._fmu_variables import Variable
from gms_fsm.exporters._registry import Exporter, register
from gms_fsm.exporters._subject import Subject

__all__ = ["fmu3"]


def fmu3(subject: Subject) -> dict[str, str | bytes]:
    """Return an FMU of FMI 3.0 and its README.

    Parameters
    ----------
    subject : Subject
        A friction or a system.

    Returns
    -------
    dict of str to (str or bytes)
        Contents by file name.
    """
    return fmu(subject, 3, _files)


def _files(it: Described) -> dict[str, str]:
    head = '<?xml version="1.0" encoding="UTF-8"?>\n'
    return {
        "modelDescription.xml": f"{head}{_description(it)}\n",
        "sources/buildDescription.xml": f"{head}{_build(it)}\n",
    }


def _build(it: Described) -> str:
    options = " ".join(each for each in FLAGS if each.startswith(("-O", "-ff")))
    files = tag(
        "SourceFileSet",
        *(tag("SourceFile", name=each) for each in it.sources),
        language="C99",
        compilerOptions=options,
    )
    configuration = tag("BuildConfiguration", files, modelIdentifier=it.name)
    return tag("fmiBuildDescription", configuration, fmiVersion="3.0")


def _description(it: Described) -> str:
    units = units_of(it.variables)
    saved = {
        "modelIdentifier": it.name,
        "canGetAndSetFMUState": True,
        "canSerializeFMUState": True,
    }
    parts = (
        [tag("ModelExchange", **saved, needsCompletedIntegratorStep=True)] if it.exchange else []
    )
    parts.append(
        tag(
            "CoSimulation",
            **saved,
            canHandleVariableCommunicationStepSize=True,
            providesIntermediateUpdate=True,
        )
    )
    parts.append(
        tag(
            "UnitDefinitions",
            *(tag("Unit", tag("BaseUnit", **base), name=text) for text, base in units.items()),
        )
    )
    types = [
        tag(
            "EnumerationType",
            *(tag("Item", name=name, value=k) for k, name in enumerate(names, 1)),
            name=kind,
        )
        for kind, names in it.types.items()
    ]
    if types:
        parts.append(tag("TypeDefinitions", *types))
    parts.append(tag("LogCategories", tag("Category", name="logStatusError")))
    parts.append(tag("DefaultExperiment", startTime=it.t_start, tolerance=it.rtol))
    every = range(len(it.variables))
    parts.append(tag("ModelVariables", *(_variable(it, k, units.keys()) for k in every)))
    structure = {
        "Output": it.outputs,
        "ContinuousStateDerivative": it.derivatives,
        "InitialUnknown": it.initial_unknowns,
        "EventIndicator": [k for k in every if it.variables[k].place == "INDICATOR"],
    }
    parts.append(
        tag(
            "ModelStructure",
            *(tag(name, valueReference=k) for name, which in structure.items() for k in which),
        )
    )
    return tag(
        "fmiModelDescription",
        *parts,
        fmiVersion="3.0",
        modelName=it.name,
        instantiationToken=it.token,
        description=it.title,
        license="MIT, for the parts from gms-fsm",
        generationTool=f"gms-fsm {__version__}",
        variableNamingConvention="structured",
    )


def _variable(it: Described, k: int, units: object) -> str:
    each: Variable = it.variables[k]
    start: float | int | None = each.start
    kind, more = "Float64", dict[str, object]()
    if each.kind:
        assert start is not None
        kind, start, more["declaredType"] = "Enumeration", int(start), each.kind
    elif each.place == "COUNT":
        kind = "Int64"
    else:
        more["unit"] = each.unit if each.unit in units else None  # type: ignore[operator]
        more["nominal"] = it.nominals.get(k)
        more["derivative"] = each.of
    if each.causality == "input":
        more["intermediateUpdate"] = True
    return tag(
        kind,
        name=each.name,
        valueReference=k,
        causality=each.causality,
        variability=each.variability,
        initial=None if each.causality in ("input", "independent") else each.initial,
        description=each.meaning,
        start=start,
        **more,
    )


register(Exporter("fmu3", "FMU of FMI 3.0: Model Exchange and Co-Simulation", fmu3, WORDS, TAKES))
