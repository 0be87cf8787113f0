// Moves the wall through the scene: mouse, keys, fingers, and buttons for those who have none of these.
import { element, setText } from './elements.js';
import { Hands } from './hands.js';
import { Newest } from './newest.js';

const kModes = ['fly', 'orbit', 'walk'];
const kWays = [['KeyW', '▲', 'Forward'], ['KeyS', '▼', 'Back'], ['KeyA', '◀', 'Left'], ['KeyD', '▶', 'Right'],
               ['KeyE', '⤒', 'Up'], ['KeyQ', '⤓', 'Down']];
const kBookmarks = 9;

export class FlyTool {
  name = 'Fly';
  hint = 'Drag to look, with Shift, another button or two fingers to shift; part two fingers to go forward.';
  keys = 'Keys on the picture: W A S D and arrows go, E and Q rise and sink, Shift is faster, Z and C roll, ' +
         'L levels, F fits what is below the mouse, Home goes home, M is the next way to move, ' +
         '1 to 9 go to bookmarks, with Shift they keep one.';
  edits = true;
  surface = 'raw';
  #around;
  #found;
  #isOn = false;
  #hands = new Hands(() => this.#send());
  #newest = new Newest();
  #told = '';     // the state that the wall has
  #mode = element('select', { 'aria-label': 'How to move' },
                  ...kModes.map((mode) => element('option', { text: mode })));
  #bookmark = element('select', { 'aria-label': 'Bookmark' });
  #steering = element('p', { class: 'muted' });
  #done = element('p', { class: 'muted', role: 'status' });
  #taken = null;  // AbortController of what is listened to
  node;

  /** @param {() => import('./aiming.js').Thing | null} found what was picked last */
  constructor(around, found) {
    this.#around = around;
    this.#found = found;
    for (let i = 1; i <= kBookmarks; ++i) this.#bookmark.append(element('option', { text: `${i}` }));
    const button = (text, onclick) => element('button', { type: 'button', text, onclick });
    this.#mode.addEventListener('change', () => this.#do({ mode: this.#mode.value }, `You ${this.#mode.value} now.`));
    const go = () => this.#goTo(this.#bookmark.value), keep = () => this.#keep(this.#bookmark.value);
    this.node = element('div', { class: 'found' },
                        element('div', { class: 'ways', role: 'group', 'aria-label': 'Held, they move' },
                                ...kWays.map((way) => this.#wayButton(way))),
                        element('div', { class: 'bar' }, this.#mode, button('Home', () => this.#do({ deed: 'home' })),
                                button('Fit all', () => this.#do({ deed: 'fit' })),
                                button('Fit what was picked', () => this.#fitPicked())),
                        element('div', { class: 'bar' },
                                element('label', { class: 'labelled' }, 'Bookmark ', this.#bookmark),
                                button('Go', go), button('Keep', keep)),
                        this.#done, this.#steering);
    around.connection.addEventListener('lost', () => {
      this.#hands.forget();
      this.#told = '';
    });
    around.status.addEventListener('status', ({ detail }) => this.#onStatus(detail));
    // Whoever does not look at this page any more holds nothing.
    addEventListener('blur', () => this.#release());
    addEventListener('pagehide', () => this.#release());
    document.addEventListener('visibilitychange', () => this.#release());
  }

  begin() {
    this.#isOn = true;
    this.#taken = new AbortController();
    this.#around.aiming.look().catch(() => {});  // where tiles lie in the mosaic
    for (const surface of this.#around.surfaces()) this.#listen(surface);
  }
  end() {
    this.#release();
    this.#isOn = false;
    this.#taken?.abort();
  }

  #listen(surface) {
    const { node } = surface, { signal } = this.#taken;
    const on = (type, take, options = {}) => node.addEventListener(type, take, { signal, ...options });
    on('pointerdown', (event) => {
      if (event.button > 2) return;
      event.preventDefault();
      node.focus({ preventScroll: true });
      node.setPointerCapture(event.pointerId);
      this.#hands.down(event, event.button !== 0 || event.shiftKey, this.#cursorAt(surface, event));
    });
    on('pointermove', (event) => this.#hands.move(event, node.clientHeight));
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture']) on(type, (event) => this.#hands.up(event));
    on('contextmenu', (event) => event.preventDefault());
    on('wheel', (event) => {
      if (event.ctrlKey) return;  // the page is made larger
      event.preventDefault();
      this.#hands.turn(event);
    }, { passive: false });
    on('keydown', (event) => this.#onKey(event, surface));
    on('keyup', (event) => this.#hands.keyUp(event.code));
    on('blur', () => this.#release());
  }

  /** On the first screen's mosaic: the wall takes a cursor nowhere else. */
  #cursorAt(surface, event) {
    const aim = surface.aimOf(event), { plan } = this.#around.aiming;
    const tile = plan?.tiles.find((one) => one.name === aim?.tile), [screen] = plan?.screens ?? [];
    if (!tile || tile.screen !== screen.name) return null;
    return { x: (tile.mosaic_x + aim.u * tile.width) / screen.mosaic_width,
             y: (tile.mosaic_y + aim.v * tile.height) / screen.mosaic_height };
  }

  #onKey(event, surface) {
    if (event.altKey || event.metaKey) return;
    const digit = /^Digit([1-9])$/.exec(event.code)?.[1];
    if (digit) {
      if (!event.repeat && (event.ctrlKey || event.shiftKey)) this.#keep(digit);
      else if (!event.repeat) this.#goTo(digit);
    } else if (event.ctrlKey) {
      return;
    } else if (!this.#hands.keyDown(event.code)) {
      const deed = {
        Home: () => this.#do({ deed: 'home' }),
        KeyF: () => (event.shiftKey ? this.#do({ deed: 'fit' }) : this.#fitBelow(surface)),
        KeyL: () => this.#hands.level(),
        KeyM: () => this.#setMode(kModes[(kModes.indexOf(this.#mode.value) + 1) % kModes.length]),
        F2: () => this.#setMode('fly'), F3: () => this.#setMode('orbit'), F4: () => this.#setMode('walk'),
      }[event.code];
      if (!deed) return;
      if (!event.repeat) deed();
    }
    event.preventDefault();
  }

  /** Held by touch, mouse or key, as the key is that it stands for. */
  #wayButton([code, sign, name]) {
    const node = element('button', { type: 'button', 'aria-label': name, text: sign });
    const down = () => this.#hands.keyDown(code), up = () => this.#hands.keyUp(code);
    node.addEventListener('pointerdown', (event) => {
      node.focus({ preventScroll: true });  // before it takes hold: whatever loses the focus lets go
      node.setPointerCapture(event.pointerId);
      down();
    });
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture', 'blur', 'keyup'])
      node.addEventListener(type, up);
    node.addEventListener('keydown', (event) => {
      if (event.key !== 'Enter' && event.key !== ' ') return;
      event.preventDefault();
      down();
    });
    node.addEventListener('contextmenu', (event) => event.preventDefault());  // of a finger that rests
    return node;
  }

  // ---- what is asked for

  #setMode(mode) {
    this.#mode.value = mode;
    this.#do({ mode }, `You ${mode} now.`);
  }
  #goTo(bookmark) {
    this.#do({ deed: 'go_to_bookmark', bookmark: Number(bookmark) });
  }
  #keep(bookmark) {
    this.#do({ deed: 'keep_bookmark', bookmark: Number(bookmark) }, `Kept as bookmark ${bookmark}.`);
  }
  #fitPicked() {
    const found = this.#found();
    if (found) this.#do({ deed: 'fit', node: found.node }, `On the way to ${found.label}.`);
    else this.#around.say('Nothing was picked yet.');
  }
  /** What is below the cursor, else all. */
  async #fitBelow(surface) {
    const { aiming, say } = this.#around;
    try {
      const aim = surface.hovered;
      const thing = aim && await aiming.pick(await aiming.ray(aim));
      await this.#do(thing ? { deed: 'fit', node: thing.node } : { deed: 'fit' });
    } catch (error) {
      say(error.message);
    }
  }
  async #do(wish, done = '') {
    try {
      await this.#around.connection.ask('NavigateView', wish);
      setText(this.#done, done);
      if (wish.mode) this.#hands.isOrbit = wish.mode === 'orbit';
      this.#around.say('');
    } catch (error) {
      this.#around.say(error.message);
    }
  }

  // ---- what is held

  #release() {
    if (this.#isOn) this.#hands.release();
  }
  /** The newest state alone: it says all that those before it have said. */
  #send() {
    const { connection, say } = this.#around;
    if (!connection.isOpen) return;
    this.#newest.send(async () => {
      const input = this.#hands.state, state = JSON.stringify(input);
      if (state === this.#told) return;
      this.#told = state;
      try {
        await connection.ask('NavigateView', { input });
      } catch (error) {
        if (error.code !== 'network') say(error.message);
      }
    });
  }
  #onStatus({ navigation, steering }) {
    if (document.activeElement !== this.#mode && kModes.includes(navigation)) this.#mode.value = navigation;
    this.#hands.isOrbit = navigation === 'orbit';
    setText(this.#steering, steering?.length ? `Steering now: ${steering.join(', ')}` : '');
  }
}
