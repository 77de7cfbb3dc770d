// The chain in motion: moves the beads and forces of the drawing that stands in the page anyway.
"use strict";
(() => {
  for (const figure of document.querySelectorAll("figure[data-motion]")) {
    const data = JSON.parse(figure.dataset.motion);
    const values = Uint8Array.from(atob(data.q), (letter) => letter.charCodeAt(0));
    const channels = 2 * data.beads + 2;
    const svg = figure.querySelector("svg");
    const moving = [...svg.querySelectorAll("[data-x]")];
    const bars = [...svg.querySelectorAll("[data-force]")];
    const clock = svg.querySelector("[data-clock]");
    const time = (frame) => (data.from + frame * data.step).toFixed(2);

    function show(frame) {
      const row = values.subarray(frame * channels, (frame + 1) * channels);
      moving.forEach((one, index) => {
        one.setAttribute("transform", `translate(${((row[index] - 127.5) / 127.5) * data.travel} 0)`);
      });
      bars.forEach((bar, index) => {
        const height = (row[data.beads + 1 + index] / 255) * data.bar;
        bar.setAttribute("y", data.floor - height);
        bar.setAttribute("height", height);
      });
      clock.textContent = `${time(frame)} µs`;
      slider.value = frame;
      slider.setAttribute("aria-valuetext", `${time(frame)} microseconds`);
    }

    const make = (tag, properties) => Object.assign(document.createElement(tag), properties);
    const slider = make("input", { type: "range", min: 0, max: data.frames - 1, step: 1, value: data.shown });
    slider.setAttribute("aria-label", "Time");
    // Frames a second.
    let rate = 60;
    let playing = null;
    let frame = data.shown;
    const play = make("button", { type: "button", textContent: "Play" });
    const speed = make("span", {});
    const pace = () => (speed.textContent = `1 µs takes ${Number((1 / (rate * data.step)).toPrecision(2))} s`);
    const faster = (text, factor) => {
      const made = make("button", { type: "button", textContent: text });
      made.addEventListener("click", () => {
        rate = Math.min(Math.max(rate * factor, 3.75), 960);
        pace();
      });
      return made;
    };
    function stop() {
      cancelAnimationFrame(playing);
      playing = null;
      play.textContent = "Play";
    }
    play.addEventListener("click", () => {
      if (playing !== null) return stop();
      play.textContent = "Pause";
      if (frame >= data.frames - 1) frame = 0;
      let last = null;
      const next = (now) => {
        frame += last === null ? 0 : (rate * (now - last)) / 1000;
        last = now;
        if (frame >= data.frames - 1) {
          frame = data.frames - 1;
          show(frame);
          return stop();
        }
        show(Math.floor(frame));
        playing = requestAnimationFrame(next);
      };
      playing = requestAnimationFrame(next);
    });
    slider.addEventListener("input", () => {
      stop();
      frame = Number(slider.value);
      show(frame);
    });
    pace();
    const controls = make("div", { className: "controls" });
    controls.append(play, slider, faster("Slower", 0.5), faster("Faster", 2), speed);
    figure.querySelector("figcaption").before(controls);
    // On paper stands the picture that stands there without a script.
    addEventListener("beforeprint", () => show(data.shown));
    addEventListener("afterprint", () => show(Math.floor(frame)));
  }
})();
