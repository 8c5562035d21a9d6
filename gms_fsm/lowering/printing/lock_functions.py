"""Writes the functions that only locks need: what follows them, and what has moved them."""

from __future__ import annotations

from gms_fsm.lowering.printing.forces import ForceWriter
from gms_fsm.lowering.printing.lines import CodeLine
from gms_fsm.lowering.printing.names import MARKS, REASONS


class LockFunctions(ForceWriter):
    """Writes these functions; without locks they are empty."""

    @property
    def marks(self) -> str:
        """The numbers of the loop that texts call by names."""
        marks = {**REASONS, **(MARKS if self.locking else {})}
        return f"{', '.join(marks)} = {', '.join(map(str, marks.values()))}  # marks of the loop"

    def moved_locks(self) -> list[CodeLine]:
        """Write that the force on a locked contact that an impulse has moved has no limit."""
        lines: list[CodeLine] = []
        for bank in self.read.banks if self.locking else ():
            if bank.locked:
                lines.append(CodeLine(f"if jolt[{self.machine(bank.index, '0')}] == LET_GO:"))
                for force, v in zip(bank.forces, bank.velocities, strict=True):
                    text = f"    {self.local(force)} = {self.local(v)} * ENDLESS"
                    lines.append(CodeLine(text, frozenset({v})))
        return lines

    def follow(self) -> list[str]:
        """Return the function that sets the velocities which locked contacts determine."""
        y, lines = self.layout.y, list[CodeLine]()
        if self.locking:
            lines = self.locks.following()
            for each in self.locks.followers():
                v = self.locks.velocity(self.locks.bodies[each])
                lines.append(CodeLine(f"y[{y.text(v)}] = {self.local(v)}", frozenset({v})))
        return self.function(
            "follow(t, y, mode, held, p)",
            "y = the velocities that locked contacts determine.",
            lines,
            "given",
        )

    def jolts(self) -> list[str]:
        """Return the function that marks the contacts whose velocities differ from before."""
        return self.function(
            "jolts(t, y, mode, p, least, mark, was, jolt)",
            "was = velocities of contacts that lock; mark the ones that differ from it.",
            [*self.driven_accelerations(), *self.locks.jolts()] if self.locking else [],
            "live",
        )
