"""Claim: a notebook shows a fit: its parameters, what cannot be told, its scores, a picture."""

from __future__ import annotations

import html
import re
from base64 import b64decode

import pytest

from plots import notebook
from tests.identification.fits_made import small, with_table

pytest.importorskip("llvmlite", reason="fits take long without machine code")


def test_the_table_the_scores_and_the_picture() -> None:
    pytest.importorskip("matplotlib", reason="figures need the extra 'plots'")
    shown = small()._repr_html_()  # type: ignore[attr-defined]
    for each in small().table:
        cells = (each.name, *each.shown, each.unit)
        assert "".join(f'<td style="text-align:left">{cell}</td>' for cell in cells) in shown
    assert f"training RMSE {small().training['rmse']:.4g} N" in shown
    assert html.escape(small().weakest[:40]) in shown
    (picture,) = re.findall(r'src="data:image/png;base64,([^"]+)"', shown)
    assert b64decode(picture).startswith(b"\x89PNG")


def test_what_cannot_be_told_has_no_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "fit_png", lambda _: None)  # as without matplotlib
    shown = with_table(5)._repr_html_()  # type: ignore[attr-defined]
    row = shown.partition("parameter_2")[2].partition("</tr>")[0]
    assert "cannot be told" in row
    assert ">inf<" not in row
    assert "<img" not in shown
