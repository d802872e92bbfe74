// A page around the report, the one of `tsumu open`: it says how to look, and is handed the review. Without one, nobody hears.

const FRAMED = window.parent !== window;

export function tellFrame(value) {
  // The report holds nothing that its frame does not have: it was handed out by it.
  if (FRAMED) window.parent.postMessage({ tsumu: value }, "*");
}

export function hearFrame(act) {
  if (FRAMED) window.addEventListener("message", event => {
    if (event.source === window.parent && event.data && typeof event.data.tsumu === "object" && event.data.tsumu) act(event.data.tsumu);
  });
}
