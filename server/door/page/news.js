// What the wall tells by itself. A subscription replaces the one before, so that this is the one place that subscribes:
// to all that anybody on this page wants.

export class News {
  #connection;
  #wanted = new Map();  // kind -> how many want it
  #isDue = false;

  /** @param {import('./connection.js').Connection} connection */
  constructor(connection) {
    this.#connection = connection;
    connection.addEventListener('open', () => this.#subscribe());
  }

  /**
   * @param {string} kind a field of SubscribeNews; its notices come as events of the connection
   * @returns {() => void} it is wanted no more
   */
  want(kind) {
    this.#count(kind, 1);
    let isWanted = true;
    return () => {
      if (isWanted) this.#count(kind, -1);
      isWanted = false;
    };
  }

  #count(kind, more) {
    const many = (this.#wanted.get(kind) ?? 0) + more;
    if (many > 0) this.#wanted.set(kind, many);
    else this.#wanted.delete(kind);
    if (this.#isDue) return;
    this.#isDue = true;
    queueMicrotask(() => {  // what changes in one moment is said once
      this.#isDue = false;
      this.#subscribe();
    });
  }
  #subscribe() {
    if (!this.#connection.isOpen) return;
    const kinds = Object.fromEntries([...this.#wanted.keys()].map((kind) => [kind, true]));
    this.#connection.ask('SubscribeNews', kinds).catch(() => {});
  }
}
