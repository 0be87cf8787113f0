// A rotation as three angles, and beside them the quaternion as the scene has it.
import { element } from './elements.js';

const kDegree = Math.PI / 180;

/** @param {import('./schema.js').Field} field */
export function isRotation(field) {
  return field.width === 4 && /rotation|orientation/i.test(field.name) && `${field.default}` === '1,0,0,0';
}

/** The shortest that a person would type. */
const rounded = (degrees) => Number(degrees.toFixed(3)) + 0;

/**
 * Turned about y first, then about the x that this leaves, then about z: where something faces, its slope, its roll.
 * @param {number[]} q [w, x, y, z], of any length but zero
 * @returns {number[]} degrees about x, y, z
 */
export function anglesOf(q) {
  const length = Math.hypot(...q);
  if (!(length > 0)) return [0, 0, 0];
  const [w, x, y, z] = q.map((part) => part / length);
  const slope = Math.min(1, Math.max(-1, 2 * (w * x - y * z)));
  if (Math.abs(slope) > 1 - 1e-12)  // straight up or down: heading and roll are the same turn
    return [rounded(Math.asin(slope) / kDegree), rounded((2 * Math.atan2(y, w)) / kDegree), 0];
  return [Math.asin(slope), Math.atan2(2 * (w * y + x * z), 1 - 2 * (x * x + y * y)),
          Math.atan2(2 * (w * z + x * y), 1 - 2 * (x * x + z * z))].map((angle) => rounded(angle / kDegree));
}

/** @param {number[]} angles degrees about x, y, z @returns {number[]} of length 1 */
export function quaternionOf(angles) {
  const [x, y, z] = angles.map((angle) => (angle * kDegree) / 2);
  const [cx, cy, cz, sx, sy, sz] = [x, y, z].map(Math.cos).concat([x, y, z].map(Math.sin));
  return [cy * cx * cz + sy * sx * sz, cy * sx * cz + sy * cx * sz, sy * cx * cz - cy * sx * sz,
          cy * cx * sz - sy * sx * cz];
}

const isSame = (a, b) => a.every((part, i) => Math.abs(part - b[i]) < 1e-12);

/**
 * An angle that is typed replaces the quaternion; what nobody types stays as exact as it is.
 * @param {(label: string) => HTMLInputElement} numberInput
 * @param {(input: HTMLInputElement) => any} numberIn
 * @param {import('./editors.js').Editor} exact
 * @returns {import('./editors.js').Editor}
 */
export function rotationEditor(label, commit, numberInput, numberIn, exact) {
  const names = ['x', 'y', 'z'];
  const inputs = names.map((name) => numberInput(`${label}, degrees about ${name}`));
  let said = null;  // the quaternion of the angles that stand there: the same rotation has others, too
  for (const input of inputs)
    input.addEventListener('change', () => {
      const angles = inputs.map(numberIn);
      const isWrong = angles.some((angle) => !Number.isFinite(angle));
      said = isWrong ? null : quaternionOf(angles);
      // The wall says what is wrong.
      commit(said ?? [...angles.map((angle) => (Number.isFinite(angle) ? 0 : String(angle))), 0]);
    });
  const parts = inputs.map((input, i) => element(
    'label', { class: 'part' }, element('span', { 'aria-hidden': 'true', text: `${names[i]}°` }), input));
  const details = element('details', { class: 'exact' },
                          element('summary', { text: 'Quaternion' }), ...exact.nodes);
  return {
    nodes: [element('div', { class: 'parts' }, ...parts), details],
    show: (value, write) => {
      exact.show(value, write);
      if (said && isSame(said, value) && inputs.every((input) => input.value !== '')) return;
      said = null;
      anglesOf(value).forEach((angle, i) => write(inputs[i], String(angle)));
    },
  };
}
