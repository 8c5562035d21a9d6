"""Pictures of the site: light and dark versions, cards of the gallery, live pages, the replay.

Three directives: ``{cards}`` shows the entries of its own page with thumbnails, ``{live} NAME`` a
page of `live_pages.PAGES`, and ``{replay}`` the run on the first page. Without JavaScript a live
page is a link, and the replay a picture with a link.
"""

from __future__ import annotations

import re
import shutil
from html import escape
from pathlib import Path
from typing import Any

import live_pages
from dark import dark_picture, dark_svg, oklab, rgb, webp
from docutils import nodes
from docutils.parsers.rst import Directive
from PIL import Image
from sphinx.application import Sphinx

MADE = Path(__file__).parents[1] / ".docs-cache" / "live"
FOLDER = "_live"  # in the site
THUMB = (480, 320)  # pixels: twice the size of a card's picture
AREA = re.compile(r'<rect fill="(#\w{6})"[^>]*? width="([\d.]+)" height="([\d.]+)"')
SIZE = re.compile(r'<svg[^>]*?viewBox="[-\d.]+ [-\d.]+ ([\d.]+) ([\d.]+)"')


class CardsNode(nodes.General, nodes.Element):  # type: ignore[misc]
    """The place of the cards; they are made when the page has been read."""


# --------------------------------------------------------------------------- pairs of pictures
def size_of(path: Path) -> tuple[int, int]:
    """Return width and height of a picture; those of an SVG document in its own unit."""
    if path.suffix == ".svg":
        found = SIZE.search(path.read_text(encoding="utf-8"))
        assert found, f"{path.name} has no viewBox"
        return round(float(found[1])), round(float(found[2]))
    with Image.open(path) as image:
        return image.size


def is_dark(path: Path) -> bool:
    """Return whether a picture is drawn on a dark ground, such as that of a terminal."""
    if path.suffix == ".svg":
        areas = [
            (oklab(rgb(colour))[0] > 0.5, float(width) * float(height))
            for colour, width, height in AREA.findall(path.read_text(encoding="utf-8"))
        ]  # of a terminal: the frame, then grounds on it; a chart has none
        light = sum(area for is_light, area in areas if is_light)
        return bool(areas) and light < areas[0][1] / 2
    with Image.open(path) as image:
        corner = image.convert("RGBA").getpixel((2, 2))
    assert isinstance(corner, tuple)
    return corner[3] > 0 and max(corner[:3]) < 100


def dark_of(source: Path, folder: Path) -> Path | None:
    """Return the dark version of a picture in a folder, made if it is missing or old.

    A film has none, and a picture that is dark itself needs none.
    """
    if source.suffix == ".gif" or is_dark(source):
        return None
    target = folder / f"{source.stem}_dark{'.svg' if source.suffix == '.svg' else '.webp'}"
    if not target.exists() or target.stat().st_mtime < source.stat().st_mtime:
        if source.suffix == ".svg":
            target.write_text(dark_svg(source.read_text(encoding="utf-8")), encoding="utf-8")
        else:
            with Image.open(source) as image:
                target.write_bytes(webp(dark_picture(image)))
    return target


def thumbs_of(source: Path, folder: Path) -> tuple[Path, Path | None]:
    """Return a small version of a picture, and its dark one; an SVG document is its own."""
    if source.suffix == ".svg":
        return folder / source.name, dark_of(source, folder)
    light = folder / f"{source.stem}_thumb.webp"
    with Image.open(source) as image:
        small = image.convert("RGBA")
    small.thumbnail(THUMB, Image.Resampling.LANCZOS)
    white = Image.new("RGBA", small.size, "white")
    light.write_bytes(webp(Image.alpha_composite(white, small).convert("RGB"), sharp=False))
    if source.suffix == ".gif" or is_dark(source):
        return light, None
    dark = folder / f"{source.stem}_thumb_dark.webp"
    dark.write_bytes(webp(dark_picture(small), sharp=False))
    return light, dark


def picture(address: str, alt: str, size: tuple[int, int], kind: str = "") -> str:
    """Return an image element that the browser loads when it comes into view."""
    look = f' class="{kind}"' if kind else ""
    return (
        f'<img{look} loading="lazy" src="{address}" alt="{escape(alt)}" '
        f'width="{size[0]}" height="{size[1]}">'
    )


def pair(light: str, dark: str | None, alt: str, size: tuple[int, int]) -> str:
    """Return a picture for both themes; without a dark version, one for both."""
    if dark is None:
        return picture(light, alt, size, "as-drawn")
    return picture(light, alt, size, "only-light") + picture(dark, alt, size, "only-dark")


def pair_pictures(app: Sphinx, _: str, __: str, context: dict[str, Any], ___: Any) -> None:
    """Give every picture of a page its dark version; alone in a paragraph, it links to itself."""
    if "body" not in context or app.builder.format != "html":
        return
    folder = Path(app.outdir) / "_images"
    sources = {name: Path(app.srcdir, path) for path, (_, name) in app.env.images.items()}

    def replaced(match: re.Match[str]) -> str:
        address = match["address"]
        place, _, name = address.rpartition("/")
        paired = 'class="only-' in match["image"]  # a card's
        if paired or name not in sources or not place.endswith("_images"):
            return match[0]
        folder.mkdir(exist_ok=True)
        plain = app.tags.has("draft") and sources[name].parent.name == "zoo"
        dark = None if plain else dark_of(sources[name], folder)
        alt = re.search(r'alt="([^"]*)"', match["image"])
        tags = [("as-drawn", address)]
        if dark:
            tags = [("only-light", address), ("only-dark", f"{place}/{dark.name}")]
        shown = ""
        for kind, where in tags:
            tag = (
                f'<img class="{kind}" loading="lazy" src="{where}" alt="{alt[1] if alt else ""}" '
                'width="{}" height="{}">'.format(*size_of(sources[name]))
            )
            shown += f'<a class="{kind}" href="{where}">{tag}</a>' if match["before"] else tag
        return f"{match['before'] or ''}{shown}{match['after'] or ''}"

    context["body"] = re.sub(
        r'(?P<before><p>)?(?P<image><img [^>]*?src="(?P<address>[^"]+)"[^>]*>)(?P<after></p>)?',
        replaced,
        context["body"],
    )


# --------------------------------------------------------------------------- cards
class Cards(Directive):
    """Show the entries of this page as cards: each section below a section, with its picture."""

    def run(self) -> list[nodes.Node]:
        """Leave a place for them."""
        return [CardsNode()]


def fill_cards(app: Sphinx, tree: nodes.document, page: str) -> None:
    """Write the cards: thumbnail, name, and the first code of the entry: how to make it."""
    for place in tree.findall(CardsNode):
        folder = Path(app.outdir) / "_images"
        folder.mkdir(parents=True, exist_ok=True)
        (whole,) = (part for part in tree.children if isinstance(part, nodes.section))
        groups = [part for part in whole.children if isinstance(part, nodes.section)]
        made = "".join(_group(app, group, folder, "../" * page.count("/")) for group in groups)
        place.replace_self(nodes.raw("", made, format="html"))


def _group(app: Sphinx, group: nodes.section, folder: Path, root: str) -> str:
    cards = ""
    for entry in group.children:
        if not isinstance(entry, nodes.section):
            continue
        image, how = next(entry.findall(nodes.image)), next(entry.findall(nodes.literal))
        source = Path(app.srcdir, image["uri"])
        light, dark = (path and f"{root}_images/{path.name}" for path in thumbs_of(source, folder))
        name, code = (escape(node.astext()) for node in (entry[0], how))
        shown = pair(str(light), dark, "", size_of(source))
        cards += (
            f'<li><a href="#{entry["ids"][0]}"><span class="thumb">{shown}</span>'
            f"<b>{name}</b><code>{code}</code></a></li>\n"
        )
    return (
        f'<p class="cards-of">{escape(group[0].astext())}</p>\n<ul class="cards">\n{cards}</ul>\n'
    )


# --------------------------------------------------------------------------- pages in frames
class Replay(Directive):
    """The replay of a run in a frame of its own."""

    def run(self) -> list[nodes.Node]:
        """Return its picture, which JavaScript replaces by the page."""
        env = self.state.document.settings.env
        root = "../" * env.docname.count("/") + f"{FOLDER}/"
        env.note_dependency(str(MADE / "stamp"))
        size = size_of(MADE / "replay.svg")
        words = "Chart of four elements of the pulled mass, two of them slipping; opens the replay"
        shown = pair(f"{root}replay.svg", f"{root}replay_dark.svg", words, size)
        page = f"{root}replay.html"
        about = f'data-page="{page}" data-title="Replay of the pulled mass"'
        text = f'<div class="replay" {about}><a href="{page}">{shown}</a></div>\n'
        return [nodes.raw("", text, format="html")]


class Live(Directive):
    """A live page in a frame of its own."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return a link, which JavaScript replaces by the page."""
        (name,) = self.arguments
        env = self.state.document.settings.env
        page = "../" * env.docname.count("/") + f"{FOLDER}/{name}.html"
        env.note_dependency(str(MADE / "stamp"))
        title = escape(live_pages.PAGES[name][0])
        link = f'<p><a href="{page}">{title}: open the page alone</a></p>'
        text = f'<div class="replay" data-page="{page}" data-title="{title}"></div>\n'
        return [nodes.raw("", link + text, format="html")]


def make_pages(_app: Sphinx) -> None:
    """Make the pages whose sources have changed."""
    live_pages.write_all(MADE)


def copy_pages(app: Sphinx, error: Exception | None) -> None:
    """Copy the pages into the site."""
    if error is None and app.builder.format == "html":
        to = Path(app.outdir) / FOLDER
        shutil.rmtree(to, ignore_errors=True)
        shutil.copytree(MADE, to, ignore=shutil.ignore_patterns("stamp"))


def register(app: Sphinx) -> None:
    """Add directives and handlers to the site."""
    app.add_node(CardsNode)
    app.add_directive("cards", Cards)
    app.add_directive("live", Live)
    app.add_directive("replay", Replay)
    app.connect("builder-inited", make_pages)
    app.connect("doctree-resolved", fill_cards)
    app.connect("html-page-context", pair_pictures, priority=800)  # before parts become reachable
    app.connect("build-finished", copy_pages)
