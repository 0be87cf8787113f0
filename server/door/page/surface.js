// What lies above the picture of some screens and is aimed at: by mouse, touch and keys; with marks on what was found.
import { placeIn } from './aiming.js';
import { drawn, element } from './elements.js';

const kStep = 0.02, kSmallStep = 0.004;  // of the picture's height: a key's way

/**
 * Events, with an Aim as `detail.aim` (null: beside all tiles): `press`, `move` while it is pressed, `release`,
 * `cancel` (whatever began with `press` is to end where it is).
 */
export class Surface extends EventTarget {
  #sheet;
  #marks;
  #cross = element('span', { class: 'cross', hidden: true });
  #at = null;         // the cross, in metres of the sheet
  #pressed = null;    // {pointer} or {keys: true}
  #lastTile = null;   // where it was pressed: a drag goes on beyond its edges
  #over = null;       // the newest place of a mouse
  #mode = 'press';

  /** @param {import('./unfold.js').Sheet} sheet */
  constructor(sheet) {
    super();
    this.#sheet = sheet;
    this.#marks = drawn('svg', { class: 'marks', viewBox: `0 0 ${sheet.width} ${sheet.height}`,
                                 preserveAspectRatio: 'none', 'aria-hidden': 'true' });
    this.node = element('div', { class: 'surface', tabindex: '0', role: 'application', hidden: true }, this.#cross);
    this.node.prepend(this.#marks);
    this.node.addEventListener('click', (event) => {
      if (this.#mode === 'press' && event.detail > 0) this.#pressOnce(this.aimOf(event));
    });
    this.node.addEventListener('pointerdown', (event) => this.#onDown(event));
    this.node.addEventListener('pointerleave', () => {
      this.#over = null;
    });
    this.node.addEventListener('pointermove', (event) => {
      this.#over = { clientX: event.clientX, clientY: event.clientY };
      if (this.#pressed?.pointer === event.pointerId) this.#tell('move', this.aimOf(event, this.#lastTile));
    });
    this.node.addEventListener('pointerup', (event) => this.#onUp(event, 'release'));
    this.node.addEventListener('pointercancel', (event) => this.#onUp(event, 'cancel'));
    this.node.addEventListener('lostpointercapture', (event) => this.#onUp(event, 'cancel'));
    this.node.addEventListener('keydown', (event) => this.#onKey(event));
    this.node.addEventListener('blur', () => {
      this.#cross.hidden = true;
      if (this.#pressed?.keys) this.#end('cancel');
    });
  }

  /** @param {'press' | 'drag' | 'raw'} mode `raw`: its tool listens itself */
  set mode(mode) {
    this.#mode = mode;
    this.node.classList.toggle('drags', mode !== 'press');
  }
  /** What is below the mouse. */
  get hovered() {
    return this.#over && this.aimOf(this.#over);
  }

  /** @param {string | null} label what it is for; null: nothing, tiles are pressed themselves */
  set label(label) {
    this.node.hidden = label === null;
    if (label !== null) this.node.setAttribute('aria-label', label);
    for (const tile of this.node.parentElement?.querySelectorAll('.tile') ?? []) tile.inert = label !== null;
  }

  /** @param {{clientX: number, clientY: number}} at @param {string | null} lastTile is meant where there is none */
  aimOf({ clientX, clientY }, lastTile = null) {
    const box = this.node.getBoundingClientRect();
    return this.#aimAt({ x: ((clientX - box.left) / box.width) * this.#sheet.width,
                         y: ((clientY - box.top) / box.height) * this.#sheet.height }, lastTile);
  }

  /** @param {number[][]} points of the world; a line joins them @param {object} plan */
  show(points, plan) {
    const places = points.map((point) => this.#placeOf(point, plan)).filter(Boolean);
    const line = places.length > 1 ? `M ${places.map(({ x, y }) => `${x} ${y}`).join(' L ')}` : '';
    const dots = places.map(({ x, y }) => `M ${x} ${y} h 0`).join(' ');
    this.#marks.replaceChildren(...(places.length === 0 ? [] : [
      drawn('path', { class: 'mark-line mark-under', d: line }), drawn('path', { class: 'mark-line', d: line }),
      drawn('path', { class: 'mark-dot mark-under', d: dots }), drawn('path', { class: 'mark-dot', d: dots }),
    ]));
  }

  #placeOf(point, plan) {
    for (const place of this.#sheet.tiles) {
      const tile = plan.tiles.find((one) => one.name === place.name);
      const seen = tile && placeIn(plan, tile, point);
      if (seen && seen.u >= 0 && seen.u <= 1 && seen.v >= 0 && seen.v <= 1)
        return { x: place.x + seen.u * place.width, y: place.y + seen.v * place.height };
    }
    return null;
  }
  #aimAt({ x, y }, lastTile) {
    const holds = (place) => x >= place.x && x < place.x + place.width && y >= place.y && y < place.y + place.height;
    const place = this.#sheet.tiles.find(holds) ?? this.#sheet.tiles.find((one) => one.name === lastTile);
    return place ? { tile: place.name, u: (x - place.x) / place.width, v: (y - place.y) / place.height } : null;
  }
  #tell(type, aim = null) {
    this.dispatchEvent(new CustomEvent(type, { detail: { aim } }));
  }
  #pressOnce(aim) {
    this.#tell('press', aim);
    this.#tell('release');
  }

  // ---- mouse and touch

  #onDown(event) {
    this.node.focus({ preventScroll: true });
    if (this.#mode !== 'drag' || this.#pressed || event.button !== 0) return;
    event.preventDefault();
    const aim = this.aimOf(event);
    if (!aim) return this.#tell('press', null);
    this.node.setPointerCapture(event.pointerId);
    this.#pressed = { pointer: event.pointerId };
    this.#lastTile = aim.tile;
    this.#tell('press', aim);
  }
  #onUp(event, how) {
    if (this.#pressed?.pointer === event.pointerId) this.#end(how);
  }
  #end(how) {
    this.#pressed = null;
    this.#tell(how);
  }
  /** Whoever has begun something: it ends. */
  letGo() {
    if (this.#pressed) this.#end('cancel');
  }

  // ---- keys: a cross that arrows lead about

  #onKey(event) {
    if (this.#mode === 'raw' || event.ctrlKey || event.altKey || event.metaKey) return;
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (way) {
      const step = (event.shiftKey ? kSmallStep : kStep) * this.#sheet.height;
      const first = this.#sheet.tiles[0];
      this.#at ??= { x: first.x + first.width / 2, y: first.y + first.height / 2 };
      const within = (value, most) => Math.min(Math.max(value, 0), most * (1 - 1e-9));
      this.#at = { x: within(this.#at.x + step * way[0], this.#sheet.width),
                   y: within(this.#at.y + step * way[1], this.#sheet.height) };
      this.#showCross();
      if (this.#pressed?.keys) this.#tell('move', this.#aimAt(this.#at, this.#lastTile));
    } else if (event.key === 'Enter' || event.key === ' ') {
      if (!event.repeat) this.#pressByKey();
    } else if (event.key === 'Escape' && this.#pressed?.keys) {
      this.#end('cancel');
    } else {
      return;
    }
    event.preventDefault();
  }
  #pressByKey() {
    const first = this.#sheet.tiles[0];
    this.#at ??= { x: first.x + first.width / 2, y: first.y + first.height / 2 };
    this.#showCross();
    const aim = this.#aimAt(this.#at, null);
    if (this.#mode === 'press') return this.#pressOnce(aim);
    if (this.#pressed) return this.#end('release');
    if (!aim) return this.#tell('press', null);
    this.#pressed = { keys: true };
    this.#lastTile = aim.tile;
    this.#tell('press', aim);
  }
  #showCross() {
    this.#cross.hidden = false;
    this.#cross.style.left = `${(100 * this.#at.x) / this.#sheet.width}%`;
    this.#cross.style.top = `${(100 * this.#at.y) / this.#sheet.height}%`;
  }
}
