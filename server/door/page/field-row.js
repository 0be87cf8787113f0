// A field of an object: its name and unit, its value, and what the wall says to another one.
import { asText, editorOf, isEditable } from './editors.js';
import { element, freshId, setText } from './elements.js';

export class FieldRow {
  #field;
  #propose;
  #onVisit;
  #editor = null;
  #said = element('p', { class: 'said', role: 'alert' });
  #value;
  #reading = element('div', { class: 'value' });
  #waiting = null;  // {value, gesture}: the newest, while another one is on its way
  #isUnderWay = false;
  #gesture = 0;

  /**
   * @param {import('./schema.js').Field} field
   * @param {{propose: ((value: any, gesture: number) => Promise<any>) | null, newGesture: () => number,
   *     onVisit?: (id: number) => void, label?: string, makeEditor?: typeof editorOf}} options propose: null for who
   *     only looks; label: what people call it
   */
  constructor(field, { propose, newGesture, onVisit, label = spaced(field.name), makeEditor = editorOf }) {
    this.#field = field;
    this.#propose = propose;
    this.#onVisit = onVisit;
    const name = element('span', { class: 'field-name', text: label, dir: 'auto' });
    const limits = [field.unit, boundsText(field)].filter(Boolean).join(', ');
    if (limits) name.append(element('span', { class: 'muted', text: limits }));
    this.node = element('div', { class: 'field' }, name, this.#reading, this.#said);
    if (!propose || !isEditable(field)) return;
    this.#editor = makeEditor(field, label, (value, isHeld) => {
      if (isHeld && !this.#gesture) this.#gesture = newGesture();
      this.#send(value, this.#gesture);
      if (!isHeld) this.#gesture = 0;
    });
    this.#reading.append(...this.#editor.nodes);
    this.#said.id = freshId('said');
    for (const input of this.#inputs()) input.setAttribute('aria-describedby', this.#said.id);
  }

  #inputs() {
    return this.#reading.querySelectorAll('input, select');
  }

  /** As it is in the scene; what somebody is typing stays. */
  show(value) {
    const isNew = JSON.stringify(value) !== JSON.stringify(this.#value);
    this.#value = value;
    if (!isNew || this.#isUnderWay) return;
    if (this.#reading.contains(document.activeElement) && document.activeElement.type === 'text') return;
    this.#showValue();
  }
  #showValue() {
    if (this.#editor) this.#editor.show(this.#value);
    else setText(this.#reading, asText(this.#value, this.#field));
    this.#showLink();
  }
  #showLink() {
    if (this.#field.kind !== 'ref') return;
    this.#reading.querySelector('.visit')?.remove();
    const id = this.#value;
    if (id === null || id === undefined) return;
    this.#reading.append(element('button', { type: 'button', class: 'visit', text: `Show #${id}`,
                                             onclick: () => this.#onVisit(id) }));
  }

  /** The newest alone, once the one before is answered. */
  async #send(value, gesture) {
    this.#waiting = { value, gesture };
    if (this.#isUnderWay) return;
    this.#isUnderWay = true;
    let refused = '';
    while (this.#waiting) {
      const next = this.#waiting;
      this.#waiting = null;
      try {
        const committed = await this.#propose(next.value, next.gesture);
        refused = committed.stopped?.length > 0 ? 'A collision stopped it on its way.' : '';
      } catch (error) {
        refused = error.message.replace(/^list\.set\[0\]\.values\[0\](\[\d\])?: /, '');
      }
    }
    this.#isUnderWay = false;
    setText(this.#said, refused ? `✕ ${refused}` : '');
    for (const input of this.#inputs()) input.setAttribute('aria-invalid', String(refused !== ''));
    if (refused) this.#showValue();
  }
}

/** "baseColor" as people read it. */
function spaced(name) {
  return name.replace(/([a-z\d])([A-Z])/g, (_, end, begin) => `${end} ${begin.toLowerCase()}`);
}

function boundsText({ least, greatest, words }) {
  if (words) return '';
  const said = (bound) => bound.toLocaleString('en');
  if (least !== undefined && greatest !== undefined) return `${said(least)} to ${said(greatest)}`;
  if (least !== undefined) return `at least ${said(least)}`;
  return greatest === undefined ? '' : `at most ${said(greatest)}`;
}
