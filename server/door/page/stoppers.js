// Who stands in the way of what was stopped.
import { seen } from './elements.js';

const kMostPairs = 64;    // contacts that are looked at
const kMostLevels = 64;   // a node's geometry lies no deeper below what moves
const kMostNamed = 3;

export class Stoppers {
  #connection;

  /** @param {import('./connection.js').Connection} connection */
  constructor(connection) {
    this.#connection = connection;
  }

  /**
   * @param {number[]} stopped cores, as an answer tells them
   * @returns {Promise<string[]>} their paths; empty: nobody tells
   */
  async find(stopped) {
    const [contacts, questions] = await Promise.all([this.#connection.ask('GetContacts'),
                                                     this.#connection.ask('GetQuestions')]);
    const asked = questions.questions.filter((one) => stopped.includes(one.transform));
    // What stopped a motion on its way comes first: others may only lie there.
    const touching = [...contacts.contacts].sort((a, b) => Number(a.time === 1) - Number(b.time === 1));
    const pairs = [...asked, ...touching].slice(0, kMostPairs).map((one) => [one.object_a, one.object_b]);
    const moves = await this.#whatMoves(new Set(pairs.flat()), stopped);
    const others = new Set();
    for (const [a, b] of pairs) if (moves.has(a) !== moves.has(b)) others.add(moves.has(a) ? b : a);
    if (others.size === 0) return [];
    const names = [...others].slice(0, kMostNamed).map((id) => `#${id}`);
    const told = await this.#connection.ask('GetObjects', { names });
    return told.objects.map((object) => seen(object.path));
  }

  /** Those of `nodes` that lie at or below a node with a stopped core. */
  async #whatMoves(nodes, stopped) {
    const above = new Map([...nodes].map((id) => [id, id]));  // node -> how far up it has been looked at
    const moves = new Set();
    for (let level = 0; level < kMostLevels && above.size > 0; ++level) {
      const ids = [...new Set(above.values())];
      const told = await this.#connection.ask('GetObjects', { names: ids.map((id) => `#${id}`), paths: false });
      const objects = new Map(told.objects.map((object, i) => [ids[i], object]));
      for (const [node, at] of [...above]) {
        const object = objects.get(at);
        const isStopped = stopped.includes(object.core);
        if (isStopped) moves.add(node);
        if (isStopped || !object.parent) above.delete(node);
        else above.set(node, object.parent);
      }
    }
    return moves;
  }
}
