// What somebody leads by hand changes faster than a wall answers: one thing at a time, and of what comes meanwhile the
// newest alone.

export class Newest {
  #say;
  #waiting = null;
  #isUnderWay = false;

  /** @param {(...said: any[]) => Promise<any>} [say] without it what is sent is a task, which is called */
  constructor(say = (task) => task()) {
    this.#say = say;
  }

  get isUnderWay() {
    return this.#isUnderWay;
  }

  /** What waits is not wanted any more. */
  drop() {
    this.#waiting = null;
  }

  /**
   * Says the newest alone, once the one before is answered.
   * @returns {Promise<{answer?: any, error?: Error} | null>} of the last that was said; null: another call tells it
   */
  async send(...said) {
    this.#waiting = said;
    if (this.#isUnderWay) return null;
    this.#isUnderWay = true;
    let last = {};
    while (this.#waiting) {
      const next = this.#waiting;
      this.#waiting = null;
      try {
        last = { answer: await this.#say(...next) };
      } catch (error) {
        last = { error };
      }
    }
    this.#isUnderWay = false;
    return last;
  }
}
