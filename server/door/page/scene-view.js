// The scene: its tree, a search, and what is selected; undo and redo for who may edit; beside it what the scene has of
// materials, animations and files.
import { AnimationsView } from './animations-view.js';
import { BudgetView } from './budget-view.js';
import { element, pause, setChildren, setText } from './elements.js';
import { InlinesView } from './inlines-view.js';
import { MaterialsView } from './materials-view.js';
import { ObjectView } from './object-view.js';
import { kFindPage, Scene } from './scene.js';
import { paced, SceneWatch } from './scene-watch.js';
import { startTabs } from './tabs.js';
import { Tree } from './tree.js';

const kTypingPause = 300;  // ms
const kTreeRest = 500;     // ms, between two looks at the tree
const kParts = { tree: 'Tree', materials: 'Materials', animations: 'Animations', inlines: 'Inlines', budget: 'Budget' };
const kRoles = ['viewer', 'editor', 'operator'];  // each may do what those before may

export class SceneView {
  #connection;
  #scene;
  #tree;
  #object;
  #isShown = false;
  #isLoaded = false;
  #schema;
  #watch;
  #shownPart = 'tree';
  #parts;     // by their names in kParts, but the tree
  #showPart;
  #tools = element('div', { class: 'tools' });
  #said = element('p', { class: 'said', role: 'alert' });
  #undo;
  #redo;
  #next = element('p', { class: 'muted next-steps', id: 'next-steps' });
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
    this.#schema = schema;
    this.#scene = new Scene(connection, schema);
    this.#watch = new SceneWatch(connection);
    this.#object = new ObjectView(this.#scene, schema, (node) => this.#onMade(node));
    this.#tree = new Tree(this.#scene, (node) => this.#select(node));
    const stepButton = (step) => {
      const onclick = () => { if (button.ariaDisabled !== 'true') this.#step(step); };
      const button = element('button', { type: 'button', 'aria-describedby': 'next-steps', onclick });
      return button;
    };
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
    const visit = (id) => {
      this.#showPart('scene-tree');
      this.#select(id);
    };
    this.#parts = {
      materials: new MaterialsView(this.#scene, schema, this.#watch, visit),
      animations: new AnimationsView(this.#scene, schema, this.#watch, status, visit),
      inlines: new InlinesView(this.#scene, schema, this.#watch, status, visit),
      budget: new BudgetView(connection, status),
    };
    this.#layOut(panel, form);
    panel.addEventListener('keydown', (event) => this.#onKey(event));
    connection.addEventListener('open', () => this.#onOpen());
    connection.addEventListener('lost', () => {
      this.#isLoaded = false;
      this.#object.doubt();
    });
    status.addEventListener('status', ({ detail }) => this.#onStatus(detail));
  }

  #layOut(panel, form) {
    const nodes = { tree: [element('div', { class: 'bar' }, form, this.#tools), this.#said,
                           element('div', { class: 'columns scene' }, this.#browse, this.#object.node)] };
    for (const [name, part] of Object.entries(this.#parts)) nodes[name] = [part.node];
    const tabs = element('div', { class: 'tabs parts', role: 'tablist', 'aria-label': 'Of the scene' });
    panel.append(tabs);
    for (const [name, text] of Object.entries(kParts)) {
      const tab = `tab-scene-${name}`, shown = `panel-scene-${name}`;
      tabs.append(element('button', { type: 'button', role: 'tab', id: tab, 'aria-controls': shown, text }));
      panel.append(element('section', { role: 'tabpanel', id: shown, 'aria-labelledby': tab, hidden: true },
                           ...nodes[name]));
    }
    const refresh = paced(() => this.#quietly(() => this.#object.refresh()));
    const sayNext = paced(() => this.#quietly(() => this.#sayNext()));
    const refreshTree = paced(() => this.#quietly(() => this.#tree.refresh()), kTreeRest);
    const refreshAll = () => {
      if (!this.#isLoaded || this.#shownPart !== 'tree') return;
      refresh();
      sayNext();
      refreshTree();
    };
    this.#watch.addEventListener('change', refreshAll);
    this.#showPart = startTabs(tabs, (name) => {
      this.#shownPart = name.slice('scene-'.length);
      this.#tellParts();
      refreshAll();  // what has changed meanwhile
    }, false);
  }
  #tellParts() {
    for (const [name, part] of Object.entries(this.#parts))
      part.isShown = this.#isShown && this.#isLoaded && name === this.#shownPart;
    this.#load();
  }

  set isShown(isShown) {
    this.#isShown = isShown;
    this.#watch.isWatching = isShown;
    this.#tellParts();
  }

  async #onOpen() {
    try {
      const { role } = await this.#connection.ask('WhoAmI');
      const mayEdit = role !== 'viewer';
      this.#object.mayEdit = mayEdit;
      for (const part of [this.#parts.animations, this.#parts.inlines]) {
        part.mayEdit = mayEdit;
        part.reset();
      }
      const budget = await this.#schema.request('SetBudget');
      this.#parts.budget.allow(kRoles.indexOf(role) >= kRoles.indexOf(budget.role), budget.fields[0].bounds);
      // Who may not edit sees nothing to do it with.
      setChildren(this.#tools, mayEdit ? [this.#undo, this.#redo, this.#next] : []);
      this.#load();
    } catch {
      // Lost again.
    }
  }
  /** Once on each connection, as soon as somebody looks. */
  async #load() {
    if (this.#isLoaded || !this.#isShown || !this.#connection.isOpen) return;
    this.#isLoaded = true;
    this.#tellParts();
    await this.#quietly(() => this.#tree.load());
    await this.#quietly(() => this.#object.refresh());
    if (!this.#object.id) this.#tree.select(0);
    await this.#quietly(() => this.#sayNext());
  }

  #onStatus(status) {
    const undo = status.undo_depth, redo = status.redo_depth;
    setText(this.#undo, undo > 0 ? `↶ Undo (${undo})` : '↶ Undo');
    setText(this.#redo, redo > 0 ? `↷ Redo (${redo})` : '↷ Redo');
    // Not `disabled`: whoever presses it until nothing is left would lose the focus, or do with the next press what
    // they have just undone.
    this.#undo.setAttribute('aria-disabled', String(undo === 0));
    this.#redo.setAttribute('aria-disabled', String(redo === 0));
  }
  /** A node has come, or its parent is left of it. */
  async #onMade(node) {
    await this.#quietly(() => this.#tree.refresh());
    this.#select(node);
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
  /** What the buttons would do, as long as nobody else edits. */
  async #sayNext() {
    if (!this.#next.isConnected) return;
    const { undo, redo } = await this.#scene.steps();
    const said = [undo.what && `↶ ${undo.what}`, redo.what && `↷ ${redo.what}`].filter(Boolean);
    setText(this.#next, said.join('   '));
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
    this.#quietly(() => this.#sayNext());
  }
  #onKey(event) {
    if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
    // A text has an undo of its own.
    if (event.target.matches('input[type=text], input[type=search], textarea')) return;
    const key = event.key.toLowerCase();
    const button = key === 'y' || (key === 'z' && event.shiftKey) ? this.#redo : key === 'z' ? this.#undo : null;
    if (!button?.isConnected) return;
    event.preventDefault();
    button.click();
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
      await this.#find(text, after, () => search === this.#searches);
    } catch (error) {
      if (search === this.#searches) setText(this.#count, `✕ ${error.message}`);
    }
  }
  /** Through a large scene by itself, until a page is full; between two looks it rests as long as one took. */
  async #find(text, after, isWanted) {
    let next = after, many = 0, rest = 0;
    do {
      await pause(rest);
      const since = performance.now(), found = isWanted() ? await this.#scene.find(text, next) : null;
      if (!found || !isWanted()) return;
      if (next === after && after.length === 0) this.#results.replaceChildren();
      const last = this.#results.querySelector('.on'), rows = found.nodes.map((node) => this.#result(node));
      const hadFocus = last?.contains(document.activeElement);
      last?.remove();  // what asked for more
      this.#results.append(...rows);
      next = found.next;
      many += rows.length;
      const isLooking = next.length > 0 && many < kFindPage;
      if (next.length > 0) this.#results.append(this.#onward(isLooking ? null : next));
      if (hadFocus) ((rows[0] ?? this.#results.lastChild)?.querySelector('button') ?? this.#input).focus();
      const all = this.#results.querySelectorAll('li:not(.on)').length;
      setText(this.#count, `${all} found${next.length > 0 ? ' so far' : ''}`);
      rest = performance.now() - since;
      if (!isLooking) return;
    } while (this.#isShown && this.#connection.isOpen);
    this.#results.querySelector('.on')?.replaceWith(this.#onward(next));
  }
  #result(node) {
    return element('li', {}, element('button', { type: 'button', onclick: () => this.#select(node.id) },
                                     element('span', { class: 'name', text: node.label }),
                                     element('span', { class: 'muted', text: node.coreType })));
  }
  /** @param {number[] | null} next where it goes on; null: it does by itself */
  #onward(next) {
    const onclick = () => { if (next) this.#search(next); };
    return element('li', { class: 'on' }, element('button', { type: 'button', text: next ? 'Search on' : 'Looking…',
                                                              onclick }));
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
