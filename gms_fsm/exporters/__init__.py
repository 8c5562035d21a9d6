"""Exports: friction handed over to other programs, one file of this folder for each format.

The formats are rows of one table (`gms_fsm._formats`); `formats` returns those of friction and of
its chart. Each module of this folder without a leading underscore registers its own.
"""

import importlib
import pkgutil

from gms_fsm._formats import FORMATS, Format, register
from gms_fsm.exporters._registry import export, formats
from gms_fsm.exporters._subject import Subject

__all__ = ["FORMATS", "Format", "Subject", "export", "formats", "register"]

for _module in pkgutil.iter_modules(__path__):
    if not _module.name.startswith("_"):
        importlib.import_module(f"{__name__}.{_module.name}")
