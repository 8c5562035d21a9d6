"""A film that is ready to be written."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from plots.film._chart import blend
from plots.film._pace import FADE
from plots.film._picture import FilmPicture
from plots.style.matplotlib import Image


@dataclass(frozen=True, eq=False)
class Movie:
    """A film that is ready to be written.

    Parameters
    ----------
    film : FilmPicture
        The moving picture.
    fps : float
        Frames per second.
    progress : callable, optional
        Called as ``progress(done, frames)``.
    """

    film: FilmPicture
    fps: float
    progress: Callable[[int, int], object] | None = None

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.film.pace.frames)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels; both are even."""
        width, height = self.film.canvas.get_width_height()
        return int(width), int(height)

    @property
    def colours(self) -> list[str]:
        """The colours of the theme that every frame needs, and those of fading edges."""
        page, own = self.film.page, self.film.colours
        fading = [blend(own.ink, own.fired, k / (FADE + 1)) for k in range(1, FADE + 1)]
        return sorted({*vars(own).values(), *page.fills, *page.hatches, page.panel, *fading})

    def held(self) -> list[int]:
        """Return the first frame of each micro-step at which time stands still."""
        first: dict[int, int] = {}
        for number, frame in enumerate(self.film.pace.frames):
            if frame.entry >= 0:
                first.setdefault(frame.entry, number)
        return list(first.values())

    def picture(self, number: int) -> Image.Image:
        """Return a frame, counted from 0."""
        return self.film.picture(number)

    def pictures(self) -> Iterator[Image.Image]:
        """Draw frame by frame."""
        for number in range(self.frames):
            yield self.film.picture(number)
            if self.progress is not None:
                self.progress(number + 1, self.frames)
