// An object with its fields; a node with those of its core.
import { FieldRow } from './field-row.js';
import { element, setChildren, setText } from './elements.js';

export class ObjectView {
  #scene;
  #schema;
  #id = 0;
  #shape = '';  // what the rows are for
  #rows = new Map();
  #title = element('h2', { tabindex: '-1', text: 'Nothing selected' });
  #path = element('p', { class: 'muted path' });
  #body = element('div');
  /** Whether its person may edit. */
  mayEdit = false;

  /**
   * @param {import('./scene.js').Scene} scene
   * @param {import('./schema.js').Schema} schema
   */
  constructor(scene, schema) {
    this.#scene = scene;
    this.#schema = schema;
    this.node = element('section', { class: 'object', 'aria-live': 'off' }, this.#title, this.#path, this.#body);
  }

  /** @param {number} id */
  async open(id) {
    this.#id = id;
    await this.refresh();
    if (this.#id !== id) return;
    this.#title.focus({ preventScroll: true });
    // Where the tree stands above it, it would have been changed out of sight.
    if (this.node.getBoundingClientRect().top > innerHeight / 2) this.node.scrollIntoView();
  }

  async refresh() {
    const id = this.#id;
    if (!id) return;
    const [told, types] = await Promise.all([this.#scene.object(id), this.#schema.types]);
    if (id !== this.#id) return;
    if (!told) {
      setText(this.#title, `#${id} is gone`);
      setText(this.#path, '');
      this.#body.replaceChildren();
      this.#shape = '';
      return;
    }
    const name = told.objects[0]?.fields.get('name');
    setText(this.#title, name || `${told.objects[0]?.type ?? 'Object'} #${id}`);
    setText(this.#path, told.path.startsWith('/') ? told.path : '');
    const shape = JSON.stringify([this.mayEdit, told.objects.map((object) => [object.id, object.type])]);
    if (shape !== this.#shape) this.#build(told.objects, types);
    this.#shape = shape;
    for (const object of told.objects)
      for (const field of types.get(object.type)?.fields ?? [])
        this.#rows.get(`${object.id} ${field.name}`)?.show(object.fields.has(field.name) ? object.fields.get(field.name)
                                                                                          : field.default);
  }

  #build(objects, types) {
    this.#rows.clear();
    setChildren(this.#body, objects.map((object) => {
      const rows = (types.get(object.type)?.fields ?? []).map((field) => {
        const row = new FieldRow(field, {
          propose: this.mayEdit ? (value, gesture) => this.#propose(object, field, value, gesture) : null,
          newGesture: () => this.#scene.newGesture(),
          onVisit: (id) => this.open(id).catch(() => {}),
        });
        this.#rows.set(`${object.id} ${field.name}`, row);
        return row.node;
      });
      return element('section', {}, element('h3', { text: `${object.type} #${object.id}` }), ...rows);
    }));
  }

  async #propose(object, field, value, gesture) {
    const committed = await this.#scene.set(object, field.name, value, gesture);
    this.refresh().catch(() => {});
    return committed;
  }
}
