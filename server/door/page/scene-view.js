// The scene: its tree, a search, and what is selected; undo and redo for who may edit.
import { element, setChildren, setText } from './elements.js';
import { ObjectView } from './object-view.js';
import { Scene } from './scene.js';
import { Tree } from './tree.js';

const kTypingPause = 300;  // ms
const kTreePeriod = 3;     // statuses between two looks at the tree

export class SceneView {
  #connection;
  #scene;
  #tree;
  #object;
  #isShown = false;
  #isLoaded = false;
  #sequence = 0;
  #looks = 0;
  #tools = element('div', { class: 'tools' });
  #said = element('p', { class: 'said', role: 'alert' });
  #undo;
  #redo;
  #input = element('input', { type: 'search', placeholder: 'Name, or /hall/**/crane*', 'aria-label': 'Search the scene',
                              spellcheck: 'false', autocomplete: 'off' });
  #results = element('ul', { class: 'results' });
  #count = element('p', { class: 'muted', role: 'status' });
  #searches = 0;
  #browse;

  /**
   * @param {HTMLElement} panel
   * @param {import('./connection.js').Connection} connection
   * @param {import('./wall-status.js').WallStatus} status
   * @param {import('./schema.js').Schema} schema
   */
  constructor(panel, connection, status, schema) {
    this.#connection = connection;
    this.#scene = new Scene(connection);
    this.#object = new ObjectView(this.#scene, schema);
    this.#tree = new Tree(this.#scene, (node) => this.#select(node));
    const stepButton = (step) => element('button', { type: 'button', onclick: () => this.#step(step) });
    this.#undo = stepButton(() => this.#scene.undo());
    this.#redo = stepButton(() => this.#scene.redo());
    let typing = 0;
    this.#input.addEventListener('input', () => {
      clearTimeout(typing);
      typing = setTimeout(() => this.#search(), kTypingPause);
    });
    const form = element('form', { role: 'search', onsubmit: (event) => { event.preventDefault(); this.#search(); } },
                         this.#input);
    this.#browse = element('div', { class: 'browse' }, this.#count, this.#results, this.#tree.node);
    this.#object.node.append(element('button', { type: 'button', class: 'to-tree', text: '↑ Tree',
                                                 onclick: () => this.#toTree() }));
    panel.append(element('div', { class: 'bar' }, form, this.#tools), this.#said,
                 element('div', { class: 'columns scene' },
                         this.#browse, this.#object.node));
    panel.addEventListener('keydown', (event) => this.#onKey(event));
    connection.addEventListener('open', () => this.#onOpen());
    connection.addEventListener('lost', () => {
      this.#isLoaded = false;
    });
    status.addEventListener('status', ({ detail }) => this.#onStatus(detail));
  }

  set isShown(isShown) {
    this.#isShown = isShown;
    this.#load();
  }

  async #onOpen() {
    try {
      const { role } = await this.#connection.ask('WhoAmI');
      this.#object.mayEdit = role !== 'viewer';
      // Who may not edit sees nothing to do it with.
      setChildren(this.#tools, role === 'viewer' ? [] : [this.#undo, this.#redo]);
      this.#load();
    } catch {
      // Lost again.
    }
  }
  /** Once on each connection, as soon as somebody looks. */
  async #load() {
    if (this.#isLoaded || !this.#isShown || !this.#connection.isOpen) return;
    this.#isLoaded = true;
    await this.#quietly(() => this.#tree.load());
    await this.#quietly(() => this.#object.refresh());
  }

  #onStatus(status) {
    const undo = status.undo_depth, redo = status.redo_depth;
    setText(this.#undo, undo > 0 ? `↶ Undo (${undo})` : '↶ Undo');
    setText(this.#redo, redo > 0 ? `↷ Redo (${redo})` : '↷ Redo');
    this.#undo.disabled = undo === 0;
    this.#redo.disabled = redo === 0;
    if (!this.#isShown || !this.#isLoaded || status.sequence === this.#sequence) return;
    this.#sequence = status.sequence;
    this.#quietly(() => this.#object.refresh());
    if (++this.#looks % kTreePeriod === 0) this.#quietly(() => this.#tree.refresh());
  }

  /** Somebody wants to see a node, from elsewhere on the page. */
  show(node) {
    this.#select(node);
  }
  /** Where both stand below each other. */
  #toTree() {
    this.#browse.scrollIntoView();
    this.#browse.querySelector('[role=treeitem][tabindex="0"], .results button')?.focus();
  }
  #select(node) {
    this.#tree.select(node);
    this.#quietly(() => this.#object.open(node));
  }
  async #step(ask) {
    try {
      await ask();
      setText(this.#said, '');
    } catch (error) {
      setText(this.#said, `✕ ${error.message}`);
    }
    this.#quietly(() => this.#object.refresh());
    this.#quietly(() => this.#tree.refresh());
  }
  #onKey(event) {
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    if (event.target.matches('input[type=text], input[type=search]')) return;  // a text has an undo of its own
    const key = event.key.toLowerCase();
    const button = key === 'y' || (key === 'z' && event.shiftKey) ? this.#redo : key === 'z' ? this.#undo : null;
    if (!button?.isConnected) return;
    event.preventDefault();
    if (!button.disabled) button.click();
  }

  async #search(after = []) {
    const search = ++this.#searches;
    const text = this.#input.value.trim();
    this.#tree.node.hidden = text !== '';
    if (text === '') {
      this.#results.replaceChildren();
      setText(this.#count, '');
      return;
    }
    try {
      const found = await this.#scene.find(text, after);
      if (search !== this.#searches) return;
      if (after.length === 0) this.#results.replaceChildren();
      else this.#results.lastChild?.remove();  // what asked for more
      for (const node of found.nodes) {
        const show = element('button', { type: 'button', onclick: () => this.#select(node.id) },
                             element('span', { class: 'name', text: node.label }),
                             element('span', { class: 'muted', text: node.coreType }));
        this.#results.append(element('li', {}, show));
      }
      const many = this.#results.children.length;
      if (found.next.length > 0)
        this.#results.append(element('li', {}, element('button', { type: 'button', text: 'Search on',
                                                                   onclick: () => this.#search(found.next) })));
      setText(this.#count, `${many} found${found.next.length > 0 ? ' so far' : ''}`);
    } catch (error) {
      if (search === this.#searches) setText(this.#count, `✕ ${error.message}`);
    }
  }

  /** What is lost with the connection is asked anew with the next one. */
  async #quietly(ask) {
    try {
      await ask();
    } catch (error) {
      if (error.code !== 'network') setText(this.#said, `✕ ${error.message}`);
    }
  }
}
