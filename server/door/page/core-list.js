// Nodes whose cores are of certain types, from all over the scene: some at a time, however many there are.
import { seen } from './elements.js';
import { valuesOf } from './schema.js';

const kLongest = 2000;  // ms, before it is told what has been found so far

/**
 * @typedef {{node: number, label: string, core: import('./scene.js').SceneObject, type: import('./schema.js').Type,
 *     values: Record<string, any>, length: number | null, at: number}} Listed `at`: when the wall was asked, in ms
 */

export class CoreList {
  #scene;
  #schema;
  #isListed;
  #size;
  #types = [];
  #found = [];  // {node, core, type, length}
  #cursor = { type: 0, after: [] };
  #first = 0;

  /**
   * @param {import('./scene.js').Scene} scene
   * @param {import('./schema.js').Schema} schema
   * @param {(type: import('./schema.js').Type) => boolean} isListed
   * @param {number} size of a page
   */
  constructor(scene, schema, isListed, size) {
    this.#scene = scene;
    this.#schema = schema;
    this.#isListed = isListed;
    this.#size = size;
  }

  /** Which of those that are known the page shows; `isAll`: there are no others. */
  get place() {
    const many = this.#found.length;
    const first = Math.min(this.#first, many);
    return { first, end: Math.min(first + this.#size, many), many, isAll: this.#isAll };
  }
  get hasMore() {
    return !this.#isAll || this.#found.length > this.#first + this.#size;
  }

  /** The page is not full, and what could fill it has not been looked for: the scene takes longer than one look. */
  get isUnfinished() {
    return !this.#isAll && this.#found.length < this.#first + this.#size;
  }

  /** Some pages on, or back. */
  move(pages) {
    this.#first = Math.max(0, this.#first + pages * this.#size);
  }
  /**
   * From the start, as far as it was known: what has come and gone. A look that is unfinished goes on.
   * @returns {Promise<Listed[]>}
   */
  async load() {
    // To begin anew would find no more than before.
    if (this.#types.length > 0 && this.isUnfinished) return this.more();
    const types = [...(await this.#schema.types).values()].filter((type) => type.core && this.#isListed(type));
    const found = [], cursor = { type: 0, after: [] };
    await this.#look(types, found, cursor);
    this.#types = types;
    this.#found = found;
    this.#cursor = cursor;
    if (this.#isAll && this.#first >= found.length)
      this.#first = this.#size * Math.max(0, Math.ceil(found.length / this.#size) - 1);
    return this.rows();
  }
  /** What is on the page that is shown now. @returns {Promise<Listed[]>} */
  async more() {
    await this.#look(this.#types, this.#found, this.#cursor);
    return this.rows();
  }

  /** @returns {Promise<Listed[]>} as the scene has them now; those that are gone are left out */
  async rows() {
    const shown = this.#found.slice(this.#first, this.#first + this.#size);
    if (shown.length === 0) return [];
    const at = performance.now();
    const { objects, paths } = await this.#scene.objects(shown.map((one) => one.node));
    const left = shown.filter(({ node, core }) => objects.has(node) && objects.has(core));
    return left.map(({ node, core: id, type, length }) => {
      const core = objects.get(id), path = paths.get(node) ?? '';
      const label = seen(path.startsWith('/') ? path : objects.get(node).fields.get('name') || `#${node}`);
      return { node, label, core, type, values: valuesOf(core, type), length, at: (at + performance.now()) / 2 };
    });
  }

  get #isAll() {
    return this.#cursor.type >= this.#types.length;
  }
  async #look(types, found, cursor) {
    const enough = this.#first + this.#size + 1, end = performance.now() + kLongest;
    while (found.length < enough && cursor.type < types.length && performance.now() < end) {
      const type = types[cursor.type];
      const { nodes, next } = await this.#scene.nodesWith(type, cursor.after);
      for (const { id, core, length } of nodes) if (core) found.push({ node: id, core: core.id, type, length });
      cursor.after = next;
      if (next.length === 0) ++cursor.type;
    }
  }
}
