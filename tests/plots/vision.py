"""How colours look in grey and to deuteranopes, and how much they differ."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, "A physiologically-based model for simulation
# of color vision deficiency", IEEE TVCG 15(6), 2009: deuteranomaly of severity 1.0, linear RGB.
MACHADO = np.array(
    [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ]
)
WEIGHTS = np.array([0.2126, 0.7152, 0.0722])  # of WCAG 2.2 and ITU-R BT.709

Floats = NDArray[np.float64]


def linear(values: Floats) -> Floats:
    """Return linear light of sRGB values from 0 to 1."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def encoded(values: Floats) -> Floats:
    """Return sRGB values of linear light."""
    values = np.clip(values, 0.0, 1.0)
    return np.where(values <= 0.0031308, 12.92 * values, 1.055 * values ** (1 / 2.4) - 0.055)


def _channels(colour: str) -> Floats:
    return np.array([int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)])


def luminance(colour: str) -> float:
    """Return the relative luminance of a colour such as ``"#0072B2"``."""
    return float(WEIGHTS @ linear(_channels(colour)))


def contrast(one: str, other: str) -> float:
    """Return the contrast of two colours, from 1 to 21."""
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def seen_by_deuteranopes(picture: Floats) -> Floats:
    """Return a picture, shape (..., 3) from 0 to 1, as deuteranopes see it."""
    return encoded(linear(picture) @ MACHADO.T)


def deuteranopia(colour: str) -> str:
    """Return a colour as deuteranopes see it."""
    seen = seen_by_deuteranopes(_channels(colour))
    return "#{:02X}{:02X}{:02X}".format(*(round(255 * value) for value in seen))
