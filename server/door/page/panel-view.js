// A panel: its title, and a card for each of its controls, as they stand in the scene.
import { element, freshId, pause, setChildren, setText } from './elements.js';
import { FieldRow } from './field-row.js';
import { panelEditor, valueOf } from './panel-editors.js';
import { Scene } from './scene.js';
import { signOf } from './wall-status.js';

const kHeldPause = 100;  // ms, between two values of a control that is held: a hundred tablets share a bound
const kDoneShown = 2000;  // ms

/**
 * @typedef {import('./panel-editors.js').Control} Control
 * @typedef {import('./panel-editors.js').Setting} Setting
 */

/** What a list of changes says of these: one column for each field, and of an object that is set twice the last. */
function changesOf(settings) {
  const columns = new Map();
  for (const setting of settings) {
    const key = `${setting.type} ${setting.field}`;
    if (!columns.has(key)) columns.set(key, { type: setting.type, field: setting.field, values: new Map() });
    columns.get(key).values.set(setting.object, valueOf(setting));
  }
  return { set: [...columns.values()].map(({ type, field, values }) => (
    { type, field, ids: [...values.keys()], values: [...values.values()] })) };
}

/** What a control moves is there, at least in part. */
function isUsable({ kind, now, sets, fault, options }) {
  if (kind === 'press') return fault === '' || sets.length === 0;
  if (kind === 'choice') return options.some((option) => option.gives.object);
  return Boolean(now.object);
}

/** One of them, with a field. */
class FieldCard {
  #row;
  #fault = element('p', { class: 'fault' });
  #control;

  /** @param {Control} control */
  constructor(control, { setOne, newGesture }) {
    this.#control = control;
    this.#fault.id = freshId('fault');
    this.#row = new FieldRow({ name: control.now.field || control.kind, kind: control.kind }, {
      label: control.label || control.now.field || control.kind,
      makeEditor: (_, label, commit) => panelEditor(control, label, commit),
      newGesture,
      propose: (value, gesture) => this.#propose(value, gesture, setOne),
    });
    this.node = element('li', { class: `card of-${control.kind}` }, this.#row.node, this.#fault);
    for (const input of this.#inputs())
      input.setAttribute('aria-describedby', `${input.getAttribute('aria-describedby')} ${this.#fault.id}`);
  }

  #inputs() {
    return this.node.querySelectorAll('input, select');
  }

  /** @param {Control} control the same one, later */
  show(control) {
    this.#control = control;
    const usable = isUsable(control);
    setText(this.#fault, control.fault ? `○ ${usable ? 'Not all is' : 'Not'} there: ${control.fault}` : '');
    this.node.classList.toggle('absent', !usable);
    this.#inputs().forEach((input, i) => {
      input.disabled = !(input.type === 'radio' ? control.options[i].gives.object : usable);
    });
    if (usable) this.#row.show(valueOf(control.now));
  }

  async #propose(value, gesture, setOne) {
    const { kind, now, bytes } = this.#control;
    const size = kind === 'text' ? new TextEncoder().encode(value).length : 0;
    if (size > bytes) throw new Error(`This is too long: ${size} bytes, and ${bytes} is the most.`);
    const committed = await setOne(now, value, gesture);
    if (gesture) await pause(kHeldPause);
    return committed;
  }
}

/** One that sets fields, leads the view, or both. */
class PressCard {
  #control;
  #button;
  #said = element('p', { class: 'said', role: 'alert' });
  #done = element('span', { class: 'done', role: 'status' });
  #fault = element('p', { class: 'fault' });
  #timer = 0;

  /** @param {Control} control */
  constructor(control, { setAll, lead }) {
    this.#control = control;
    this.#fault.id = freshId('fault');
    const label = control.label || (control.home ? 'Home' : control.bookmark ? `Place ${control.bookmark}` : 'Press');
    this.#button = element('button', { type: 'button', 'aria-describedby': this.#fault.id,
                                       onclick: () => this.#press(setAll, lead) },
                           element('span', { text: label, dir: 'auto' }), this.#done);
    this.node = element('li', { class: 'card of-press' }, this.#button, this.#said, this.#fault);
  }

  /** @param {Control} control */
  show(control) {
    this.#control = control;
    const usable = isUsable(control);
    this.#button.disabled = !usable;
    setText(this.#fault, control.fault ? `○ Not there: ${control.fault}` : '');
  }

  async #press(setAll, lead) {
    clearTimeout(this.#timer);
    setText(this.#done, '');
    const { sets, home, bookmark } = this.#control;
    try {
      if (sets.length > 0) await setAll(sets);
      if (home) await lead({ deed: 'home' });
      if (bookmark) await lead({ deed: 'go_to_bookmark', bookmark });
      setText(this.#said, '');
      setText(this.#done, '✓');
      this.#timer = setTimeout(() => setText(this.#done, ''), kDoneShown);
    } catch (error) {
      setText(this.#said, `✕ ${error.message}`);
    }
  }
}

/** What makes another card where it is another. */
function shapeOf({ kind, label, now, unit, least, greatest, step, options }) {
  return JSON.stringify([kind, label, now.field, now.flag === undefined, unit, least, greatest, step, options]);
}

/** @param {import('./panel-link.js').PanelLink} link */
export function startPanel(link) {
  const title = document.getElementById('panel-title'), state = document.getElementById('panel-state');
  const cards = element('ul', { class: 'cards' });
  document.getElementById('content').append(cards);
  const scene = new Scene(link);
  let shown = [];  // {card, shape}

  const tell = (sign, word, tone) => {
    setText(state, `${sign} ${word}`);
    state.dataset.tone = tone;
  };
  tell('◌', 'connecting', 'warn');
  link.addEventListener('open', () => tell(signOf('live').sign, 'live', 'good'));
  link.addEventListener('lost', () => tell(signOf('joining').sign, 'connecting', 'warn'));
  link.addEventListener('refused', () => tell(signOf('lost').sign, 'ended', 'bad'));

  const tools = {
    setOne: async ({ object, type, field }, value, gesture) => {
      const committed = await scene.set({ id: object, type }, field, value, gesture);
      if (!gesture) link.look();
      return committed;
    },
    setAll: async (settings) => {
      await link.ask('ProposeChanges', { list: changesOf(settings) });
      link.look();
    },
    lead: (wish) => link.ask('NavigateView', wish),
    newGesture: () => scene.newGesture(),
  };
  link.addEventListener('panel', ({ detail }) => {
    setText(title, detail.title || 'Panel');
    document.title = detail.title || 'Tessera';
    shown = detail.controls.map((control, i) => {
      const shape = shapeOf(control);
      if (shown[i]?.shape === shape) return shown[i];
      return { shape, card: control.kind === 'press' ? new PressCard(control, tools) : new FieldCard(control, tools) };
    });
    setChildren(cards, shown.map(({ card }) => card.node));
    detail.controls.forEach((control, i) => shown[i].card.show(control));
  });
}
