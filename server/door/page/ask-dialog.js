// A question that is asked once, before something happens that others see.
import { element, freshId, setText } from './elements.js';

export class AskDialog {
  #title = element('h2', { id: freshId('ask') });
  #body = element('div', { class: 'ask-body' });
  #yes = element('button', { class: 'yes', value: 'yes' });
  #no = element('button', { type: 'button', text: 'Not now', onclick: () => this.node.close() });
  #answer = () => {};

  constructor() {
    const form = element('form', { method: 'dialog' }, this.#title, this.#body,
                         element('div', { class: 'tools' }, this.#yes, this.#no));
    this.node = element('dialog', { 'aria-labelledby': this.#title.id }, form);
    this.node.addEventListener('close', () => {
      const answer = this.#answer;
      this.#answer = () => {};
      answer(this.node.returnValue === 'yes');
    });
  }

  /**
   * @param {string} title @param {string} yes what happens
   * @param {...Node} body
   * @returns {Promise<boolean>} whether it shall; another question meanwhile stands for no
   */
  ask(title, yes, ...body) {
    this.#answer(false);
    setText(this.#title, title);
    setText(this.#yes, yes);
    this.#body.replaceChildren(...body);
    this.node.returnValue = '';
    // Not closed first: that is told later, and would answer this question.
    if (this.node.open) this.#no.focus();
    else this.node.showModal();
    return new Promise((resolve) => {
      this.#answer = resolve;
    });
  }
}
