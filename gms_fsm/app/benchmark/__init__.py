"""The benchmark: friction models on public records, scored on rows that were held out."""

from __future__ import annotations

from gms_fsm.app.benchmark.card import Card, Row, make
from gms_fsm.app.benchmark.pages import page, write

__all__ = ["Card", "Row", "make", "page", "write"]
