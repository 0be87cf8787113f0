// A field of an object: its name and unit, its value, and what the wall says to another one.
import { asText, editorOf, isEditable } from './editors.js';
import { element, freshId, setText } from './elements.js';
import { Newest } from './newest.js';
import { reasonOf } from './scene.js';
import { isOfServer, isReference, spaced } from './schema.js';

const kMostLinks = 32;  // of a list of references
const kWrittenOut = 1e9;  // a bound, up to here

export class FieldRow {
  #field;
  #proposals;
  #onVisit;
  #editor = null;
  #said = element('p', { class: 'said', role: 'alert' });
  #value;
  #isOld = false;  // something else has been proposed since
  #shown = null;   // of values, as JSON: what the editor shows; null: what somebody has done to it
  #reading = element('div', { class: 'value' });
  #gesture = 0;

  /**
   * @param {import('./schema.js').Field} field
   * @param {{propose: ((value: any, gesture: number) => Promise<any>) | null, newGesture: () => number,
   *     onVisit?: (id: number) => void, choose?: import('./reference-editor.js').Choose, label?: string,
   *     makeEditor?: typeof editorOf}} options propose: null for who only looks; label: what people call it;
   *     makeEditor: for kinds that are no scene's
   */
  constructor(field, { propose, newGesture, onVisit, choose, label = spaced(field.name), makeEditor }) {
    this.#field = field;
    this.#proposals = new Newest(propose);
    this.#onVisit = onVisit;
    const name = element('span', { class: 'field-name', text: label, dir: 'auto' });
    if (field.help) name.title = field.help;
    const canEdit = Boolean(makeEditor) || (isEditable(field) && !isOfServer(field));
    const about = [field.unit, boundsText(field), propose && !canEdit && whyNoEditor(field)].filter(Boolean).join(', ');
    if (about) name.append(element('span', { class: 'muted', text: about }));
    this.node = element('div', { class: 'field' }, name, this.#reading, this.#said);
    if (!propose || !canEdit) return;
    this.#editor = (makeEditor ?? editorOf)(field, label, (value, isHeld) => {
      this.#shown = null;
      this.#isOld = true;
      if (isHeld && !this.#gesture) this.#gesture = newGesture();
      this.#send(value, this.#gesture);
      if (!isHeld) this.#gesture = 0;
    }, choose);
    this.#reading.append(...this.#editor.nodes);
    this.#said.id = freshId('said');
    for (const input of this.#inputs()) input.setAttribute('aria-describedby', this.#said.id);
    this.#reading.addEventListener('focusout', () => {
      this.#gesture = 0;  // of a finger that was taken away
      this.#showNews();   // what others have set meanwhile
    });
  }

  #inputs() {
    return this.#reading.querySelectorAll('input, select, textarea');
  }

  /** As it is in the scene; what has the focus to be typed in, or is held, stays. */
  show(value) {
    this.#value = value;
    this.#isOld &&= this.#proposals.isUnderWay;
    this.#showNews();
  }
  #showNews() {
    if (this.#value === undefined || this.#isOld || this.#proposals.isUnderWay || this.#gesture) return;
    if (JSON.stringify(this.#value) !== this.#shown) this.#showValue(false);
  }
  /** @param {boolean} isForced what is typed was refused, and goes */
  #showValue(isForced) {
    const typed = isForced ? null : this.#typedIn();
    if (this.#editor) this.#editor.show(this.#value, (input, text) => { if (input !== typed) input.value = text; });
    else setText(this.#reading, asText(this.#value, this.#field));
    this.#shown = typed ? null : JSON.stringify(this.#value);
    this.#showLink();
  }
  #typedIn() {
    const at = document.activeElement;
    return this.#reading.contains(at) && at.matches('[type=text], textarea') ? at : null;
  }
  #showLink() {
    if (!isReference(this.#field)) return;
    for (const link of this.#reading.querySelectorAll('.visit')) link.remove();
    const ids = [this.#value ?? []].flat();
    this.#reading.append(...ids.slice(0, kMostLinks).map((id) => element(
      'button', { type: 'button', class: 'visit', text: `Show #${id}`, onclick: () => this.#onVisit(id) })));
  }

  async #send(value, gesture) {
    const last = await this.#proposals.send(value, gesture);
    if (!last) return;
    const stopped = last.answer?.stopped?.length > 0 ? 'A collision stopped it on its way.' : '';
    const refused = last.error ? reasonOf(last.error) : stopped;
    setText(this.#said, refused ? `✕ ${refused}` : '');
    for (const input of this.#inputs()) input.setAttribute('aria-invalid', String(refused !== ''));
    if (refused) this.#showValue(true);
  }
}

function whyNoEditor(field) {
  if (isOfServer(field)) return ['the wall says it', field.instead].filter(Boolean).join(': ');
  return field.kind === 'blob' ? 'an array: programs write it' : `${field.kind}: not edited here`;
}

function boundsText({ least, greatest, words }) {
  if (words) return '';
  // Of what is as good as no bound nobody counts the noughts.
  const said = (bound) => (Math.abs(bound) < kWrittenOut ? bound.toLocaleString('en')
                                                         : bound.toExponential().replace('e+', 'e'));
  if (least !== undefined && greatest !== undefined) return `${said(least)} to ${said(greatest)}`;
  if (least !== undefined) return `at least ${said(least)}`;
  return greatest === undefined ? '' : `at most ${said(greatest)}`;
}
