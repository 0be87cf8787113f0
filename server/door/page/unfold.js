// Where the tiles of a wall stand on a flat page: in metres, x to the right, y down.
import { apart, cross, dot, minus, unit } from './vectors.js';

/**
 * @typedef {{name: string, x: number, y: number, width: number, height: number, tile: object}} PlacedTile
 * @typedef {{name: string, isFlat: boolean, width: number, height: number, tiles: PlacedTile[]}} Sheet screens that
 *     hang together; flat: they lie in one plane
 */

const kSameDirection = 1e-3, kSamePlane = 1e-2;  // of unit vectors; metres
const kHinge = 0.05;  // of an edge's length: two screens' edges that are no farther apart are one

/** The directions of a screen, and its plane. */
function frameOf(screen) {
  const right = unit(minus(screen.lower_right, screen.lower_left));
  const up = unit(minus(screen.upper_left, screen.lower_left));
  return { right, up, normal: unit(cross(right, up)), origin: screen.lower_left };
}

function isSamePlane(a, b) {
  const distance = Math.abs(dot(a.normal, minus(b.origin, a.origin)));
  return dot(a.normal, b.normal) > 1 - kSameDirection && distance < kSamePlane;
}

/** Around a parallelogram, as it lies in a frame. */
function rectangleIn(frame, corners) {
  const { lower_left: a, lower_right: b, upper_left: c } = corners;
  const fourth = b.map((value, i) => value + c[i] - a[i]);
  const xs = [], ys = [];
  for (const corner of [a, b, c, fourth]) {
    const from = minus(corner, frame.origin);
    xs.push(dot(from, frame.right));
    ys.push(-dot(from, frame.up));
  }
  return around(xs.map((x, i) => ({ x, y: ys[i], width: 0, height: 0 })));
}

function around(rectangles) {
  const x = Math.min(...rectangles.map((one) => one.x)), y = Math.min(...rectangles.map((one) => one.y));
  return { x, y, width: Math.max(...rectangles.map((one) => one.x + one.width)) - x,
           height: Math.max(...rectangles.map((one) => one.y + one.height)) - y };
}

/** Of two eyes' tiles in one place the first alone: stereo is shown as one eye. */
function oneEye(tiles) {
  const seen = new Set();
  const order = { center: 0, left: 1, right: 2 };
  return [...tiles]
    .sort((a, b) => (order[a.eye] ?? 0) - (order[b.eye] ?? 0))
    .filter((tile) => {
      const place = [tile.screen, tile.x, tile.y, tile.width, tile.height].join(' ');
      return !seen.has(place) && seen.add(place);
    });
}

/** Screens of one plane: where they are in it, and its edges in the room. */
function planeOf(frame, screens) {
  const box = around(screens.map((screen) => rectangleIn(frame, screen)));
  const corner = (x, y) => frame.origin.map((value, i) => value + x * frame.right[i] - y * frame.up[i]);
  const topLeft = corner(box.x, box.y), topRight = corner(box.x + box.width, box.y);
  const lowLeft = corner(box.x, box.y + box.height), lowRight = corner(box.x + box.width, box.y + box.height);
  return { frame, box, names: screens.map((screen) => screen.name),
           edges: { left: [lowLeft, topLeft], right: [lowRight, topRight], top: [topLeft, topRight],
                    bottom: [lowLeft, lowRight] } };
}

/** Where `b` lies, folded out around the edge that it shares with `a`; nothing: it shares none. */
function foldedOut(a, b) {
  const shares = (side, other) => {
    const [from, to] = a.edges[side], [begin, end] = b.edges[other];
    return Math.max(apart(from, begin), apart(to, end)) < kHinge * apart(from, to);
  };
  const { x, y } = a.at;
  if (shares('right', 'left')) return { x: x + a.box.width, y };
  if (shares('left', 'right')) return { x: x - b.box.width, y };
  if (shares('bottom', 'top')) return { x, y: y + a.box.height };
  if (shares('top', 'bottom')) return { x, y: y - b.box.height };
  return null;
}

function overlaps(at, plane, other) {
  const room = 1e-3;  // metres
  return at.x + plane.box.width > other.at.x + room && other.at.x + other.box.width > at.x + room &&
         at.y + plane.box.height > other.at.y + room && other.at.y + other.box.height > at.y + room;
}

/** Planes that hang together, each with its place `at` on the page. */
function hangingTogether(planes) {
  const left = [...planes], groups = [];
  while (left.length > 0) {
    const group = [left.shift()];
    group[0].at = { x: 0, y: 0 };
    for (const placed of group) {  // it grows meanwhile
      for (const plane of [...left]) {
        const at = foldedOut(placed, plane);
        if (!at || group.some((other) => overlaps(at, plane, other))) continue;
        plane.at = at;
        group.push(plane);
        left.splice(left.indexOf(plane), 1);
      }
    }
    groups.push(group);
  }
  return groups;
}

/**
 * Screens of one plane keep their places; a room is cut open and folded flat around the first screen; what touches
 * nothing lies by itself.
 * @param {{screens: object[], tiles: object[]}} plan the answer of GetWall
 * @returns {Sheet[]}
 */
export function unfold(plan) {
  const planes = [];
  for (const screen of plan.screens) {
    const frame = frameOf(screen);
    const known = planes.find((plane) => isSamePlane(plane.frame, frame));
    if (known) known.screens.push(screen);
    else planes.push({ frame, screens: [screen] });
  }
  const tiles = oneEye(plan.tiles);
  return hangingTogether(planes.map(({ frame, screens }) => planeOf(frame, screens))).map((group) => {
    const box = around(group.map(({ at, box: { width, height } }) => ({ ...at, width, height })));
    return {
      name: group.flatMap((plane) => plane.names).join(', '),
      isFlat: group.length === 1,
      width: box.width,
      height: box.height,
      tiles: group.flatMap((plane) => tiles.filter((tile) => plane.names.includes(tile.screen)).map((tile) => {
        const place = rectangleIn(plane.frame, tile);
        return { ...place, x: place.x - plane.box.x + plane.at.x - box.x, y: place.y - plane.box.y + plane.at.y - box.y,
                 name: tile.name, tile };
      })),
    };
  });
}
