"""Dark versions of the site's pictures: lightness is reversed, hue is kept.

A picture is drawn once, on white. In its dark version white is the ground of the dark site and
black is almost white; blue stays blue and orange stays orange, so each colour keeps its meaning.
"""

from __future__ import annotations

import io
import re

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFilter

from plots.style import CHART_THEMES

GROUND = "#131416"  # of the dark site: --color-background-primary of its theme
STEPS = 33  # per channel, of the table of colours
CURVE = 0.6  # below 1: colours between black and white become lighter than by a plain reversal
# Ottosson's Oklab: linear sRGB to cone responses, and their cube roots to lightness and two hues.
CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)
COLOUR = re.compile(r'(?<![(&])(?<!href=")#(?:[0-9a-fA-F]{6}|[0-9a-fA-F]{3})\b')
NAMED = re.compile(r'(?<=(?:fill|roke)[=:]")(?:black|white)(?=")')

Colours = NDArray[np.float64]


def rgb(text: str) -> Colours:
    """Return a colour such as ``"#0072B2"`` as three numbers from 0 to 1."""
    digits = text.removeprefix("#")
    if len(digits) == 3:
        digits = "".join(2 * digit for digit in digits)
    return np.array([int(digits[k : k + 2], 16) for k in (0, 2, 4)]) / 255


def oklab(colours: Colours) -> Colours:
    """Return sRGB colours, shape (..., 3), in Oklab."""
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    return np.cbrt(linear @ CONES.T) @ LAB.T


def srgb(colours: Colours) -> Colours:
    """Return Oklab colours in sRGB; those outside of it lose chroma until they fit."""
    chroma = np.linspace(1, 0, 41)[:, None, None]
    tried = colours.reshape(-1, 3) * np.concatenate([np.ones_like(chroma), chroma, chroma], axis=2)
    linear = (tried @ np.linalg.inv(LAB).T) ** 3 @ np.linalg.inv(CONES).T
    fits = ((linear > -1e-3) & (linear < 1 + 1e-3)).all(axis=2)
    linear = linear[fits.argmax(axis=0), np.arange(linear.shape[1])].clip(0, 1)
    out = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return out.reshape(colours.shape)


def reversed_colours(colours: Colours) -> Colours:
    """Return what colours, shape (..., 3), are on the dark site.

    White becomes `GROUND`, and the ink of light pictures that of dark charts.
    """
    lab = oklab(colours)
    ends = [oklab(rgb(text)) for text in (CHART_THEMES["light"].ink, CHART_THEMES["dark"].ink)]
    ground = oklab(rgb(GROUND))
    depth = ((1 - lab[..., 0]) / (1 - ends[0][0])).clip(0, 1) ** CURVE
    light = ground[0] + depth * (ends[1][0] - ground[0])
    tint = (1 - depth)[..., None] * ground[1:]
    return srgb(np.concatenate([light[..., None], lab[..., 1:] + tint], axis=-1))


def reversed_text(match: re.Match[str]) -> str:
    """Return the dark colour of one that an SVG writes."""
    light = {"black": "#000000", "white": "#ffffff"}.get(match[0], match[0])
    levels = (255 * reversed_colours(rgb(light))).round().astype(int)
    return "#" + "".join(f"{level:02x}" for level in levels)


def _table() -> ImageFilter.Color3DLUT:
    axis = np.linspace(0, 1, STEPS)
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")  # red varies fastest
    colours = np.stack([red, green, blue], axis=-1).reshape(-1, 3)
    return ImageFilter.Color3DLUT(STEPS, reversed_colours(colours).ravel().tolist())


TABLE = _table()


def dark_svg(text: str) -> str:
    """Return an SVG document with its colours reversed.

    Parameters
    ----------
    text : str
        The document; colours are written as ``#rgb`` or ``#rrggbb``, ``black`` or ``white``.

    Returns
    -------
    str
        The document. What had no colour, which means black, has the dark site's.
    """
    text = NAMED.sub(reversed_text, COLOUR.sub(reversed_text, text))
    return text.replace("<svg ", f'<svg fill="{CHART_THEMES["dark"].ink}" ', 1)


def dark_picture(light: Image.Image) -> Image.Image:
    """Return a picture with its colours reversed; what is transparent lies on white."""
    rgba = light.convert("RGBA")
    white = Image.new("RGBA", rgba.size, "white")
    return Image.alpha_composite(white, rgba).convert("RGB").filter(TABLE)


def webp(image: Image.Image, *, sharp: bool = True) -> bytes:
    """Return a picture as WebP: sharp for lines and letters, else smaller."""
    out = io.BytesIO()
    if sharp:
        image.save(out, "webp", lossless=True, method=2)
    else:
        image.save(out, "webp", quality=84, method=4)
    return out.getvalue()
