// What the scene holds, asked in pages; and edits of it.

/**
 * @typedef {{id: number, name: string, children: number, coreType: string}} TreeNode
 * @typedef {{id: number, type: string, fields: Map<string, any>}} SceneObject with what differs from a field's default
 */

const kRoot = 1;
const kFindPage = 100;
const kMostNames = 256;  // that the wall is asked for at once
const kMostPages = 50;  // of one search, some thousand nodes each; then somebody has to ask for more

/** Objects of a list of changes that creates them, by their ids. */
function objectsIn(content) {
  /** @type {Map<number, SceneObject>} */
  const objects = new Map();
  for (const { id, type } of content?.created ?? []) objects.set(id, { id, type, fields: new Map() });
  for (const { field, ids, values } of content?.set ?? [])
    ids.forEach((id, i) => objects.get(id)?.fields.set(field, values[i]));
  return objects;
}

export class Scene {
  #connection;

  /** @param {import('./connection.js').Connection} connection */
  constructor(connection) {
    this.#connection = connection;
  }

  get root() {
    return kRoot;
  }

  /**
   * A page of the nodes right below one, and that one itself on the first page.
   * @param {number} node
   * @param {number[]} after `next` of the page before
   * @returns {Promise<{self: TreeNode | null, children: TreeNode[], next: number[]}>}
   */
  async childrenOf(node, after = []) {
    const page = await this.#connection.ask('GetTree', { node, levels: 1, after });
    const objects = objectsIn(page.content);
    const nodes = page.nodes.map((told) => {
      const fields = objects.get(told.node)?.fields;
      const core = objects.get(fields?.get('core'));
      return { id: told.node, name: fields?.get('name') ?? '', children: told.children, coreType: core?.type ?? '' };
    });
    return { self: nodes.find((one) => one.id === node) ?? null, children: nodes.filter((one) => one.id !== node),
             next: page.next };
  }

  /**
   * @param {string} text an expression, or a part of a name
   * @returns {Promise<{nodes: {id: number, label: string, coreType: string}[], next: number[]}>}
   */
  async find(text, after = []) {
    const expression = /[*?[/\\]/.test(text) ? text : `*${text}*`;
    const nodes = [];
    let next = after;
    for (let page = 0; page < kMostPages; ++page) {
      const found = await this.#connection.ask('FindNodes', { expression, page_size: kFindPage, after: next });
      nodes.push(...found.nodes);
      next = found.next;
      if (next.length === 0 || nodes.length >= kFindPage) break;
    }
    return this.#labelled({ nodes, next });
  }

  /** Of a node among very many the wall tells no path: its name says more than its number. */
  async #labelled({ nodes, next }) {
    const names = nodes.map((node) => node.path).filter((path) => !path.startsWith('/')).slice(0, kMostNames);
    const told = names.length > 0 ? await this.#connection.ask('GetObjects', { names, content: true }) : null;
    const objects = objectsIn(told?.content);
    return { next, nodes: nodes.map(({ id, path, core, core_type }) => {
      const name = objects.get(id)?.fields.get('name');
      return { id, label: name ? `${name} (${path})` : path, coreType: core ? core_type : '' };
    }) };
  }

  /**
   * An object; of a node with its core.
   * @returns {Promise<{path: string, objects: SceneObject[]} | null>} null: there is none any more
   */
  async object(id) {
    const told = await this.#connection.ask('GetObjects', { names: [`#${id}`], content: true, paths: true });
    if (!told.objects[0].id) return null;
    return { path: told.objects[0].path, objects: [...objectsIn(told.content).values()] };
  }

  /** One that edits in a row share: together they are one step of undo. */
  newGesture() {
    return Date.now() * 1000 + Math.floor(Math.random() * 1000);  // of two pages two; exact as a number of JavaScript
  }

  /**
   * @param {SceneObject} object
   * @param {string} field
   * @param {any} value
   * @param {number} gesture 0: a step of its own
   */
  set(object, field, value, gesture = 0) {
    const set = [{ type: object.type, field, ids: [object.id], values: [value] }];
    return this.#connection.ask('ProposeChanges', { gesture, list: { set } });
  }
  /** What the next step of undo, and of redo, would do. */
  steps() {
    return this.#connection.ask('GetSteps');
  }
  undo() {
    return this.#connection.ask('UndoStep');
  }
  redo() {
    return this.#connection.ask('RedoStep');
  }
}
