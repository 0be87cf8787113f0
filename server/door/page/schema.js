// The types of a scene with their fields, as the wall describes them at /api.
import { pause } from './elements.js';
import { authorization } from './token.js';

const kAgain = 1000;  // ms

/**
 * @typedef {{name: string, number: number, kind: string, width: number, unit: string, to?: string, default: any,
 *     least?: number, greatest?: number, words?: Record<string, number>, flags?: boolean, written_by?: string,
 *     instead?: string, help?: string}} Field
 * @typedef {{name: string, number: number, core: boolean, fields: Field[]}} Type
 */

/** "baseColor" as people read it. */
export function spaced(name) {
  return name.replace(/([a-z\d])([A-Z])/g, (_, end, begin) => `${end} ${begin.toLowerCase()}`);
}
/** @param {Field} field */
export function isReference(field) {
  return field.kind === 'ref' || field.kind === 'reference list';
}
/** What the wall finds out or chooses itself: edits of it are refused. @param {Field} field */
export function isOfServer(field) {
  return field.written_by === 'server';
}
/** All fields of an object: what the wall has not said is default. */
export function valuesOf(object, type) {
  return Object.fromEntries(type.fields.map((field) => (
    [field.name, object.fields.has(field.name) ? object.fields.get(field.name) : field.default])));
}

/** Event `outdated`: behind the same address another version answers now, and this page is of the one before. */
export class Schema extends EventTarget {
  /** @type {Promise<Map<string, Type>>} by their names */
  #types = new Promise(() => {});
  #requests = new Map();
  #known = '';

  /** @param {import('./connection.js').Connection} connection */
  constructor(connection) {
    super();
    connection.addEventListener('open', () => {
      this.#types = this.#load(connection);
      this.#types.catch(() => {});
    });
  }

  get types() {
    return this.#types;
  }

  /** @returns {Promise<{role: string, fields: {name: string, least?: number, greatest?: number}[]} | undefined>} */
  async request(name) {
    await this.#types;
    return this.#requests.get(name);
  }

  async #load(connection) {
    let answer = await fetch('/api', { headers: authorization() });
    for (; !answer.ok && connection.isOpen; answer = await fetch('/api', { headers: authorization() }))
      await pause(kAgain);  // too much is asked at once
    if (!answer.ok) throw new Error(`The types of the scene did not come: ${answer.status}`);
    const api = await answer.json();
    const version = `${api.version} ${api.protocol} ${api.schema}`;
    this.#known ||= version;
    if (this.#known !== version) this.dispatchEvent(new Event('outdated'));
    this.#requests = new Map(api.requests.map((request) => [request.name, request]));
    for (const field of api.types.flatMap((type) => type.fields)) field.default = inWords(field, field.default);
    return new Map(api.types.map((type) => [type.name, type]));
  }
}

/** Values of a scene come in words, defaults as numbers. */
function inWords(field, value) {
  if (!field.words) return value;
  const words = Object.entries(field.words);
  if (field.flags) return words.filter(([, bit]) => value & bit).map(([word]) => word).join(',') || value;
  return words.find(([, number]) => number === value)?.[0] ?? value;
}
