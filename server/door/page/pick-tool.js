// What stands at a place of the picture: its path, how far away it is, and the way to its fields.
import { lengthText, pointText } from './aiming.js';
import { element, setText } from './elements.js';
import { Newest } from './newest.js';

export class PickTool {
  name = 'Pick';
  hint = 'Press what you want to know about.';
  keys = 'Keys on the picture: arrows lead a cross, Enter picks.';
  /** @type {import('./aiming.js').Thing | null} the newest */
  found = null;
  #around;
  #newest = new Newest();
  #label = element('p', { class: 'path', role: 'status' });
  #facts = element('p', { class: 'muted' });
  #show;
  node;

  constructor(around) {
    this.#around = around;
    this.#show = element('button', { type: 'button', text: 'Show in Scene', hidden: true,
                                     onclick: () => around.showInScene(this.found.node) });
    around.connection.addEventListener('lost', () => {
      if (this.found) this.#tell(null, '');
    });
    this.node = element('div', { class: 'found' }, this.#label, this.#facts, this.#show);
  }

  get marks() {
    return this.found ? [this.found.point] : [];
  }
  begin() {}
  end() {
    this.#newest.drop();
  }
  press(aim) {
    if (!aim) return this.#tell(null);
    this.#newest.send(() => this.#pick(aim));
  }

  async #pick(aim) {
    const { aiming, say } = this.#around;
    try {
      this.#tell(await aiming.pick(await aiming.ray(aim)));
      say('');
    } catch (error) {
      say(error.message);
    }
  }
  #tell(found, none = 'Nothing stands there.') {
    this.found = found;
    setText(this.#label, found ? found.label : none);
    const distance = found && lengthText(found.distance, this.#around.aiming.plan);
    setText(this.#facts, found ? `#${found.node} · ${distance} from the eye · at ${pointText(found.point)}` : '');
    this.#show.hidden = !found;
    this.#around.showMarks();
  }
}
