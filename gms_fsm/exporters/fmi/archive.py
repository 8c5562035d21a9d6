"""FMUs: the archive, its binary, its documentation; what both versions of FMI have in common.

One FMU offers Model Exchange and Co-Simulation. The XML text is made in `fmu`.
"""

from __future__ import annotations

import hashlib
import html
import io
import platform
import shutil
import subprocess
import tempfile
import uuid
import warnings
import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

from gms_fsm._version import __version__
from gms_fsm.exporters._adapting import check_first_call
from gms_fsm.exporters._c import WORDS, filled
from gms_fsm.exporters._subject import Subject
from gms_fsm.exporters.fmi.model import FmuModel
from gms_fsm.exporters.fmi.variables import FmuVariable, types_of, variables_of
from gms_fsm.foundation.quantities import base_units
from gms_fsm.foundation.text import encoded, visible

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden")
_SYSTEMS = {  # by operating system: folders of FMI 2, system of FMI 3, ending
    "Linux": ("linux", "linux", ".so"),
    "Darwin": ("darwin", "darwin", ".dylib"),
    "Windows": ("win", "windows", ".dll"),
}
_MACHINES = {"x86_64": "x86_64", "AMD64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
HELD = {
    2: """\
Give input derivatives (`fmi2SetRealInputDerivatives`): inputs are then straight lines during a
step. Without them they are held.""",
    3: """\
Inputs are straight lines during a step if the importer sets them, for the end of the step, in the
intermediate update callback that the FMU makes before each step. Otherwise they are held.""",
}
ONLY_HELD = {
    2: "`fmpy simulate` holds inputs (with `set_input_derivatives=True`, FMPy 0.3.32 stops).",
    3: "`fmpy simulate` holds inputs.",
}
EPOCH = (1980, 1, 1, 0, 0, 0)  # of all files: the same model gives the same bytes
NO_EXCHANGE = """\
## Model Exchange

There is none: a chart reads how fast an input changes, which an importer does not tell there.

"""
LICENCE = """\
The C text is a part of gms-fsm; what it describes is yours.

MIT License

Copyright (c) 2026 The gms-fsm founders

Permission is hereby granted, free of charge, to any person obtaining a copy of this software and
associated documentation files (the "Software"), to deal in the Software without restriction,
including without limitation the rights to use, copy, modify, merge, publish, distribute,
sublicense, and/or sell copies of the Software, and to permit persons to whom the Software is
furnished to do so, subject to the following conditions:

The above copyright notice and this permission notice shall be included in all copies or substantial
portions of the Software.

THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT
NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND
NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES
OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN
CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.
"""


@dataclass(frozen=True)
class Described:
    """What a model description tells.

    Parameters
    ----------
    name, title : str
        Model identifier, and the title for people.
    token : str
        GUID or instantiation token.
    variables : tuple of FmuVariable
        By value reference.
    types : mapping of str to tuple of str
        Enumerations: the names of the states.
    exchange : bool
        Whether there is Model Exchange.
    t_start : float
        s.
    rtol : float
        Relative tolerance.
    nominals : mapping of int to float
        Of the continuous states, by value reference.
    sources : tuple of str
        Files to be compiled.
    """

    name: str
    title: str
    token: str
    variables: tuple[FmuVariable, ...]
    types: Mapping[str, tuple[str, ...]]
    exchange: bool
    t_start: float
    rtol: float
    nominals: Mapping[int, float]
    sources: tuple[str, ...]

    @property
    def derivatives(self) -> list[int]:
        """References of the derivatives of the continuous states."""
        return [k for k, each in enumerate(self.variables) if each.of is not None]

    @property
    def outputs(self) -> list[int]:
        """References of the outputs."""
        return [k for k, each in enumerate(self.variables) if each.causality == "output"]

    @property
    def initial_unknowns(self) -> list[int]:
        """References of the outputs and derivatives that are computed at the start."""
        wanted = {*self.outputs, *self.derivatives}
        return [k for k in sorted(wanted) if self.variables[k].calculated]


def fmu(
    subject: Subject, version: int, describe: Callable[[Described, int], Mapping[str, str]]
) -> dict[str, str | bytes]:
    """Return an FMU and its README."""
    start = subject.start
    check_first_call(subject, WORDS)
    exchange = "piecewise_slope(" not in start.program.source
    variables = variables_of(subject, exchange=exchange)
    model = FmuModel(subject, variables, exchange=exchange)
    digest = hashlib.sha256(repr((version, model.engine(), variables)).encode()).hexdigest()
    token = f"{{{uuid.UUID(digest[:32])}}}"
    sources = model.sources(version, token)
    described = Described(
        name=subject.name,
        title=subject.title,
        token=token,
        variables=variables,
        types=types_of(start),
        exchange=exchange,
        t_start=subject.t_start,
        rtol=start.options.rtol,
        nominals=model.nominals,
        sources=tuple(name for name in sources if name.endswith(".c")),
    )
    binary, why = _binary(subject.name, version, sources)
    readme = _readme(subject, described, version, why)
    files: dict[str, str | bytes] = {**describe(described, version)}
    files |= {f"sources/{name}": text for name, text in sources.items()}
    files |= binary
    files["documentation/index.html"] = _page(subject.title, readme)
    folder = "documentation" if version == 2 else "documentation/licenses"
    files[f"{folder}/license.txt"] = LICENCE
    return {
        _file(subject.name, version): _archive(files),
        f"README-{subject.name}-fmu{version}.md": readme,
    }


def _file(name: str, version: int) -> str:
    """Return the archive's name: those of both versions can be in one folder."""
    return f"{name}_fmi{version}.fmu"


def _archive(files: Mapping[str, str | bytes]) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for name, content in files.items():
            info = zipfile.ZipInfo(name, EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o644 << 16
            archive.writestr(info, encoded(content) if isinstance(content, str) else content)
    return data.getvalue()


# --------------------------------------------------------------------------- binary
def _binary(
    name: str, version: int, sources: Mapping[str, str]
) -> tuple[dict[str, str | bytes], str]:
    """Return the binary for this machine by its path, or why there is none."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    folder, ending = _platform(version)
    if compiler is None:
        why = "no C compiler was found (cc, gcc, clang)"
    elif not folder:
        why = f"FMI {version} has no name for {platform.system()} on {platform.machine()}"
    else:
        with tempfile.TemporaryDirectory() as place:
            for each, text in sources.items():
                (Path(place) / each).write_bytes(encoded(text))
            made = Path(place) / f"{name}{ending}"
            compiled = [each for each in sources if each.endswith(".c")]
            command = [compiler, *FLAGS, *compiled, "-o", made.name, "-lm"]
            done = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False)
            if done.returncode == 0:
                return {f"binaries/{folder}/{name}{ending}": made.read_bytes()}, ""
        first = (done.stderr.strip().splitlines() or ["no message"])[0]
        why = f"{' '.join(command)} failed: {first}"
    warnings.warn(f"the FMU has no binary: {why}", stacklevel=6)
    return {}, why


def _platform(version: int) -> tuple[str, str]:
    """Return the folder for binaries of this machine, empty if there is none, and their ending."""
    plain, system, ending = _SYSTEMS.get(platform.system(), ("", "", ""))
    machine = _MACHINES.get(platform.machine(), "")
    if not system or not machine:
        return "", ending
    if version == 3:
        return f"{machine}-{system}", ending
    return (f"{plain}64" if machine == "x86_64" or system == "darwin" else ""), ending


# --------------------------------------------------------------------------- XML
def tag(name: str, /, *inside: str, **attributes: object) -> str:
    """Return an XML element.

    Examples
    --------
    >>> print(tag("a", tag("b", x=1.5), y=True))
    <a y="true">
      <b x="1.5"/>
    </a>
    """
    texts = {
        key: str(value).lower() if isinstance(value, bool) else str(value)
        for key, value in attributes.items()
        if value is not None and value != ""
    }
    head = "".join([name, *(f" {key}={quoteattr(visible(text))}" for key, text in texts.items())])
    if not inside:
        return f"<{head}/>"
    lines = [f"  {line}" for each in inside for line in each.splitlines()]
    return "\n".join([f"<{head}>", *lines, f"</{name}>"])


def units_of(variables: Iterable[FmuVariable]) -> dict[str, dict[str, int]]:
    """Return the units that can be read, with their exponents."""
    found = {each.unit: base_units(each.unit) for each in variables if each.unit}
    return {text: found[text] or {} for text in sorted(found) if found[text] is not None}


# --------------------------------------------------------------------------- documentation
def _readme(subject: Subject, described: Described, version: int, why: str) -> str:
    variables, (folder, ending) = described.variables, _platform(version)
    charts = dict.fromkeys(contact.chart.name for contact in subject.start.system.machines)
    inputs, outputs = (
        "\n".join(_line(each) for each in variables if each.causality == causality)
        for causality in ("input", "output")
    )
    return filled(
        "fmi/fmu.md",
        title=visible(subject.title),
        version=version,
        writer=__version__,
        name=described.name,
        file=_file(described.name, version),
        what="friction whose velocity is an input" if subject.alone else "a whole system",
        kinds="Model Exchange and Co-Simulation" if described.exchange else "Co-Simulation",
        charts=visible(", ".join(charts)),
        binary=f"There is no binary in it: {why}. Compile the sources."
        if why
        else f"The binary is for {folder}; for other machines compile the sources.",
        exchange=filled("fmi/fmu_exchange.md") if described.exchange else NO_EXCHANGE,
        flags=" ".join(FLAGS),
        sources=" ".join(described.sources),
        ending=ending or ".so",
        inputs=f"Inputs:\n\n{inputs}" if inputs else "There are no inputs.",
        outputs=f"Outputs:\n\n{outputs}",
        rtol=f"{described.rtol:g}",
        held=_held(subject, described, version),
    )


def _held(subject: Subject, described: Described, version: int) -> str:
    """Return what inputs are during a step, the danger in it, and a loop that avoids it."""
    inputs = [each.name for each in described.variables if each.causality == "input"]
    if not inputs:
        return ""
    file = _file(described.name, version)
    loop = filled(
        f"fmi/fmi{version}_loop.md",
        file=file,
        name=described.name,
        input=inputs[0],
        output=described.variables[described.outputs[0]].name,
        start=repr(subject.t_start),
    )
    return filled("fmi/fmu_inputs.md", held=HELD[version], only_held=ONLY_HELD[version], loop=loop)


def _line(each: FmuVariable) -> str:
    unit = f" [{each.unit}]" if each.unit else ""
    return f"- `{each.name}`{unit} {visible(each.meaning)}".rstrip()


def _page(title: str, readme: str) -> str:
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>'
        f"{html.escape(visible(title))}"
        f"</title></head>\n<body><pre>\n{html.escape(readme)}</pre></body></html>\n"
    )
