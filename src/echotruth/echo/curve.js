// Smooth curves through points [lateral, axial], px.

// Centripetal Catmull-Rom curve: a list of points at about `step` for each piece between two of the given points, of
// which the end is the begin of the next. An open curve ends with a piece that is its last point alone.
export function pieces(points, closed, step = 1) {
  const count = points.length;
  if (count < 3) return points.map(point => [point]);
  const at = index => (closed ? points[(index + count) % count] : points[index]);
  const found = Array.from({length: closed ? count : count - 1}, (_, index) =>
    piece([-1, 0, 1, 2].map(shift => at(index + shift)), step));
  return closed ? found : [...found, [points[count - 1]]];
}

export function curve(points, closed, step = 1) {
  return pieces(points, closed, step).flat();
}

// Hermite form of the piece from the second to the third of four points, of which the first or the last may be missing.
function piece([before, from, to, after], step) {
  const steps = Math.max(1, Math.round(1.1 * distance(from, to) / step));
  const slopes = [0, 1].map(axis => {
    const first = before && slope(before, from, to, axis) * knot(from, to);
    const last = after && slope(from, to, after, axis) * knot(from, to);
    // At an end the piece is a parabola, which bends as its neighbour does.
    return [first ?? 2 * (to[axis] - from[axis]) - last, last ?? 2 * (to[axis] - from[axis]) - first];
  });
  return Array.from({length: steps}, (_, index) => [0, 1].map(axis =>
    hermite(index / steps, from[axis], to[axis], ...slopes[axis])));
}

// Slope at the second of three points.
function slope(a, b, c, axis) {
  const [first, second] = [knot(a, b), knot(b, c)];
  return (b[axis] - a[axis]) / first - (c[axis] - a[axis]) / (first + second) + (c[axis] - b[axis]) / second;
}

// Length of a piece in the parameter of the curve.
function knot(a, b) {
  return Math.max(Math.sqrt(distance(a, b)), 1e-6);
}

function hermite(t, from, to, slopeFrom, slopeTo) {
  const rest = 1 - t;
  return (1 + 2 * t) * rest * rest * from + t * t * (3 - 2 * t) * to + t * rest * (rest * slopeFrom - t * slopeTo);
}

export function distance(a, b) {
  return Math.hypot(a[0] - b[0], a[1] - b[1]);
}

// Number and distance of the point of a line that is nearest to a place.
export function nearest(line, place) {
  let best = {index: -1, distance: Infinity};
  line.forEach((point, index) => {
    const apart = distance(point, place);
    if (apart < best.distance) best = {index, distance: apart};
  });
  return best;
}

// As few points of a line, at equal distances along it, as make a curve that is nowhere farther from it than
// `tolerance`, px; 30 at most. A line of few points is taken as it is.
export function fitted(line, closed, tolerance = 0.5) {
  if (line.length <= 24) return line;
  for (let count = 8; ; count += 1) {
    const points = spread(line, closed, count), drawn = curve(points, closed, 0.5);
    if (count === 30 || line.every(point => nearest(drawn, point).distance <= tolerance)) return points;
  }
}

// Points of a line nearest to equal distances along it; an open one keeps its ends.
function spread(line, closed, count) {
  let length = 0;
  const along = line.map((point, index) => length += index ? distance(point, line[index - 1]) : 0);
  const step = closed ? (length + distance(line[0], line[line.length - 1])) / count : length / (count - 1);
  return Array.from({length: count}, (_, number) => line[nearest(along.map(at => [at, 0]), [number * step, 0]).index]);
}
