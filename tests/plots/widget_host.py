"""A widget in a browser without Jupyter: a small page that imitates anywidget's host.

Its model forwards requests to the Python widget and fires the changes of the traits, all at once,
as Jupyter does.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from playwright.sync_api import Browser, FrameLocator, Page

__all__ = ["Host"]

TRAITS = ("page", "runs", "charts", "panel", "height")
SETUP = """async ([code, style, traits]) => {
  const module = await import(URL.createObjectURL(new Blob([code], { type: "text/javascript" })));
  document.head.appendChild(document.createElement("style")).textContent = style;
  const heard = {}, given = {};
  window.host_traits = traits;
  const model = {
    get: (name) => traits[name],
    set: (name, value) => { given[name] = value; },
    on: (name, call) => (heard[name] ??= new Set()).add(call),
    off: (name, call) => heard[name]?.delete(call),
    save_changes: async () => {
      const changed = await window.asked(given.request);
      while (window.held) await new Promise((go) => setTimeout(go, 10));
      Object.assign(traits, changed);
      const names = Object.keys(changed).map((name) => `change:${name}`);
      for (const name of names) for (const call of heard[name] ?? []) call();
    },
  };
  module.default.render({ model, el: document.body });
}"""


class Host:
    """A page with a widget in it, which answers the requests of the page."""

    def __init__(self, browser: Browser, widget: Any) -> None:
        self.widget, self.wrong, self.requests = widget, list[str](), list[dict[str, Any]]()
        context = browser.new_context(viewport={"width": 1366, "height": 1000})
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

    def wait(self, condition: Callable[[], bool]) -> None:
        """Wait until a condition holds."""
        for _ in range(500):
            if condition():
                return
            self.page.wait_for_timeout(20)
        raise AssertionError("waited in vain")

    @property
    def busy(self) -> bool:
        """Whether a request has not been answered."""
        return self.page.locator(".gms-busy").count() > 0

    def hold(self, on: bool) -> None:
        """Keep answers back, or let them go."""
        self.page.evaluate(f"window.held = {str(on).lower()}")

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
