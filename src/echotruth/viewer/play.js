// Plays the clip while the button is down: every so many milliseconds the slider goes to the next frame.
const state = (window.echotruth ??= { drawn: 0, pending: false, tables: [] });
button.label = button.active ? "❚❚ Pause" : "▶ Play";
cancelAnimationFrame(state.playing);
let last = performance.now();
const step = (now) => {
  if (!button.active) return;
  const due = Math.floor(((now - last) * Number(rate.value)) / 1000);
  if (due > 0) {
    last += (due * 1000) / Number(rate.value);
    const next = (slider.value + Math.min(due, 2)) % (slider.end + 1); // rather slower than with gaps
    slider.setv({ value: next }, { sync: false }); // the server need not know
  }
  state.playing = requestAnimationFrame(step);
};
if (button.active) state.playing = requestAnimationFrame(step);
