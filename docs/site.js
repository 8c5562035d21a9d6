"use strict";
// The replay and live pages, each in its frame. Nothing is asked of other hosts.

// ------------------------------------------------------------------ light or dark, as the site shows it
const prefersDark = matchMedia("(prefers-color-scheme: dark)");

function themeShown() {
  const chosen = document.body.dataset.theme;
  return chosen === "light" || chosen === "dark" ? chosen : prefersDark.matches ? "dark" : "light";
}

function onTheme(act) {
  new MutationObserver(act).observe(document.body, { attributeFilter: ["data-theme"] });
  prefersDark.addEventListener("change", act);
}

// ------------------------------------------------------------------ pages in frames
function embed(place) {
  const page = document.createElement("iframe");
  const tell = () => page.contentWindow?.postMessage({ theme: themeShown() }, "*"); // from disk, a page has no origin
  Object.assign(page, { title: place.dataset.title, loading: "lazy", src: place.dataset.page });
  page.addEventListener("load", () => {
    tell();
    place.classList.add("alive");
  });
  place.append(page);
  onTheme(tell);
}

// The theme does not name its two regions beside the page.
document.querySelector(".sidebar-drawer")?.setAttribute("aria-label", "Pages");
document.querySelector(".toc-drawer")?.setAttribute("aria-label", "On this page");
document.querySelectorAll(".replay").forEach(embed);
