// The tree of the scene, in pages: what is open has been asked for, and no more.
import { element, seen, setChildren, setText } from './elements.js';

const kRowsAtOnce = 200;  // of one node's children: more are shown when somebody asks

/** A node that is open: what is known of its children. */
class Branch {
  /** @type {import('./scene.js').TreeNode[]} */
  children = [];
  next = [];
  count = 0;  // of all
  shown = kRowsAtOnce;
}

export class Tree {
  #scene;
  #onSelect;
  #open = new Map();  // node -> Branch
  #rows = new Map();  // key -> {node, name, type, toggle, row}
  #flat = [];         // what stands there, from top to bottom
  #root = null;
  #focused = '';      // key
  #selected = 0;
  #timesAsked = 0;

  /** @param {import('./scene.js').Scene} scene @param {(node: number) => void} onSelect */
  constructor(scene, onSelect) {
    this.#scene = scene;
    this.#onSelect = onSelect;
    this.node = element('div', { class: 'tree', role: 'tree', 'aria-label': 'Scene' });
    this.node.addEventListener('keydown', (event) => this.#onKey(event));
    this.node.addEventListener('focusin', (event) => {
      this.#focused = event.target.closest('[role=treeitem]')?.dataset.key ?? this.#focused;
      this.#showFocus();
    });
  }

  /** From the start: nothing that was known counts. */
  async load() {
    const known = [...this.#open.keys()];
    this.#open.clear();
    await this.#openNode(this.#scene.root);
    for (const node of known) if (this.#isThere(node)) await this.#openNode(node);
  }

  /** What is open is asked for again, as far as it is shown. */
  async refresh() {
    for (const [node, branch] of [...this.#open]) {
      if (node !== this.#scene.root && !this.#isThere(node)) this.#open.delete(node);
      else await this.#fetch(node, branch);
    }
    this.#show();
  }

  select(node) {
    this.#selected = node;
    this.#show();
    this.#rows.get(`${node}`)?.node.scrollIntoView({ block: 'nearest' });
  }

  #isThere(node) {
    return this.#flat.some((row) => row.id === node);
  }

  async #openNode(node) {
    const branch = new Branch();
    this.#open.set(node, branch);
    await this.#fetch(node, branch);
    this.#show();
  }
  #closeNode(node) {
    this.#open.delete(node);
    this.#show();
  }
  /** As many pages as are shown; or all over again. */
  async #fetch(node, branch) {
    const asked = ++this.#timesAsked;
    const page = await this.#scene.childrenOf(node);
    const { self } = page;
    await this.#fill(node, page, branch.shown);
    if (asked < branch.asked) return;  // a later question was answered before
    branch.asked = asked;
    branch.children = page.children;
    branch.next = page.next;
    branch.count = self?.children ?? 0;
    if (node === this.#scene.root) this.#root = self;
  }
  async #fill(node, page, many) {
    while (page.children.length < many && page.next.length > 0) {
      const { children, next } = await this.#scene.childrenOf(node, page.next);
      page.children.push(...children);
      page.next = next;
    }
  }
  async #more(node) {
    const branch = this.#open.get(node);
    const first = branch.shown;
    branch.shown += kRowsAtOnce;
    await this.#fill(node, branch, branch.shown);
    this.#show();
    if (branch.children[first]) this.#focus(`${branch.children[first].id}`);
  }

  // ---- what stands there

  #show() {
    const at = Math.max(0, this.#flat.findIndex((row) => row.key === this.#focused));
    const hadFocus = this.node.contains(document.activeElement);
    this.#flat = [];
    if (this.#root) this.#lay({ ...this.#root, name: this.#root.name || 'Scene' }, 1);
    const keys = new Set(this.#flat.map((row) => row.key));
    for (const key of this.#rows.keys()) if (!keys.has(key)) this.#rows.delete(key);
    if (!keys.has(this.#focused)) this.#focused = this.#flat[Math.min(at, this.#flat.length - 1)]?.key ?? '';
    setChildren(this.node, this.#flat.map((row) => this.#rowNode(row)));
    this.#showFocus();
    if (hadFocus && !this.node.contains(document.activeElement)) this.#focus(this.#focused);  // it was on what is gone
  }
  #lay(node, level) {
    const branch = this.#open.get(node.id);
    this.#flat.push({ ...node, key: `${node.id}`, level, isOpen: Boolean(branch) });
    if (!branch) return;
    for (const child of branch.children.slice(0, branch.shown)) this.#lay(child, level + 1);
    if (branch.shown < branch.children.length || branch.next.length > 0) {
      const left = Math.max(0, branch.count - Math.min(branch.shown, branch.children.length));
      const name = `Show more of ${left.toLocaleString('en')}`;
      this.#flat.push({ key: `more ${node.id}`, moreOf: node.id, name, level: level + 1 });
    }
  }
  #rowNode(row) {
    let known = this.#rows.get(row.key);
    if (!known) {
      const toggle = element('span', { class: 'toggle', 'aria-hidden': 'true' });
      const name = element('span', { class: 'name' }), type = element('span', { class: 'muted' });
      const node = element('div', { role: 'treeitem', 'data-key': row.key, tabindex: '-1' }, toggle, name, type);
      known = { node, toggle, name, type, row };
      toggle.addEventListener('click', (event) => {
        if (!known.row.children) return;
        event.stopPropagation();
        this.#toggle(known.row);
      });
      node.addEventListener('click', () => this.#activate(known.row));
      this.#rows.set(row.key, known);
    }
    known.row = row;
    setText(known.toggle, row.children ? (row.isOpen ? '▾' : '▸') : '');
    setText(known.name, seen(row.name) || '(no name)');
    setText(known.type, row.coreType ?? '');
    known.node.setAttribute('aria-level', row.level);
    known.node.style.setProperty('--level', row.level);
    if (row.children) known.node.setAttribute('aria-expanded', String(row.isOpen));
    else known.node.removeAttribute('aria-expanded');
    known.node.setAttribute('aria-selected', String(row.id === this.#selected));
    return known.node;
  }
  #showFocus() {
    for (const [key, { node }] of this.#rows) node.tabIndex = key === this.#focused ? 0 : -1;
  }
  #focus(key) {
    this.#rows.get(key)?.node.focus();
  }

  // ---- what somebody does

  #toggle(row) {
    if (row.isOpen) this.#closeNode(row.id);
    else this.#openNode(row.id).catch(() => {});
  }
  #activate(row) {
    if (row.moreOf) this.#more(row.moreOf).catch(() => {});
    else this.#onSelect(row.id);
  }
  #onKey(event) {
    const at = this.#flat.findIndex((row) => row.key === this.#focused);
    const row = this.#flat[at];
    if (!row || event.ctrlKey || event.altKey || event.metaKey) return;
    const above = () => this.#flat.slice(0, at).findLast((other) => other.level < row.level);
    switch (event.key) {
      case 'ArrowDown': this.#focus(this.#flat[at + 1]?.key); break;
      case 'ArrowUp': this.#focus(this.#flat[at - 1]?.key); break;
      case 'Home': this.#focus(this.#flat[0].key); break;
      case 'End': this.#focus(this.#flat.at(-1).key); break;
      case 'ArrowRight':
        if (row.children && !row.isOpen) this.#toggle(row);
        else if (row.isOpen) this.#focus(this.#flat[at + 1]?.key);
        break;
      case 'ArrowLeft':
        if (row.isOpen) this.#toggle(row);
        else this.#focus(above()?.key);
        break;
      case 'Enter': case ' ': this.#activate(row); break;
      default: return;
    }
    event.preventDefault();
  }
}
