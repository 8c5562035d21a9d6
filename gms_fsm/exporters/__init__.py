"""Exports: friction handed over to other programs, one file of `targets` for each format.

The formats are rows of one table (`gms_fsm.formats`); `formats` returns those of friction and of
its chart. Each module of `targets` registers its own.
"""

import importlib
import pkgutil

from gms_fsm.exporters import targets
from gms_fsm.exporters._registry import export, formats
from gms_fsm.exporters._subject import Subject
from gms_fsm.formats import FORMATS, Format, register

__all__ = ["FORMATS", "Format", "Subject", "export", "formats", "register"]

for _module in pkgutil.iter_modules(targets.__path__):
    importlib.import_module(f"{targets.__name__}.{_module.name}")
