"use strict";
(() => {
  const clips = JSON.parse(document.getElementById("clips").textContent);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name);
  const canvas = document.getElementById("screen"), pen = canvas.getContext("2d");
  const slider = document.getElementById("frame"), clock = document.getElementById("clock");
  const play = document.getElementById("play"), course = document.getElementById("course");
  const shows = (name) => { const box = document.getElementById("show-" + name); return box && box.checked && !box.disabled; };
  const RATE = 20, GAP = -32768, SIDE = 360;
  let unit = 1; // px of the clip in one of a clip of that side, so that marks and words are as large in all
  let clip = null, frame = 0, playing = false, last = 0;

  function bytes(text) {
    return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  }

  function prepare(view) {
    const one = clips[view];
    if (!one.picture) {
      one.picture = new Image();
      one.picture.onload = draw;
      one.picture.src = one.sheet;
      one.paths = new Int16Array(bytes(one.path));
      one.tint = new Image();
      one.tint.onload = draw;
      one.tint.src = one.colours;
      one.found = one.tracked && new Int16Array(bytes(one.tracked));
    }
    return one;
  }

  function choose(view) {
    const phase = clip ? frame / clip.frames : 0;
    clip = prepare(view);
    frame = Math.min(Math.round(phase * clip.frames), clip.frames - 1);
    unit = clip.width / SIDE;
    const density = Math.max(2, Math.ceil(720 / clip.width));
    canvas.width = clip.width * density;
    canvas.height = clip.height * density;
    pen.setTransform(density, 0, 0, density, 0, 0);
    slider.max = clip.frames - 1;
    for (const button of document.querySelectorAll("[data-view]")) {
      button.setAttribute("aria-pressed", String(button.dataset.view === view));
    }
    const box = document.getElementById("show-tracked");
    if (box) box.disabled = !clip.found;
    document.getElementById("strain-name").textContent = clip.strain_name;
    drawCourse();
    draw();
  }

  function at(array, count, t, k) {
    const i = 2 * (t * count + k);
    return array[i] === GAP || array[i + 1] === GAP ? null : [array[i] / clip.steps, array[i + 1] / clip.steps];
  }

  function drawMotion(array, count, numbers, colour, ring) {
    pen.lineWidth = 1.1 * unit;
    pen.strokeStyle = pen.fillStyle = colour;
    numbers.forEach((k) => {
      const now = at(array, count, frame, k);
      if (!now) return;
      for (let t = 1; t <= frame; t++) {
        const from = at(array, count, t - 1, k), to = at(array, count, t, k);
        if (!from || !to) continue;
        pen.globalAlpha = 0.12 + 0.7 * t / frame;
        pen.beginPath();
        pen.moveTo(from[0], from[1]);
        pen.lineTo(to[0], to[1]);
        pen.stroke();
      }
      pen.globalAlpha = 1;
      pen.beginPath();
      pen.arc(now[0], now[1], (ring ? 3 : 2) * unit, 0, 7);
      if (ring) pen.stroke(); else pen.fill();
    });
  }

  function draw() {
    if (!clip) return;
    const row = Math.floor(frame / clip.columns), column = frame % clip.columns;
    pen.globalAlpha = 1;
    pen.fillStyle = "#000";
    pen.fillRect(0, 0, clip.width, clip.height);
    const drawn = (picture) => {
      if (!picture.complete || !picture.naturalWidth) return;
      const box = [clip.width, clip.height];
      pen.drawImage(picture, column * box[0], row * box[1], box[0], box[1], 0, 0, box[0], box[1]);
    };
    drawn(clip.picture);
    pen.globalAlpha = canvas.dataset.opacity;
    if (shows("strain")) drawn(clip.tint);
    pen.globalAlpha = 1;
    if (shows("true")) drawMotion(clip.paths, clip.points, clip.chosen, colour("motion"), false);
    if (shows("tracked") && clip.found) {
      drawMotion(clip.found, clip.chosen.length, clip.chosen.map((_, k) => k), colour("tracked"), true);
    }
    pen.globalAlpha = 1;
    pen.fillStyle = pen.strokeStyle = "#fff";
    pen.lineWidth = 2 * unit;
    pen.beginPath();
    pen.moveTo(12 * unit, clip.height - 10 * unit);
    pen.lineTo(12 * unit + clip.bar_px, clip.height - 10 * unit);
    pen.stroke();
    pen.font = `${11 * unit}px system-ui, sans-serif`;
    pen.fillText(clip.bar, 12 * unit, clip.height - 16 * unit);
    const name = frame === 0 ? " ED" : frame === clip.es ? " ES" : "";
    slider.value = frame;
    clock.textContent = clip.time_ms[frame].toFixed(0) + " ms" + name;
    moveCursor();
  }

  const BOX = { width: 320, height: 190, left: 34, right: 8, top: 10, bottom: 26 };
  function scales() {
    const line = clip.course, every = [0].concat(line.true, line.tracked || []).filter((value) => value !== null);
    const low = Math.min(...every), high = Math.max(...every), room = 0.08 * Math.max(high - low, 1);
    const end = clip.time_ms[clip.frames - 1] || 1;
    return {
      low: low - room, high: high + room,
      x: (t) => BOX.left + (BOX.width - BOX.left - BOX.right) * clip.time_ms[t] / end,
      y: (v) => BOX.top + (BOX.height - BOX.top - BOX.bottom) * (high + room - v) / (high - low + 2 * room),
    };
  }

  function drawCourse() {
    if (!course || !clip.course) { if (course) course.innerHTML = ""; return; }
    const s = scales(), parts = [];
    const step = [1, 2, 5, 10, 20, 50, 100].find((one) => (s.high - s.low) / one <= 6) || 200;
    for (let v = Math.ceil(s.low / step) * step; v <= s.high; v += step) {
      parts.push(`<line x1="${BOX.left}" x2="${BOX.width - BOX.right}" y1="${s.y(v)}" y2="${s.y(v)}" stroke="var(--grid)"/>`);
      parts.push(`<text x="${BOX.left - 5}" y="${s.y(v) + 3.5}" text-anchor="end">${String(v).replace("-", "−")}</text>`);
    }
    const line = (values, colour, width) => {
      let pieces = "", pen = "M";
      values.forEach((v, t) => { if (v === null) { pen = "M"; return; } pieces += pen + s.x(t).toFixed(1) + " " + s.y(v).toFixed(1); pen = "L"; });
      return `<path d="${pieces}" fill="none" stroke="${colour}" stroke-width="${width}"/>`;
    };
    parts.push(line(clip.course.true, "var(--ink)", 2.6));
    if (clip.course.tracked) parts.push(line(clip.course.tracked, "var(--tracked)", 1.5));
    parts.push(`<line id="cursor" y1="${BOX.top}" y2="${BOX.height - BOX.bottom}" stroke="var(--muted)" stroke-width="1.2"/>`);
    const end = clip.time_ms[clip.frames - 1];
    parts.push(`<text x="${BOX.left}" y="${BOX.height - 8}">0</text>`);
    parts.push(`<text x="${BOX.width - BOX.right}" y="${BOX.height - 8}" text-anchor="end">${end.toFixed(0)} ms</text>`);
    course.innerHTML = `<svg viewBox="0 0 ${BOX.width} ${BOX.height}" role="img" aria-label="${clip.course.title}"><g font-size="11" fill="var(--muted)">${parts.join("")}</g></svg>`;
    document.getElementById("course-title").textContent = clip.course.title + " (%)";
    moveCursor();
  }

  function moveCursor() {
    const cursor = document.getElementById("cursor");
    if (!cursor || !clip.course) return;
    const x = scales().x(frame);
    cursor.setAttribute("x1", x);
    cursor.setAttribute("x2", x);
  }

  function tick(now) {
    if (!playing) return;
    if (now - last >= 1000 / RATE) {
      last = now;
      frame = (frame + 1) % clip.frames;
      draw();
    }
    requestAnimationFrame(tick);
  }

  function setPlaying(wanted) {
    playing = wanted;
    play.textContent = playing ? "Pause" : "Play";
    if (playing) requestAnimationFrame(tick);
  }

  function step(by) {
    setPlaying(false);
    frame = (frame + by + clip.frames) % clip.frames;
    draw();
  }

  play.addEventListener("click", () => setPlaying(!playing));
  slider.addEventListener("input", () => { setPlaying(false); frame = Number(slider.value); draw(); });
  document.getElementById("back").addEventListener("click", () => step(-1));
  document.getElementById("on").addEventListener("click", () => step(1));
  for (const button of document.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => choose(button.dataset.view));
  }
  for (const box of document.querySelectorAll(".overlays input")) box.addEventListener("change", draw);
  choose(document.querySelector("[data-first]").dataset.view);
  const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (still) { frame = clip.es; draw(); } else setPlaying(true);
})();
