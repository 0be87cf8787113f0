// A wall from one side, to scale: screens, what each head sees through them, heads and wands.
import { drawn, element } from './elements.js';
import { minus, plus, times, turned } from './vectors.js';

const kMargin = 40;        // px around all of it: labels
const kHeadMetres = 0.11;  // half a head
const kLeastHead = 7;      // px
const kNoseMetres = 0.3, kWandMetres = 0.35;
const kAbove = 8, kBelow = 20;  // px, from an edge to the line that its label stands on
const kCorner = 8, kApart = 4;  // px: the corners of a box are empty where its label stands aslant; between others
const kMostLetters = 20;   // of a head's or a wand's name
const kFlat = 1e-3;        // metres: a screen that is seen from its edge

/** @typedef {{name: string, caption: string, flatten: (place: number[]) => [number, number]}} Side */

/** @type {Side[]} the picture's right, and up, in metres of the wall */
export const kSides = [
  { name: 'above', caption: 'From above, in metres: the front is at the top', flatten: ([x, , z]) => [x, -z] },
  { name: 'side', caption: 'From the left, in metres: the front is at the left', flatten: ([, y, z]) => [z, y] },
];

const cornersOf = ({ lower_left, lower_right, upper_left }) =>
  [lower_left, lower_right, plus(lower_right, minus(upper_left, lower_left)), upper_left];

/** Around points of a plane (Andrew's monotone chain). */
function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (all) => {
    const kept = [];
    for (const point of all) {
      while (kept.length > 1) {
        const [a, b] = kept.slice(-2);
        if ((b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]) > 0) break;
        kept.pop();
      }
      kept.push(point);
    }
    return kept.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

/** 1, 2 or 5 times a power of ten: what is not longer. */
function niceBelow(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [5, 2, 1].map((step) => step * power).find((step) => step <= value) ?? power;
}

export class PlanDrawing {
  #side;
  #svg = drawn('svg', { role: 'img' });
  #label = '';

  /** @param {Side} side */
  constructor(side) {
    this.#side = side;
    this.#svg.dataset.side = side.name;
    this.node = element('figure', { class: 'plan' }, element('figcaption', { text: side.caption }), this.#svg);
  }

  /**
   * @param {object} plan an answer of GetWall
   * @param {{user: string, tracked: boolean, position: number[], orientation: number[]}[]} heads
   * @param {{name: string, tracked: boolean, position: number[], orientation: number[]}[]} wands
   */
  draw(plan, heads, wands) {
    const { flatten } = this.#side;
    const outlines = outlinesOf(plan, flatten);
    const places = [...outlines.flatMap(({ points }) => points), ...heads.map(({ position }) => flatten(position)),
                    ...wands.map(({ position }) => flatten(position))];
    const scale = this.#fit(places);
    if (!scale) return;
    const { at, unit } = scale;
    const parts = [];
    const path = (points) => points.map((point) => at(point).map((value) => value.toFixed(1)).join(',')).join(' ');
    const add = (tag, attributes, text) => parts.push(drawn(tag, attributes, text));
    for (const head of heads) {
      const theirs = new Set(plan.tiles.filter((tile) => tile.user === head.user).map((tile) => tile.screen));
      for (const screen of plan.screens.filter(({ name }) => theirs.has(name)))
        add('polygon', { class: 'frustum', points: path(hull([head.position, ...cornersOf(screen)].map(flatten))) });
    }
    for (const { points } of outlines) add('polygon', { class: 'screen', points: path(points) });
    const middle = [this.#svg.clientWidth / 2, this.#height / 2];
    const labels = outlines.map(({ points, names, isEdge }) => {
      const place = isEdge ? besideEdge(points.map(at), middle) : onFace(points.map(at));
      return drawn('text', { ...place, 'text-anchor': 'middle' }, names.join(', '));
    });
    parts.push(...labels);
    const names = [];
    const arrow = (kind, { position, orientation, tracked }, metres) => {
      const ahead = plus(position, times(turned([0, 0, -1], orientation), metres));
      add('polyline', { class: tracked ? kind : `${kind} lost`, points: path([flatten(position), flatten(ahead)]) });
    };
    for (const wand of wands) {
      arrow('wand', wand, kWandMetres);
      const [x, y] = at(flatten(wand.position));
      add('circle', { cx: x, cy: y, r: 4, class: 'head wand-end' });
      names.push(drawn('text', { x, y: y + 20, 'text-anchor': 'middle' }, short(wand.name)));
    }
    for (const head of heads) {
      arrow('nose', { ...head, tracked: true }, kNoseMetres);
      const [x, y] = at(flatten(head.position)), radius = Math.max(kLeastHead, kHeadMetres * unit);
      add('circle', { class: 'head', cx: x, cy: y, r: radius, 'data-user': head.user });
      names.push(drawn('text', { x, y: y + radius + 18, 'text-anchor': 'middle' }, short(head.user)));
    }
    this.#addRuler(add, unit);
    this.#svg.replaceChildren(...parts, ...names);
    leaveFree(this.#svg, labels);
    for (const name of names) keepInside(this.#svg, name);
    const label = `${this.#side.caption}: ${plan.screens.length} screens, ${heads.length} heads, ${wands.length} wands`;
    if (label !== this.#label) this.#svg.setAttribute('aria-label', label);
    this.#label = label;
  }

  /** How metres lie on the page, as wide as there is room. */
  #fit(places) {
    const width = this.#svg.clientWidth;
    if (width === 0 || places.length === 0) return null;
    const xs = places.map(([x]) => x), ys = places.map(([, y]) => y);
    const left = Math.min(...xs), top = Math.max(...ys);
    const across = Math.max(Math.max(...xs) - left, 0.5), high = Math.max(top - Math.min(...ys), 0.5);
    const most = Math.max(200, innerHeight * 0.55) - 2 * kMargin - kMargin;
    const unit = Math.min((width - 2 * kMargin) / across, most / high);
    const height = Math.round(unit * high + 3 * kMargin);
    this.#svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
    this.#svg.style.height = `${height}px`;
    const aside = (width - unit * across) / 2;
    this.#height = height;
    return { unit, at: ([x, y]) => [aside + unit * (x - left), kMargin + unit * (top - y)] };
  }
  #height = 0;

  #addRuler(add, unit) {
    const width = this.#svg.clientWidth, metres = niceBelow(width / 3 / unit), y = this.#height - 10;
    const end = 12 + metres * unit;
    add('path', { class: 'ruler', d: `M 12 ${y - 6} V ${y} H ${end} V ${y - 6}` });
    add('text', { x: end + 8, y, class: 'ruler-text' }, `${metres} m`);
  }
}

/** Screens as they are seen from here; those that lie on each other together. */
function outlinesOf(plan, flatten) {
  const outlines = [];
  for (const screen of plan.screens) {
    const points = hull(cornersOf(screen).map(flatten));
    const key = points.map((point) => point.map((value) => value.toFixed(3)).join()).join(' ');
    const known = outlines.find((one) => one.key === key);
    if (known) known.names.push(screen.name);
    else outlines.push({ key, points, names: [screen.name], isEdge: areaOf(points) < kFlat });
  }
  return outlines;
}

function areaOf(points) {
  return Math.abs(points.reduce((sum, [x, y], i) => {
    const [a, b] = points[(i + 1) % points.length];
    return sum + x * b - y * a;
  }, 0)) / 2;
}

// ---- labels, on the page

/** At an edge a name stands beside its place. */
function keepInside(svg, label) {
  const { x, width } = label.getBBox(), inside = Math.max(0, Math.min(x, svg.clientWidth - width));
  label.setAttribute('x', Number(label.getAttribute('x')) + inside - x);
}

/** A name that leaves room; the list says all of it. */
function short(name) {
  return name.length > kMostLetters ? `${name.slice(0, kMostLetters - 1)}…` : name;
}

const middleOf = (corners) => [0, 1].map((i) => corners.reduce((sum, corner) => sum + corner[i] / corners.length, 0));

/** Along an edge, on the side that is farther from the middle of all. */
function besideEdge(corners, middle) {
  const [x, y] = middleOf(corners), [[x0, y0], [x1, y1]] = [corners[0], corners.at(-1)];
  let angle = Math.atan2(y1 - y0, x1 - x0);
  if (angle >= Math.PI / 2) angle -= Math.PI;  // nothing stands on its head
  if (angle < -Math.PI / 2) angle += Math.PI;
  const up = [Math.sin(angle), -Math.cos(angle)];
  const isAbove = up[0] * (x - middle[0]) + up[1] * (y - middle[1]) > 0;
  const away = isAbove ? kAbove : -kBelow;
  const at = { x: x + away * up[0], y: y + away * up[1] };
  return { ...at, transform: `rotate(${(180 / Math.PI) * angle} ${at.x} ${at.y})` };
}

/** At the lower side of what is seen as a face. */
function onFace(corners) {
  return { x: middleOf(corners)[0], y: Math.max(...corners.map(([, y]) => y)) - kAbove };
}

/** A label that would lie on another one, or be cut off, goes: the list says all. */
function leaveFree(svg, labels) {
  const whole = svg.getBoundingClientRect(), kept = [];
  for (const label of labels) {
    const box = label.getBoundingClientRect();
    const spare = label.hasAttribute('transform') ? kCorner : -kApart;
    const meets = (other) => Math.min(box.right, other.right) - Math.max(box.left, other.left) > spare &&
                             Math.min(box.bottom, other.bottom) - Math.max(box.top, other.top) > spare;
    if (box.left < whole.left || box.right > whole.right || kept.some(meets)) label.remove();
    else kept.push(box);
  }
}
