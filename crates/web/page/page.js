// The page: fields into a form, the form to the worker, the worker's answer into the page.
"use strict";
(() => {
  const at = (id) => document.getElementById(id);
  const FIELDS = ["scene", "settings", "frequency", "damping", "further", "horn"];
  const CHANNEL = ["channel", "unit", "scale", "keys"];
  const say = (text) => (at("status").textContent = text);
  const show = (id, on) => (at(id).hidden = !on);
  const element = (tag, text, properties = {}) => Object.assign(document.createElement(tag), { textContent: text, ...properties });

  let files = []; // { name, bytes }
  let compiled = null;
  let worker = null;
  let busy = null;
  let started = 0;
  let last = null;

  // --- worker ---

  function ended(text) {
    busy = null;
    at("cancel").disabled = true;
    at("dry_run").disabled = at("fit").disabled = files.length === 0;
    show("progress", false);
    say(text);
  }

  function begin() {
    worker?.terminate();
    const source = new Blob([at("worker").textContent], { type: "text/javascript" });
    const place = URL.createObjectURL(source);
    worker = new Worker(place);
    URL.revokeObjectURL(place);
    worker.onmessage = ({ data }) => heard(data);
    worker.onerror = (event) => heard({ failed: event.message || "the worker could not be started" });
    worker.postMessage({ module: compiled });
  }

  function ask(what) {
    if (!compiled || files.length === 0) return;
    if (busy) begin();
    busy = what;
    started = performance.now();
    at("dry_run").disabled = at("fit").disabled = what !== "look";
    at("cancel").disabled = what === "look";
    at("progress").value = 0;
    show("progress", what === "fit");
    if (what !== "look") {
      show("done", false);
      refuse(null);
    }
    say({ look: "reading …", dry_run: "running the chain …", fit: "fitting …" }[what]);
    worker.postMessage({ what, form: form(), bytes: files.map((file) => file.bytes) });
  }

  function heard({ what, answer, progress, failed }) {
    if (failed !== undefined) {
      ended("");
      refuse({ message: `the module stopped: ${failed}\n  this is an error of granchain; please report it with the files`, fields: [] });
      begin();
    } else if (progress !== undefined) {
      at("progress").value = progress;
      const percent = Math.floor(100 * progress);
      say(percent < 100 ? `fitting, ${percent} %` : "comparing with the record; if the verdict is in doubt, looking for causes …");
    } else if (what === "benches") {
      // Later workers take over from one that was ended.
      if (at("scene").options.length > 0) return;
      const option = ({ name, description }) => element("option", `${name}: ${description}`, { value: name });
      at("scene").append(...answer.map(option));
      at("scene").value = "annulus";
      ended("ready: choose files");
      ask("look");
    } else if (answer.message !== undefined) {
      ended("");
      refuse(answer);
    } else {
      const took = ((performance.now() - started) / 1000).toFixed(1);
      ended({ look: "read", dry_run: `done in ${took} s`, fit: `fitted in ${took} s: ${answer.text}` }[what]);
      if (what === "look") looked(answer);
      else report(what, answer);
    }
  }

  // --- form ---

  function form() {
    const value = (id) => at(id).value;
    const channel = (prefix) => Object.fromEntries(CHANNEL.map((id) => [id, value(prefix + id)]));
    const own = Object.fromEntries(FIELDS.map((id) => [id, value(id)]));
    return { ...own, files: files.map((file) => file.name), bead: channel(""), tip: channel("tip-") };
  }

  async function take(list) {
    const chosen = [...list];
    if (chosen.length === 0) return;
    // A further file joins the only one there is.
    const all = chosen.length === 1 && files.length === 1 ? [...files, ...chosen] : chosen;
    if (all.length > 2) {
      refuse({ message: `expected one or two files, found ${all.length}; choose the last bead's record and the horn's`, fields: [] });
      return;
    }
    const read = async (file) => (file instanceof File) ? { name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) } : file;
    files = await Promise.all(all.map(read));
    if (files.length === 2 && files[0].name === files[1].name) files[1].name = `2-${files[1].name}`;
    at("horn").replaceChildren(element("option", "found from names, units and spectra", { value: "" }), ...files.map(({ name }) => element("option", name, { value: name })));
    show("roles", files.length === 2);
    const rows = files.map(({ name, bytes }) => element("li", `${name}, ${(bytes.length / 1024).toFixed(0)} KiB`));
    at("named").replaceChildren(...rows);
    for (const id of ["named", "clear"]) show(id, true);
    show("done", false);
    last = null;
    refuse(null);
    ask("look");
  }

  function clear() {
    if (busy) begin();
    files = [];
    last = null;
    at("files").value = "";
    for (const id of CHANNEL) at(id).value = at(`tip-${id}`).value = "";
    for (const id of ["named", "clear", "roles", "done", "warned"]) show(id, false);
    refuse(null);
    ended("ready: choose files");
    at("files").focus();
  }

  function looked(answer) {
    last = answer;
    refuse(null);
    if (answer.tip_channel) at("tip-channel").value = answer.tip_channel;
    if (answer.horn && !at("horn").value) at("horn").value = answer.horn;
    const said = answer.records.map((record, index) => {
      const rate = (record.sample_rate_hz / 1e6).toPrecision(4);
      const [factor, unit] = { "m/s": [1e3, "mm/s"], m: [1e6, "µm"], Pa: [1e-3, "kPa"] }[record.unit] ?? [1, record.unit];
      const peaks = [record.positive_peak, record.negative_peak].map((peak) => (factor * peak).toPrecision(3).replace("-", "\u2212"));
      const line = record.strongest_line_hz ? `, strongest line ${(record.strongest_line_hz / 1e3).toFixed(2)} kHz` : "";
      const role = index ? "horn" : "last bead";
      return element("li", `${role}: ${record.file}, column ${record.value_column} in ${record.value_unit}, ${record.samples} samples at ${rate} MHz, peaks ${peaks.join(" and ")} ${unit}${line}`);
    });
    const open = answer.records.length < 2 ? [element("li", "horn: no record; the piston moves as the bench says, unless you name its channel")] : [];
    at("named").replaceChildren(...said, ...open);
    const columns = (record) => record.columns.filter((name) => name).map((name) => element("option", "", { value: name }));
    at("columns").replaceChildren(...columns(answer.records[0]));
    at("tip-columns").replaceChildren(...columns(answer.records[1] ?? answer.records[0]));
    at("command").textContent = answer.command;
    at("named").dataset.records = JSON.stringify(answer.records);
    warn(answer.warnings);
  }

  function warn(texts) {
    at("warned").replaceChildren(...texts.map((text) => element("p", text)));
    show("warned", texts.length > 0);
  }

  // What was refused, and the fields that would settle it: what is known is filled in, what only the user knows is asked for.
  function refuse(refused) {
    for (const field of document.querySelectorAll("[aria-invalid]")) field.removeAttribute("aria-invalid");
    at("refused").textContent = refused?.message ?? "";
    show("refused", refused !== null);
    if (!refused) return;
    warn([]);
    const { filled = {}, open = {} } = refused.fill ?? {};
    for (const [id, value] of Object.entries(filled)) if (at(id) && !at(id).value) at(id).value = value;
    for (const [id, value] of Object.entries(open)) if (at(id)) at(id).placeholder = value;
    const named = [...new Set([...Object.keys(open), ...refused.fields])].filter((id) => at(id) && !(id in filled));
    for (const id of named) at(id).setAttribute("aria-invalid", "true");
    at("refused").scrollIntoView({ block: "nearest" });
    if (named.length) at(named[0]).focus();
  }

  // --- answer ---

  function report(what, answer) {
    // Its style is this page's.
    const page = new DOMParser().parseFromString(answer.html.slice(answer.html.indexOf("<body>")), "text/html");
    const parts = [...page.querySelector("main").childNodes, page.getElementById("curves")].filter((part) => part);
    at("result").replaceChildren(...parts.map((part) => document.adoptNode(part)));
    at("said").textContent = what === "fit" ? "" : answer.text;
    at("assumed").replaceChildren(...answer.assumptions.map((text) => element("li", text)));
    warn(answer.warnings);
    show("done", true);
    at("save").onclick = () => save(what, answer.html);
    at("done").dataset.result = JSON.stringify(answer.result);
    tables();
    if (at("curves")) explore();
    at("result").scrollIntoView();
  }

  function save(what, html) {
    const stem = (last?.records[0].file ?? "record").replace(/\.[^.]*$/, "");
    const place = URL.createObjectURL(new Blob([html], { type: "text/html" }));
    element("a", "", { href: place, download: `${stem}-${what === "fit" ? "report" : "dry-run"}.html` }).click();
    setTimeout(() => URL.revokeObjectURL(place), 10000);
  }

  async function copy() {
    const text = at("command").textContent;
    try {
      await navigator.clipboard.writeText(text);
      say("copied");
    } catch {
      getSelection().selectAllChildren(at("command"));
      say("marked: copy it with Ctrl+C");
    }
  }

  // --- events ---

  const over = (on) => (event) => {
    event.preventDefault();
    at("drop").classList.toggle("over", on);
    if (event.type === "drop") take(event.dataTransfer.files);
  };
  for (const [name, on] of [["dragover", true], ["dragleave", false], ["drop", false]]) addEventListener(name, over(on));
  at("files").addEventListener("change", () => take(at("files").files));
  at("form").addEventListener("change", (event) => event.target.id !== "files" && ask("look"));
  at("form").addEventListener("submit", (event) => event.preventDefault());
  at("dry_run").addEventListener("click", () => ask("dry_run"));
  at("fit").addEventListener("click", () => ask("fit"));
  at("cancel").addEventListener("click", () => {
    begin();
    ended("cancelled");
    at("fit").focus();
  });
  at("copy").addEventListener("click", copy);
  at("clear").addEventListener("click", clear);

  async function load() {
    at("dry_run").disabled = at("fit").disabled = true;
    const packed = Uint8Array.from(atob(at("module").textContent), (letter) => letter.charCodeAt(0));
    at("module").textContent = "";
    const bytes = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    compiled = await WebAssembly.compile(await new Response(bytes).arrayBuffer());
    begin();
  }
  load().catch((error) => {
    say("");
    refuse({ message: `this browser cannot run the page (${error}); use Chrome or Edge 91, Firefox 113, Safari 16.4 or later`, fields: [] });
  });
})();
