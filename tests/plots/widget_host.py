"""A widget in a browser without Jupyter: a small page that imitates anywidget's host.

Its model forwards requests to the Python widget and fires the changes of the traits, all at once, as
Jupyter does.
"""

from __future__ import annotations

from typing import Any

from playwright.sync_api import Browser, FrameLocator, Page

__all__ = ["Host"]

TRAITS = ("page", "runs", "charts", "panel", "height")
SETUP = """async ([code, style, traits]) => {
  const module = await import(URL.createObjectURL(new Blob([code], { type: "text/javascript" })));
  document.head.appendChild(document.createElement("style")).textContent = style;
  const heard = {}, given = {};
  const model = {
    get: (name) => traits[name],
    set: (name, value) => { given[name] = value; },
    on: (name, call) => (heard[name] ??= new Set()).add(call),
    off: (name, call) => heard[name]?.delete(call),
    save_changes: async () => {
      const changed = await window.asked(given.request);
      Object.assign(traits, changed);
      for (const name of Object.keys(changed)) for (const call of heard[`change:${name}`] ?? []) call();
    },
  };
  window.close_widget = module.default.render({ model, el: document.body });
}"""


class Host:
    """A page with a widget in it.

    Parameters
    ----------
    browser : Browser
        Chromium.
    widget : Explorer
        The widget, which answers the requests of the page.
    size : (int, int)
        Of the window, in pixels.
    **options
        Of the browser's context, such as ``color_scheme``.
    """

    def __init__(
        self, browser: Browser, widget: Any, size: tuple[int, int] = (1366, 1000), **options: Any
    ) -> None:
        self.widget, self.wrong, self.requests = widget, list[str](), list[dict[str, Any]]()
        context = browser.new_context(viewport={"width": size[0], "height": size[1]}, **options)
        self.page: Page = context.new_page()
        self.page.on("console", lambda message: self.wrong.append(message.text))
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.expose_function("asked", self._asked)
        code, style = (str(getattr(widget, name)) for name in ("_esm", "_css"))
        self.page.set_content("<!DOCTYPE html><title>host</title><body></body>")
        traits = {name: getattr(widget, name) for name in TRAITS}
        self.page.evaluate(SETUP, [code, style, traits])
        self.page.wait_for_selector(".gms-now", state="attached")  # the replay page has answered

    def _asked(self, request: dict[str, Any]) -> dict[str, Any]:
        self.requests.append(request)
        self.widget.request = request
        return {name: getattr(self.widget, name) for name in ("runs", "charts", "panel")}

    @property
    def inner(self) -> FrameLocator:
        """The replay page."""
        return self.page.frame_locator("iframe")

    def replay(self, expression: str) -> Any:
        """Return the value of an expression in the replay page."""
        return self.page.frames[1].evaluate(expression)

    def close(self) -> None:
        """Close the page."""
        self.page.context.close()
