// What a person edits a value with: made after the field's description, one small editor for each kind.
import { colourOf, isColour, pickerValue } from './colours.js';
import { element } from './elements.js';
import { referenceEditor, referencesEditor } from './reference-editor.js';
import { isRotation, rotationEditor } from './rotation-editor.js';

/**
 * @typedef {import('./schema.js').Field} Field
 * @typedef {(input: HTMLInputElement, text: string) => void} Write leaves alone what somebody types in
 * @typedef {{nodes: HTMLElement[], show: (value: any, write: Write) => void}} Editor `show` says nothing to `commit`
 * @typedef {(value: any, isUnderWay?: boolean) => void} Commit under way: a slider that is still held
 */

const kMostLines = 16;       // of a text that are seen at once
const kWidestSlider = 1000;  // between bounds: farther apart a slider leads nowhere in particular

const kEdited = ['bool', 'int', 'float', 'double', 'text', 'ref', 'reference list'];

/** @param {Field} field @returns {boolean} false: the value is shown, and nobody types it */
export function isEditable(field) {
  return kEdited.includes(field.kind);
}

/** @param {any} value @param {Field} field */
export function asText(value, field) {
  if (value === null || value === undefined) return 'none';
  if (field.kind === 'blob') return `${value.bytes.toLocaleString('en')} bytes`;
  if (field.kind === 'ref') return `#${value}`;
  if (field.kind === 'reference list') return value.length > 0 ? value.map((id) => `#${id}`).join(', ') : 'none';
  if (field.kind === 'bool') return value ? 'on' : 'off';
  if (Array.isArray(value)) return value.map(shortest).join(', ');
  return typeof value === 'number' ? shortest(value) : String(value);
}

/** Floats come as doubles: 0.1 is told as 0.10000000149011612. */
export function shortest(value) {
  return String(Number(value.toPrecision(7)));
}

/**
 * @param {Field} field
 * @param {string} label
 * @param {Commit} commit
 * @param {import('./reference-editor.js').Choose} choose
 * @returns {Editor}
 */
export function editorOf(field, label, commit, choose) {
  if (field.kind === 'bool') return switchEditor(label, commit);
  if (field.kind === 'text') return textEditor(label, commit);
  if (field.kind === 'ref') return referenceEditor(field, label, commit, choose);
  if (field.kind === 'reference list') return referencesEditor(field, label, commit, choose);
  if (field.words && field.flags) return flagsEditor(field, label, commit);
  if (field.words) return wordEditor(field, label, commit);
  if (isRotation(field))
    return rotationEditor(label, commit, (name) => numberInput(field, name), numberIn,
                          vectorEditor(field, label, commit));
  if (field.width > 1) return isColour(field) ? colourEditor(field, label, commit) : vectorEditor(field, label, commit);
  if (field.greatest - field.least <= kWidestSlider) return sliderEditor(field, label, commit);
  return numberEditor(field, label, commit);
}

function switchEditor(label, commit) {
  const input = element('input', { type: 'checkbox', role: 'switch', 'aria-label': label });
  input.addEventListener('change', () => commit(input.checked));
  return { nodes: [input], show: (value) => { input.checked = value; } };
}

/** A line, or as many as there are: Enter ends one line, and begins another where there are several already. */
function textEditor(label, commit) {
  const input = element('textarea', { rows: 1, 'aria-label': label, spellcheck: 'false', autocomplete: 'off' });
  const fit = () => { input.rows = Math.min(kMostLines, input.value.split('\n').length); };
  let told = '';
  const say = () => {
    if (input.value === told) return;
    told = input.value;
    commit(told);
  };
  input.addEventListener('input', fit);
  input.addEventListener('change', say);
  input.addEventListener('keydown', (event) => {
    const isLine = !input.value.includes('\n') && !event.shiftKey;
    if (event.key !== 'Enter' || !(isLine || event.ctrlKey)) return;
    event.preventDefault();
    say();
  });
  const show = (value, write) => {
    write(input, value ?? '');
    if (input.value === (value ?? '')) told = input.value;
    fit();
  };
  return { nodes: [input], show };
}

/** Nothing that can be read as a number goes to the wall as it is: the wall says what is wrong with it. */
export function numberIn(input) {
  return input.value.trim() !== '' && Number.isFinite(Number(input.value)) ? Number(input.value) : input.value;
}
function numberInput(field, label) {
  return element('input', { type: 'text', inputmode: field.kind === 'int' && field.least >= 0 ? 'numeric' : 'text',
                            'aria-label': label, class: 'number', autocomplete: 'off' });
}
function numberEditor(field, label, commit) {
  const input = numberInput(field, label);
  input.addEventListener('change', () => commit(numberIn(input)));
  return { nodes: [input], show: (value, write) => write(input, shortest(value)) };
}
function sliderEditor(field, label, commit) {
  const number = numberEditor(field, label, commit);
  const slider = rangeInput(field, `${label}, slider`, commit);
  return { nodes: [slider, ...number.nodes],
           show: (now, write) => { number.show(now, write); slider.value = String(now); } };
}
/**
 * @param {{least: number, greatest: number, kind?: string, step?: number}} field step: none or 0, as fine as the screen
 */
export function rangeInput(field, label, commit) {
  const whole = field.kind === 'int' ? 1 : 0, way = field.greatest - field.least;
  const least = field.step || whole;  // of its steps
  const slider = element('input', { type: 'range', min: field.least, max: field.greatest, step: least || 'any',
                                    'aria-label': label });
  const rounded = () => (least ? Number(slider.value) : Number(Number(slider.value).toPrecision(3)));
  const value = () => Math.min(field.greatest, Math.max(field.least, rounded()));
  slider.addEventListener('input', () => commit(value(), true));
  slider.addEventListener('change', () => commit(value()));
  // By keys a hundredth of the way, whatever `any` means to a browser.
  slider.addEventListener('keydown', (event) => {
    const steps = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[event.key];
    if (!steps) return;
    event.preventDefault();
    const step = Math.max(least, whole ? Math.round(way / 100) : way / 100);
    slider.value = String(Number(slider.value) + steps * step);
    commit(value());
  });
  return slider;
}

/** As labels say them; what stands beside a number is their first letter. */
function partNames(field) {
  if (isColour(field)) return ['red', 'green', 'blue', 'alpha'];
  if (isRotation(field)) return ['w', 'x', 'y', 'z'];
  return field.width <= 4 ? ['x', 'y', 'z', 'w'] : Array.from({ length: field.width }, (_, i) => String(i));
}
function vectorEditor(field, label, commit) {
  const names = partNames(field).slice(0, field.width);
  const inputs = names.map((name) => numberInput(field, `${label}, ${name}`));
  for (const input of inputs) input.addEventListener('change', () => commit(inputs.map(numberIn)));
  const parts = inputs.map((input, i) => element('label', { class: 'part' },
                                                 element('span', { 'aria-hidden': 'true', text: names[i][0] }), input));
  return { nodes: [element('div', { class: 'parts' }, ...parts)],
           show: (value, write) => inputs.forEach((input, i) => write(input, shortest(value[i]))) };
}
function colourEditor(field, label, commit) {
  const numbers = vectorEditor(field, label, commit);
  const picker = element('input', { type: 'color', 'aria-label': `${label}, picker` });
  let now = field.default;
  picker.addEventListener('input', () => commit(colourOf(picker.value, now), true));
  picker.addEventListener('change', () => commit(colourOf(picker.value, now)));
  return { nodes: [picker, ...numbers.nodes],
           show: (value, write) => { now = value; numbers.show(value, write); picker.value = pickerValue(value); } };
}

function wordEditor(field, label, commit) {
  const words = Object.keys(field.words);
  const select = element('select', { 'aria-label': label },
                         ...words.map((word) => element('option', { value: word, text: word })));
  if (field.greatest - field.least + 1 === words.length) {
    select.addEventListener('change', () => commit(select.value));
    return { nodes: [select], show: (value) => { select.value = value; } };
  }
  // Some numbers have words, others count.
  const kNumber = 'number';
  select.append(element('option', { value: kNumber, text: 'a number:' }));
  const number = numberEditor(field, `${label}, number`, commit);
  select.addEventListener('change', () => {
    number.nodes[0].hidden = select.value !== kNumber;
    if (select.value === kNumber) number.nodes[0].focus();
    else commit(select.value);
  });
  return {
    nodes: [select, ...number.nodes],
    show: (value, write) => {
      const isNumber = typeof value === 'number';
      select.value = isNumber ? kNumber : value;
      number.nodes[0].hidden = !isNumber;
      if (isNumber) number.show(value, write);
    },
  };
}
function flagsEditor(field, label, commit) {
  const boxes = Object.keys(field.words).map((word) => {
    const box = element('input', { type: 'checkbox', value: word });
    return { box, node: element('label', { class: 'flag' }, box, word) };
  });
  for (const { box } of boxes)
    box.addEventListener('change', () => {
      const words = boxes.filter((one) => one.box.checked).map((one) => one.box.value);
      commit(words.length > 0 ? words.join(',') : 0);
    });
  return {
    nodes: [element('div', { role: 'group', 'aria-label': label, class: 'flags' }, ...boxes.map(({ node }) => node))],
    show: (value) => {
      const words = String(value).split(',');
      for (const { box } of boxes) box.checked = words.includes(box.value);
    },
  };
}
