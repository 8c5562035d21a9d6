"""The files of a film: GIF by Pillow, videos by PyAV. Frames are written one by one, never kept."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL.GifImagePlugin import getdata

from gms_fsm.foundation.extras import require
from plots.film._movie import Movie
from plots.style.matplotlib import Image, to_rgb

COLOURS = 255  # of a GIF; one more is the transparent one
SAMPLES = 12  # frames from which the colours are taken
LONGEST = 65_535  # hundredths of a second that a frame of a GIF can last
BT709 = 1  # the colours of a video, in ffmpeg's numbers
# Quality so high that texts show no artefacts.
CODECS = {
    "libx264": {"crf": "18", "preset": "medium", "tune": "animation"},
    "libvpx-vp9": {"crf": "24", "b": "0", "deadline": "good", "cpu-used": "4"},
}
Palette = NDArray[np.uint8]


# --------------------------------------------------------------------------- GIF
def gif(movie: Movie) -> bytes:
    """Return a film as a GIF, which repeats forever.

    All frames share one palette. Each stores only the pixels that differ from those before; a
    frame that does not differ makes the one before it last longer.
    """
    palette = _palette(movie)
    table = palette.tobytes().ljust(3 * 256, b"\0")
    width, height = movie.size
    head = b"GIF89a" + struct.pack("<HHBBB", width, height, 0xF7, 0, 0) + table
    forever = b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"
    return head + forever + b"".join(_gif_frames(movie, palette)) + b";"


def _gif_frames(movie: Movie, palette: Palette) -> Iterator[bytes]:
    """Yield the blocks of each frame, once it is known how long it lasts."""
    nearest = _Nearest(palette)
    before: Palette | None = None
    waiting: tuple[Image.Image, tuple[int, int]] | None = None
    since = 0
    for number, picture in enumerate(movie.pictures()):
        pixels = nearest(picture)
        now = round(100 * number / movie.fps)
        changed = _changed(pixels, before)
        if changed is not None or now - since > LONGEST // 2:
            if waiting is not None:
                yield _gif_block(*waiting, now - since)
            waiting, since, before = changed or _changed(pixels, None), now, pixels
    assert waiting is not None
    yield _gif_block(*waiting, round(100 * movie.frames / movie.fps) - since)


def _changed(pixels: Palette, before: Palette | None) -> tuple[Image.Image, tuple[int, int]] | None:
    """Return the part that differs, the rest of it transparent, and its place; None if none."""
    differs = np.ones(pixels.shape, dtype=bool) if before is None else pixels != before
    rows, columns = np.flatnonzero(differs.any(axis=1)), np.flatnonzero(differs.any(axis=0))
    if not rows.size:
        return None
    part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    kept = np.where(differs[part], pixels[part], COLOURS).astype(np.uint8)
    return Image.fromarray(kept), (int(columns[0]), int(rows[0]))


def _gif_block(part: Image.Image, place: tuple[int, int], hundredths: int) -> bytes:
    part.putpalette(bytes(3 * 256))  # its numbers are those of the file's palette
    blocks = getdata(
        part, place, duration=10 * hundredths, disposal=1, transparency=COLOURS, interlace=0
    )
    return b"".join(blocks)


def _palette(movie: Movie) -> Palette:
    """Return one palette for all frames, shape (255, 3); separate ones would make colours flicker.

    The colours of the theme are exact; the others are those that occur in some frames.
    """
    exact = np.array([np.round(255 * np.array(to_rgb(c))) for c in movie.colours], np.uint8)
    held = movie.held()
    wanted = set(np.linspace(0, movie.frames - 1, SAMPLES).astype(int).tolist())
    wanted |= set(held[:: max(len(held) // SAMPLES, 1)])
    width, height = movie.size
    sheet = Image.new("RGB", (width, height * len(wanted)))
    for place, number in enumerate(sorted(wanted)):
        sheet.paste(movie.picture(number), (0, place * height))
    found = sheet.quantize(COLOURS - len(exact)).getpalette() or []
    table = np.concatenate([exact, np.array(found, np.uint8).reshape(-1, 3)])
    return np.resize(table, (COLOURS, 3))


class _Nearest:
    """The nearest colours of a palette. Pillow's own search is too coarse to keep white white.

    Parameters
    ----------
    palette : ndarray of uint8, shape (255, 3)
        The colours.
    """

    def __init__(self, palette: Palette) -> None:
        self.palette = palette.astype(np.int32)
        self.known = np.full(1 << 24, -1, np.int16)  # for every colour met so far

    def __call__(self, picture: Image.Image) -> Palette:
        """Return the number of the nearest colour of each pixel."""
        parts = np.asarray(picture).astype(np.int32)
        codes = parts[..., 0] << 16 | parts[..., 1] << 8 | parts[..., 2]
        found = self.known[codes]
        new = np.unique(codes[found < 0])
        for some in np.array_split(new, new.size // 4096 + 1):
            colours = np.column_stack([some >> 16, some >> 8 & 255, some & 255])
            far = ((colours[:, None, :] - self.palette) ** 2).sum(axis=2)
            self.known[some] = far.argmin(axis=1)
        numbers: Palette = (self.known[codes] if new.size else found).astype(np.uint8)
        return numbers


# --------------------------------------------------------------------------- video
def video(movie: Movie, form: str, codec: str) -> bytes:
    """Return a film as a video that browsers play."""
    av = require("av", "film")
    with TemporaryDirectory() as folder:
        path = Path(folder, f"film.{form}")  # its index is moved to the front, which needs a file
        flags = {"movflags": "faststart"} if codec == "libx264" else {}
        with av.open(str(path), "w", format=form, options=flags) as file:
            rate = Fraction(movie.fps).limit_denominator(1000)
            stream = file.add_stream(codec, rate=rate, options=CODECS[codec])
            stream.width, stream.height = movie.size
            stream.pix_fmt = "yuv420p"
            context = stream.codec_context
            context.colorspace = context.color_primaries = context.color_trc = BT709
            for picture in movie.pictures():
                file.mux(stream.encode(_video_frame(av, picture)))
            file.mux(stream.encode(None))
        return path.read_bytes()


def _video_frame(av: Any, picture: Image.Image) -> Any:
    frame = av.VideoFrame.from_ndarray(np.asarray(picture), format="rgb24")
    return frame.reformat(format="yuv420p", dst_colorspace="ITU709")
