// Leads a thing about in the plane that is parallel to its screen; or a manipulator's handle, where one is pressed.
import { normalOf, onPlane, rayOf, written } from './aiming.js';
import { element, setText } from './elements.js';
import { Scene } from './scene.js';
import { Stoppers } from './stoppers.js';
import { inAxes, length, minus, plus } from './vectors.js';

const kWorldAxes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const kNamePeriod = 250;  // ms between two questions about who is in the way
const kMostWaiting = 2;  // presses, behind one that the wall has not answered yet

export class DragTool {
  name = 'Drag';
  hint = 'Press a thing, or a handle, and drag. What stands in its way stops it.';
  keys = 'Keys on the picture: arrows lead a cross, Enter takes hold and lets go, Escape lets go.';
  edits = true;
  surface = 'drag';
  #around;
  #scene;
  #stoppers;
  #grabs = [];  // the one that is under way, and those behind it; of each the newest aim counts
  #isBusy = false;
  #label = element('p', { class: 'path', role: 'status' });
  #stopped = element('p', { class: 'stopped', role: 'status' });
  #undo;
  node;

  constructor(around) {
    this.#around = around;
    this.#scene = new Scene(around.connection);
    this.#stoppers = new Stoppers(around.connection);
    this.#undo = element('button', { type: 'button', text: '↶ Undo', hidden: true, onclick: () => this.#takeBack() });
    this.node = element('div', { class: 'found' }, this.#label, this.#stopped, this.#undo);
  }

  begin() {}
  end() {
    this.release();
  }

  press(aim) {
    this.#around.say('');
    setText(this.#stopped, '');
    setText(this.#label, aim ? '' : 'There is no tile.');
    if (!aim) return;
    if (this.#grabs.length > kMostWaiting) return;
    this.#grabs.push({ aim, led: aim, isTaken: false, isOver: false, what: '', lead: null, release: null,
                       namedAt: -Infinity, unnamed: null });
    this.#work();
  }
  move(aim) {
    const grab = this.#grabs.at(-1);
    if (!aim || !grab || grab.isOver) return;
    grab.aim = aim;
    this.#work();
  }
  /** Where the hand was last it comes to lie, and then it is let go. */
  release() {
    const grab = this.#grabs.at(-1);
    if (!grab) return;
    grab.isOver = true;
    this.#work();
  }
  cancel() {
    this.release();
  }

  /** One request at a time: where the hand has gone meanwhile, the next one leads to where it is then. */
  async #work() {
    if (this.#isBusy) return;
    this.#isBusy = true;
    for (let grab = this.#grabs[0]; grab; grab = this.#grabs[0]) {
      if (!grab.isTaken) {
        grab.isTaken = true;
        await this.#quietly(grab, () => this.#take(grab));
      } else if (grab.lead && grab.led !== grab.aim) {
        grab.led = grab.aim;
        await this.#quietly(grab, () => this.#lead(grab));
      } else if (grab.isOver) {
        this.#grabs.shift();
        if (grab.unnamed) await this.#quietly(grab, () => this.#name(grab, grab.unnamed));
        await this.#quietly(grab, () => grab.release?.());
      } else {
        break;
      }
    }
    this.#isBusy = false;
  }

  async #take(grab) {
    const { aiming, connection } = this.#around;
    const ray = await aiming.ray(grab.led);  // where it was pressed: the hand may be elsewhere by now
    const handle = await connection.ask('GrabHandle', { ray });
    if (handle.hit) {
      grab.release = () => connection.ask('ReleaseHandle');
      grab.lead = () => connection.ask('DragHandle', { ray: rayOf(aiming.plan, grab.aim) });
      this.#hold(grab, `Handle of ${(await aiming.describe(handle.node)).path}`);
      return;
    }
    const thing = await aiming.pick(ray);
    if (!thing) return setText(this.#label, 'Nothing stands there.');
    if (!thing.movable) return setText(this.#label, `${thing.label} has no Transform: nothing can move it.`);
    await this.#takeThing(grab, thing);
  }

  /** From the hand in the world to the numbers of its Transform, which count in the node above. */
  async #takeThing(grab, thing) {
    const { aiming, connection } = this.#around;
    const [moved, { objects }] = await Promise.all([aiming.describe(thing.movable), this.#scene.object(thing.movable)]);
    const axes = moved.parent ? await this.#axesOf(moved.parent) : kWorldAxes;
    const begin = objects.find(({ type }) => type === 'Transform')?.fields.get('translation') ?? [0, 0, 0];
    const normal = normalOf(aiming.plan, grab.led), gesture = this.#scene.newGesture();
    this.#hold(grab, moved.path);
    grab.lead = async () => {
      const ray = rayOf(aiming.plan, grab.aim), to = ray && onPlane(ray, thing.point, normal);
      const way = to && inAxes(minus(to, thing.point), axes);
      if (!way) return null;
      const translation = plus(begin, way);
      const done = await connection.ask('MoveNode', { node: thing.movable, translation, gesture });
      // Where it was stopped it is not where the hand is.
      const far = `: ${written(length(minus(to, thing.point)))} units from where it was`;
      setText(this.#label, done.stopped?.length ? moved.path : moved.path + far);
      return done;
    };
  }
  async #axesOf(node) {
    const { x_axis, y_axis, z_axis } = (await this.#around.aiming.describe(node, { paths: false, places: true })).place;
    return [x_axis, y_axis, z_axis];
  }
  #hold(grab, what) {
    grab.what = what;
    setText(this.#label, what);
  }

  async #lead(grab) {
    const done = await grab.lead();
    if (!done) return;
    this.#undo.hidden = false;
    this.#around.say('');
    grab.unnamed = null;
    if (!done.stopped?.length) return setText(this.#stopped, '');
    if (performance.now() - grab.namedAt < kNamePeriod) grab.unnamed = done.stopped;
    else await this.#name(grab, done.stopped);
  }
  async #name(grab, stopped) {
    grab.namedAt = performance.now();
    const by = await this.#stoppers.find(stopped);
    setText(this.#stopped, by.length > 0 ? `■ Stopped by ${by.join(', ')}` : '■ Stopped by a collision');
  }
  async #quietly(grab, ask) {
    try {
      await ask();
    } catch (error) {
      grab.lead = null;  // whoever else has it now keeps it
      this.#around.say(grab.what ? `${grab.what}: ${error.message}` : error.message);
    }
  }
  async #takeBack() {
    try {
      await this.#scene.undo();
      setText(this.#label, 'Taken back.');
      setText(this.#stopped, '');
      this.#around.say('');
    } catch (error) {
      this.#around.say(error.message);
    }
  }
}
