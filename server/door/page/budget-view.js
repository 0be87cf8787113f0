// How long a frame may take, how long it takes, and how much detail is left away for it.
import { numberIn } from './editors.js';
import { element, setText } from './elements.js';

const kOffers = [{ ms: 16.6, text: '60 a second' }, { ms: 33.3, text: '30 a second' }, { ms: 0, text: 'No limit' }];

export class BudgetView {
  #connection;
  #facts = element('dl', { class: 'numbers' });
  #form = element('form', { class: 'budget', hidden: true });
  #input = element('input', { type: 'text', inputmode: 'decimal', autocomplete: 'off', 'aria-label': 'Budget in ms' });
  #bounds = element('span', { class: 'muted' });
  #said = element('p', { class: 'said', role: 'alert' });
  #values = new Map();

  /** @param {import('./connection.js').Connection} connection @param {import('./wall-status.js').WallStatus} status */
  constructor(connection, status) {
    this.#connection = connection;
    for (const name of ['Budget for a frame', 'Frames take', 'Detail', 'Programs of materials']) {
      const value = element('dd', { text: '–' });
      this.#values.set(name, value);
      this.#facts.append(element('dt', { text: name }), value);
    }
    this.#form.append(element('label', { class: 'labelled' }, 'Budget in ms ', this.#input),
                      element('button', { text: 'Set' }),
                      ...kOffers.map(({ ms, text }) => (
                        element('button', { type: 'button', text, onclick: () => this.#set(ms) }))), this.#bounds);
    this.#form.addEventListener('submit', (event) => {
      event.preventDefault();
      this.#set(numberIn(this.#input));
    });
    this.node = element('div', { class: 'object' }, element('h2', { text: 'Budget' }), this.#facts, this.#form,
                        this.#said);
    status.addEventListener('status', ({ detail }) => this.#show(detail));
  }

  /** @param {boolean} maySet @param {string} bounds in words */
  allow(maySet, bounds) {
    this.#form.hidden = !maySet;
    setText(this.#bounds, bounds);
  }

  #show({ budget_ms: budget, detail, frames, programs }) {
    const say = (name, text) => setText(this.#values.get(name), text);
    say('Budget for a frame', budget > 0 ? `${Number(budget.toFixed(3))} ms` : 'no limit: no detail is left away');
    say('Frames take', frames.count > 0 ? `${frames.p99_ms.toFixed(1)} ms at most, 99 of 100; half of them ${
      frames.half_ms.toFixed(1)} ms, since the server has started` : 'none yet');
    say('Detail', detail === 0 ? 'all of it (step 0)' : `step ${detail}: less than all of it`);
    say('Programs of materials', programs.length > 0 ? programs.join('; ') : 'none is bad or heavy');
    if (document.activeElement !== this.#input) this.#input.value = String(Number(budget.toFixed(3)));
  }

  async #set(milliseconds) {
    try {
      await this.#connection.ask('SetBudget', { milliseconds });
      setText(this.#said, '');
      this.#input.value = String(milliseconds);
    } catch (error) {
      setText(this.#said, `✕ ${error.message}`);
    }
  }
}
