// Where screens, heads and wands are in the room: two drawings, and the same in words.
import { pointText, written } from './aiming.js';
import { element, setChildren, setText } from './elements.js';
import { Newest } from './newest.js';
import { PlanDrawing, kSides } from './plan-drawing.js';
import { apart } from './vectors.js';

const kCalmPeriod = 1000;  // ms between two drawings for who wants little motion
const kWordsPeriod = 250;

export class PlanView {
  #connection;
  #news;
  #status;
  #isShown = false;
  #letGo = null;     // of the news
  #plan = null;
  #poses = null;     // the newest notice
  #isDue = false;
  #drawnAt = -Infinity;
  #words = 0;        // a timer: they are said once for several drawings
  #seen = '';        // what the newest notice shows
  #newest = new Newest();
  #calm = matchMedia('(prefers-reduced-motion: reduce)');
  #drawings = kSides.map((side) => new PlanDrawing(side));
  #said = element('p', { class: 'said', role: 'alert' });
  #lists = new Map(['Screens', 'Heads', 'Wands', 'Trackers', 'In the world']
    .map((name) => [name, element('ul', { class: 'places', 'aria-label': name })]));

  /**
   * @param {HTMLElement} panel
   * @param {import('./connection.js').Connection} connection
   * @param {import('./wall-status.js').WallStatus} status
   * @param {import('./news.js').News} news
   */
  constructor(panel, connection, status, news) {
    this.#connection = connection;
    this.#status = status;
    this.#news = news;
    panel.append(this.#said, element('div', { class: 'plans' }, ...this.#drawings.map((drawing) => drawing.node)),
                 element('div', { class: 'columns' }, ...[...this.#lists].map(
                   ([name, list]) => element('section', {}, element('h2', { text: name }), list))));
    connection.addEventListener('open', () => this.#load());
    connection.addEventListener('lost', () => {
      this.#poses = null;
      this.#seen = '';
    });
    connection.addEventListener('notice', ({ detail }) => {
      if (detail.notice === 'Poses' && this.#isShown) this.#take(detail.fields);
    });
    status.addEventListener('status', () => this.#load());  // who moves the wall, or a head without a tracker
    document.addEventListener('themechange', () => this.#drawSoon());
    new ResizeObserver(() => this.#drawSoon()).observe(panel);
  }

  set isShown(isShown) {
    this.#isShown = isShown;
    this.#letGo?.();
    this.#letGo = isShown ? this.#news.want('poses') : null;
    if (isShown) this.#load();
  }

  #load() {
    if (!this.#isShown || !this.#connection.isOpen) return;
    this.#newest.send(async () => {
      try {
        this.#plan = await this.#connection.ask('GetWall');
        setText(this.#said, '');
      } catch (error) {
        if (error.code !== 'network') setText(this.#said, `✕ ${error.message}`);
      }
      this.#drawSoon();
    });
  }

  /** It is told of each frame, whether anybody has moved or not. */
  #take(poses) {
    const without = ({ poses: _, ...shown }) => shown;
    const seen = JSON.stringify([poses.heads.map(without), poses.wands.map(without)]);
    if (seen === this.#seen) return;
    this.#seen = seen;
    this.#poses = poses;
    this.#drawSoon();
  }

  #drawSoon() {
    if (this.#isDue || !this.#isShown) return;
    this.#isDue = true;
    const wait = this.#calm.matches ? Math.max(0, this.#drawnAt + kCalmPeriod - performance.now()) : 0;
    const draw = () => requestAnimationFrame(() => {
      this.#isDue = false;
      this.#draw();
    });
    if (wait > 0) setTimeout(draw, wait);
    else draw();
  }
  #draw() {
    if (!this.#plan || !this.#isShown) return;
    for (const drawing of this.#drawings) drawing.draw(this.#plan, this.#heads(), this.#wands());
    this.#drawnAt = performance.now();
    this.#words ||= setTimeout(() => {
      this.#words = 0;
      this.#say(this.#heads(), this.#wands());
    }, kWordsPeriod);
  }

  /** As the newest frame has them; before the first is told, as the wall's file does. */
  #heads() {
    return this.#poses?.heads ?? this.#plan.users.map(({ name, position }) => (
      { user: name, tracked: false, position, orientation: [1, 0, 0, 0] }));
  }

  #wands() {
    return this.#poses?.wands ?? [];
  }

  #say(heads, wands) {
    const plan = this.#plan, metres = (value) => `${value.toFixed(2)} m`;
    const at = ([x, y, z]) => `x ${metres(x)}, y ${metres(y)}, z ${metres(z)}`;
    this.#tell('Screens', plan.screens.map((screen) => {
      const users = [...new Set(plan.tiles.filter((tile) => tile.screen === screen.name).map((tile) => tile.user))];
      return `${screen.name}: ${metres(apart(screen.lower_left, screen.lower_right))} wide, ` +
             `${metres(apart(screen.lower_left, screen.upper_left))} high, ${screen.width} × ${screen.height} pixels` +
             (users.length > 0 ? `, drawn for ${users.join(', ')}` : '');
    }), 'None.');
    this.#tell('Heads', heads.map(({ user, tracked, position }) => (
      `${user}: ${at(position)}, ${tracked ? 'seen by a tracker' : 'not tracked'}`)), 'None.');
    this.#tell('Wands', wands.map(({ name, tracked, position, buttons }) => {
      const pressed = [...Array(32).keys()].filter((i) => (buttons >>> i) & 1);
      return `${name}: ${at(position)}, ${tracked ? 'seen by a tracker' : 'not tracked'}` +
             (pressed.length > 0 ? `, pressed: ${pressed.join(', ')}` : '');
    }), 'None.');
    this.#tell('Trackers', this.#status.newest?.trackers ?? [], 'None.');
    this.#tell('In the world', plan.position ? [
      `The wall's origin stands at ${pointText(plan.position)}`,
      `A metre of the room is ${written(plan.world_units_per_metre)} units of the world`,
    ] : [], 'The wall stands nowhere: its camera is gone from the scene.');
  }
  #tell(name, lines, none) {
    const list = this.#lists.get(name), wanted = lines.length > 0 ? lines : [none];
    setChildren(list, wanted.map((_, i) => list.children[i] ?? element('li')));
    wanted.forEach((line, i) => setText(list.children[i], line));
  }
}
