// Pictures of the wall as they change. The next ones are asked for once these are shown: a slow browser slows itself
// alone.
import { pause } from './elements.js';
import { authorization } from './token.js';

const kWholePeriod = 1000;  // ms, between two pictures of the whole wall

/**
 * Where the wall knows no previews, it is asked for whole pictures instead.
 * Events: `tile`, whose detail has `tile`, `host`, `frame` and a `picture` that its receiver closes; `missing` (names
 * of tiles that nobody draws); `whole`, whose detail is a `picture` of the whole wall.
 */
export class Preview extends EventTarget {
  #connection;
  #runs = 0;  // a number of the loop that is meant: others end
  #stamp = 0;
  #hasPreviews = true;
  /** Each pixel stands for as many of the tile's in both directions: 1, 2, 4, … 32. */
  shrink = 4;

  /** @param {import('./connection.js').Connection} connection */
  constructor(connection) {
    super();
    this.#connection = connection;
  }

  start() {
    this.#run(++this.#runs);
  }
  stop() {
    ++this.#runs;
  }
  /** All tiles are wanted again, changed or not: after another wall or size. */
  forget() {
    this.#stamp = 0;
    this.#hasPreviews = true;
  }

  async #run(run) {
    while (run === this.#runs) {
      try {
        if (this.#hasPreviews) await this.#askTiles(run);
        else await this.#askWhole(run);
      } catch (error) {
        if (error.code === 'not_found' && this.#hasPreviews) this.#hasPreviews = false;
        else if (error.code === 'network') return;  // whoever starts it does so again
        else await pause(kWholePeriod);
      }
    }
  }

  async #askTiles(run) {
    const answer = await this.#connection.ask('GetPreview', { shrink: this.shrink, after: this.#stamp });
    if (run !== this.#runs) return;
    this.#stamp = answer.stamp;
    await Promise.all(answer.tiles.map(async ({ tile, host, frame, jpeg }) => {
      const picture = await createImageBitmap(new Blob([jpeg], { type: 'image/jpeg' }));
      this.dispatchEvent(new CustomEvent('tile', { detail: { tile, host, frame, picture } }));
    }));
    this.dispatchEvent(new CustomEvent('missing', { detail: answer.missing }));
  }

  async #askWhole(run) {
    const answer = await fetch('/wall.jpg', { headers: authorization() });
    if (!answer.ok) throw new Error(`${answer.status}`);
    const picture = await createImageBitmap(await answer.blob());
    if (run === this.#runs) this.dispatchEvent(new CustomEvent('whole', { detail: { picture } }));
    await pause(kWholePeriod);
  }
}
