// Places and directions as arrays of three numbers, rotations as [w, x, y, z].

export const plus = (a, b) => a.map((value, i) => value + b[i]);
export const minus = (a, b) => a.map((value, i) => value - b[i]);
export const times = (a, factor) => a.map((value) => value * factor);
export const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const length = (a) => Math.hypot(...a);
export const unit = (a) => times(a, 1 / length(a));
export const apart = (a, b) => length(minus(a, b));

/** `a` turned by a rotation of length 1. */
export function turned(a, [w, ...axis]) {
  const twice = times(cross(axis, a), 2);
  return plus(plus(a, times(twice, w)), cross(axis, twice));
}

/** The same turned back. */
export function turnedBack(a, [w, x, y, z]) {
  return turned(a, [w, -x, -y, -z]);
}

/** How much of each axis makes `a` (Cramer's rule); null: the axes lie in a plane. */
export function inAxes(a, [x, y, z]) {
  const volume = dot(x, cross(y, z));
  if (volume === 0 || !Number.isFinite(1 / volume)) return null;
  return [dot(a, cross(y, z)), dot(x, cross(a, z)), dot(x, cross(y, a))].map((part) => part / volume);
}
