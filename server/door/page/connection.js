// One WebSocket to the door: requests with their answers, notices, and the way back when it is gone.
import { authorization, keptToken } from './token.js';

const kFirstWait = 250, kLongestWait = 5000;  // ms, between two tries
const kPatience = 12000;  // ms without a word from the wall, though something was asked: it is gone without saying so
const kWakePatience = 2000;  // ms; the same for who comes back to this page

/** What a wall refuses, or does not answer any more. */
export class RequestError extends Error {
  /** @param {{code: string, message: string, field?: string}} said */
  constructor(said) {
    super(said.message);
    this.code = said.code;
    this.field = said.field ?? '';
  }
}

/**
 * Events: `open`; `lost`, once for each time that it is gone; `refused`, whose detail says why nobody is let in;
 * `notice`, whose detail is the notice. It dials again by itself until it is refused.
 */
export class Connection extends EventTarget {
  #socket = null;
  #isOpen = false;
  #lastId = 0;
  #asked = new Map();  // id -> {resolve, reject}
  #awaited = null;     // a text whose binaries are on their way
  #binaries = [];
  #wait = kFirstWait;
  #retry = 0;
  #isRefused = false;  // until somebody dials: a token is asked for
  #heard = 0;
  #watch = 0;

  constructor() {
    super();
    document.addEventListener('visibilitychange', () => this.#onWake());
    addEventListener('online', () => this.#onWake());
  }

  get isOpen() {
    return this.#isOpen;
  }

  /** Now, whatever was planned. */
  dial() {
    clearTimeout(this.#retry);
    this.#isRefused = false;
    this.#drop();
    const url = new URL('/socket', location.href);
    url.protocol = location.protocol === 'https:' ? 'wss:' : 'ws:';
    url.searchParams.set('name', 'console');
    if (keptToken()) url.searchParams.set('token', keptToken());
    const socket = new WebSocket(url);
    socket.binaryType = 'arraybuffer';
    this.#socket = socket;
    socket.onopen = () => {
      this.#isOpen = true;
      this.#wait = kFirstWait;
      this.#heard = performance.now();
      this.#watch = setInterval(() => this.#lookWhetherItLives(kPatience), 1000);
      this.dispatchEvent(new Event('open'));
    };
    socket.onmessage = (message) => this.#onMessage(message.data);
    socket.onclose = () => this.#onGone();
  }

  /**
   * @param {string} request
   * @param {object} [fields]
   * @returns {Promise<any>} the answer's fields; what an answer holds as `{"binary": 0}` is there as an ArrayBuffer
   */
  ask(request, fields = {}) {
    if (!this.#isOpen) return Promise.reject(gone());
    const id = ++this.#lastId;
    return new Promise((resolve, reject) => {
      this.#asked.set(id, { resolve, reject, since: performance.now() });
      this.#socket.send(JSON.stringify({ id, request, fields }));
    });
  }

  #onMessage(data) {
    this.#heard = performance.now();
    if (typeof data !== 'string') {
      this.#binaries.push(data);
    } else {
      this.#awaited = JSON.parse(data);
      this.#binaries = [];
    }
    if (!this.#awaited || this.#binaries.length < (this.#awaited.binaries ?? 0)) return;
    const said = this.#awaited;
    this.#awaited = null;
    if (said.notice) {
      this.dispatchEvent(new CustomEvent('notice', { detail: said }));
      return;
    }
    const asked = this.#asked.get(said.id);
    if (!asked) return;
    this.#asked.delete(said.id);
    if (said.error) asked.reject(new RequestError(said.error));
    else asked.resolve(withBinaries(said.fields, this.#binaries));
  }

  /** Without the socket's events: those of one that is dropped count no more. */
  #drop() {
    clearInterval(this.#watch);
    const socket = this.#socket;
    this.#socket = null;
    this.#isOpen = false;
    this.#awaited = null;
    if (socket) {
      socket.onopen = socket.onmessage = socket.onclose = null;
      socket.close();
    }
    const asked = [...this.#asked.values()];
    this.#asked.clear();
    for (const one of asked) one.reject(gone());
  }

  async #onGone() {
    const wasOpen = this.#isOpen;
    this.#drop();
    this.dispatchEvent(new Event('lost'));
    const why = wasOpen ? '' : await whyRefused();
    if (why) {
      this.#isRefused = true;
      this.dispatchEvent(new CustomEvent('refused', { detail: why }));
      return;
    }
    if (this.#socket) return;  // somebody has dialled meanwhile
    clearTimeout(this.#retry);
    this.#retry = setTimeout(() => this.dial(), this.#wait);
    this.#wait = Math.min(2 * this.#wait, kLongestWait);
  }

  #lookWhetherItLives(patience) {
    const now = performance.now();
    for (const one of this.#asked.values())
      if (now - Math.max(one.since, this.#heard) > patience) return this.#onGone();
  }

  /** A phone that has slept: its socket may be dead, and its timers late. */
  #onWake() {
    if (document.visibilityState !== 'visible') return;
    if (!this.#isOpen) {
      if (this.#retry && !this.#isRefused) this.dial();
      return;
    }
    this.ask('WhoAmI').catch(() => {});
    setTimeout(() => this.#lookWhetherItLives(kWakePatience), kWakePatience + 100);
  }
}

/** What is told to whoever asks while there is no connection. */
export function gone() {
  return new RequestError({ code: 'network', message: 'The connection to the wall is lost.' });
}

/** A browser does not say why a WebSocket was refused. Empty: nobody has refused. */
async function whyRefused() {
  try {
    const answer = await fetch('/api/WhoAmI', { method: 'POST', headers: authorization() });
    if (answer.status !== 401 && answer.status !== 403) return '';
    if (answer.status === 401 && keptToken()) return 'this token is wrong, has ended, or was taken back.';
    return (await answer.json()).error.message;
  } catch {
    return '';
  }
}

function withBinaries(value, binaries) {
  if (binaries.length === 0 || value === null || typeof value !== 'object') return value;
  if (Number.isInteger(value.binary)) return binaries[value.binary];
  for (const key of Object.keys(value)) value[key] = withBinaries(value[key], binaries);
  return value;
}
