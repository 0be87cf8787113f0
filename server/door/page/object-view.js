// An object with its fields; a node with those of its core.
import { Chooser } from './chooser.js';
import { FieldRow } from './field-row.js';
import { element, seen, setChildren, setText } from './elements.js';
import { MaterialPreview } from './material-preview.js';
import { NodeTools } from './node-tools.js';
import { valuesOf } from './schema.js';

export class ObjectView {
  #scene;
  #schema;
  #id = 0;
  #shape = '';  // what the rows are for
  #what = '';   // the object, as people know it
  #isDoubted = false;  // behind its number there may be another one
  #rows = new Map();
  #previews = new Map();  // object -> MaterialPreview
  #chooser;
  #tools;
  #title = element('h2', { tabindex: '-1', text: 'Nothing selected' });
  #path = element('p', { class: 'muted path' });
  #body = element('div');
  /** Whether its person may edit. */
  mayEdit = false;

  /**
   * @param {import('./scene.js').Scene} scene
   * @param {import('./schema.js').Schema} schema
   * @param {(node: number) => void} onMade where a node has come, or gone: what to look at now
   */
  constructor(scene, schema, onMade) {
    this.#scene = scene;
    this.#schema = schema;
    this.#chooser = new Chooser(scene, schema);
    this.#tools = new NodeTools(scene, schema, onMade);
    this.node = element('section', { class: 'object', 'aria-live': 'off' }, this.#title, this.#path, this.#tools.node,
                        this.#body, this.#chooser.node);
  }

  /** @param {number} id */
  async open(id) {
    this.#id = id;
    this.#isDoubted = false;
    await this.refresh();
    if (this.#id !== id) return;
    this.#title.focus({ preventScroll: true });
    // Where the tree stands above it, it would have been changed out of sight.
    if (this.node.getBoundingClientRect().top > innerHeight / 2) this.node.scrollIntoView();
  }

  /** What is shown; 0: nothing. */
  get id() {
    return this.#id;
  }
  /** Another server may answer next, whose numbers mean other objects. */
  doubt() {
    this.#isDoubted = true;
  }

  async refresh() {
    const id = this.#id;
    if (!id) return;
    const [told, types] = await Promise.all([this.#scene.object(id), this.#schema.types]);
    if (id !== this.#id) return;
    const what = told && JSON.stringify([told.path, told.objects.map(({ type }) => type)]);
    const isOther = this.#isDoubted && what !== this.#what;
    this.#isDoubted = false;
    this.#what = what;
    if (isOther) this.#id = 0;
    if (!told || isOther) {
      setText(this.#title, `#${id} is gone`);
      setText(this.#path, '');
      this.#tools.show(null);
      this.#chooser.cancel();
      this.#body.replaceChildren();
      this.#shape = '';
      return;
    }
    const name = told.objects[0]?.fields.get('name');
    setText(this.#title, seen(name ?? '') || `${told.objects[0]?.type ?? 'Object'} #${id}`);
    setText(this.#path, told.path.startsWith('/') ? seen(told.path) : '');
    this.#tools.show(this.mayEdit && told.objects[0]?.type === 'Node' ? { id, name: name ?? '' } : null);
    const shape = JSON.stringify([this.mayEdit, told.objects.map((object) => [object.id, object.type])]);
    if (shape !== this.#shape) this.#build(told.objects, types);
    this.#shape = shape;
    for (const object of told.objects) {
      const type = types.get(object.type);
      const values = type ? valuesOf(object, type) : {};
      for (const [field, value] of Object.entries(values)) this.#rows.get(`${object.id} ${field}`)?.show(value);
      this.#previews.get(object.id)?.show(values, type);
    }
  }

  #build(objects, types) {
    this.#rows.clear();
    this.#previews.clear();
    setChildren(this.#body, objects.map((object) => {
      const rows = (types.get(object.type)?.fields ?? []).map((field) => {
        const row = new FieldRow(field, {
          propose: this.mayEdit ? (value, gesture) => this.#propose(object, field, value, gesture) : null,
          newGesture: () => this.#scene.newGesture(),
          onVisit: (id) => this.open(id).catch(() => {}),
          choose: (field) => this.#chooser.choose(field),
        });
        this.#rows.set(`${object.id} ${field.name}`, row);
        return row.node;
      });
      if (object.type === 'Material') this.#previews.set(object.id, new MaterialPreview());
      const none = element('p', { class: 'muted', text: 'It has no fields.' });
      return element('section', {}, element('h3', { text: `${object.type} #${object.id}` }),
                     ...(object.type === 'Material' ? [this.#previews.get(object.id).node] : []),
                     ...(rows.length > 0 ? rows : [none]));
    }));
  }

  async #propose(object, field, value, gesture) {
    const committed = await this.#scene.set(object, field.name, value, gesture);
    this.refresh().catch(() => {});
    return committed;
  }
}
