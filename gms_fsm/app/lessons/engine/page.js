{
  "use strict";
  const one = (selector) => document.querySelector(selector);
  const { questions, measured } = JSON.parse(one("#asked").textContent);

  // As `judged` in predict.py, with the same fields.
  const short = (value) => { // as Python's .4g
    const [digits, exponent] = value.toExponential(3).split("e"), size = Math.abs(exponent);
    if (exponent >= -4 && exponent < 4) return String(Number(value.toPrecision(4)));
    return `${Number(digits)}e${exponent < 0 ? "-" : "+"}${size < 10 ? "0" : ""}${size}`;
  };
  const said = (value, unit) => (typeof value === "string" ? value : `${short(value)} ${unit}`.trim());
  const off = (predicted, found, { rtol, atol }) => {
    if (Math.abs(predicted - found) <= Math.max(atol, rtol * Math.abs(found))) return "";
    const side = predicted > found ? "high" : "low";
    if (!Number.isFinite(predicted) || Math.abs(found) <= atol || predicted * found < 0) return `Your answer is too ${side}`;
    const ratio = predicted / found;
    if (ratio > 0.1 && ratio < 10) return `Your answer is ${(100 * Math.abs(ratio - 1)).toFixed(0)} % too ${side}`;
    return `Your answer is much too ${side}`;
  };
  const judged = (question, predicted, found) => {
    const { unit } = question;
    if (predicted === null) return [false, `You predicted nothing. Measured: ${said(found, unit)}.`];
    const head = `You predicted ${said(predicted, unit)}. Measured: ${said(found, unit)}.`;
    if (typeof found === "string") return [predicted === found, `${head} ${predicted === found ? "Right." : "Not right."}`];
    const error = off(predicted, found, question);
    return [!error, `${head} ${error || `Right, within ${question.tolerance}`}.`];
  };
  window.judged = judged;

  const typed = (field) => {
    const text = field.value.trim();
    if (!text || field.tagName === "SELECT") return text || null;
    return Number(text.replace(",", ".").replace("−", "-").split(/\s/)[0]);
  };
  const fields = [...document.querySelectorAll("#answers .answer")];
  one("#answers").addEventListener("submit", (event) => {
    event.preventDefault();
    let asks = false;
    fields.forEach((row, i) => {
      const field = row.querySelector("input, select"), value = typed(field), output = row.querySelector("output");
      const wrong = typeof value === "number" && Number.isNaN(value);
      field.setAttribute("aria-invalid", String(wrong));
      if (wrong) output.textContent = "Give a number, for example 0.25.";
      asks ||= wrong;
    });
    if (asks) return;
    fields.forEach((row, i) => {
      const field = row.querySelector("input, select"), output = row.querySelector("output");
      const [right, words] = judged(questions[i], typed(field), measured[i]);
      output.textContent = words;
      output.className = right ? "right" : "wrong";
      field.disabled = true;
    });
    one("#compare").disabled = true;
    one("#judged").hidden = false;
    one("#judged").scrollIntoView({ block: "nearest" });
  });
  const show = (lesson) => {
    one("#lesson").hidden = !lesson;
    one("#to-lesson").hidden = lesson;
    for (const part of document.body.children) if (part.id !== "lesson") part.inert = lesson;
  };
  one("#to-run").addEventListener("click", () => show(false));
  one("#to-lesson").addEventListener("click", () => { show(true); one("#revealed").hidden = false; });
  one("#to-why").addEventListener("click", () => { one("#revealed").hidden = false; one("#revealed").scrollIntoView(); });
  for (const kind of ["keydown", "keyup"]) one("#lesson").addEventListener(kind, (event) => event.stopPropagation());
  one("#top").append(one("#to-lesson"));
  show(true);
}
