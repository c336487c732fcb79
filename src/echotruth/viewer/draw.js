// Draws the frame that the slider says: the pictures with their colours and paths, and the lines in the curves.
// Arguments: slider, opacity (sliders); clip {grey}, times {time, text}; and for each panel, in lists, colours {index},
// palettes {red, green, blue}, pictures {image}, labels, figures; positions {x, y} and paths, in pairs; and cursors.
const state = (window.echotruth ??= { drawn: 0, pending: false, tables: [] });
if (!state.pending) {
  state.pending = true; // several changes within a frame of the screen are drawn once
  requestAnimationFrame(() => {
    state.pending = false;
    const frame = Math.min(slider.value, times.data.time.length - 1);
    const kinds = positions.length / figures.length;
    figures.forEach((figure, panel) => {
      if (!figure.visible) return; // drawn while hidden, a figure is laid out anew every time
      draw_picture(pictures[panel], panel, frame);
      for (let n = panel * kinds; n < (panel + 1) * kinds; n++) draw_path(positions[n], paths[n], frame);
    });
    cursors.forEach((cursor) => { set(cursor, { location: times.data.time[frame] }); });
    labels.forEach((label, panel) => { if (figures[panel].visible) set(label, { text: times.data.text[frame] }); });
    state.drawn += 1;
    state.frame = frame;
  });
}

// Changes a model here alone: the server need not know.
function set(model, values) {
  model.setv(values, { sync: false });
}

function draw_picture(picture, panel, frame) {
  const target = picture.data.image[0], stack = clip.data.grey[0];
  if (stack.length < target.length * (frame + 1)) return; // the parts of another size are still on their way
  const grey = part(Uint8Array, stack, frame * target.length, target.length);
  const index = colours[panel].data.index[0];
  const table = blended(panel);
  if (index.length === stack.length) {
    const over = part(Uint8Array, index, frame * target.length, target.length);
    for (let i = 0; i < target.length; i++) target[i] = table[(over[i] << 8) | grey[i]];
  } else {
    for (let i = 0; i < target.length; i++) target[i] = table[grey[i]];
  }
  picture.change.emit();
}

// A part of an array of Bokeh's, whose own subarray() is the whole of it.
function part(type, array, from, count) {
  return new type(array.buffer, array.byteOffset + from * array.BYTES_PER_ELEMENT, count);
}

// Colour of every grey level under every entry of the palette; entry 0 is the grey level alone.
function blended(panel) {
  const { red, green, blue } = palettes[panel].data;
  const known = state.tables[panel];
  if (known && known.red === red && known.opacity === opacity.value) return known.table;
  const table = known ? known.table : new Uint32Array(256 * 256);
  for (let entry = 0; entry <= red.length; entry++) {
    const share = entry === 0 ? 0 : opacity.value;
    const [r, g, b] = entry === 0 ? [0, 0, 0] : [red[entry - 1], green[entry - 1], blue[entry - 1]];
    for (let grey = 0; grey < 256; grey++) {
      const mixed = (colour) => Math.round((1 - share) * grey + share * colour);
      table[(entry << 8) | grey] = ((255 << 24) | (mixed(b) << 16) | (mixed(g) << 8) | mixed(r)) >>> 0;
    }
  }
  state.tables[panel] = { red, opacity: opacity.value, table };
  return table;
}

// A path is all its steps up to the frame, with a dot where the point is.
function draw_path(position, path, frame) {
  const { x, y } = position.data;
  if (x.length === 0 && path.data.x0.length === 0) return;
  const points = Math.round(x.length / times.data.time.length), count = (frame + 1) * points;
  const [x1, y1] = [x, y].map((all) => part(Float32Array, all, 0, count));
  const [x0, y0] = [x1, y1].map((all) => all.map((_, i) => all[Math.max(i - points, i % points)]));
  const head_x = x1.map((value, i) => (i < count - points ? NaN : value));
  Object.assign(path.data, { x0, y0, x1, y1, head_x });
  path.change.emit();
}
