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
  const { frames, ending, first } = JSON.parse(figure.querySelector("script").textContent);
  const label = figure.querySelector("label"), input = label.querySelector("input"), output = label.querySelector("output");
  const images = figure.querySelectorAll(".frame img"), cursor = figure.querySelector(".cursor"), caption = figure.querySelector("figcaption");
  const address = (k, dark) => `${first}${String(k).padStart(2, "0")}${dark ? "_dark" : ""}${ending}`;

  async function show() {
    const k = Number(input.value), [value, said, at] = frames[k];
    output.textContent = value;
    caption.textContent = said;
    input.setAttribute("aria-valuetext", `${value}. ${said}`);
    if (cursor) cursor.style.left = `${100 * at}%`;
    const next = new Image();
    next.src = address(k, themeShown() === "dark");
    await next.decode().catch(() => {}); // the old picture stays until the next one can be drawn
    if (Number(input.value) !== k) return;
    for (const image of images) {
      image.src = address(k, image.classList.contains("only-dark"));
      image.alt = said;
    }
  }

  function prepare() { // as soon as somebody comes near
    const dark = themeShown() === "dark";
    frames.forEach((_, k) => { new Image().src = address(k, dark); });
  }

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

document.querySelectorAll("figure.frames").forEach(slide);
document.querySelectorAll(".replay").forEach(embed);
