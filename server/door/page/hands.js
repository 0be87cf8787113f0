// What a person does with keys, mouse and fingers, as the whole state that the wall takes from an application
// (common/input/InputState.h): the same keys and the same feel as a window of tessera-client.

const kUnit = 65536;   // a height of the picture, or a click of the wheel
const kFull = 32767;   // all the way
const kLevel = 7, kGrab = 8;  // places in `asked`
const kNear = Math.log(1 / 0.85);  // a click of the wheel nears an orbit by so much
const kThrottle = 2;   // fingers that part to 1.9 times their distance go forward at full speed
const kIdle = 0.3;     // of the throttle: fingers that shift do not keep their distance exactly
const kWheelPixels = 100;  // of a wheel that counts in pixels, a click

/** Keys count by where they are on the keyboard. */
const kAxes = {
  right: [['KeyD', 'ArrowRight'], ['KeyA', 'ArrowLeft']],
  up: [['KeyE', 'PageUp'], ['KeyQ', 'PageDown']],
  back: [['KeyS', 'ArrowDown'], ['KeyW', 'ArrowUp']],
  roll_right: [['KeyC'], ['KeyZ']],
};
const kShift = ['ShiftLeft', 'ShiftRight'];
const kHeldKeys = new Set([...Object.values(kAxes).flat(2), ...kShift]);

export class Hands {
  /** Whether two fingers that part near what is looked at, and do not fly. */
  isOrbit = false;
  #keys = new Set();
  #pointers = new Map();  // id -> {x, y, shifts}
  #throttle = 0;
  #sums = {};   // in parts of a unit
  #cursor = { x: 0.5, y: 0.5 };
  #asked = new Array(28).fill(0);
  #onChange;

  /** @param {() => void} onChange the state is another one */
  constructor(onChange) {
    this.#onChange = onChange;
    this.forget();
  }

  /** The wall knows nothing of this page yet. */
  forget() {
    this.#sums = { look_right: 0, look_down: 0, pan_right: 0, pan_down: 0, wheel: 0 };
    this.#asked.fill(0);
    this.#keys.clear();
    this.#pointers.clear();
    this.#throttle = 0;
  }
  /** Nothing is held any more; what has been done stays done. */
  release() {
    this.#keys.clear();
    this.#pointers.clear();
    this.#throttle = 0;
    this.#onChange();
  }

  /** As a field of NavigateView. */
  get state() {
    const held = (keys) => keys.some((key) => this.#keys.has(key));
    const input = { held: held(kShift) ? 1 : 0, asked: [...this.#asked], cursor_x: Math.round(65535 * this.#cursor.x),
                    cursor_y: Math.round(65535 * this.#cursor.y) };
    for (const [axis, [forth, back]] of Object.entries(kAxes)) {
      const value = Number(held(forth)) - Number(held(back)) - (axis === 'back' ? beyondIdle(this.#throttle) : 0);
      input[axis] = Math.round(kFull * Math.min(Math.max(value, -1), 1));
    }
    for (const [sum, value] of Object.entries(this.#sums)) input[sum] = Math.trunc(value * kUnit);
    return input;
  }

  // ---- keys

  /** @param {string} code @returns {boolean} whether it is one that is held */
  keyDown(code) {
    if (!kHeldKeys.has(code)) return false;
    this.#keys.add(code);
    this.#onChange();
    return true;
  }
  keyUp(code) {
    if (this.#keys.delete(code)) this.#onChange();
  }
  /** Upright again. */
  level() {
    this.#ask(kLevel);
  }
  #ask(action) {
    this.#asked[action] = (this.#asked[action] + 1) & 0xffff;
    this.#onChange();
  }

  // ---- mouse and fingers

  /**
   * @param {PointerEvent} event @param {boolean} shifts it is another button than the first, or Shift is held
   * @param {{x: number, y: number} | null} cursor on the first screen, 0 to 1; null: it lies elsewhere
   */
  down(event, shifts, cursor) {
    this.#pointers.set(event.pointerId, { x: event.clientX, y: event.clientY, shifts });
    if (cursor) this.#cursor = cursor;
    // What is there is what an orbit turns around.
    if (cursor && this.#pointers.size === 1) this.#ask(kGrab);
  }
  /** @param {PointerEvent} event @param {number} height of what a drag over all of it counts 1, pixels */
  move(event, height) {
    const pointer = this.#pointers.get(event.pointerId);
    if (!pointer || !(height > 0)) return;
    const before = this.#spread();
    const right = (event.clientX - pointer.x) / height, down = (event.clientY - pointer.y) / height;
    pointer.x = event.clientX;
    pointer.y = event.clientY;
    const fingers = this.#pointers.size;
    const kind = pointer.shifts || fingers > 1 ? 'pan' : 'look';
    this.#sums[`${kind}_right`] += right / fingers;
    this.#sums[`${kind}_down`] += down / fingers;
    const after = this.#spread();
    if (before > 0 && after > 0) {
      const ways = Math.log(after / before);
      if (this.isOrbit) this.#sums.wheel += ways / kNear;
      else this.#throttle += kThrottle * ways;
    }
    this.#onChange();
  }
  up(event) {
    if (!this.#pointers.delete(event.pointerId)) return;
    this.#throttle = 0;
    this.#onChange();
  }
  /** @param {WheelEvent} event */
  turn(event) {
    const clicks = event.deltaMode === 0 ? event.deltaY / kWheelPixels : Math.sign(event.deltaY);
    this.#sums.wheel -= clicks;
    this.#onChange();
  }
  /** How far two fingers are apart. */
  #spread() {
    if (this.#pointers.size !== 2) return 0;
    const [a, b] = [...this.#pointers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  }
}

function beyondIdle(throttle) {
  return Math.sign(throttle) * Math.max(0, Math.abs(throttle) - kIdle);
}
