"""The command line. A user's mistake is answered by one message and exit code 2.

Each verb of `gms_fsm.app.verbs` imports what it needs when it runs, so that help, completion and
error messages appear at once.
"""

from __future__ import annotations

import copy
import itertools
import re
import sys
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, get_args

import typer
from typer.core import TyperCommand, TyperGroup, TyperOption

import gms_fsm
from gms_fsm.app.verbs.card import benchmark_command
from gms_fsm.app.verbs.charts import (
    blocks_command,
    chart_command,
    check_command,
    code_command,
    handout_command,
)
from gms_fsm.app.verbs.console import error_line, note, put
from gms_fsm.app.verbs.cover import cover_command
from gms_fsm.app.verbs.difference import diff_command
from gms_fsm.app.verbs.export import export_command
from gms_fsm.app.verbs.fit import fit_command
from gms_fsm.app.verbs.runs import (
    class_command,
    copy_command,
    cycle_command,
    dap_command,
    debug_command,
    lesson_command,
    paper_command,
    phenomena_command,
    run_command,
    schema_command,
    sweep_command,
)
from gms_fsm.app.verbs.traces import animate_command, play_command, plot_command, replay_command
from gms_fsm.errors import GMSError
from gms_fsm.scenarios import shipped


@dataclass
class CliOptions:
    """The options before the verb."""

    debug: bool = False


_UsageError: Any = typer.BadParameter.__base__  # of click, or of its copy in newer typers
_MEANT = {
    "simulate": "run",
    "start": "run",
    "draw": "chart",
    "prove": "check",
    "verify": "check",
    "compare": "diff",
    "film": "animate",
    "live": "play",
    "step": "debug",
    "identify": "fit",
    "teach": "lesson",
    "trust": "run --trust",
    "coverage": "cover",
    "list": "run --list",
    "scenarios": "run --list",
    "help": "--help",
    "version": "--version",
    "new": "copy",
    "optimise": "fit",
    "figures": "plot",
}


FEW = 8  # options that a message lists


class _Verbs(TyperGroup):
    """The verbs; ``--debug`` is accepted before or after one."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        if args and args[0] in _MEANT:
            raise _UsageError(f"No such command {args[0]!r}. Did you mean {_MEANT[args[0]]!r}?")
        return super().resolve_command(ctx, args)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        options = args[: args.index("--")] if "--" in args else args
        if "--debug" in options:
            args = ["--debug", *(a for a in options if a != "--debug"), *args[len(options) :]]
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except typer.BadParameter as error:  # newer versions of typer pass on pydantic's prefix
            error.message = error.message.removeprefix("Value error, ")
            raise


class _Verb(TyperCommand):
    """A verb; an option or argument that it does not have is answered with what is meant."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        given = [*args]  # parsing empties the list
        try:
            return super().parse_args(ctx, args)
        except _UsageError as error:
            param = getattr(error, "param", None)  # the missing one
            help_ = "" if error.message or param is None else str(getattr(param, "help", ""))
            cures = self.cures(given, error.message)
            said = [error.message.rstrip("."), help_.rstrip("."), *cures]
            error.message = ". ".join(filter(None, said))
            raise

    def cures(self, args: list[str], message: str) -> Iterator[str]:
        """Yield what could be meant by arguments that are not taken."""
        from gms_fsm.app._tables import RunTable
        from gms_fsm.charts.gms import LAWS

        known = {option for param in self.params for option in param.opts}
        alone = [
            each for before, each in zip(["", *args], args, strict=False) if before not in known
        ]
        if "--set" in known and "--law" in args:
            yield "A scenario has its law as a key: --set model.law=signed"
        over = "--over" in known and "--over" not in args
        for each in alone:
            if over and re.fullmatch(r"[\w.]+=.*", each):
                yield f"What varies is named by --over {each.partition('=')[0]}=from:to:count"
            elif "--set" in known and re.fullmatch(r"[\w.]+=.*", each):
                yield f"A key is changed by --set {each}"
            if "--law" in known and each in LAWS:
                yield f"A law is chosen by --law {each}"
        between = r"--(set|vary) ([\w.]+)(?: = ?|= | (?=[-\d\[]))([^\s=]+)"
        parted = re.search(between, " ".join(args))
        extra = re.search(r"unexpected extra argument.*\(([^\s=]+[./\\][^\s=]*)\)", message)
        if parted:
            what = "key is changed" if parted[1] == "set" else "range is given"
            yield f"A {what} without blanks: --{parted[1]} {parted[2]}={parted[3]}"
        elif "-out" in args and "--output" in known:
            folder = dict(itertools.pairwise(args)).get("-out", "...")
            yield f"What is written is named by -o {folder}"
        elif extra and "--output" in known:
            yield f"What is written is named by -o {extra[1]}"
        elif surplus := re.search(r"unexpected extra argument.*\(([^\s)]+)", message):
            yield from self._one_alone(args, surplus[1])
        ends = any("ending in" in str(getattr(param, "help", "")) for param in self.params)
        if ends and {"--to", "--format"} & ({*args} - known):
            yield "What it becomes is said by the ending of its name: -o NAME.pdf"
        option = re.match(r"No such option:? '?(-+([\w-]+))", message)
        name = option[2].replace("-", "_") if option else ""
        keys = [each for each in RunTable.model_fields if name and each.startswith(name)]
        value = dict(itertools.pairwise(args)).get(option[1], "...") if option else "="
        if keys and "--set" in known and "=" not in value:
            yield f"A key of the run is changed by --set run.{keys[0]}={value}"
        if {"-o", "--output"} & {*args} and "--output" not in known:
            yield f"It prints: gms-fsm {self.name} ... > FILE"
        elif option and len(known) <= FEW:
            yield f"{self.name} takes {', '.join(sorted(u for u in known if u.startswith('--')))}"

    def _one_alone(self, args: list[str], surplus: str) -> Iterator[str]:
        """Yield what is meant by an argument after the last one that is taken."""
        flags = [
            each for param in self.params if getattr(param, "is_flag", 0) for each in param.opts
        ]
        before = dict(zip(args[1:], args, strict=False)).get(surplus, "")
        if before in flags:
            yield f"{before} takes no value: leave {surplus} out"
        elif self.name == "class":
            yield f"What is written is named by -o {surplus}"
        elif self.name == "run" and (name := f"{before}_{surplus}") in shipped():
            yield f"Did you mean {name!r}?"
        elif self.name == "run":
            yield f"It runs one scenario at a time: gms-fsm run {surplus} is another call"


class _Drawing(_Verb):
    """A verb whose help lists file endings: ``{chart}`` stands for those of charts, and so on."""

    def get_params(self, ctx: Any) -> Any:
        from plots.output import formats

        params = [copy.copy(each) for each in super().get_params(ctx)]  # a command is asked again
        listed: dict[str, str] = {each: formats.listed(each) for each in get_args(formats.Written)}
        listed["chart"] = formats.listed("graph", "chart")
        for param in params:
            if isinstance(param, TyperOption) and param.help:
                param.help = param.help.format(**listed)
        return params


app = typer.Typer(
    name="gms-fsm",
    cls=_Verbs,
    help="Friction as an explicit state machine: the Generalized Maxwell Slip model.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        put(f"gms-fsm {gms_fsm.__version__}")
        raise typer.Exit


@app.callback()
def root(
    context: typer.Context,
    _version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_show_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of an error and its causes.")
    ] = False,
) -> None:
    """Friction as an explicit state machine: the Generalized Maxwell Slip model."""
    context.ensure_object(CliOptions).debug = debug


app.command("paper", cls=_Verb)(paper_command)
app.command("run", cls=_Verb)(run_command)
app.command("copy", cls=_Verb)(copy_command)
app.command("sweep", cls=_Verb)(sweep_command)
app.command("cycle", cls=_Verb)(cycle_command)
app.command("fit", cls=_Verb)(fit_command)
app.command("phenomena", cls=_Verb)(phenomena_command)
app.command("schema", cls=_Verb)(schema_command)
app.command("chart", cls=_Drawing)(chart_command)
app.command("check", cls=_Verb)(check_command)
app.command("diff", cls=_Drawing)(diff_command)
app.command("cover", cls=_Drawing)(cover_command)
app.command("blocks", cls=_Drawing)(blocks_command)
app.command("handout", cls=_Drawing)(handout_command)
app.command("plot", cls=_Verb)(plot_command)
app.command("animate", cls=_Drawing)(animate_command)
app.command("replay", cls=_Drawing)(replay_command)
app.command("play", cls=_Drawing)(play_command)
app.command("debug", cls=_Verb)(debug_command)
app.command("dap", cls=_Verb)(dap_command)
app.command("lesson", cls=_Verb)(lesson_command)
app.command("class", cls=_Verb)(class_command)
app.command("code", cls=_Verb)(code_command)
app.command("export", cls=_Verb)(export_command)
app.command("benchmark", cls=_Verb)(benchmark_command)


def main() -> None:
    """Run the command line; print a user's mistake as one message and exit with code 2."""
    warnings.showwarning = note
    options = CliOptions()
    try:
        app(obj=options)
    except GMSError as error:
        if options.debug:
            _show_causes(error)
            raise
        error_line("\n".join([str(error), *getattr(error, "__notes__", ())]))
        sys.exit(2)


def _show_causes(error: BaseException | None) -> None:
    """Make the traceback of an error include its causes."""
    while error is not None:
        error.__suppress_context__ = False
        error = error.__context__
