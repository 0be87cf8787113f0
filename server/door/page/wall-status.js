// How the wall is, once a second, and what is told of each frame: the one place that asks, for all who show it.

const kPeriod = 1000;  // ms
/** Frames a second: above the first a page is not told of each, below the second it is again. */
const kFast = 150, kSlow = 120;

/** Words and signs of what a host does: never a colour alone. `tone` names a colour of style.css. */
export const kHostStates = {
  live: { sign: '●', tone: 'good' },
  late: { sign: '◐', tone: 'warn' },
  joining: { sign: '◌', tone: 'warn' },
  syncing: { sign: '◌', tone: 'warn' },
  absent: { sign: '○', tone: 'bad' },
  lost: { sign: '✕', tone: 'bad' },
};

/** @param {string} state of a host */
export function signOf(state) {
  return kHostStates[state] ?? { sign: '?', tone: 'warn' };
}

/**
 * Events: `status` (its detail is the answer of GetStatus), `states` (its detail: the notice's fields, as soon as a
 * host or the journal is another than before, or somebody has come or gone), `frame` (its detail is the notice's
 * fields and when it came), `restarted` where another server answers than before.
 */
export class WallStatus extends EventTarget {
  /** @type {any} the newest; null: none has come on this connection */
  newest = null;
  #connection;
  #news;
  #letFramesGo;  // null: they are not told
  #epoch = '';
  #timer = 0;
  #frames = [];  // [ms, number] of statuses, for the rate

  /** @param {import('./connection.js').Connection} connection @param {import('./news.js').News} news */
  constructor(connection, news) {
    super();
    this.#connection = connection;
    this.#news = news;
    this.#letFramesGo = news.want('frames');
    news.want('states');
    connection.addEventListener('open', () => this.#begin());
    connection.addEventListener('lost', () => this.#end());
    connection.addEventListener('notice', ({ detail }) => {
      if (detail.notice === 'States') this.#onStates(detail.fields);
      if (detail.notice !== 'Frame') return;
      this.dispatchEvent(new CustomEvent('frame', { detail: { ...detail.fields, at: performance.now() } }));
    });
  }

  /** Events `frame` come: not of a wall that draws faster than a slow browser reads. */
  get tellsFrames() {
    return this.#letFramesGo !== null;
  }
  #weighFrames() {
    const rate = this.frameRate;
    if (rate > kFast && this.#letFramesGo) {
      this.#letFramesGo();
      this.#letFramesGo = null;
    } else if (rate !== null && rate < kSlow) {
      this.#letFramesGo ??= this.#news.want('frames');
    }
  }
  /** In frames per second, over the last seconds; null: not known yet. */
  get frameRate() {
    if (this.#frames.length < 2) return null;
    const [from, first] = this.#frames[0];
    const [to, last] = this.#frames.at(-1);
    return (1000 * (last - first)) / (to - from);
  }

  /** In one word, and whether it is well. */
  describe() {
    const status = this.newest;
    if (!status) return { word: 'connecting', sign: '◌', tone: 'warn' };
    const states = new Set(status.hosts.map((host) => host.state));
    if (status.journal_trouble) return { word: 'read-only', ...signOf('lost') };
    if (states.has('lost')) return { word: 'faulty', ...signOf('lost') };
    if (status.frame === 0 || status.hosts.every((host) => host.state === 'absent'))
      return { word: 'waiting', ...signOf('joining') };
    if (states.has('late')) return { word: 'late', ...signOf('late') };
    if (states.size > 1) return { word: 'joining', ...signOf('joining') };
    return { word: 'running', ...signOf('live') };
  }

  #begin() {
    this.#frames = [];
    this.#look();
  }
  #end() {
    clearTimeout(this.#timer);
    this.newest = null;
    this.#frames = [];
  }
  /** Nobody waits for the next look to see them. */
  #onStates(states) {
    this.dispatchEvent(new CustomEvent('states', { detail: states }));
    if (!this.newest) return;
    this.newest = { ...this.newest, hosts: states.hosts, journal_trouble: states.journal_trouble };
    this.dispatchEvent(new CustomEvent('status', { detail: this.newest }));
  }
  async #look() {
    clearTimeout(this.#timer);
    try {
      const status = await this.#connection.ask('GetStatus');
      this.newest = status;
      this.#frames.push([performance.now(), status.frame]);
      if (this.#frames.length > 4) this.#frames.shift();
      this.#weighFrames();
      if (this.#epoch && this.#epoch !== status.epoch) this.dispatchEvent(new Event('restarted'));
      this.#epoch = status.epoch;
      this.dispatchEvent(new CustomEvent('status', { detail: status }));
    } catch {
      // The connection is lost, and says so to all; or the wall has no time now.
    }
    if (this.#connection.isOpen) this.#timer = setTimeout(() => this.#look(), kPeriod);
  }
}
