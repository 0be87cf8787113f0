// Colours of a scene are linear light; a browser's picker speaks sRGB (IEC 61966-2-1).

const toSrgb = (linear) => (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);
const toLinear = (srgb) => (srgb <= 0.04045 ? srgb / 12.92 : ((srgb + 0.055) / 1.055) ** 2.4);

/** @param {number[]} colour its first three, of any strength @returns {string} "#rrggbb", the strongest at most full */
export function pickerValue(colour) {
  const strength = Math.max(1, ...colour.slice(0, 3));
  return `#${colour.slice(0, 3)
    .map((value) => Math.round(255 * toSrgb(Math.max(0, value) / strength)).toString(16).padStart(2, '0')).join('')}`;
}

/** @param {string} picked @param {number[]} before keeps its strength above 1, and what follows the first three */
export function colourOf(picked, before) {
  const strength = Math.max(1, ...before.slice(0, 3));
  const parts = [1, 3, 5].map((at) => strength * toLinear(parseInt(picked.slice(at, at + 2), 16) / 255));
  return [...parts.map((value) => Number(value.toPrecision(4))), ...before.slice(3)];
}

/** @param {import('./schema.js').Field} field */
export function isColour(field) {
  return field.kind === 'float' && field.width >= 3 && /colou?r|emissive|^sky$|^ground$|^background$/i.test(field.name);
}
