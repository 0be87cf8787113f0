// What goes wrong, as it happens: the newest first.
import { element, setText } from './elements.js';
import { signOf } from './wall-status.js';

const kMost = 100;

export class FaultList {
  #list = element('ol', { class: 'faults', 'aria-live': 'polite' });
  #none = element('p', { class: 'muted', text: 'None since this page was opened.' });
  #states = new Map();  // of hosts
  #held = new Set();    // hosts that show an earlier frame
  #trouble = '';

  /**
   * @param {import('./connection.js').Connection} connection
   * @param {import('./wall-status.js').WallStatus} status
   */
  constructor(connection, status) {
    this.node = element('section', {}, element('h2', { text: 'Faults' }), this.#none, this.#list);
    status.addEventListener('status', ({ detail }) => this.#onStatus(detail));
    status.addEventListener('frame', ({ detail }) => this.#onFrame(detail));
    status.addEventListener('restarted', () => this.#tell('The server was started again', 'joining'));
    let isLost = false;
    connection.addEventListener('lost', () => {
      if (!isLost) this.#tell('Connection to the wall lost', 'lost');
      isLost = true;
      this.#states.clear();
    });
    connection.addEventListener('open', () => {
      if (isLost) this.#tell('Connected again', 'live');
      isLost = false;
    });
  }

  #onStatus(status) {
    for (const { name, state } of status.hosts) {
      const before = this.#states.get(name);
      this.#states.set(name, state);
      if (before === state || (before === undefined && state === 'live')) continue;
      this.#tell(before === undefined ? `Host ${name} is ${state}` : `Host ${name}: ${before}, now ${state}`, state);
    }
    if (status.journal_trouble && status.journal_trouble !== this.#trouble)
      this.#tell(`No edits are taken: ${status.journal_trouble}`, 'lost');
    this.#trouble = status.journal_trouble;
  }

  #onFrame({ frame, held }) {
    for (const name of held)
      if (!this.#held.has(name)) this.#tell(`Host ${name} missed frame ${frame} and shows an earlier one`, 'late');
    this.#held = new Set(held);
  }

  #tell(what, state) {
    const { sign, tone } = signOf(state);
    const mark = element('span', { class: 'sign' });
    mark.dataset.tone = tone;
    setText(mark, sign);
    const time = element('time', { text: new Date().toLocaleTimeString('en-GB') });
    this.#list.prepend(element('li', {}, time, mark, element('span', { text: what })));
    while (this.#list.children.length > kMost) this.#list.lastChild.remove();
    this.#none.hidden = true;
  }
}
