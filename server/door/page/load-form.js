// Where a file that is loaded stands.
import { element, freshId } from './elements.js';

export class LoadForm {
  #choice = element('select');
  #under = element('input', { type: 'text', value: '/', spellcheck: 'false', autocomplete: 'off' });
  #fit = numberInput();
  #at = ['x', 'y', 'z'].map((axis) => numberInput(`At, ${axis}`, axis));
  #up = element('select', {}, ...[['of_file', 'as the file says'], ['y', 'Y'], ['z', 'Z']].map(
      ([value, text]) => element('option', { value, text })));
  #file = labelled('File', this.#choice);
  node = element('div', { class: 'load-form' }, this.#file, labelled('Below the node', this.#under),
                 labelled('Length, m (empty: as it is)', this.#fit),
                 element('div', { class: 'row' }, element('span', { text: 'At, m' }),
                         element('span', { class: 'parts' }, ...this.#at)),
                 labelled('Up is', this.#up));

  /** @param {string[]} paths of which one is loaded @param {(path: string) => string} nameOf */
  begin(paths, nameOf) {
    this.#choice.replaceChildren(...paths.map((path) => element('option', { value: path, text: nameOf(path) })));
    this.#file.hidden = paths.length < 2;
  }

  /** The fields of LoadFile. Throws what is wrong with them, in words. */
  fields() {
    const fields = { path: this.#choice.value, parent: this.#under.value.trim() || '/', up: this.#up.value };
    const fit = numberIn(this.#fit);
    if (fit !== null) fields.fit = fit;
    const at = this.#at.map(numberIn);
    if (at.some((part) => part !== null)) fields.at = at.map((part) => part ?? 0);
    return fields;
  }
}

function numberInput(label = null, placeholder = null) {
  return element('input', { type: 'text', class: 'number', inputmode: 'decimal', autocomplete: 'off', placeholder,
                            'aria-label': label });
}
function numberIn(input) {
  const text = input.value.trim();
  const number = Number(text);
  if (!Number.isFinite(number)) throw new Error(`“${text}” is no number.`);
  return text === '' ? null : number;
}
function labelled(text, input) {
  input.id = freshId('load');
  return element('div', { class: 'row' }, element('label', { for: input.id, text }), input);
}
