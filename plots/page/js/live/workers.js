"use strict";
// Workers that have the engines of the page. The first run is begun before the rest of the page is read.
// The first time that floats are handed over, V8 throws away all code that it has compiled for floats: here, before there is any.
const RUNNER = `
const none = new Float64Array(1);
structuredClone(none, { transfer: [none.buffer] });
const engines = [];
onmessage = ({ data: { number, numbers } }) => {
  const begin = performance.now(), found = kept((engines[number] ??= new Engine(ENGINES[number])).run(numbers));
  const buffers = Object.values(found).filter((each) => each instanceof Float64Array).map(({ buffer }) => buffer);
  postMessage({ found, took: performance.now() - begin }, buffers);
};
`;

// A worker that does what a text says.
function inWorker(text, heard) {
  const engines = document.getElementById("engine").textContent, worker = new Worker(URL.createObjectURL(new Blob([engines, text], { type: "text/javascript" })));
  if (heard) worker.onmessage = ({ data: each }) => heard(each);
  return worker;
}

const runner = inWorker(RUNNER);

// What an engine finds with other numbers: [word, value] pairs.
function computed(number, numbers) {
  return new Promise((then) => {
    runner.onmessage = ({ data: each }) => then(each);
    runner.postMessage({ number, numbers });
  });
}

const begun = computed(0, []);
