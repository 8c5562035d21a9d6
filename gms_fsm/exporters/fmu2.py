"""FMI 2.0: friction, or a system, as an FMU for Model Exchange and Co-Simulation."""

from __future__ import annotations

from gms_fsm._version import __version__
from gms_fsm.exporters._c import TAKES, WORDS
from gms_fsm.exporters._fmu import Described, fmu, tag, units_of
from gms_fsm.exporters._fmu_variables import Variable
from gms_fsm.exporters._registry import Exporter, register
from gms_fsm.exporters._subject import Subject

__all__ = ["fmu2"]


def fmu2(subject: Subject) -> dict[str, str | bytes]:
    """Return an FMU of FMI 2.0 and its README.

    Parameters
    ----------
    subject : Subject
        A friction or a system.

    Returns
    -------
    dict of str to (str or bytes)
        Contents by file name.
    """
    return fmu(subject, 2, _files)


def _files(it: Described) -> dict[str, str]:
    return {"modelDescription.xml": f'<?xml version="1.0" encoding="UTF-8"?>\n{_description(it)}\n'}


def _description(it: Described) -> str:
    # The independent variable is not among them: here it is optional, and few importers expect it.
    shown = [k for k, each in enumerate(it.variables) if each.causality != "independent"]
    number = {k: place for place, k in enumerate(shown, 1)}  # variables are counted from 1
    units = units_of(it.variables)
    sources = tag("SourceFiles", *(tag("File", name=each) for each in it.sources))
    saved = {
        "modelIdentifier": it.name,
        "canNotUseMemoryManagementFunctions": True,
        "canGetAndSetFMUstate": True,
        "canSerializeFMUstate": True,
    }
    indicators = [each for each in it.variables if each.place == "INDICATOR"]
    parts = [tag("ModelExchange", sources, **saved)] if it.exchange else []
    parts.append(
        tag(
            "CoSimulation",
            sources,
            **saved,
            canHandleVariableCommunicationStepSize=True,
            canInterpolateInputs=True,
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
            "SimpleType",
            tag(
                "Enumeration",
                *(tag("Item", name=name, value=k) for k, name in enumerate(names, 1)),
            ),
            name=kind,
        )
        for kind, names in it.types.items()
    ]
    if types:
        parts.append(tag("TypeDefinitions", *types))
    parts.append(tag("LogCategories", tag("Category", name="logStatusError")))
    parts.append(tag("DefaultExperiment", startTime=it.t_start, tolerance=it.rtol))
    parts.append(tag("ModelVariables", *(_variable(it, k, number, units.keys()) for k in shown)))
    structure = {
        "Outputs": it.outputs,
        "Derivatives": it.derivatives,
        "InitialUnknowns": it.initial_unknowns,
    }
    parts.append(
        tag(
            "ModelStructure",
            *(
                tag(name, *(tag("Unknown", index=number[k]) for k in which))
                for name, which in structure.items()
                if which
            ),
        )
    )
    return tag(
        "fmiModelDescription",
        *parts,
        fmiVersion="2.0",
        modelName=it.name,
        guid=it.token,
        description=it.title,
        license="MIT, for the parts from gms-fsm",
        generationTool=f"gms-fsm {__version__}",
        variableNamingConvention="structured",
        numberOfEventIndicators=len(indicators) if it.exchange else None,
    )


def _variable(it: Described, k: int, number: dict[int, int], units: object) -> str:
    each: Variable = it.variables[k]
    start = each.start
    if each.kind:
        assert start is not None
        typed = tag("Enumeration", declaredType=each.kind, start=int(start))
    elif each.place == "COUNT":
        typed = tag("Integer")
    else:
        typed = tag(
            "Real",
            unit=each.unit if each.unit in units else None,  # type: ignore[operator]
            nominal=it.nominals.get(k),
            start=start,
            derivative=None if each.of is None else number[each.of],
        )
    return tag(
        "ScalarVariable",
        typed,
        name=each.name,
        valueReference=k,
        causality=each.causality,
        variability=each.variability,
        initial=None if each.causality == "input" else each.initial,
        description=each.meaning,
    )


register(Exporter("fmu2", "FMU of FMI 2.0: Model Exchange and Co-Simulation", fmu2, WORDS, TAKES))
