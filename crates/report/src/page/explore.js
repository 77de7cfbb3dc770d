// Figures of curves to be looked into: zoom, pan, values, traces on and off. The printed drawing stays in the page.
"use strict";
(() => {
  const page = JSON.parse(document.getElementById("curves").textContent);
  const bytes = (code) => Uint8Array.from(atob(code), (letter) => letter.charCodeAt(0));

  function decode({ from, step, n, f, low, log, q }) {
    if (n !== undefined) return Float64Array.from({ length: n }, (_, i) => from + i * step);
    if (f !== undefined) return Float64Array.from(new Float32Array(bytes(f).buffer));
    const value = (v) => (log ? 10 ** (low + v * step) : low + v * step);
    return Float64Array.from(new Uint16Array(bytes(q).buffer), value);
  }
  const decoded = new Map();
  const array = (index) => {
    if (!decoded.has(index)) decoded.set(index, decode(page.arrays[index]));
    return decoded.get(index);
  };

  function element(tag, properties = {}, ...children) {
    const made = Object.assign(document.createElement(tag), properties);
    made.append(...children);
    return made;
  }
  const button = (text, label, action) => {
    const made = element("button", { type: "button", textContent: text });
    if (label) {
      made.setAttribute("aria-label", label);
      made.title = label;
    }
    made.addEventListener("click", action);
    return made;
  };
  const shown = (value, digits = 4) => String(Number(value.toPrecision(digits))).replace("-", "\u2212");
  const unit = (label) => label.match(/ \(([^–()]*)\)$/)?.[1] ?? "";

  // The curve's value at x between its neighbours; nothing beyond its ends.
  function at(curve, x) {
    const [xs, ys] = [array(curve.x), array(curve.y)];
    if (!(x >= xs[0] && x <= xs[xs.length - 1])) return null;
    let [low, high] = [0, xs.length - 1];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (xs[middle] <= x) low = middle;
      else high = middle;
    }
    const share = xs[high] > xs[low] ? (x - xs[low]) / (xs[high] - xs[low]) : 0;
    if (curve.marker) return ys[share < 0.5 ? low : high];
    return ys[low] + share * (ys[high] - ys[low]);
  }

  // Panels now open. Those of one link show one range.
  const open = new Set();
  const ranges = new Map();

  class Plot {
    constructor(panel, place) {
      this.panel = panel;
      this.curves = panel.curves;
      const ends = this.curves.map(({ x }) => array(x)).map((xs) => [xs[0], xs[xs.length - 1]]);
      const whole = [Math.min(...ends.map((it) => it[0])), Math.max(...ends.map((it) => it[1]))];
      this.home = panel.x.range ?? whole;
      this.whole = [Math.min(whole[0], this.home[0]), Math.max(whole[1], this.home[1])];
      this.reading = element("p", { className: "reading" });
      this.reading.setAttribute("role", "status");
      this.canvas = element("div", { tabIndex: 0, className: "plot" });
      this.canvas.setAttribute("role", "application");
      const keys = "arrows move, plus and minus zoom, shift and arrows read values, 0 resets";
      this.canvas.setAttribute("aria-label", `${panel.title ?? panel.y.label} over ${panel.x.label}: ${keys}`);
      this.legend = element("div", { className: "legend" });
      this.curves.forEach((curve, index) => this.toggle(curve, index + 1));
      if (panel.title) place.append(element("p", { className: "title", textContent: panel.title }));
      place.append(this.legend, this.canvas, this.reading);
      this.draw();
      this.canvas.addEventListener("keydown", (event) => this.key(event));
      this.canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
      this.resized = new ResizeObserver(() => this.size());
      this.resized.observe(place);
      open.add(this);
      const [low, high] = ranges.get(panel.link) ?? this.home;
      this.show(low, high);
      this.read(null);
    }

    toggle(curve, series) {
      if (!curve.label) return;
      const swatch = element("span", { className: "swatch" });
      swatch.style.borderColor = curve.colour;
      swatch.style.borderTopStyle = curve.dash.length ? "dashed" : "solid";
      if (curve.marker) swatch.classList.add(curve.marker);
      const made = button("", null, () => {
        const on = made.getAttribute("aria-pressed") !== "true";
        made.setAttribute("aria-pressed", on);
        this.plot.setSeries(series, { show: on });
      });
      made.setAttribute("aria-pressed", true);
      made.append(swatch, curve.label);
      this.legend.append(made);
    }

    draw() {
      const { x, y, height } = this.panel;
      const font = '12px "DejaVu Sans",sans-serif';
      const plain = (_, ticks) => ticks.map((tick) => shown(tick, 6));
      const axis = ({ label, log }, size) => {
        const words = { label, font, labelFont: font, stroke: "#1e1e1e", labelSize: 20, size };
        return log ? words : { ...words, values: plain };
      };
      const series = this.curves.map((curve) => ({
        label: curve.label,
        stroke: curve.colour,
        width: Math.max(1, 1.3 * curve.width),
        dash: curve.dash.map((length) => 1.5 * length),
        paths: curve.marker ? () => null : undefined,
        points: { show: curve.marker ? true : undefined, size: 7, fill: curve.marker === "open" ? "#fff" : curve.colour },
      }));
      const one = this.curves.every((curve) => curve.x === this.curves[0].x);
      const own = this.curves.map((curve) => [array(curve.x), array(curve.y)]);
      const data = one ? [own[0][0], ...own.map((it) => it[1])] : uPlot.join(own);
      const options = {
        width: this.width(),
        height: Math.max(220, 5.2 * height),
        legend: { show: false },
        scales: {
          x: { time: false, distr: x.log ? 3 : 1 },
          y: { distr: y.log ? 3 : 1, ...(y.range && { range: () => y.range }) },
        },
        axes: [axis(x, 34), axis(y, 56)],
        series: [{}, ...series],
        cursor: {
          drag: { x: true, y: false },
          bind: {
            mousedown: (plot, _, zoom) => (event) => (event.shiftKey ? this.drag(event) : zoom(event)),
            dblclick: () => () => this.reset(),
          },
        },
        hooks: {
          setScale: [(plot, key) => key === "x" && this.follow()],
          setCursor: [(plot) => this.read(plot.cursor.left >= 0 ? plot.posToVal(plot.cursor.left, "x") : null)],
          drawAxes: [(plot) => this.marks(plot)],
        },
      };
      this.plot = new uPlot(options, data, this.canvas);
      this.plot.root.setAttribute("aria-hidden", "true");
    }

    width() {
      return Math.max(260, this.canvas.clientWidth);
    }

    size() {
      if (this.width() !== this.plot.width) this.plot.setSize({ width: this.width(), height: this.plot.height });
    }

    marks(plot) {
      const { ctx, bbox } = plot;
      ctx.save();
      ctx.lineWidth = devicePixelRatio;
      ctx.setLineDash([4 * devicePixelRatio, 4 * devicePixelRatio]);
      ctx.font = `${11 * devicePixelRatio}px sans-serif`;
      ctx.textAlign = "center";
      let taken = -Infinity;
      for (const mark of this.panel.marks) {
        const at = plot.valToPos(mark.at, "x", true);
        if (at < bbox.left || at > bbox.left + bbox.width) continue;
        ctx.strokeStyle = ctx.fillStyle = "#6a6a6a";
        ctx.beginPath();
        ctx.moveTo(at, bbox.top);
        ctx.lineTo(at, bbox.top + bbox.height);
        ctx.stroke();
        // A name that would lie on its neighbour's is left out.
        const half = 0.5 * ctx.measureText(mark.label).width + devicePixelRatio;
        if (at - half < taken) continue;
        ctx.fillText(mark.label, at, bbox.top - 3 * devicePixelRatio);
        taken = at + half;
      }
      for (const level of this.panel.levels) {
        const at = plot.valToPos(level.at, "y", true);
        if (at < bbox.top || at > bbox.top + bbox.height) continue;
        ctx.strokeStyle = level.colour;
        ctx.beginPath();
        ctx.moveTo(bbox.left, at);
        ctx.lineTo(bbox.left + bbox.width, at);
        ctx.stroke();
      }
      ctx.restore();
    }

    range() {
      const { min, max } = this.plot.scales.x;
      return [min, max];
    }

    // Show a range, no longer than the curves and no shorter than a few samples.
    show(low, high) {
      const [from, to] = this.whole;
      const least = Math.min((to - from) / 20000, this.home[1] - this.home[0]);
      const span = Math.min(Math.max(high - low, least), to - from);
      const min = Math.min(Math.max(0.5 * (low + high - span), from), to - span);
      this.plot.setScale("x", { min, max: min + span });
    }

    zoom(factor, around) {
      const [low, high] = this.range();
      const middle = around ?? 0.5 * (low + high);
      this.show(middle + (low - middle) * factor, middle + (high - middle) * factor);
    }

    pan(share) {
      const [low, high] = this.range();
      this.show(low + share * (high - low), high + share * (high - low));
    }

    reset() {
      ranges.delete(this.panel.link);
      const linked = [...open].filter((other) => other.panel.link === this.panel.link);
      following = true;
      linked.forEach((other) => other.show(...other.home));
      requestAnimationFrame(() => (following = false));
    }

    // What a reader does here, the linked panels do too.
    follow() {
      const range = this.range();
      const dataset = this.canvas.dataset;
      [dataset.low, dataset.high] = range;
      if (following || !open.has(this)) return;
      const same = (a, b) => Math.abs(a - b) <= 1e-9 * Math.max(Math.abs(a), Math.abs(b), 1);
      const known = ranges.get(this.panel.link) ?? this.home;
      if (same(range[0], known[0]) && same(range[1], known[1])) return;
      ranges.set(this.panel.link, range);
      for (const other of open) if (other !== this && other.panel.link === this.panel.link) other.show(...range);
    }

    read(x) {
      if (x === null) {
        const hint = "Drag to zoom, shift and drag to move, double-click to reset.";
        this.reading.textContent = hint;
        return;
      }
      const values = this.curves.map((curve, index) => {
        const value = this.plot.series[index + 1].show ? at(curve, x) : null;
        return value === null ? null : `${curve.label || "value"}: ${shown(value)} ${unit(this.panel.y.label)}`;
      });
      const parts = [`${shown(x)} ${unit(this.panel.x.label)}`, ...values.filter((value) => value !== null)];
      this.reading.textContent = parts.join("   ");
    }

    // Move the reading line by a share of the width.
    point(share) {
      const { over, cursor } = this.plot;
      const width = over.clientWidth;
      const left = cursor.left >= 0 ? cursor.left : 0.5 * width;
      const next = Math.min(Math.max(left + share * width, 0), width - 1);
      this.plot.setCursor({ left: next, top: 0.5 * over.clientHeight });
    }

    key(event) {
      const read = event.shiftKey;
      const actions = {
        ArrowLeft: () => (read ? this.point(-0.01) : this.pan(-0.1)),
        ArrowRight: () => (read ? this.point(0.01) : this.pan(0.1)),
        ArrowUp: () => this.zoom(0.8),
        ArrowDown: () => this.zoom(1.25),
        "+": () => this.zoom(0.5),
        "=": () => this.zoom(0.5),
        "-": () => this.zoom(2),
        0: () => this.reset(),
        Home: () => this.reset(),
      };
      const action = actions[event.key];
      if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      action();
    }

    wheel(event) {
      // A page that scrolls under the pointer must not zoom by itself.
      if (!event.ctrlKey && document.activeElement !== this.canvas) return;
      event.preventDefault();
      this.zoom(event.deltaY < 0 ? 0.8 : 1.25, this.plot.posToVal(this.plot.cursor.left, "x"));
    }

    drag(down) {
      const [low, high] = this.range();
      const scale = (high - low) / this.plot.over.clientWidth;
      const move = (event) => this.show(low - (event.clientX - down.clientX) * scale, high - (event.clientX - down.clientX) * scale);
      addEventListener("mousemove", move);
      addEventListener("mouseup", () => removeEventListener("mousemove", move), { once: true });
    }

    close() {
      open.delete(this);
      this.resized.disconnect();
      this.plot.destroy();
    }
  }
  let following = false;

  for (const figure of document.querySelectorAll("figure[data-curves]")) {
    const data = page.figures[figure.dataset.curves];
    const number = `figure ${figure.dataset.curves}`;
    let live = null;
    let plots = [];
    const each = (action) => () => {
      // Panels of one link follow the first.
      const seen = new Set();
      plots.filter((plot) => !seen.has(plot.panel.link) && seen.add(plot.panel.link)).forEach(action);
    };
    const tools = [
      button("+", `Zoom in, ${number}`, each((plot) => plot.zoom(0.5))),
      button("\u2212", `Zoom out, ${number}`, each((plot) => plot.zoom(2))),
      button("\u2190", `Earlier or lower, ${number}`, each((plot) => plot.pan(-0.25))),
      button("\u2192", `Later or higher, ${number}`, each((plot) => plot.pan(0.25))),
      button("Reset", `Reset, ${number}`, each((plot) => plot.reset())),
    ];
    const toggle = button("Explore", `Explore ${number}`, () => {
      const on = live === null;
      if (on) {
        live = element("div", { className: "live" });
        figure.querySelector(".sheet").after(live);
        plots = data.panels.map((panel) => new Plot(panel, live));
      } else {
        plots.forEach((plot) => plot.close());
        plots = [];
        live.remove();
        live = null;
      }
      figure.classList.toggle("exploring", on);
      tools.forEach((tool) => (tool.hidden = !on));
      toggle.textContent = on ? "As printed" : "Explore";
      toggle.setAttribute("aria-label", `${toggle.textContent}, ${number}`);
      toggle.title = "";
    });
    tools.forEach((tool) => (tool.hidden = true));
    const controls = element("div", { className: "controls" }, toggle, ...tools);
    figure.querySelector("figcaption").before(controls);
  }
})();
