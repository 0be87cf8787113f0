// One thing at a time, and of what comes meanwhile the newest alone: nothing piles up before a slow wall.

export class Newest {
  #waiting = null;
  #run = null;  // a promise, while anything is under way

  /**
   * @param {() => Promise<void>} task sees to its own faults
   * @returns {Promise<void>} once nothing is under way any more
   */
  ask(task) {
    this.#waiting = task;
    this.#run ??= this.#work();
    return this.#run;
  }
  /** What waits is not wanted any more. */
  drop() {
    this.#waiting = null;
  }

  async #work() {
    try {
      while (this.#waiting) {
        const task = this.#waiting;
        this.#waiting = null;
        await task();
      }
    } finally {
      this.#run = null;
    }
  }
}
