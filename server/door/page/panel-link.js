// How a panel's page asks the wall: over HTTP, once a second and after each edit. A socket would be one of few, and a
// hundred tablets of one token share a link of the door this way. While nobody looks nothing is asked.
import { gone, RequestError } from './connection.js';
import { pause } from './elements.js';
import { authorization, keptToken } from './token.js';

const kPeriod = 1000;                       // ms, between two looks
const kFirstWait = 250, kLongestWait = 4000;  // ms, between two tries
const kPatience = 8000;                     // ms, for an answer
const kBusyTries = 3;                       // of what the door has no time for

/**
 * Events: `open`; `lost`, at each try that fails; `refused`, whose detail says why nobody is let in, until somebody
 * dials; `panel`, whose detail is the answer of GetPanel where it is another than the last one.
 */
export class PanelLink extends EventTarget {
  #isOpen = false;
  #isRefused = false;
  #stamp = '';
  #wait = kFirstWait;
  #timer = 0;
  #looking = null;  // an AbortController, while a look is on its way
  #looksAgain = false;

  constructor() {
    super();
    document.addEventListener('visibilitychange', () => {
      if (document.visibilityState === 'visible') this.#wake();
      else clearTimeout(this.#timer);
    });
    document.addEventListener('resume', () => this.#wake());  // it was frozen, while it was to be seen or not
    addEventListener('pageshow', (event) => { if (event.persisted) this.#wake(); });
    addEventListener('online', () => this.#wake());
  }

  /** Now, whatever was planned. */
  dial() {
    this.#isRefused = false;
    this.#stamp = '';
    this.#drop();
    this.#look();
  }

  /** Soon: something has been changed. */
  look() {
    if (this.#looking) this.#looksAgain = true;
    else if (!this.#isRefused) this.#look();
  }

  /**
   * @param {string} request
   * @param {object} [fields]
   * @returns {Promise<any>} the answer's fields
   */
  async ask(request, fields = {}, ending = new AbortController()) {
    for (let tries = 1; ; ++tries) {
      const { status, said } = await post(request, fields, ending);
      if (status === 429 && tries < kBusyTries) {
        await pause(kPeriod);
        continue;
      }
      if (status === 200) return said.fields;
      if (status === 401) this.#refuse('this link has ended, or was taken back. Whoever gave it has another one.');
      throw new RequestError(said.error);
    }
  }

  async #look() {
    clearTimeout(this.#timer);
    const looking = new AbortController();
    this.#looking = looking;
    let wait = kPeriod;
    try {
      const told = await this.ask('GetPanel', { since: this.#stamp }, looking);
      if (this.#looking !== looking) return;
      this.#wait = kFirstWait;
      if (!this.#isOpen) this.dispatchEvent(new Event('open'));
      this.#isOpen = true;
      this.#stamp = told.stamp;
      if (!told.same) this.dispatchEvent(new CustomEvent('panel', { detail: told }));
    } catch (error) {
      if (this.#looking !== looking) return;
      wait = this.#lose(error);
    }
    this.#looking = null;
    if (this.#isRefused) return;
    if (this.#looksAgain) wait = 0;
    this.#looksAgain = false;
    if (document.visibilityState === 'visible') this.#timer = setTimeout(() => this.#look(), wait);
  }

  /** What was asked before counts no more. */
  #drop() {
    clearTimeout(this.#timer);
    const looking = this.#looking;
    this.#looking = null;
    looking?.abort();
  }

  /** @returns {number} ms until the next try */
  #lose(error) {
    this.#isOpen = false;
    this.#stamp = '';
    if (this.#isRefused) return 0;
    if (error.code === 'network' || error.code === 'limit') this.dispatchEvent(new Event('lost'));
    else if (error.code === 'not_found') location.replace(`/?token=${encodeURIComponent(keptToken())}`);  // of no panel
    else this.#refuse(error.message);
    const wait = this.#wait;
    this.#wait = Math.min(2 * wait, kLongestWait);
    return wait;
  }
  #refuse(why) {
    if (this.#isRefused) return;
    this.#isRefused = true;
    this.#isOpen = false;
    this.dispatchEvent(new CustomEvent('refused', { detail: why }));
  }

  /** A phone that has slept: what it asked before may never be answered, and its timers are late. */
  #wake() {
    if (document.visibilityState !== 'visible' || this.#isRefused) return;
    this.#wait = kFirstWait;
    this.#drop();
    this.#look();
  }
}

/** @returns {Promise<{status: number, said: any}>} */
async function post(request, fields, ending) {
  const patience = setTimeout(() => ending.abort(), kPatience);
  try {
    const answer = await fetch(`/api/${request}`, {
      method: 'POST', headers: authorization(), body: JSON.stringify(fields), signal: ending.signal,
    });
    return { status: answer.status, said: await answer.json() };
  } catch {
    throw gone();
  } finally {
    clearTimeout(patience);
  }
}
