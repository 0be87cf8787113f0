// Whether the scene has changed, for those who show it: asked while somebody looks, and never busy with it alone.

const kPeriod = 400;      // ms
const kRest = 4;          // times as long as an answer took nothing more is asked: at most a fifth of the time

/** Event `change`: the scene has changed, or is another one; its detail is the number of the list. */
export class SceneWatch extends EventTarget {
  #connection;
  #sequence = null;
  #isWatching = false;
  #timer = 0;

  /** @param {import('./connection.js').Connection} connection */
  constructor(connection) {
    super();
    this.#connection = connection;
    connection.addEventListener('open', () => this.#begin());
    connection.addEventListener('lost', () => clearTimeout(this.#timer));
    document.addEventListener('visibilitychange', () => this.#begin());
  }

  set isWatching(isWatching) {
    this.#isWatching = isWatching;
    this.#begin();
  }

  #begin() {
    clearTimeout(this.#timer);
    this.#sequence = null;
    this.#look();
  }
  async #look() {
    if (!this.#isWatching || document.hidden || !this.#connection.isOpen) return;
    try {
      const { sequence } = await this.#connection.ask('GetObjects', { names: [] });
      if (sequence !== this.#sequence) this.dispatchEvent(new CustomEvent('change', { detail: sequence }));
      this.#sequence = sequence;
    } catch {
      // Lost, or refused: the next look tells.
    }
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#look(), kPeriod);
  }
}

/**
 * One question at a time, and a rest after each. Who wants it meanwhile is heard afterwards, once.
 * @param {() => Promise<void>} ask
 * @param {number} [least] ms of rest
 * @param {number} [rest] times as long as it took
 * @returns {() => void}
 */
export function paced(ask, least = 0, rest = kRest) {
  let isBusy = false, isWanted = false;
  const run = async () => {
    if (isBusy) {
      isWanted = true;
      return;
    }
    isBusy = true;
    isWanted = false;
    const since = performance.now();
    try {
      await ask();
    } finally {
      setTimeout(() => {
        isBusy = false;
        if (isWanted) run();
      }, Math.max(least, rest * (performance.now() - since)));
    }
  };
  return () => { run().catch(() => {}); };
}
