// Says what is under the pointer: position, grey level, and the number or the name that the colour stands for.
const { x, y } = cb_obj;
const size = Math.round(Math.sqrt(picture.data.image[0].length));
const column = Math.floor((x / side.value + 0.5) * size), row = Math.floor((y / side.value) * size);
if (column >= 0 && column < size && row >= 0 && row < size) {
  const place = slider.value * size * size + row * size + column;
  const index = colour.data.index[0][place] ?? 0, scale = bar.color_mapper;
  const shown = scale.low + (index - 0.5) * (scale.high - scale.low) / scale.palette.length;
  const named = names.data.name.length > 1 ? names.data.name[index] : shown.toPrecision(3);
  const parts = [`${x.toFixed(2)} mm, depth ${y.toFixed(2)} mm`, `grey level ${clip.data.grey[0][place]}`];
  if (index > 0) parts.push(`${bar.title}: ${named}`);
  said.setv({ text: parts.join(" · ") }, { sync: false });
}
