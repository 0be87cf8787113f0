// A dialog in which somebody chooses an object of a type: nodes by a search, what stands at no node from a list.
import { element, seen, setText } from './elements.js';
import { drawMaterialSoon } from './material-preview.js';
import { ObjectFinder } from './object-finder.js';
import { valuesOf } from './schema.js';

const kAtOnce = 24;         // objects of a page
const kTypingPause = 300;   // ms

/** How an object of no name is called, wherever it is listed. */
export function objectLabel(object) {
  const says = ['name', 'key', 'field'].map((field) => object.fields.get(field)).find(Boolean);
  return says ? `${seen(says)} (#${object.id})` : `${object.type} #${object.id}`;
}

/** How a material looks, in small; of other types nothing. */
export function swatchOf(object, type, side = 48) {
  if (type.name !== 'Material') return [];
  const swatch = element('canvas', { class: 'swatch', width: side, height: side, 'aria-hidden': 'true' });
  drawMaterialSoon(swatch, valuesOf(object, type));
  return [swatch];
}

export class Chooser {
  #scene;
  #schema;
  #title = element('h2', { id: 'choose-title' });
  #input = element('input', { type: 'search', placeholder: 'Name, or /hall/**/crane*', 'aria-label': 'Search nodes',
                              spellcheck: 'false', autocomplete: 'off' });
  #list = element('ul', { class: 'results choices' });
  #said = element('p', { class: 'muted', role: 'status' });
  #more = element('button', { type: 'button', text: 'Look on' });
  #none;
  #cancel;
  #page = async () => {};
  #asked = 0;
  #answer = undefined;

  /** @param {import('./scene.js').Scene} scene @param {import('./schema.js').Schema} schema */
  constructor(scene, schema) {
    this.#scene = scene;
    this.#schema = schema;
    const end = (text, answer) => element('button', { type: 'button', text, onclick: () => this.#end(answer) });
    this.#none = end('None', null);
    this.#cancel = end('Cancel', undefined);
    const tools = element('p', { class: 'tools' }, this.#more, this.#none, this.#cancel);
    this.node = element('dialog', { 'aria-labelledby': 'choose-title' }, this.#title, this.#input, this.#said,
                        this.#list, tools);
    let typing = 0;
    this.#input.addEventListener('input', () => {
      clearTimeout(typing);
      typing = setTimeout(() => this.#begin(), kTypingPause);
    });
    this.#more.addEventListener('click', () => this.#show());
  }

  /** @type {import('./reference-editor.js').Choose} */
  async choose(field) {
    const types = await this.#schema.types;
    const type = types.get(field.to);
    setText(this.#title, `Choose: ${field.to}`);
    this.#input.value = '';
    this.#none.hidden = field.kind !== 'ref';
    this.#input.hidden = Boolean(type) && !type.core && type.name !== 'Node';
    this.#begin = this.#input.hidden ? () => this.#beginObjects(types, type) : () => this.#beginNodes(type);
    this.#answer = undefined;
    this.node.showModal();
    this.#begin();
    return new Promise((resolve) => {
      this.node.addEventListener('close', () => resolve(this.#answer), { once: true });
    });
  }

  #begin = () => {};
  #beginObjects(types, type) {
    const finder = new ObjectFinder(this.#scene, types, type.name);
    this.#start(async (isWanted) => {
      let found = [];
      while (found.length === 0 && !finder.isDone && isWanted()) found = await finder.next(kAtOnce);
      return { isDone: finder.isDone, choices: found.map((object) => (
        this.#choice(object.id, objectLabel(object), '', ...swatchOf(object, type)))) };
    });
  }
  /** @param {import('./schema.js').Type | undefined} type undefined: any object, which here is any node's core */
  #beginNodes(type) {
    let after = [];
    const core = type?.core ? type : null;
    this.#start(async (isWanted) => {
      let nodes = [];
      do {
        const found = await this.#scene.find(this.#input.value.trim(), after, core?.number ?? 0);
        after = found.next;
        nodes = found.nodes.filter(({ core: id }) => type?.name === 'Node' || id);
      } while (nodes.length === 0 && after.length > 0 && isWanted());
      const choices = nodes.map(
        (node) => this.#choice(type?.name === 'Node' ? node.id : node.core, node.label, node.coreType));
      return { choices, isDone: after.length === 0 };
    });
  }
  /** @param {(isWanted: () => boolean) => Promise<{choices: Node[], isDone: boolean}>} page looks until it has some */
  #start(page) {
    const isWanted = () => this.node.open && this.#page === ask, ask = () => page(isWanted);
    this.#page = ask;
    this.#list.replaceChildren();
    this.#show();
  }

  async #show() {
    const asked = ++this.#asked, hadFocus = document.activeElement === this.#more;
    setText(this.#said, 'Looking…');
    this.#more.hidden = true;
    try {
      const { choices, isDone } = await this.#page();
      if (asked !== this.#asked) return;
      this.#list.append(...choices);
      const many = this.#list.children.length;
      setText(this.#said, many === 0 && isDone ? 'There is none.' : `${many} found${isDone ? '' : ' so far'}`);
      this.#more.hidden = isDone;
      if (hadFocus) (choices[0]?.firstChild ?? (isDone ? this.#cancel : this.#more)).focus();
    } catch (error) {
      if (asked !== this.#asked) return;
      setText(this.#said, `✕ ${error.message}`);
      this.#more.hidden = false;
      if (hadFocus) this.#more.focus();
    }
  }
  #choice(id, label, kind, ...before) {
    return element('li', {}, element('button', { type: 'button', onclick: () => this.#end(id) }, ...before,
                                     element('span', { class: 'name', text: label }),
                                     element('span', { class: 'muted', text: kind })));
  }

  /** Nobody wants it any more. */
  cancel() {
    this.#end(undefined);
  }
  #end(answer) {
    this.#answer = answer;
    this.node.close();
  }
}
