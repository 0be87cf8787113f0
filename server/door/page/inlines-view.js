// Files that nodes of the scene hold: which are there, which load, why one failed.
import { element, setText } from './elements.js';
import { ListView } from './list-view.js';

const kRowsAtOnce = 50;
const kSigns = { there: ['✓', 'good'], loading: ['◌', 'warn'], waiting: ['○', 'warn'], failed: ['✕', 'bad'] };

/** @param {import('./schema.js').Type} type */
const holdsFile = ({ fields }) => ['file', 'load', 'state', 'problem']
  .every((name) => fields.some((field) => field.name === name));

class InlineRow {
  #listed = null;
  #sign = element('span', { class: 'sign', 'aria-hidden': 'true' });
  #name = element('span', { class: 'name' });
  #state = element('span', { class: 'state' });
  #file = element('span', { class: 'muted file' });
  #problem = element('p', { class: 'said' });
  #wanted = element('input', { type: 'checkbox', role: 'switch' });

  /** @param {{scene: import('./scene.js').Scene, mayEdit: boolean, onSelect: (node: number) => void,
   *     listed: import('./core-list.js').Listed}} options */
  constructor({ scene, mayEdit, onSelect, listed }) {
    const show = element('button', { type: 'button', class: 'link', onclick: () => onSelect(listed.node) }, this.#name);
    const what = element('div', { class: 'what' }, show, this.#file);
    this.node = element('li', { class: 'inline' }, this.#sign, what, this.#state);
    if (mayEdit) this.node.append(element('label', { class: 'flag' }, this.#wanted, 'Wanted'));
    this.node.append(this.#problem);
    this.#wanted.setAttribute('aria-label', `${listed.label}, wanted`);
    this.#wanted.addEventListener('change', async () => {
      try {
        await scene.set(this.#listed.core, 'wanted', this.#wanted.checked);
      } catch (error) {
        setText(this.#problem, `✕ ${error.message}`);
        this.#wanted.checked = this.#listed.values.wanted;
      }
    });
  }

  /** @param {import('./core-list.js').Listed} listed */
  show(listed) {
    const { label, type, values } = listed;
    this.#listed = listed;
    const [sign, tone] = kSigns[values.state] ?? ['?', 'warn'];
    this.node.dataset.tone = tone;
    setText(this.#sign, sign);
    setText(this.#name, label);
    const when = values.load === 'near' ? `near ${values.distance}` : values.load;
    setText(this.#file, `${type.name}, ${when}: ${values.file}`);
    setText(this.#state, values.state);
    setText(this.#problem, values.problem ? `✕ ${values.problem}` : '');
    this.#wanted.checked = values.wanted;
    this.#wanted.parentElement?.toggleAttribute('hidden', values.load === 'at-once');
  }
}

export class InlinesView {
  #list;
  /** Whether its person may edit. */
  mayEdit = false;

  /**
   * @param {import('./scene.js').Scene} scene
   * @param {import('./schema.js').Schema} schema
   * @param {import('./scene-watch.js').SceneWatch} watch
   * @param {import('./wall-status.js').WallStatus} status
   * @param {(node: number) => void} onSelect
   */
  constructor(scene, schema, watch, status, onSelect) {
    this.#list = new ListView(scene, schema, watch, status, {
      isListed: holdsFile, size: kRowsAtOnce, none: 'No node of this scene holds another file.',
      makeRow: (listed) => new InlineRow({ scene, mayEdit: this.mayEdit, onSelect, listed }),
    });
    this.node = this.#list.node;
  }

  set isShown(isShown) {
    this.#list.isShown = isShown;
  }
  reset() {
    this.#list.reset();
  }
}
