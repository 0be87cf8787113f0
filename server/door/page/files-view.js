// Files: what somebody drops on the page is brought to the wall and loaded; what lies at the server is; the scene and a
// picture of the whole wall come out.
import { AskDialog } from './ask-dialog.js';
import { asSet, filesOf } from './dropped.js';
import { element, setChildren, setText } from './elements.js';
import { FolderView } from './folder-view.js';
import { LoadForm } from './load-form.js';
import { keepAsFile, sizeText, transfer, uploadPath } from './transfer.js';
import { UploadList } from './upload-list.js';

const kRanks = ['viewer', 'editor', 'operator'];

export class FilesView {
  #connection;
  #isShown = false;
  #isLoaded = false;
  #rank = 0;
  #dialog = new AskDialog();
  #form = new LoadForm();
  #uploads = new UploadList();
  #folders;
  #room = element('p', { class: 'muted' });
  #said = element('p', { class: 'said', role: 'alert' });
  #outcome = element('div', { class: 'outcome', role: 'status' });
  #bring;
  #take;
  #columns = element('div', { class: 'columns' });

  /** @param {HTMLElement} panel @param {import('./connection.js').Connection} connection */
  constructor(panel, connection) {
    this.#connection = connection;
    this.#folders = new FolderView(connection, (path) => this.#askToLoad([path]), (name) => this.#remove(name));
    const input = element('input', { type: 'file', multiple: true, hidden: true });
    input.addEventListener('change', () => {
      this.#takeIn([...input.files].map((file) => ({ name: file.name, file })));
      input.value = '';
    });
    const choose = element('button', { type: 'button', text: 'Choose files', onclick: () => input.click() });
    this.#bring = element('section', { class: 'drop' }, element('h2', { text: 'Bring files' }),
                          element('p', { text: 'Drop a model here, with the files that it names, or anywhere on ' +
                                               'this page.' }),
                          choose, input, this.#room, this.#uploads.node, this.#said, this.#outcome);
    this.#take = element('section', { class: 'take' });
    panel.append(this.#columns, this.#dialog.node);
    this.#listenForDrops();
    connection.addEventListener('open', () => this.#onOpen());
    connection.addEventListener('lost', () => {
      this.#isLoaded = false;
    });
  }

  set isShown(isShown) {
    this.#isShown = isShown;
    this.#load();
  }

  async #onOpen() {
    try {
      const { role } = await this.#connection.ask('WhoAmI');
      this.#rank = kRanks.indexOf(role);
      this.#build();
      this.#load();
    } catch {
      // Lost again.
    }
  }

  /** Who may not do a thing sees nothing to do it with. */
  #build() {
    const out = [this.#out('Picture of the whole wall', '/wall.png', 'wall.png')];
    if (this.#rank >= 1)
      out.push(this.#out('The scene, as it is', '/scene.tsc', 'scene.tsc'),
               this.#out('The scene, as text', '/scene.tsct', 'scene.tsct'));
    this.#take.replaceChildren(element('h2', { text: 'Keep' }), ...out);
    if (this.#rank >= 2) this.#take.append(element('h2', { text: 'At the server' }), this.#folders.node);
    setChildren(this.#columns, this.#rank >= 2 ? [this.#bring, this.#take] : [this.#take]);
  }

  /** Once on each connection, as soon as somebody looks. */
  async #load() {
    if (this.#isLoaded || !this.#isShown || this.#rank < 2 || !this.#connection.isOpen) return;
    this.#isLoaded = true;
    await this.#lookForRoom();
    await this.#folders.refresh();
  }

  /** @returns {Promise<{bytes: number, files: number} | null>} that may still come; null: none is taken here */
  async #lookForRoom() {
    try {
      const used = await transfer({ method: 'GET', path: '/upload' }).done;
      this.#folders.uploads = used.folder;
      setText(this.#room, `${sizeText(used.bytes)} of ${sizeText(used.most_bytes)} are used.`);
      return { bytes: used.most_bytes - used.bytes, files: used.most_files - used.files };
    } catch (error) {
      setText(this.#room, `✕ ${error.message}`);
      return null;
    }
  }

  #listenForDrops() {
    const holdsFiles = (event) => event.dataTransfer?.types.includes('Files');
    addEventListener('dragover', (event) => {
      if (!holdsFiles(event)) return;
      event.preventDefault();  // the browser would leave the page for the file
      event.dataTransfer.dropEffect = this.#rank >= 2 ? 'copy' : 'none';
      document.body.classList.toggle('dropping', this.#rank >= 2);
    });
    addEventListener('dragleave', (event) => {
      if (!event.relatedTarget) document.body.classList.remove('dropping');
    });
    addEventListener('drop', async (event) => {
      if (!holdsFiles(event)) return;
      event.preventDefault();
      document.body.classList.remove('dropping');
      if (this.#rank < 2) return;
      const files = filesOf(event.dataTransfer);
      document.getElementById('tab-files').click();
      try {
        await this.#takeIn(await files);
      } catch (error) {
        setText(this.#said, `✕ ${error.message}`);
      }
    });
  }

  /** @param {{name: string, file: File}[]} dropped */
  async #takeIn(dropped) {
    setText(this.#said, '');
    this.#outcome.replaceChildren();
    const files = asSet(dropped);
    if (files.length === 0) return;
    const title = files.length === 1 ? files[0].name : `${files[0].name.split('/')[0]} (${files.length} files)`;
    const room = await this.#lookForRoom();
    if (!room) return;
    const bytes = files.reduce((sum, { file }) => sum + file.size, 0);
    if (bytes > room.bytes || files.length > room.files) {
      setText(this.#said, bytes > room.bytes
        ? `✕ ${title} has ${sizeText(bytes)}, and there is room for ${sizeText(room.bytes)}: remove something first.`
        : `✕ ${files.length} files, and there is room for ${room.files}: remove something first.`);
      return;
    }
    const paths = await this.#uploads.send(title, files);
    await this.#lookForRoom();
    await this.#folders.refresh();
    if (!paths) return;
    const models = await this.#modelsAmong(paths);
    if (models.length > 0) await this.#askToLoad(models);
    else setText(this.#said, `✕ ${title} lies at the server, and nothing in it is a model that it reads.`);
  }

  async #modelsAmong(paths) {
    const folders = new Set(paths.map((path) => path.slice(0, path.lastIndexOf('/'))));
    const wanted = new Set(paths), models = [];
    for (const folder of folders) {
      let after = '';
      do {
        const page = await this.#connection.ask('GetFiles', { folder, after, page_size: 512 });
        models.push(...page.entries.filter(({ path, loads }) => loads && wanted.has(path)).map(({ path }) => path));
        after = page.next;
      } while (after !== '');
    }
    return models;
  }

  async #askToLoad(paths) {
    const nameOf = (path) => path.slice(path.lastIndexOf('/') + 1);
    this.#form.begin(paths, nameOf);
    const title = paths.length === 1 ? `Load ${nameOf(paths[0])} into the scene?` : 'Load one of these into the scene?';
    if (!await this.#dialog.ask(title, 'Load', this.#form.node)) return;
    setText(this.#said, '');
    let path = '', name = '';
    try {
      const fields = this.#form.fields();
      path = fields.path;
      name = nameOf(path);
      const loaded = await this.#whileLoading(path, name, this.#connection.ask('LoadFile', fields));
      this.#outcome.replaceChildren(
        element('p', { text: `✓ ${name}: ${loaded.objects} objects, ${loaded.triangles} triangles` }),
        element('ul', { class: 'notes' }, ...loaded.notes.map((text) => element('li', { text }))));
    } catch (error) {
      this.#outcome.replaceChildren();
      setText(this.#said, `✕ ${error.message.replace(path, name)}`);
    }
  }

  /** Shows, until there is an answer, how far a load of this page is, with a button that cancels it. */
  async #whileLoading(path, name, answer) {
    const said = element('span', { text: `◌ ${name} is read …` });
    const bar = element('progress', { max: 1, 'aria-label': name });
    let own = null;
    const end = () => this.#connection.ask('CancelLoad', { load: own }).catch(() => {});
    const cancel = element('button', { type: 'button', text: '✕ Cancel', 'aria-label': `Cancel ${name}`, hidden: true,
                                       onclick: end });
    this.#outcome.replaceChildren(element('p', { class: 'loading' }, said, bar, cancel));
    const look = async () => {
      try {
        const { loads } = await this.#connection.ask('GetLoads');
        const load = loads.find((one) => one.yours && one.path === path);
        if (!load) return;
        own = load.load;
        cancel.hidden = load.stage === 'appearing';
        setText(said, `◌ ${name}: ${load.stage}, ${Math.round(load.seconds)} s`);
        if (load.part >= 0) bar.value = load.part;
        else bar.removeAttribute('value');
      } catch {
        // The load itself says what is wrong.
      }
    };
    const timer = setInterval(look, 500);
    try {
      return await answer;
    } finally {
      clearInterval(timer);
    }
  }

  async #remove(name) {
    if (!await this.#dialog.ask(`Remove ${name} from the server?`, 'Remove',
                                element('p', { text: 'What the scene has loaded of it stays; films do not.' }))) return;
    try {
      await transfer({ method: 'DELETE', path: uploadPath(name) }).done;
      setText(this.#said, '');
    } catch (error) {
      setText(this.#said, `✕ ${error.message}`);
    }
    await this.#lookForRoom();
    await this.#folders.refresh();
  }

  /** A file that comes out of the wall. */
  #out(title, path, name) {
    const said = element('span', { class: 'muted', role: 'status' });
    let running = null;
    const button = element('button', { type: 'button', text: `↓ ${title}`, onclick: async () => {
      if (running) return running.stop();
      running = transfer({ method: 'GET', path, answers: 'blob' },
                         (part, bytes) => setText(said, `${sizeText(bytes)} …`));
      said.className = 'muted';
      setText(said, '…');
      setText(button, `✕ Stop: ${title}`);
      try {
        const blob = await running.done;
        keepAsFile(blob, name);
        setText(said, `✓ ${sizeText(blob.size)}`);
      } catch (error) {
        said.className = 'said';
        setText(said, `✕ ${error.message}`);
      }
      running = null;
      setText(button, `↓ ${title}`);
    } });
    return element('p', { class: 'out' }, button, said);
  }
}
