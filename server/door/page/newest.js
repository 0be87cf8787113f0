// What somebody leads by hand changes faster than a wall answers.

export class Newest {
  #say;
  #waiting = null;
  #isUnderWay = false;

  /** @param {(...said: any[]) => Promise<any>} say */
  constructor(say) {
    this.#say = say;
  }

  get isUnderWay() {
    return this.#isUnderWay;
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
