// A page of a list of nodes, kept as the scene is while somebody looks: what animations and files have in common.
import { CoreList } from './core-list.js';
import { element, setChildren, setText } from './elements.js';
import { paced } from './scene-watch.js';

const kWhole = 5000;  // ms, between two looks at the whole list; sooner where the scene has more objects, or fewer

/** @typedef {{node: HTMLElement, isPlaying?: boolean, show: (listed: import('./core-list.js').Listed) => void}} Row */

export class ListView {
  #list;
  #makeRow;
  #none;
  #rows = new Map();  // core -> Row
  #isShown = false;
  #counted = '';   // objects of the scene when the whole list was looked at
  #loaded = 0;     // and when that was, in ms
  #body = element('ul', { class: 'listed' });
  #count = element('p', { class: 'muted', role: 'status', tabindex: '-1' });
  #back = element('button', { type: 'button', text: '‹ Back', onclick: () => this.#turn(-1) });
  #on = element('button', { type: 'button', text: 'On ›', onclick: () => this.#turn(1) });
  #load;
  #goOn = paced(async () => {
    if (this.#isShown) await this.#show(() => this.#list.more());
  }, 0, 1);

  /**
   * @param {import('./scene.js').Scene} scene
   * @param {import('./schema.js').Schema} schema
   * @param {import('./scene-watch.js').SceneWatch} watch
   * @param {import('./wall-status.js').WallStatus} status
   * @param {{isListed: (type: import('./schema.js').Type) => boolean, size: number, none: string,
   *     makeRow: (listed: import('./core-list.js').Listed) => Row}} options none: what stands there without any
   */
  constructor(scene, schema, watch, status, { isListed, size, none, makeRow }) {
    this.#list = new CoreList(scene, schema, isListed, size);
    this.#makeRow = makeRow;
    this.#none = none;
    this.#load = paced(() => this.#show(() => {
      this.#loaded = performance.now();
      return this.#list.load();
    }));
    const refresh = paced(() => this.#show(() => this.#list.rows()));
    watch.addEventListener('change', () => {
      if (!this.#isShown) return;
      if (performance.now() - this.#loaded > kWhole) this.#load();
      else refresh();
    });
    status.addEventListener('status', ({ detail }) => {
      const counted = `${detail.objects} ${detail.nodes}`;
      if (this.#isShown && counted !== this.#counted) this.#load();
      // What has come to a stop changes nothing more.
      else if (this.#isShown && [...this.#rows.values()].some((row) => row.isPlaying)) refresh();
      this.#counted = counted;
    });
    this.node = element('div', {}, this.#count, this.#body, element('p', { class: 'tools' }, this.#back, this.#on));
  }

  set isShown(isShown) {
    this.#isShown = isShown;
    if (isShown) this.#load();
  }
  /** Rows are made anew, for another role. */
  reset() {
    this.#rows.clear();
    if (this.#isShown) this.#load();
  }

  #turn(pages) {
    this.#list.move(pages);
    this.#show(() => this.#list.more());
  }
  async #show(ask) {
    try {
      const listed = await ask();
      const rows = new Map();
      for (const one of listed) {
        const row = this.#rows.get(one.core.id) ?? this.#makeRow(one);
        row.show(one);
        rows.set(one.core.id, row);
      }
      this.#rows = rows;
      setChildren(this.#body, [...rows.values()].map((row) => row.node));
      const { first, end, many, isAll } = this.#list.place;
      const range = `${(first + 1).toLocaleString('en')} to ${end.toLocaleString('en')}`;
      const known = many === 0 ? 'None so far: the scene is large.' : `${range}, and there are more`;
      setText(this.#count, !isAll ? known : many === 0 ? this.#none : `${range} of ${many.toLocaleString('en')}`);
      const focused = document.activeElement;
      if (this.#list.isUnfinished) this.#goOn();
      this.#back.hidden = first === 0;
      this.#on.hidden = !this.#list.hasMore;
      // Not on the other one: it would turn back.
      if ([this.#back, this.#on].some((button) => button.hidden && button === focused)) this.#count.focus();
    } catch (error) {
      if (error.code !== 'network') setText(this.#count, `✕ ${error.message}`);
    }
  }
}
