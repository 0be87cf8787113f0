// Materials of the scene, each as a ball: those that something refers to.
import { objectLabel, swatchOf } from './chooser.js';
import { element, pause, setText } from './elements.js';
import { ObjectFinder } from './object-finder.js';
import { paced } from './scene-watch.js';

const kAtOnce = 60;
const kRest = 900;  // ms

export class MaterialsView {
  #scene;
  #schema;
  #onSelect;
  #finder = null;
  #isShown = false;
  #isLooking = false;
  #buttons = new Map();  // id -> {button, drawn}
  #list = element('ul', { class: 'materials' });
  #count = element('p', { class: 'muted', role: 'status', tabindex: '-1' });
  #more = element('button', { type: 'button', hidden: true, onclick: () => {
    if (!this.#isLooking) this.#tryTo(() => this.#look());
  } });

  /**
   * @param {import('./scene.js').Scene} scene
   * @param {import('./schema.js').Schema} schema
   * @param {import('./scene-watch.js').SceneWatch} watch
   * @param {(id: number) => void} onSelect
   */
  constructor(scene, schema, watch, onSelect) {
    this.#scene = scene;
    this.#schema = schema;
    this.#onSelect = onSelect;
    const refresh = paced(() => this.#tryTo(() => this.#refresh()), kRest);
    watch.addEventListener('change', () => {
      if (this.#isShown) refresh();
    });
    this.node = element('div', {}, this.#count, this.#list, this.#more);
  }

  set isShown(isShown) {
    this.#isShown = isShown;
    if (isShown) this.#tryTo(() => this.#begin());
  }

  async #tryTo(ask) {
    try {
      await ask();
    } catch (error) {
      if (error.code !== 'network') setText(this.#count, `✕ ${error.message}`);
    }
  }

  async #begin() {
    const types = await this.#schema.types;
    this.#finder = new ObjectFinder(this.#scene, types, 'Material');
    await this.#look(true);
  }
  /** Through a large scene by itself, as long as somebody looks; between two looks it rests as long as one took. */
  async #look(isAnew = false) {
    const types = await this.#schema.types, finder = this.#finder, before = isAnew ? 0 : this.#buttons.size;
    const isOld = () => finder !== this.#finder;
    this.#isLooking = true;
    setText(this.#more, 'Looking…');
    try {
      for (let rest = 0, isFirst = isAnew; this.#isShown && this.#buttons.size - before < kAtOnce; isFirst = false) {
        await pause(rest);
        const since = performance.now(), found = isOld() ? [] : await finder.next(kAtOnce);
        if (isOld()) return;
        if (isFirst) this.#clear();
        this.#add(found, types);
        if (finder.isDone) break;
        rest = performance.now() - since;
      }
    } finally {
      if (!isOld()) this.#endLook([...this.#buttons.values()][before]?.button ?? this.#count);
    }
  }
  #clear() {
    this.#buttons.clear();
    this.#list.replaceChildren();
  }
  #add(found, types) {
    for (const object of found) {
      const button = element('button', { type: 'button', onclick: () => this.#onSelect(object.id) });
      this.#buttons.set(object.id, { button, drawn: '' });
      this.#list.append(element('li', {}, button));
      this.#draw(object, types.get('Material'));
    }
    this.#tell();
    if (!this.#finder.isDone) this.#more.hidden = false;
  }
  #tell() {
    const many = this.#buttons.size, { isDone } = this.#finder;
    setText(this.#count, many === 0 && isDone ? 'Nothing in this scene has a material.'
                                              : `${many} material${many === 1 ? '' : 's'}${isDone ? '' : ' so far'}`);
  }
  /** @param {HTMLElement} next has the focus where the button had it, and goes */
  #endLook(next) {
    this.#isLooking = false;
    setText(this.#more, 'Look on');
    const hadFocus = document.activeElement === this.#more;
    this.#more.hidden = this.#finder.isDone;
    if (hadFocus && this.#more.hidden) next.focus();
  }
  async #refresh() {
    const types = await this.#schema.types;
    const { objects } = await this.#scene.objects([...this.#buttons.keys()]);
    for (const [id, { button }] of this.#buttons) {
      if (objects.has(id)) {
        this.#draw(objects.get(id), types.get('Material'));
      } else {
        button.parentElement.remove();
        this.#buttons.delete(id);
      }
    }
    if (!this.#isLooking) this.#tell();
  }
  #draw(object, type) {
    const known = this.#buttons.get(object.id), drawn = JSON.stringify([...object.fields]);
    if (!known || known.drawn === drawn) return;
    known.drawn = drawn;
    const label = element('span', { class: 'name', text: objectLabel(object) });
    known.button.replaceChildren(...swatchOf(object, type, 96), label);
  }
}
