"use strict";
// Sliders whose pictures were made in advance, and the replay in its frame. Nothing is asked of other hosts.

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

// ------------------------------------------------------------------ sliders
function slide(figure) {
  const { frames, ending, first, parts } = JSON.parse(figure.querySelector("script").textContent);
  const label = figure.querySelector("label"), input = label.querySelector("input"), output = label.querySelector("output");
  const places = [...figure.querySelectorAll(".frame")], cursor = figure.querySelector(".cursor"), caption = figure.querySelector("figcaption");
  const address = (k, part, dark) => `${first}${String(k).padStart(2, "0")}${part}${dark ? "_dark" : ""}${ending}`;
  const loaded = (k) => [...parts].map((part) => {
    const image = new Image();
    image.src = address(k, part, themeShown() === "dark");
    return image;
  });

  async function show() {
    const k = Number(input.value), [value, said, at] = frames[k];
    output.textContent = value;
    caption.textContent = said;
    input.setAttribute("aria-valuetext", `${value}. ${said}`);
    if (cursor) cursor.style.left = `${100 * at}%`;
    await Promise.allSettled(loaded(k).map((image) => image.decode())); // the old pictures stay until then
    if (Number(input.value) !== k) return;
    for (const place of places) {
      for (const image of place.querySelectorAll("img")) {
        image.src = address(k, place.dataset.part, image.classList.contains("only-dark"));
        if (image.alt) image.alt = said;
      }
    }
  }

  const prepare = () => frames.forEach((_, k) => loaded(k)); // as soon as somebody comes near

  label.hidden = false;
  input.value = input.defaultValue; // some browsers keep it when the page is loaded again
  input.setAttribute("aria-valuetext", `${output.textContent}. ${caption.textContent}`);
  input.addEventListener("input", show);
  for (const event of ["focus", "pointerenter"]) input.addEventListener(event, prepare, { once: true });
}

// ------------------------------------------------------------------ the replay
function embed(place) {
  const page = document.createElement("iframe");
  const tell = () => page.contentWindow?.postMessage({ theme: themeShown() }, "*"); // from disk, a page has no origin
  Object.assign(page, { title: "Replay of the pulled mass", loading: "lazy", src: place.dataset.page });
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
document.querySelectorAll("figure.frames").forEach(slide);
document.querySelectorAll(".replay").forEach(embed);
