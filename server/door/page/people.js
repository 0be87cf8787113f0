// Who else is here: a number in the header, and a dialog with names and roles.
import { element, seen, setChildren, setText } from './elements.js';

export class People {
  #connection;
  #you = '';
  #count = 0;
  #list = element('ul', { class: 'people' });
  #said = element('p', { class: 'muted', role: 'status' });
  #dialog;
  /** To be placed in the header. */
  button = element('button', { type: 'button', id: 'identity', class: 'identity', 'aria-haspopup': 'dialog',
                               hidden: true, onclick: () => this.#open() });

  /**
   * @param {import('./connection.js').Connection} connection
   * @param {import('./wall-status.js').WallStatus} status
   */
  constructor(connection, status) {
    this.#connection = connection;
    const close = element('button', { type: 'button', text: 'Close', onclick: () => this.#dialog.close() });
    this.#dialog = element('dialog', { 'aria-labelledby': 'people-title' },
                           element('h2', { id: 'people-title', text: 'Who is here' }), this.#said, this.#list, close);
    this.#dialog.addEventListener('click', (event) => {
      if (event.target === this.#dialog) this.#dialog.close();  // beside it
    });
    document.body.append(this.#dialog);
    connection.addEventListener('open', () => this.#askWho());
    connection.addEventListener('lost', () => this.#say(this.#you, 0));
    status.addEventListener('states', ({ detail }) => {
      this.#say(this.#you, detail.applications);
      if (this.#dialog.open) this.#load();
    });
  }

  async #askWho() {
    try {
      const { name, role } = await this.#connection.ask('WhoAmI');
      // Without a key or a token of one's own the name is this page's.
      this.#say(name === 'console' ? `You: ${role}` : `You: ${name}, ${role}`, this.#count);
    } catch {
      // Lost again: the banner says so.
    }
  }
  #say(you, count) {
    this.#you = you;
    this.#count = count;
    this.button.hidden = you === '';
    setText(this.button, count > 1 ? `${you} · ${count} here` : you);
  }

  #open() {
    this.#dialog.showModal();
    this.#load();
  }
  async #load() {
    try {
      const { people, left_out } = await this.#connection.ask('GetPeople');
      setText(this.#said, left_out > 0 ? `These, and ${left_out} more.` : '');
      setChildren(this.#list, people.map((person, i) => row(this.#list.children[i], person)));
    } catch (error) {
      setText(this.#said, `✕ ${error.message}`);
    }
  }
}

/** @param {Element | undefined} node one that is there, or none yet */
function row(node, { name, program, role, seconds, you }) {
  const item = node ?? element('li', {}, element('span', { class: 'name' }), element('span', { class: 'muted' }));
  setText(item.firstChild, `${seen(name || program)}${you ? ' (you)' : ''}`);
  setText(item.lastChild, [role, name ? seen(program) : '', `for ${inWords(seconds)}`].filter(Boolean).join(', '));
  return item;
}

function inWords(seconds) {
  if (seconds < 90) return `${Math.round(seconds)} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  return `${Math.round(seconds / 3600)} h`;
}
