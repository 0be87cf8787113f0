// Which other object a field means: said by number or path, or chosen from those that there are.
import { element } from './elements.js';

/**
 * @typedef {import('./schema.js').Field} Field
 * @typedef {(field: Field) => Promise<number | null | undefined>} Choose null: none; undefined: all stays as it is
 */

/** "#17", or a node's path; nothing: none. */
function referenceIn(text) {
  return text.trim() === '' ? null : text.trim();
}
function referenceInput(label, placeholder) {
  return element('input', { type: 'text', 'aria-label': label, placeholder, spellcheck: 'false', autocomplete: 'off' });
}

/** @param {Field} field @param {Choose} choose @returns {import('./editors.js').Editor} */
export function referenceEditor(field, label, commit, choose) {
  const input = referenceInput(label, `none (${field.to}: #ID or /path)`);
  input.addEventListener('change', () => commit(referenceIn(input.value)));
  const show = (value, write) => write(input, value === null ? '' : `#${value}`);
  const button = chooseButton('Choose…', label, async () => {
    const id = await choose(field);
    if (id !== undefined) commit(id);
  });
  return { nodes: [input, button], show };
}

/** @param {Field} field @param {Choose} choose @returns {import('./editors.js').Editor} */
export function referencesEditor(field, label, commit, choose) {
  const input = referenceInput(label, `none (${field.to}: #ID, #ID)`);
  let now = [];
  input.addEventListener('change', () => commit(input.value.split(',').map(referenceIn).filter((one) => one !== null)));
  const button = chooseButton('Add…', label, async () => {
    const id = await choose(field);
    if (id !== undefined) commit([...now, id]);
  });
  return { nodes: [input, button],
           show: (value, write) => { now = value; write(input, value.map((id) => `#${id}`).join(', ')); } };
}

function chooseButton(text, label, onclick) {
  return element('button', { type: 'button', class: 'choose', text, 'aria-label': `${label}, ${text}`, onclick });
}
