// The page on which the wall is drawn. Points are [lateral, axial] in px of the clip; 0 is the centre of the first pixel.

import {curve, distance, fitted, nearest, pieces} from "./curve.js";

const PARTS = {
  endocardium: {label: "Endocardium", colour: "#ffd34d"},
  epicardium: {label: "Epicardium", colour: "#56b4e9"},
  anterior_insertion: {label: "Anterior insertion", colour: "#ff6fb5", letter: "A"},
  inferior_insertion: {label: "Inferior insertion", colour: "#7ee081", letter: "I"},
};
const BORDERS = ["endocardium", "epicardium"];
const LONG_AXIS = ["four_chamber", "two_chamber", "three_chamber", "long_axis"];
const REACH = 8;  // px of the screen within which a point or a curve is hit
const FRAME_MS = 50;  // time from frame to frame when the clip plays, slower than most hearts beat
const BAR = 0.2;  // largest length of the scale bar, over the width of the image

const element = id => document.getElementById(id);
const canvas = element("canvas");
const empty = () => Object.fromEntries(Object.keys(PARTS).map(part => [part, []]));

let clip = null;
let images = [];
let points = empty();
let before = [];  // what undo goes back to
let part = "endocardium";  // what is clicked
let selected = null;  // {part, index}
let dragged = false;
let frame = 0;
let cycle = [0, 0];  // end-diastole, and the next: the frame after the last of the cycle
let player = null;
let unsaved = false;

const view = () => element("view").value;
const isClosed = () => !LONG_AXIS.includes(view());
const isShown = name => BORDERS.includes(name) || isClosed();
const shownParts = () => Object.keys(PARTS).filter(isShown);

// ---- where things are on the screen

// Scale, px of the screen to one of the clip, and the place of the left upper corner of the image.
function placement() {
  const {clientWidth, clientHeight} = canvas;
  const scale = Math.min(clientWidth / clip.width, clientHeight / clip.height);
  return {scale, left: (clientWidth - scale * clip.width) / 2, top: (clientHeight - scale * clip.height) / 2};
}

function toScreen([lateral, axial]) {
  const {scale, left, top} = placement();
  return [left + scale * (lateral + 0.5), top + scale * (axial + 0.5)];
}

// Place in the clip of the pointer, kept within the image.
function toClip(event) {
  const {scale, left, top} = placement();
  const within = (value, size) => Math.min(Math.max(value, -0.5), size - 0.5);
  return [
    within((event.offsetX - left) / scale - 0.5, clip.width),
    within((event.offsetY - top) / scale - 0.5, clip.height),
  ];
}

// ---- drawing

function draw() {
  const context = canvas.getContext("2d"), ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(canvas.clientWidth * ratio);
  canvas.height = Math.round(canvas.clientHeight * ratio);
  context.scale(ratio, ratio);
  drawFrame(context);
  shownParts().forEach(name => drawPart(context, name));
  drawScaleBar(context);
  window.echotruth.drawn += 1;
}

function drawFrame(context) {
  const {scale, left, top} = placement(), image = images[frame];
  if (image?.complete) context.drawImage(image, left, top, scale * clip.width, scale * clip.height);
}

function drawPart(context, name) {
  context.strokeStyle = context.fillStyle = PARTS[name].colour;
  context.lineWidth = 2;
  context.setLineDash(frame === cycle[0] ? [] : [4, 4]);  // it belongs to end-diastole
  if (BORDERS.includes(name)) drawCurve(context, curve(points[name], isClosed()));
  context.setLineDash([]);
  if (frame === cycle[0]) points[name].forEach((point, index) => drawPoint(context, name, point, index));
}

function drawCurve(context, line) {
  context.beginPath();
  line.map(toScreen).forEach(([x, y]) => context.lineTo(x, y));
  if (isClosed() && line.length > 2) context.closePath();
  context.stroke();
}

function drawPoint(context, name, point, index) {
  const [x, y] = toScreen(point), {letter} = PARTS[name];
  context.beginPath();
  context.arc(x, y, letter ? 9 : 4.5, 0, 2 * Math.PI);
  context.fill();
  if (selected?.part === name && selected.index === index) {
    context.strokeStyle = "#fff";
    context.stroke();
  }
  if (letter) drawText(context, letter, x, y + 5, "#000");
}

function drawText(context, text, x, y, colour) {
  context.font = "bold 14px system-ui, sans-serif";
  context.textAlign = "center";
  context.fillStyle = colour;
  context.fillText(text, x, y);
}

function drawScaleBar(context) {
  const {scale, left, top} = placement();
  const most = BAR * clip.width * clip.spacing_mm, power = 10 ** Math.floor(Math.log10(most));
  const length = power * Math.max(...[1, 2, 5].filter(step => step * power <= most));
  const x = left + 16, y = top + scale * clip.height - 16, width = scale * length / clip.spacing_mm;
  context.fillStyle = "#fff";
  context.fillRect(x, y - 3, width, 3);
  drawText(context, `${Number(length.toPrecision(1))} mm`, x + width / 2, y - 9, "#fff");
}

// ---- changes

function change(act) {
  const kept = JSON.stringify(points);
  act();
  if (JSON.stringify(points) !== kept) remember(kept);
  show();
}

function remember(kept) {
  before.push(kept);
  unsaved = true;
}

function undo() {
  if (!before.length) return;
  points = JSON.parse(before.pop());
  selected = null;
  unsaved = true;
  show();
}

// A click on the curve puts a point in between; elsewhere the curve goes on to it.
function add(place) {
  const list = points[part];
  let index = list.length;
  if (!BORDERS.includes(part)) list.length = index = 0;
  else if (index > 2) index = between(place) ?? index;
  list.splice(index, 0, place);
  selected = {part, index};
}

function between(place) {
  const found = pieces(points[part], isClosed());
  const apart = found.map(line => nearest(line, place).distance);
  const piece = apart.indexOf(Math.min(...apart));
  return piece < points[part].length - !isClosed() && apart[piece] * placement().scale < REACH ? piece + 1 : null;
}

function remove(hit) {
  if (!hit) return;
  points[hit.part].splice(hit.index, 1);
  selected = null;
}

// The point that is under the pointer, of what is clicked before other parts.
function pointAt(event) {
  const pointer = [event.offsetX, event.offsetY];
  for (const name of [part, ...shownParts()]) {
    const hit = nearest(points[name].map(toScreen), pointer);
    if (hit.distance < REACH) return {part: name, index: hit.index};
  }
  return null;
}

function choose(name) {
  part = name;
  selected = null;
  show();
}

// ---- pointer and keys

let kept = null;  // points before they are dragged

function press(event) {
  if (event.button !== 0 && event.button !== 2) return;
  canvas.focus();
  if (frame !== cycle[0] || player) return goTo(cycle[0]);  // what is drawn belongs to end-diastole
  const hit = pointAt(event);
  if (event.button === 2 || event.ctrlKey) return change(() => remove(hit));  // Ctrl and click, on a Mac
  kept = JSON.stringify(points);
  if (hit) [part, selected] = [hit.part, hit];
  else add(toClip(event));
  dragged = true;
  canvas.setPointerCapture(event.pointerId);
  show();
}

function drag(event) {
  if (!dragged) return;
  points[selected.part][selected.index] = toClip(event);
  draw();
}

function release() {
  if (!dragged) return;
  dragged = false;
  if (JSON.stringify(points) !== kept) remember(kept);
  show();
}

function key(event) {
  const name = event.key.toLowerCase(), held = event.ctrlKey || event.metaKey;
  if (dragged || event.target.tagName === "SELECT") return;
  if (held && name === "z") undo();
  else if (held && name === "s") save();
  else if (!held && ["delete", "backspace"].includes(name)) change(() => remove(selected));
  else return;
  event.preventDefault();
}

// ---- frames

function goTo(number) {
  clearInterval(player);
  player = null;
  showFrame(number);
  show();
}

function showFrame(number) {
  frame = window.echotruth.frame = number;
  element("frame").value = number;
  const time = clip.time_ms[number].toFixed(1);
  const name = number === cycle[0] ? ", end-diastole" : number === cycle[1] ? ", next end-diastole" : "";
  element("time").textContent = `frame ${number} / ${clip.frames - 1}, ${time} ms${name}`;
  draw();
}

function play() {
  if (player) return goTo(cycle[0]);
  player = setInterval(() => showFrame((frame + 1) % clip.frames), FRAME_MS);
  show();
}

// The cycle goes on to the end of the clip unless there is a next end-diastole after the one that is chosen.
function beginCycle() {
  const least = clip.fewest_frames;
  if (frame > clip.frames - least) return say(`A cycle needs ${least} frames: choose an earlier one.`, "error");
  setCycle(frame, cycle[1] < frame + least ? clip.frames : cycle[1]);
}

function endCycle() {
  const least = clip.fewest_frames;
  if (frame < cycle[0] + least) return say(`Choose a frame ${least} or more after end-diastole, ${cycle[0]}.`, "error");
  setCycle(cycle[0], frame);
}

function setCycle(...frames) {
  cycle = frames;
  unsaved = true;
  goTo(frame);
}

// One after the other, so that the first is there at once.
async function loadFrames() {
  for (let number = 0; number < clip.frames; number += 1) {
    const image = images[number] = new Image();
    image.src = `frame/${number}.png`;
    await image.decode().catch(() => say(`frame ${number} cannot be shown`, "error"));
    if (number === frame) draw();
  }
}

// ---- what the page says

function say(text, kind = "") {
  element("message").textContent = text;
  element("message").className = kind;
}

function showFile(isThere) {
  element("file").textContent = `Save ${isThere ? "replaces" : "writes"} ${clip.output}`;
}

function hint() {
  if (frame !== cycle[0] || player) {
    return `The wall is drawn in frame ${cycle[0]}, at end-diastole: click the image to go back to it.`;
  }
  if (!BORDERS.includes(part)) {
    return `Click where the right ventricle joins the wall at its ${part.split("_")[0]} side.`;
  }
  const way = isClosed() ? "all around" : "from base to apex to base";
  return `Click eight to twelve points of the ${part} in order, ${way}. `
    + "Drag to move, click on the curve to insert, right click to delete.";
}

function show() {
  if (!isShown(part)) part = "endocardium";
  for (const name of Object.keys(PARTS)) {
    element(name).style.visibility = isShown(name) ? "visible" : "hidden";  // so that others stay where they are
    element(name).setAttribute("aria-pressed", name === part);
  }
  element("undo").disabled = !before.length;
  element("delete").disabled = !selected;
  element("clear").disabled = !points[part].length;
  element("first").setAttribute("aria-pressed", frame === cycle[0]);
  element("next").setAttribute("aria-pressed", frame === cycle[1]);
  element("play").textContent = player ? "❚❚ Stop" : "▶ Play";
  say(hint());
  draw();
}

// ---- server

function drawn() {
  const [anterior, inferior] = Object.keys(PARTS).slice(2).map(name => (isClosed() ? points[name][0] ?? null : null));
  const borders = Object.assign({}, ...BORDERS.map(border));
  return {view: view(), cycle, ...borders, anterior_insertion: anterior, inferior_insertion: inferior};
}

// A border as it is shown, and which of its points were clicked.
function border(name) {
  const made = pieces(points[name], isClosed());
  let start = 0;
  const clicked = made.map(line => (start += line.length) - line.length);
  return {[name]: made.flat(), [`${name}_clicked`]: clicked};
}

async function save() {
  const sent = JSON.stringify(drawn());
  try {
    const answer = await fetch("save", {method: "POST", body: sent, headers: {"Content-Type": "application/json"}});
    const said = await answer.json();
    if (!answer.ok) return say(`Not saved. ${said.error}`, "error");
    unsaved = JSON.stringify(drawn()) !== sent;
    showFile(true);
    say(`Saved: ${said.saved}. The wall is ${said.thickness_mm.toPrecision(3)} mm thick on average.`, "saved");
  } catch {
    say("Not saved. The server does not answer: is echotruth draw still running?", "error");
  }
}

function begin(wall) {
  if (!wall) return;
  element("view").value = wall.view;
  for (const name of Object.keys(PARTS)) {
    points[name] = BORDERS.includes(name) && !clip.clicked.includes(name) ? fitted(wall[name], isClosed()) : wall[name];
  }
}

// ---- the page

function makeParts() {
  for (const [name, {label, colour}] of Object.entries(PARTS)) {
    const button = document.createElement("button");
    Object.assign(button, {id: name, textContent: label, onclick: () => choose(name)});
    button.style.color = colour;
    element("parts").append(button);
  }
}

function listen() {
  canvas.addEventListener("pointerdown", press);
  canvas.addEventListener("pointermove", drag);
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  addEventListener("keydown", key);
  addEventListener("beforeunload", event => unsaved && event.preventDefault());
  new ResizeObserver(draw).observe(canvas);
  const clicks = {undo, play, save, delete: () => change(() => remove(selected)), clear: () => change(clear),
    first: beginCycle, next: endCycle};
  for (const [id, act] of Object.entries(clicks)) element(id).onclick = act;
  element("frame").oninput = event => goTo(Number(event.target.value));
  element("view").onchange = () => { unsaved = true; show(); };
}

function clear() {
  points[part] = [];
  selected = null;
}

async function open() {
  makeParts();
  const answer = await fetch("clip.json");
  const said = await answer.json();
  if (!answer.ok) return say(said.error, "error");
  clip = said;
  document.title = `${clip.source} - echotruth`;
  element("view").append(...clip.views.map(name => new Option(name.replace("_", " "), name)));
  element("view").value = "short_axis";
  element("frame").max = clip.frames - 1;
  showFile(clip.replaces);
  begin(clip.wall);
  listen();
  cycle = clip.cycle;
  goTo(cycle[0]);
  await loadFrames();
}

// For whoever tests the page: how often it was drawn, the frame, and where a point of the clip is on the screen.
window.echotruth = {drawn: 0, frame: 0, toScreen};
open().catch(error => say(`The page cannot be shown: ${error.message}`, "error"));
