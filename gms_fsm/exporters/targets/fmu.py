"""FMUs of FMI 2.0 and FMI 3.0: friction, or a system, for Model Exchange and Co-Simulation."""

from __future__ import annotations

import functools
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from gms_fsm._version import __version__
from gms_fsm.exporters._c import TAKES, WORDS
from gms_fsm.exporters.fmi.archive import FLAGS, Described, fmu, tag, units_of
from gms_fsm.formats import Format, register

__all__: list[str] = []

HEAD = '<?xml version="1.0" encoding="UTF-8"?>\n'


@dataclass(frozen=True)
class Wording:
    """What a version of the standard calls the same things.

    Parameters
    ----------
    version : str
        As in the model description.
    token : str
        The attribute of the GUID or instantiation token.
    both, exchange, stepping : mapping
        What the FMU can do: in both kinds, in Model Exchange, in Co-Simulation.
    real, whole : str
        Elements of variables that are numbers and integers.
    """

    version: str
    token: str
    both: Mapping[str, Any]
    exchange: Mapping[str, Any]
    stepping: Mapping[str, Any]
    real: str
    whole: str


WORDINGS = {
    2: Wording(
        version="2.0",
        token="guid",
        both={
            "canNotUseMemoryManagementFunctions": True,
            "canGetAndSetFMUstate": True,
            "canSerializeFMUstate": True,
        },
        exchange={},
        stepping={"canInterpolateInputs": True},
        real="Real",
        whole="Integer",
    ),
    3: Wording(
        version="3.0",
        token="instantiationToken",
        both={"canGetAndSetFMUState": True, "canSerializeFMUState": True},
        exchange={"needsCompletedIntegratorStep": True},
        stepping={"providesIntermediateUpdate": True},
        real="Float64",
        whole="Int64",
    ),
}


def _files(it: Described, version: int) -> dict[str, str]:
    """Return the XML files that the standard wants, by their paths in the archive."""
    files = {"modelDescription.xml": f"{HEAD}{_description(it, version)}\n"}
    if version == 3:
        files["sources/buildDescription.xml"] = f"{HEAD}{_build(it)}\n"
    return files


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


def _description(it: Described, version: int) -> str:
    words, units = WORDINGS[version], units_of(it.variables)
    indicators = [k for k, each in enumerate(it.variables) if each.place == "INDICATOR"]
    # FMI 2 lists the sources here, counts the variables from 1 and leaves out the independent one,
    # which is optional there and which few importers expect.
    sources = [tag("SourceFiles", *(tag("File", name=each) for each in it.sources))]
    own = () if version == 3 else sources
    kinds = {"CoSimulation": {"canHandleVariableCommunicationStepSize": True, **words.stepping}}
    if it.exchange:
        kinds = {"ModelExchange": {**words.exchange}, **kinds}
    saved = {"modelIdentifier": it.name, **words.both}
    parts = [tag(kind, *own, **saved, **more) for kind, more in kinds.items()]
    bases = (tag("Unit", tag("BaseUnit", **base), name=text) for text, base in units.items())
    parts.append(tag("UnitDefinitions", *bases))
    if it.types:
        types = (_type(kind, names, version) for kind, names in it.types.items())
        parts.append(tag("TypeDefinitions", *types))
    parts.append(tag("LogCategories", tag("Category", name="logStatusError")))
    parts.append(tag("DefaultExperiment", startTime=it.t_start, tolerance=it.rtol))
    variables = _variables_2(it, units) if version == 2 else _variables_3(it, units)
    parts.append(tag("ModelVariables", *variables))
    structure = _structure_2(it) if version == 2 else _structure_3(it, indicators)
    parts.append(tag("ModelStructure", *structure))
    return tag(
        "fmiModelDescription",
        *parts,
        fmiVersion=words.version,
        modelName=it.name,
        **{words.token: it.token},
        description=it.title,
        license="MIT, for the parts from gms-fsm",
        generationTool=f"gms-fsm {__version__}",
        variableNamingConvention="structured",
        numberOfEventIndicators=len(indicators) if it.exchange and version == 2 else None,
    )


def _type(kind: str, names: tuple[str, ...], version: int) -> str:
    items = [tag("Item", name=name, value=k) for k, name in enumerate(names, 1)]
    if version == 3:
        return tag("EnumerationType", *items, name=kind)
    return tag("SimpleType", tag("Enumeration", *items), name=kind)


# --------------------------------------------------------------------------- variables
def _typed(
    it: Described, k: int, version: int, units: Container[str]
) -> tuple[str, dict[str, Any]]:
    """Return the element of a variable's type, and what only such variables have."""
    each, words = it.variables[k], WORDINGS[version]
    if each.kind:
        assert each.start is not None
        return "Enumeration", {"declaredType": each.kind, "start": int(each.start)}
    if each.place == "COUNT":
        return words.whole, {}
    unit = each.unit if each.unit in units else None
    return words.real, {"unit": unit, "nominal": it.nominals.get(k), "start": each.start}


def _numbered(it: Described) -> dict[int, int]:
    shown = (k for k, each in enumerate(it.variables) if each.causality != "independent")
    return {k: place for place, k in enumerate(shown, 1)}


def _variables_2(it: Described, units: Container[str]) -> Iterator[str]:
    number = _numbered(it)
    for k in number:
        each = it.variables[k]
        kind, own = _typed(it, k, 2, units)
        yield tag(
            "ScalarVariable",
            tag(kind, **own, derivative=None if each.of is None else number[each.of]),
            name=each.name,
            valueReference=k,
            causality=each.causality,
            variability=each.variability,
            initial=None if each.causality == "input" else each.initial,
            description=each.meaning,
        )


def _variables_3(it: Described, units: Container[str]) -> Iterator[str]:
    for k, each in enumerate(it.variables):
        kind, own = _typed(it, k, 3, units)
        yield tag(
            kind,
            name=each.name,
            valueReference=k,
            causality=each.causality,
            variability=each.variability,
            initial=None if each.causality in ("input", "independent") else each.initial,
            description=each.meaning,
            start=own.pop("start", None),
            **own,
            derivative=each.of,
            intermediateUpdate=True if each.causality == "input" else None,
        )


def _structure_2(it: Described) -> Iterator[str]:
    number = _numbered(it)
    for name, which in (
        ("Outputs", it.outputs),
        ("Derivatives", it.derivatives),
        ("InitialUnknowns", it.initial_unknowns),
    ):
        if which:
            yield tag(name, *(tag("Unknown", index=number[k]) for k in which))


def _structure_3(it: Described, indicators: list[int]) -> Iterator[str]:
    for name, which in (
        ("Output", it.outputs),
        ("ContinuousStateDerivative", it.derivatives),
        ("InitialUnknown", it.initial_unknowns),
        ("EventIndicator", indicators),
    ):
        yield from (tag(name, valueReference=k) for k in which)


for _version in WORDINGS:
    register(
        Format(
            f"fmu{_version}",
            "friction",
            f"FMU of FMI {_version}.0, for Simulink, Modelica tools and others",
            "gms-fsm",
            functools.partial(fmu, version=_version, describe=_files),
            words=WORDS,
            takes=TAKES,
            whole=True,
        )
    )
