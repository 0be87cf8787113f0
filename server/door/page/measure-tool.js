// How far it is from a picked point to another one, or to the nearest surface of a thing.
import { lengthText, pointText, written } from './aiming.js';
import { element, setText } from './elements.js';
import { Newest } from './newest.js';

export class MeasureTool {
  name = 'Measure';
  hint = 'Press two places: the line between them is measured.';
  keys = 'Keys on the picture: arrows lead a cross, Enter sets a point.';
  #around;
  #newest = new Newest();
  #from = null;      // a Thing
  #measured = null;  // the wall's answer
  #to = element('select', {}, element('option', { value: 'point', text: 'the second point' }),
                element('option', { value: 'surface', text: 'the nearest place of a thing' }));
  #result = element('p', { class: 'measured', role: 'status' });
  #facts = element('p', { class: 'muted' });
  node;

  constructor(around) {
    this.#around = around;
    const again = element('button', { type: 'button', text: 'Start again', onclick: () => this.#startAgain() });
    this.node = element('div', { class: 'found' },
                        element('div', { class: 'bar' }, element('label', { class: 'labelled' }, 'To ', this.#to),
                                again),
                        this.#result, this.#facts);
    around.connection.addEventListener('lost', () => this.#startAgain());
    this.#tell();
  }

  get marks() {
    if (this.#measured) return [this.#measured.from, this.#measured.to];
    return this.#from ? [this.#from.point] : [];
  }
  begin() {}
  end() {
    this.#newest.drop();
  }
  press(aim) {
    if (aim) this.#newest.send(() => this.#take(aim));
    else this.#around.say('There is no tile.');
  }

  #startAgain() {
    this.#newest.drop();
    this.#from = this.#measured = null;
    this.#around.say('');
    this.#tell();
  }
  async #take(aim) {
    const { aiming, connection, say } = this.#around;
    try {
      const thing = await aiming.pick(await aiming.ray(aim));
      say(thing ? '' : 'Nothing stands there.');
      if (!thing) return;
      if (!this.#from || this.#measured) {
        this.#from = thing;
        this.#measured = null;
      } else {
        const end = this.#to.value === 'surface' ? { node: thing.node } : { to: thing.point };
        const measured = await connection.ask('MeasureDistance', { from: this.#from.point, ...end });
        this.#measured = { ...measured, label: thing.label };
      }
      this.#tell();
    } catch (error) {
      say(error.message);
    }
  }
  #tell() {
    if (this.#measured) {
      const { from, to, distance, error, label } = this.#measured, { plan } = this.#around.aiming;
      setText(this.#result, lengthText(distance, plan));
      setText(this.#facts, `From ${this.#from.label} at ${pointText(from)} to ${label} at ${pointText(to)}` +
                           (error > 0 ? `; true to ${written(error)} units` : ''));
    } else {
      setText(this.#result, this.#from ? 'Now the second place.' : 'Now the first place.');
      setText(this.#facts, this.#from ? `From ${this.#from.label} at ${pointText(this.#from.point)}` : '');
    }
    this.#around.showMarks();
  }
}
