// What plays in the scene: animations, motions, films, streams of particles; and how far each is.
import { numberIn } from './editors.js';
import { element, setText } from './elements.js';
import { ListView } from './list-view.js';
import { Newest } from './newest.js';
import { reasonOf } from './scene.js';

const kRowsAtOnce = 50;
const kFramesPerSecond = 60;  // of a scene's time: with each frame of a wall it grows by a sixtieth of its speed
const kStep = 66;             // ms between two looks at what moves

/** @param {import('./schema.js').Type} type */
const plays = ({ fields }) => fields.some(({ name, kind }) => name === 'playing' && kind === 'bool')
  && fields.some(({ name }) => name === 'time');

/** A time beyond an end stays there, or goes round; to and fro it runs to twice the length. */
function folded(time, length, mode) {
  if (!(length > 0)) return time;
  if (mode === 'once') return Math.min(length, Math.max(0, time));
  const way = mode === 'ping-pong' ? 2 * length : length;
  // An end is an end, and not the beginning.
  return time > 0 && time % way === 0 ? way : ((time % way) + way) % way;
}

class AnimationRow {
  #scene;
  #listed = null;
  #pace = 0;       // s of its time in a second
  #isHeld = false;
  #gesture = 0;
  #edits;
  #said = element('p', { class: 'said', role: 'alert' });
  #name = element('span', { class: 'name' });
  #kind = element('span', { class: 'muted' });
  #time = element('span', { class: 'time' });
  #play = element('button', { type: 'button', onclick: () => this.#set('playing', !this.#listed.values.playing) });
  #slider = element('input', { type: 'range', min: 0, step: 'any' });
  #seek = element('input', { type: 'text', class: 'number', autocomplete: 'off', inputmode: 'decimal' });
  #speed = element('input', { type: 'text', class: 'number', autocomplete: 'off' });
  #rate;

  /**
   * @param {{scene: import('./scene.js').Scene, mayEdit: boolean, onSelect: (node: number) => void, rate: () => number,
   *     listed: import('./core-list.js').Listed}} options rate: frames of the wall in a second
   */
  constructor({ scene, mayEdit, onSelect, rate, listed }) {
    this.#scene = scene;
    this.#rate = rate;
    this.#edits = new Newest((field, value) => scene.set(this.#listed.core, field, value, this.#gesture));
    const label = listed.label;
    const show = element('button', { type: 'button', class: 'link', onclick: () => onSelect(listed.node) }, this.#name);
    const speed = 'speed' in listed.values;
    this.#slider.setAttribute('aria-label', `${label}, time`);
    this.#seek.setAttribute('aria-label', `${label}, time in s`);
    this.#speed.setAttribute('aria-label', `${label}, speed`);
    this.node = element('li', { class: 'animation' }, element('div', { class: 'what' }, show, this.#kind));
    if (mayEdit) {
      this.node.append(this.#play, element('div', { class: 'seek' }, this.#slider, this.#time));
      this.node.append(element('label', { class: 'part' }, 's', this.#seek));
      if (speed) this.node.append(element('label', { class: 'part' }, '×', this.#speed));
      this.#begin();
    } else {
      this.node.append(this.#time);
    }
    this.node.append(this.#said);
  }

  #begin() {
    this.#seek.addEventListener('change', () => {
      const { length, values } = this.#listed, typed = numberIn(this.#seek);
      this.#set('time', Number.isFinite(typed) ? folded(typed, length, values.mode) : String(typed));
    });
    this.#speed.addEventListener('change', () => this.#set('speed', numberIn(this.#speed)));
    const time = () => Number(Number(this.#slider.value).toFixed(3));
    this.#slider.addEventListener('input', () => {
      this.#isHeld = true;
      this.#gesture ||= this.#scene.newGesture();
      this.#set('time', time());
      this.#showTime(time(), false);
    });
    this.#slider.addEventListener('change', async () => {
      await this.#set('time', time());
      this.#isHeld = false;
      this.#gesture = 0;
    });
    this.#slider.addEventListener('keydown', (event) => {
      const steps = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10 }[event.key];
      const length = this.#listed.length;
      if (!steps || !length) return;
      event.preventDefault();
      const to = Math.min(length, Math.max(0, this.#place().at + (steps * length) / 100));
      this.#slider.value = String(to);
      this.#set('time', Number(to.toFixed(3)));
    });
  }

  get isPlaying() {
    return this.#listed.values.playing && this.node.isConnected;
  }

  /** Between two answers it goes on by itself. */
  #now() {
    const { values, length, at } = this.#listed;
    const gone = values.playing ? (performance.now() - at) / 1000 : 0;
    return folded(values.time + gone * this.#pace, length, values.mode);
  }
  /** Where in its length that is, and whether it is on its way back. */
  #place() {
    const time = this.#now(), { length } = this.#listed;
    return length > 0 && time > length ? { at: 2 * length - time, isBack: true } : { at: time, isBack: false };
  }

  /** @param {import('./core-list.js').Listed} listed */
  show(listed) {
    const { values, length, label, type } = listed;
    this.#pace = this.#paceOf(listed);
    this.#listed = listed;
    setText(this.#name, label);
    const mode = length === null ? '' : `, ${values.mode}`;
    const state = values.problem ? `✕ ${values.problem}` : values.playing ? 'plays' : 'stands';
    setText(this.#kind, `${type.name}${mode}: ${state}`);
    setText(this.#play, values.playing ? '❚❚ Pause' : '▶ Play');
    this.#play.setAttribute('aria-label', `${values.playing ? 'Pause' : 'Play'} ${label}`);
    this.#slider.max = String(length ?? 0);
    this.#slider.hidden = length === null;
    for (const [input, value] of [[this.#seek, this.#place().at], [this.#speed, values.speed]])
      if (document.activeElement !== input) input.value = String(Number((value ?? 1).toFixed(3)));
    this.move();
  }
  /** What a collision stops, or an end, does not go on: as fast as it went between the last two answers. */
  #paceOf(listed) {
    const before = this.#listed, nominal = ((listed.values.speed ?? 1) * this.#rate()) / kFramesPerSecond;
    if (!before?.values.playing || listed.at - before.at < 100) return before ? this.#pace : nominal;
    const pace = (1000 * (listed.values.time - before.values.time)) / (listed.at - before.at);
    return pace * nominal >= 0 && Math.abs(pace) <= 1.5 * Math.abs(nominal) + 0.1 ? pace : nominal;
  }
  move() {
    if (this.#isHeld) return;
    const { at, isBack } = this.#place();
    if (!this.#slider.hidden) this.#slider.value = String(at);
    this.#showTime(at, isBack);
  }
  #showTime(at, isBack) {
    const { length } = this.#listed;
    const of = length === null ? 's' : `of ${length.toFixed(2)} s`;
    setText(this.#time, `${at.toFixed(2)} ${of}${isBack ? ', on its way back' : ''}`);
    this.#slider.setAttribute('aria-valuetext', `${at.toFixed(1)} ${of}`);
  }

  async #set(field, value) {
    const last = await this.#edits.send(field, value);
    if (!last) return;
    setText(this.#said, last.error ? `✕ ${reasonOf(last.error)}` : '');
    if (last.error) return this.show(this.#listed);
    // At once, and not only when the wall is asked the next time.
    const values = { ...this.#listed.values, time: this.#now(), [field]: value };
    this.show({ ...this.#listed, values, at: performance.now() });
  }
}

export class AnimationsView {
  #list;
  #rows = new Set();
  #isShown = false;
  /** Whether its person may edit. */
  mayEdit = false;

  /**
   * @param {import('./scene.js').Scene} scene
   * @param {import('./schema.js').Schema} schema
   * @param {import('./scene-watch.js').SceneWatch} watch
   * @param {import('./wall-status.js').WallStatus} status
   * @param {(node: number) => void} onSelect
   */
  constructor(scene, schema, watch, status, onSelect) {
    const makeRow = (listed) => {
      const row = new AnimationRow({ scene, mayEdit: this.mayEdit, onSelect, listed,
                                     rate: () => status.frameRate ?? kFramesPerSecond });
      this.#rows.add(row);
      return row;
    };
    this.#list = new ListView(scene, schema, watch, status, { isListed: plays, size: kRowsAtOnce, makeRow,
                                                              none: 'Nothing in this scene plays.' });
    this.node = this.#list.node;
    this.#move();
  }

  set isShown(isShown) {
    this.#isShown = isShown;
    this.#list.isShown = isShown;
  }
  reset() {
    this.#list.reset();
  }

  /** What plays moves on; who wants little motion sees what the wall has told, twice a second. */
  #move() {
    const isStill = matchMedia('(prefers-reduced-motion: reduce)');
    setInterval(() => {
      if (!this.#isShown || document.hidden || isStill.matches) return;
      for (const row of this.#rows) {
        if (!row.node.isConnected) this.#rows.delete(row);
        else if (row.isPlaying) row.move();
      }
    }, kStep);
  }
}
