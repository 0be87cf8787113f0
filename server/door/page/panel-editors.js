// What a visitor moves a control with: few and large. Those of the console are editors.js.
import { colourOf, pickerValue } from './colours.js';
import { editorOf, rangeInput, shortest } from './editors.js';
import { element, freshId, setText } from './elements.js';

const kMostButtons = 8;  // options; more stand in a list

/**
 * @typedef {{object: number | null, type: string, field: string, numbers: number[], flag?: boolean,
 *     text: string}} Setting
 * @typedef {{kind: string, label: string, fault: string, now: Setting, unit: string, least: number, greatest: number,
 *     step: number, bytes: number, options: {label: string, gives: Setting}[], sets: Setting[], bookmark: number,
 *     home: boolean}} Control as GetPanel tells it
 */

/** @param {Setting} setting @returns {any} as a list of changes has it */
export function valueOf(setting) {
  if (setting.flag !== undefined) return setting.flag;
  if (setting.numbers.length === 0) return setting.text;
  return setting.numbers.length === 1 ? setting.numbers[0] : setting.numbers;
}

/** @param {Control} control @returns {import('./editors.js').Editor} whose values are those of `valueOf` */
export function panelEditor(control, label, commit) {
  if (control.kind === 'slider') return slider(control, label, commit);
  if (control.kind === 'toggle') return toggle(control, label, commit);
  if (control.kind === 'colour') return colour(label, commit);
  if (control.kind === 'text') return editorOf({ kind: 'text' }, label, commit);
  return control.options.length > kMostButtons ? list(control, label, commit) : buttons(control, label, commit);
}

function slider(control, label, commit) {
  const output = element('output', { class: 'reading', 'aria-hidden': 'true' });
  const range = rangeInput(control, label, (value, isHeld) => {
    show(value);
    commit(value, isHeld);
  });
  const show = (value) => {
    const text = control.unit ? `${shortest(value)} ${control.unit}` : shortest(value);
    setText(output, text);
    range.setAttribute('aria-valuetext', text);
  };
  return { nodes: [range, output], show: (value) => { range.value = String(value); show(value); } };
}

/** Of what is true or false, or 0 or 1: as it comes so it goes. */
function toggle(control, label, commit) {
  const isNumber = control.now.flag === undefined;
  const editor = editorOf({ kind: 'bool' }, label, (value) => commit(isNumber ? Number(value) : value));
  return { nodes: editor.nodes, show: (value) => editor.show(Boolean(value)) };
}

function colour(label, commit) {
  const picker = element('input', { type: 'color', 'aria-label': label });
  picker.addEventListener('input', () => commit(colourOf(picker.value, []), true));
  picker.addEventListener('change', () => commit(colourOf(picker.value, [])));
  return { nodes: [picker], show: (value) => { picker.value = pickerValue(value); } };
}

const isSame = (option, value) => JSON.stringify(valueOf(option.gives)) === JSON.stringify(value);

function buttons({ options }, label, commit) {
  const name = freshId('choice');
  const inputs = options.map((option) => {
    const input = element('input', { type: 'radio', name, disabled: !option.gives.object });
    input.addEventListener('change', () => commit(valueOf(option.gives)));
    return input;
  });
  const labels = options.map((option, i) => element('label', { class: 'option' }, inputs[i],
                                                    element('span', { text: option.label, dir: 'auto' })));
  return {
    nodes: [element('div', { class: 'options', role: 'radiogroup', 'aria-label': label }, ...labels)],
    show: (value) => inputs.forEach((input, i) => { input.checked = isSame(options[i], value); }),
  };
}

function list({ options }, label, commit) {
  const other = element('option', { value: '', text: '–', disabled: true, hidden: true });  // set elsewhere
  const select = element('select', { 'aria-label': label }, other, ...options.map(
    (option, i) => element('option', { value: i, text: option.label, disabled: !option.gives.object })));
  select.addEventListener('change', () => commit(valueOf(options[Number(select.value)].gives)));
  return {
    nodes: [select],
    show: (value) => { select.selectedIndex = 1 + options.findIndex((option) => isSame(option, value)); },
  };
}
