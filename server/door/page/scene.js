// What the scene holds, asked in pages; and edits of it.
import { seen, straight } from './elements.js';

/**
 * @typedef {{id: number, name: string, children: number, coreType: string}} TreeNode
 * @typedef {{id: number, type: string, fields: Map<string, any>}} SceneObject with what differs from a field's default
 */

const kRoot = 1;
const kTreePage = 201;  // a node with as many children as a tree shows at once, where the wall lets one say so
export const kFindPage = 100;
const kNamesBelow = 5;    // of what goes with a node
const kMostNames = 256;  // that the wall is asked for at once
const kMostPages = 50;     // of what is counted, some hundred nodes each
const kLongestFind = 500;  // ms, before it is told what has been found so far

/** What a wall says to a value that it refuses, without the place in the proposal. @param {Error} error */
export function reasonOf(error) {
  return error.message.replace(/^list\.set\[0\]\.values\[0\](\[\d\])?: /, '');
}

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
  #schema;

  /** @param {import('./connection.js').Connection} connection @param {import('./schema.js').Schema} schema */
  constructor(connection, schema) {
    this.#connection = connection;
    this.#schema = schema;
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
    const size = (await this.#schema.request('GetTree'))?.fields.find((field) => field.name === 'page_size');
    const wish = size ? { page_size: Math.min(kTreePage, size.greatest ?? kTreePage) } : {};
    const page = await this.#treePage({ ...wish, node, levels: 1, after });
    return { self: page.nodes.find((one) => one.id === node) ?? null,
             children: page.nodes.filter((one) => one.id !== node), next: page.next };
  }

  /**
   * A page of all nodes whose cores are of a type; it may be empty and not the last.
   * @param {import('./schema.js').Type | null} type null: of any type, or none
   * @param {number[]} after `next` of the page before
   * @returns {Promise<{nodes: (TreeNode & {core: SceneObject | undefined, length: number | null, parent: number})[],
   *     objects: Map<number, SceneObject>, next: number[]}>} `length` of what plays, in seconds, where it is known
   */
  nodesWith(type, after = []) {
    return this.#treePage({ core_type: type?.number ?? 0, after });
  }

  /** @returns {Promise<{names: string[], nodes: number, isAll: boolean, parent: number}>} it, and what is below it */
  async countBelow(node) {
    const told = { names: [], nodes: 0, isAll: true, parent: kRoot };
    let after = [], rightBelow = 0;
    for (let page = 0; page < kMostPages; ++page) {
      const { nodes, next } = await this.#treePage({ node, after });
      if (page === 0) [{ parent: told.parent, children: rightBelow }] = nodes;
      const below = nodes.slice(page === 0 ? 1 : 0);
      told.names.push(...below.slice(0, kNamesBelow - told.names.length).map(({ name }) => name));
      told.nodes += nodes.length;
      after = next;
      if (next.length === 0) return told;
    }
    return { ...told, nodes: Math.max(told.nodes, 1 + rightBelow), isAll: false };
  }

  async #treePage(wish) {
    const page = await this.#connection.ask('GetTree', wish);
    const objects = objectsIn(page.content);
    const lengths = new Map(page.lengths.map(({ core, seconds }) => [core, seconds]));
    const nodes = page.nodes.map(({ node, parent, children }) => {
      const fields = objects.get(node)?.fields;
      const core = objects.get(fields?.get('core'));
      return { id: node, parent, children, name: fields?.get('name') ?? '', core, coreType: core?.type ?? '',
               length: lengths.get(core?.id) ?? null };
    });
    return { nodes, objects, next: page.next };
  }

  /**
   * Some of what is found: perhaps nothing yet, of a large scene.
   * @param {string} text an expression, or a part of a name
   * @param {number[]} after `next` of the page before
   * @param {number} coreType a type's number: only nodes with such a core; 0: all
   * @returns {Promise<{nodes: {id: number, label: string, core: number, coreType: string}[], next: number[]}>}
   */
  async find(text, after = [], coreType = 0) {
    const expression = /[*?[/\\]/.test(text) ? text : text ? `*${text}*` : '/**';
    const nodes = [], end = performance.now() + kLongestFind;
    let next = after;
    do {
      const found = await this.#connection.ask('FindNodes', { expression, core_type: coreType, page_size: kFindPage,
                                                                  after: next });
      nodes.push(...found.nodes);
      next = found.next;
    } while (next.length > 0 && nodes.length < kFindPage && performance.now() < end);
    return this.#labelled({ nodes, next });
  }

  /** Of a node among very many the wall tells no path: its name says more than its number. */
  async #labelled({ nodes, next }) {
    const names = nodes.map((node) => node.path).filter((path) => !path.startsWith('/')).slice(0, kMostNames);
    const told = names.length > 0 ? await this.#connection.ask('GetObjects', { names, content: true }) : null;
    const objects = objectsIn(told?.content);
    return { next, nodes: nodes.map(({ id, path, core, core_type }) => {
      const name = objects.get(id)?.fields.get('name');
      return { id, label: name ? `${seen(name)} (${path})` : seen(path), core, coreType: core ? core_type : '' };
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

  /**
   * @param {number[]} ids any number of them
   * @returns {Promise<{objects: Map<number, SceneObject>, paths: Map<number, string>}>} those that are still there
   */
  async objects(ids) {
    const told = { objects: new Map(), paths: new Map() };
    for (let at = 0; at < ids.length; at += kMostNames) {
      const names = ids.slice(at, at + kMostNames).map((id) => `#${id}`);
      const page = await this.#connection.ask('GetObjects', { names, content: true, paths: true });
      for (const [id, object] of objectsIn(page.content)) told.objects.set(id, object);
      for (const { id, path } of page.objects) if (id) told.paths.set(id, path);
    }
    return told;
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
  async steps() {
    const { undo, redo } = await this.#connection.ask('GetSteps');
    const paths = await this.#pathsOfCores([undo, redo].flatMap(({ what, objects }) => (
      objects.filter((id) => what.includes(`#${id} `)))));
    for (const step of [undo, redo])
      step.what = straight(step.what).replace(/#(\d+) \w+/g, (said, id) => paths.get(Number(id)) ?? said);
    return { undo, redo };
  }
  /** Of cores the nodes' paths, as far as a page of the tree has them. */
  async #pathsOfCores(cores) {
    if (cores.length === 0) return new Map();
    const { nodes } = await this.#treePage({ cores });
    const { paths } = await this.objects(nodes.map(({ id }) => id));
    return new Map(nodes.map(({ id, core }) => [core?.id, seen(paths.get(id) ?? `#${id}`)]));
  }
  remove(node) {
    return this.#connection.ask('RemoveNode', { node });
  }
  /** With cores, materials, images of its own: it can be moved by itself. @returns {Promise<number>} beside it */
  async clone(node, name) {
    return (await this.#connection.ask('CloneNode', { node, name, deep: true })).ids[0].id;
  }
  /** @param {string} type of its core; empty: none @returns {Promise<number>} the new node */
  async create(parent, name, type) {
    const created = [{ id: '$0', type: 'Node' }];
    const set = [{ type: 'Node', field: 'name', ids: ['$0'], values: [name] }];
    if (type) {
      created.push({ id: '$1', type });
      set.push({ type: 'Node', field: 'core', ids: ['$0'], values: ['$1'] });
    }
    const placed = [{ node: '$0', parent }];
    const committed = await this.#connection.ask('ProposeChanges', { list: { created, placed, set } });
    return committed.ids[0].id;
  }
  undo() {
    return this.#connection.ask('UndoStep');
  }
  redo() {
    return this.#connection.ask('RedoStep');
  }
}
