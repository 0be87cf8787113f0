// Objects that stand at no node: found by what refers to them, from the cores of the tree on.

const kLongest = 500;    // ms, before it is told what has been found so far
const kDeepest = 6;      // references behind each other

/** @typedef {import('./schema.js').Type} Type */

/** @param {Map<string, Type>} types @param {string} to @returns {Set<string>} types whose references lead there */
export function typesLeadingTo(types, to) {
  const leading = new Set([to]);
  for (let grown = -1; grown !== leading.size;) {
    grown = leading.size;
    for (const type of types.values())
      if (type.fields.some((field) => leading.has(field.to))) leading.add(type.name);
  }
  return leading;
}

/** What is found of one type, page after page. */
export class ObjectFinder {
  #scene;
  #types;
  #to;
  #leading;
  #cores;             // types of cores from which to begin, one after the other
  #after = [];
  #seen = new Set();  // ids that were followed

  /** @param {import('./scene.js').Scene} scene @param {Map<string, Type>} types @param {string} to name of a type */
  constructor(scene, types, to) {
    this.#scene = scene;
    this.#types = types;
    this.#to = to;
    this.#leading = typesLeadingTo(types, to);
    // Nodes of other types are passed over by the wall, many at a time.
    this.#cores = [...types.values()].filter((type) => type.core && this.#leading.has(type.name));
  }

  /** Whether all has been looked at. */
  get isDone() {
    return this.#cores.length === 0;
  }

  /**
   * @param {number} many that are enough
   * @returns {Promise<import('./scene.js').SceneObject[]>} perhaps none yet, of a large scene
   */
  async next(many) {
    const found = [], end = performance.now() + kLongest;
    while (found.length < many && !this.isDone && performance.now() < end) {
      const { objects, next } = await this.#scene.nodesWith(this.#cores[0], this.#after);
      this.#after = next;
      if (next.length === 0) this.#cores.shift();
      let frontier = [...objects.values()];
      for (let depth = 0; depth < kDeepest && frontier.length > 0; ++depth) {
        const ids = frontier.flatMap((object) => this.#referred(object));
        const told = ids.length > 0 ? await this.#scene.objects(ids) : { objects: new Map() };
        frontier = ids.map((id) => told.objects.get(id)).filter(Boolean);
        found.push(...frontier.filter((object) => object.type === this.#to));
      }
    }
    return found;
  }

  /** Those that lead there, each once. */
  #referred(object) {
    const fields = this.#types.get(object.type)?.fields ?? [];
    const ids = fields.filter((field) => this.#leading.has(field.to) && !this.#types.get(field.to).core)
      .flatMap((field) => object.fields.get(field.name) ?? []).filter((id) => !this.#seen.has(id));
    for (const id of ids) this.#seen.add(id);
    return [...new Set(ids)];
  }
}
