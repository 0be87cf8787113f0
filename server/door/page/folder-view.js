// What lies in the folders of the server from which may be loaded.
import { element, seen, setText } from './elements.js';
import { sizeText } from './transfer.js';

const kPage = 200;

export class FolderView {
  #connection;
  #onLoad;
  #onRemove;
  #uploads = '';  // the folder of what people have brought
  #folder = '';
  #trail = [];
  #title = element('h3', { tabindex: '-1' });
  #list = element('ul', { class: 'results' });
  #said = element('p', { class: 'said', role: 'alert' });
  #looks = 0;
  node = element('div', { class: 'folder' }, this.#title, this.#said, this.#list);

  /**
   * @param {import('./connection.js').Connection} connection
   * @param {(path: string) => void} onLoad @param {(name: string) => void} onRemove of what people have brought
   */
  constructor(connection, onLoad, onRemove) {
    this.#connection = connection;
    this.#onLoad = onLoad;
    this.#onRemove = onRemove;
  }

  set uploads(path) {
    this.#uploads = path;
  }

  refresh() {
    return this.open(this.#folder);
  }

  /** @param {string} folder empty: all of them @param {string} after the name at which a page has ended */
  async open(folder, after = '') {
    const look = ++this.#looks;
    try {
      const page = await this.#connection.ask('GetFiles', { folder, after, page_size: kPage });
      if (look !== this.#looks) return;
      this.#folder = folder;
      setText(this.#said, '');
      setText(this.#title, folder === '' ? 'Folders' : this.#nameOf(folder));
      const hadFocus = this.#list.contains(document.activeElement);
      if (after === '') this.#list.replaceChildren(...(folder === '' ? [] : [this.#up()]));
      else this.#list.lastChild?.remove();  // what asked for more
      const rows = page.entries.map((entry) => this.#row(entry));
      this.#list.append(...rows);
      if (hadFocus && !this.#list.contains(document.activeElement))
        ((after !== '' && rows[0]?.querySelector('button')) || this.#title).focus();
      if (page.next !== '')
        this.#list.append(this.#item('Show more', '', () => this.open(folder, page.next)));
      else if (this.#list.children.length < 2 && page.entries.length === 0)
        this.#list.append(element('li', { class: 'muted', text: 'Nothing lies here.' }));
    } catch (error) {
      // A set goes with its last file.
      if (look === this.#looks && error.code === 'not_found' && folder !== '' && folder === this.#folder)
        return this.open(this.#trail.pop() ?? '');
      if (look === this.#looks && error.code !== 'network') setText(this.#said, `✕ ${error.message}`);
    }
  }

  #nameOf(path) {
    if (this.#uploads && path === this.#uploads) return 'Brought by people';
    if (this.#uploads && path.startsWith(`${this.#uploads}/`)) return path.slice(this.#uploads.length + 1);
    return path === 'asset://' ? 'Assets' : path;
  }
  /** What was opened on the way here: what lies above it may not be seen. */
  #up() {
    return this.#item('↑ Back', '', async () => {
      await this.open(this.#trail.pop() ?? '');
      this.#title.focus();
    });
  }
  #item(text, more, onclick) {
    return element('li', {}, element('button', { type: 'button', onclick }, element('span', { class: 'name', text }),
                                     element('span', { class: 'muted', text: more })));
  }
  #row({ name, path, is_folder: isFolder, bytes, loads }) {
    const shown = seen(this.#folder === '' ? this.#nameOf(path) : name);
    let row;
    if (isFolder) {
      row = this.#item(`▸ ${shown}`, '', async () => {
        this.#trail.push(this.#folder);
        await this.open(path);
        this.#title.focus();
      });
    } else if (loads) {
      row = this.#item(shown, `${sizeText(bytes)} · load`, () => this.#onLoad(path));
    } else {
      row = element('li', { class: 'file' }, element('span', { class: 'name', text: shown }),
                    element('span', { class: 'muted', text: sizeText(bytes) }));
    }
    if (this.#uploads && path.startsWith(`${this.#uploads}/`))
      row.append(element('button', { type: 'button', class: 'remove', text: '✕', 'aria-label': `Remove ${name}`,
                                     onclick: () => this.#onRemove(path.slice(this.#uploads.length + 1)) }));
    return row;
  }
}
