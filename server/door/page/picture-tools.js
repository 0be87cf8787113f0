// What a press on the picture of the wall does: a tool at a time, chosen above it.
import { Aiming } from './aiming.js';
import { DragTool } from './drag-tool.js';
import { element, setChildren, setText } from './elements.js';
import { FlyTool } from './fly-tool.js';
import { MeasureTool } from './measure-tool.js';
import { PickTool } from './pick-tool.js';
import { Surface } from './surface.js';

/** Tiles are pressed themselves: they show their numbers. */
class LookTool {
  name = 'Look';
  hint = 'Press a tile for its numbers.';
  node = element('div');
  begin() {}
  end() {}
}

export class PictureTools {
  #connection;
  #aiming;
  #surfaces = [];
  #tools;
  #tool;
  #isShown = false;
  #isBegun = false;
  #isLooking = false;
  #bar = element('div', { class: 'bar', role: 'group', 'aria-label': 'What a press on the picture does' });
  #hint = element('p', { class: 'muted' });
  #said = element('p', { class: 'said', role: 'alert' });
  #keys = element('p', { class: 'muted' });
  #buttons = new Map();
  /** Above the picture: which tool. */
  node = element('section', { class: 'picture-tools', 'aria-label': 'Tools for the picture' }, this.#bar, this.#hint);
  /** Beside it, or below: what the tool says, and what else it does. */
  side = element('section', { class: 'tool-side', 'aria-label': 'Tool' });

  /**
   * @param {import('./connection.js').Connection} connection
   * @param {import('./wall-status.js').WallStatus} status
   * @param {(node: number) => void} showInScene
   */
  constructor(connection, status, showInScene) {
    this.#connection = connection;
    this.#aiming = new Aiming(connection);
    const around = {
      connection, status, showInScene, aiming: this.#aiming,
      say: (what) => setText(this.#said, what ? `✕ ${what}` : ''),
      surfaces: () => this.#surfaces,
      showMarks: () => this.#showMarks(),
    };
    const pick = new PickTool(around);
    this.#tools = [new LookTool(), pick, new MeasureTool(around), new DragTool(around),
                   new FlyTool(around, () => pick.found)];
    for (const tool of this.#tools) {
      const choose = () => this.#choose(tool);
      this.#buttons.set(tool, element('button', { type: 'button', text: tool.name, onclick: choose }));
    }
    this.#offer([]);
    this.#choose(this.#tools[0]);
    connection.addEventListener('open', () => this.#onOpen());
    connection.addEventListener('lost', () => this.#end());
    status.addEventListener('status', () => this.#lookAgain());
  }

  set isShown(isShown) {
    this.#isShown = isShown;
    if (isShown) this.#begin();
    else this.#end();
  }

  /** The picture is made anew. */
  uncover() {
    this.#end();
    this.#surfaces = [];
  }
  /** @param {HTMLElement} area @param {import('./unfold.js').Sheet} sheet what is seen there */
  cover(area, sheet) {
    const surface = new Surface(sheet);
    this.#surfaces.push(surface);
    area.append(surface.node);
    for (const event of ['press', 'move', 'release', 'cancel'])
      surface.addEventListener(event, ({ detail: { aim } }) => this.#tool[event]?.(aim));
  }
  /** All of it is covered. */
  begin() {
    this.#begin();
  }

  /** Who may not edit sees no tool for it. */
  async #onOpen() {
    try {
      const { role } = await this.#connection.ask('WhoAmI');
      this.#offer(this.#tools.filter((tool) => !tool.edits || role !== 'viewer'));
      this.#begin();
    } catch {
      // Lost again.
    }
  }
  #offer(tools) {
    if (this.#tool && tools.length > 0 && !tools.includes(this.#tool)) this.#choose(tools[0]);
    setChildren(this.#bar, tools.map((tool) => this.#buttons.get(tool)));
  }

  #choose(tool) {
    this.#end();
    this.#tool = tool;
    for (const [other, button] of this.#buttons) button.setAttribute('aria-pressed', String(other === tool));
    setText(this.#hint, tool.hint);
    setText(this.#said, '');
    setText(this.#keys, tool.keys ?? '');
    setChildren(this.side, [this.#said, tool.node, this.#keys]);
    this.side.hidden = tool.name === 'Look';
    this.#begin();
  }
  #begin() {
    const isLooking = this.#tool.name === 'Look';
    for (const surface of this.#surfaces) {
      surface.mode = this.#tool.surface ?? 'press';
      surface.label = isLooking ? null : `${this.#tool.name} on the picture. ${this.#tool.keys ?? ''}`;
    }
    if (this.#isBegun || !this.#isShown || !this.#connection.isOpen) return;
    this.#isBegun = true;
    this.#tool.begin();
    this.#showMarks();
  }
  /** Whatever is held is let go. */
  #end() {
    if (!this.#isBegun) return;
    this.#isBegun = false;
    for (const surface of this.#surfaces) surface.letGo();
    this.#tool.end();
    for (const surface of this.#surfaces) surface.show([], null);
  }

  #showMarks() {
    const plan = this.#aiming.plan;
    const points = (plan?.position && this.#tool.marks) || [];
    for (const surface of this.#surfaces) surface.show(points, plan);
  }
  /** Marks stay on what they mark while the wall moves. */
  async #lookAgain() {
    if (!this.#isBegun || this.#isLooking || !this.#tool.marks?.length) return;
    this.#isLooking = true;
    try {
      await this.#aiming.look();
      this.#showMarks();
    } catch {
      // They stay where they are.
    }
    this.#isLooking = false;
  }
}
