// One tile in the picture of the wall: its picture, what its host does, and a dialog with its numbers.
import { element, setText } from './elements.js';
import { signOf } from './wall-status.js';

/** A button in the mosaic. */
export class TileButton {
  #canvas = element('canvas');
  #label = element('span', { class: 'tile-label' });

  /**
   * @param {string} name of the tile
   * @param {() => void} onOpen
   */
  constructor(name, onOpen) {
    this.name = name;
    this.node = element('button', { type: 'button', class: 'tile', onclick: onOpen }, this.#canvas, this.#label);
    this.showState('absent');
  }

  /** @param {import('./unfold.js').PlacedTile} place @param {import('./unfold.js').Sheet} sheet */
  place(place, sheet) {
    const percent = (part, whole) => `${(100 * part) / whole}%`;
    Object.assign(this.node.style, {
      left: percent(place.x, sheet.width),
      top: percent(place.y, sheet.height),
      width: percent(place.width, sheet.width),
      height: percent(place.height, sheet.height),
    });
  }

  /** @param {ImageBitmap} picture is closed */
  showPicture(picture) {
    if (this.#canvas.width !== picture.width || this.#canvas.height !== picture.height) {
      this.#canvas.width = picture.width;
      this.#canvas.height = picture.height;
    }
    this.#canvas.getContext('2d').drawImage(picture, 0, 0);
    picture.close();
  }

  /** @param {string} state of its host */
  showState(state) {
    const { sign, tone } = signOf(state);
    this.node.dataset.tone = tone;
    setText(this.#label, state === 'live' ? sign : `${sign} ${state}`);
    this.node.setAttribute('aria-label', `Tile ${this.name}: ${state}`);
  }
}

/** Its numbers, as long as it is open. */
export class TileDialog {
  #list = element('dl', { class: 'numbers' });
  #title = element('h2', { id: 'tile-title' });
  #facts = () => [];

  constructor() {
    const close = element('button', { type: 'button', text: 'Close', onclick: () => this.node.close() });
    this.node = element('dialog', { 'aria-labelledby': 'tile-title' }, this.#title, this.#list, close);
    this.node.addEventListener('click', (event) => {
      if (event.target === this.node) this.node.close();  // beside it
    });
  }

  /** @param {string} title @param {() => [string, string][]} facts are asked for again and again */
  open(title, facts) {
    setText(this.#title, title);
    this.#facts = facts;
    this.#list.replaceChildren();
    this.node.showModal();
    this.refresh();
  }

  refresh() {
    if (!this.node.open) return;
    const facts = this.#facts();
    while (this.#list.children.length < 2 * facts.length) this.#list.append(element('dt'), element('dd'));
    while (this.#list.children.length > 2 * facts.length) this.#list.lastChild.remove();
    facts.forEach(([name, value], i) => {
      setText(this.#list.children[2 * i], name);
      setText(this.#list.children[2 * i + 1], value);
    });
  }
}
