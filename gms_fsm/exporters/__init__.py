"""Exports: friction handed over to other programs, one file of this folder for each format.

`EXPORTERS` is the only list of formats; the command line, the messages and the documentation read
it. Each module of this folder without a leading underscore registers its formats with `register`.
"""

import importlib
import pkgutil

from gms_fsm.exporters._registry import EXPORTERS, Exporter, export, register
from gms_fsm.exporters._subject import Subject

__all__ = ["EXPORTERS", "Exporter", "Subject", "export", "register"]

for _module in pkgutil.iter_modules(__path__):
    if not _module.name.startswith("_"):
        importlib.import_module(f"{__name__}.{_module.name}")
