// Gives the pictures as much of the window as their aspect and the graphs allow, now and when a size changes.
const GRAPHS = 470; // width that is left to the graphs beside the pictures, px
const LEAST = 380; // side of a picture below which the graphs go below it, px
const element = (figure) => Bokeh.index.find_one(figure).el;

function fit() {
  const shown = figures.filter((figure) => figure.visible && figure.inner_width > 0);
  if (shown.length === 0) return;
  const { clientWidth, clientHeight } = document.documentElement;
  const below = clientHeight - element(shown[0]).getBoundingClientRect().top - scrollY; // of the top of a picture
  const above = shown[0].outer_height - shown[0].inner_height; // title and axis
  const bottom = (model) => element(model).getBoundingClientRect().bottom;
  const under = bottom(facts) - bottom(shown.at(-1)) + 14; // what is seen with a picture: player and facts
  const high = Math.max(LEAST, below - above - under), room = clientWidth - 30;
  const widest = Math.max(...shown.map((figure) => figure.outer_width - figure.inner_width)); // axis, colour bar
  let side = (room - GRAPHS) / shown.length - widest;
  if (side < LEAST) side = room / shown.length - widest;
  if (side < LEAST) side = room - widest;
  side = Math.floor(Math.min(side, high));
  for (const figure of figures) {
    if (Math.abs(figure.frame_width - side) < 2) continue;
    figure.setv({ frame_width: side, frame_height: side }, { sync: false });
  }
  const height = Math.max(180, Math.floor((below - 80) / graphs.length));
  for (const graph of graphs) if (graph.height !== height) graph.setv({ height }, { sync: false });
}

const observer = new ResizeObserver(() => requestAnimationFrame(fit));
observer.observe(document.documentElement);
for (const model of [...figures, facts]) observer.observe(element(model));
