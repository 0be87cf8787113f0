// Objects that stand at no node: found by what refers to them, from the cores of the tree on.

const kMostPages = 16;   // of the tree, for one page of what is found
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
  #after = [];
  #seen = new Set();  // ids that were followed
  /** Whether all has been looked at. */
  isDone = false;

  /** @param {import('./scene.js').Scene} scene @param {Map<string, Type>} types @param {string} to name of a type */
  constructor(scene, types, to) {
    this.#scene = scene;
    this.#types = types;
    this.#to = to;
    this.#leading = typesLeadingTo(types, to);
  }

  /** @param {number} many that are enough @returns {Promise<import('./scene.js').SceneObject[]>} */
  async next(many) {
    const found = [];
    for (let page = 0; page < kMostPages && found.length < many && !this.isDone; ++page) {
      const { objects, next } = await this.#scene.nodesWith(null, this.#after);
      this.#after = next;
      this.isDone = next.length === 0;
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
