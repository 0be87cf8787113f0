// What somebody does with a whole node: copies it, hangs another one below it, removes it after one question.
import { element, seen, setText } from './elements.js';

export class NodeTools {
  #scene;
  #schema;
  #onMade;
  #shown = null;
  #said = element('p', { class: 'said', role: 'alert' });
  #clone = this.#button('Clone', () => this.#cloneIt());
  #add = this.#button('+ New child…', () => this.#askForChild());
  #remove = this.#button('✕ Remove…', () => this.#askToRemove());
  #dialog = element('dialog', { 'aria-labelledby': 'node-question' });

  /**
   * @param {import('./scene.js').Scene} scene
   * @param {import('./schema.js').Schema} schema
   * @param {(node: number) => void} onMade
   */
  constructor(scene, schema, onMade) {
    this.#scene = scene;
    this.#schema = schema;
    this.#onMade = onMade;
    this.node = element('div', { class: 'node-tools', hidden: true },
                        element('div', { class: 'tools' }, this.#clone, this.#add, this.#remove), this.#said,
                        this.#dialog);
  }

  /** @param {{id: number, name: string} | null} node null: there is none, or nobody may change it */
  show(node) {
    if (this.#shown?.id !== node?.id) {
      setText(this.#said, '');
      this.#dialog.close();
    }
    this.#shown = node;
    this.node.hidden = node === null;
    this.#clone.hidden = this.#remove.hidden = node?.id === this.#scene.root;
  }

  #button(text, deed) {
    return element('button', { type: 'button', text, onclick: async () => {
      try {
        await deed();
        setText(this.#said, '');
      } catch (error) {
        setText(this.#said, `✕ ${error.message}`);
      }
    } });
  }

  async #cloneIt() {
    const { id, name } = this.#shown;
    // "wheel" becomes "wheel 2", and that "wheel 3".
    const [, word, number] = /^(.*?)(?: (\d{1,6}))?$/s.exec(name);
    this.#onMade(await this.#scene.clone(id, name && `${word} ${Number(number ?? 1) + 1}`));
  }

  async #askToRemove() {
    const { id, name } = this.#shown;
    const { names, nodes, isAll, parent } = await this.#scene.countBelow(id);
    if (this.#shown?.id !== id) return;
    const below = nodes - 1;
    const what = `${isAll ? '' : 'At least '}${below.toLocaleString('en')} node${below === 1 ? '' : 's'} below`;
    const all = `${what} ${below === 1 ? 'goes' : 'go'} with it`;
    const some = names.map((one) => seen(one) || '(no name)').join(', ') + (below > names.length ? ', …' : '');
    const remove = this.#answerButton('Remove', async () => {
      await this.#scene.remove(id);
      this.#onMade(parent);
    });
    remove.className = 'danger';
    this.#ask(`Remove ${seen(name) || `#${id}`}?`,
              [element('p', { text: below > 0 ? `${all}: ${some}` : 'Nothing is below it.' }),
               element('p', { class: 'muted', text: 'Undo brings it back.' })], remove);
  }

  async #askForChild() {
    const { id } = this.#shown;
    const cores = [...(await this.#schema.types).values()].filter((type) => type.core).map((type) => type.name).sort();
    const input = element('input', { type: 'text', name: 'name', value: 'node', spellcheck: 'false',
                                     autocomplete: 'off' });
    const type = element('select', { name: 'type' }, element('option', { value: '', text: 'none: a group' }),
                         ...cores.map((name) => element('option', { value: name, text: name })));
    type.value = cores.includes('Transform') ? 'Transform' : '';
    const make = this.#answerButton('Create', async () => {
      this.#onMade(await this.#scene.create(id, input.value, type.value));
    });
    this.#ask('New child', [element('label', { class: 'asked' }, 'Name', input),
                            element('label', { class: 'asked' }, 'Core', type)], make);
    input.addEventListener('keydown', (event) => {
      if (event.key === 'Enter') make.click();
    });
    input.focus();
    input.select();
  }

  /** Once; Escape, and the other button, leave all as it is. */
  #ask(title, says, button) {
    const said = element('p', { class: 'said', role: 'alert' });
    const cancel = element('button', { type: 'button', text: 'Cancel', onclick: () => this.#dialog.close() });
    this.#dialog.replaceChildren(element('h2', { id: 'node-question', text: title }), ...says, said,
                                 element('p', { class: 'tools' }, cancel, button));
    this.#dialog.showModal();
    cancel.focus();
  }
  #answerButton(text, deed) {
    const button = element('button', { type: 'button', text, onclick: async () => {
      button.disabled = true;
      try {
        await deed();
        this.#dialog.close();
      } catch (error) {
        setText(this.#dialog.querySelector('.said'), `✕ ${error.message}`);
        button.disabled = false;
      }
    } });
    return button;
  }
}
