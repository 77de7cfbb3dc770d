// One worker, one module: what the page asks for is done here, so that the page stays alive. To cancel, the page ends the worker.
self.progress = (done, all) => postMessage({ progress: done / all });
self.panicked = (text) => postMessage({ failed: text });
self.onmessage = ({ data }) => {
  try {
    if (data.module) {
      wasm_bindgen.initSync({ module: data.module });
      postMessage({ what: "benches", answer: JSON.parse(wasm_bindgen.begin()) });
    } else {
      const answer = JSON.parse(wasm_bindgen[data.what](JSON.stringify(data.form), ...data.bytes));
      postMessage({ what: data.what, answer });
    }
  } catch (error) {
    postMessage({ failed: String(error) });
  }
};
