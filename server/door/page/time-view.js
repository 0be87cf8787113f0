// Where the time goes: frames, the barrier, whom the others wait for, and faults.
import { element, setChildren, setText } from './elements.js';
import { FaultList } from './faults.js';
import { Plot, Samples } from './plot.js';

const kDrawPeriod = 250;  // ms
const kMostWaits = 12;
const kHeartbeat = 1000;  // ms
const kAsleep = 4000;     // ms without one: the page has slept, and not the wall

export class TimeView {
  #between = new Samples();  // two frames, as they come here
  #frame = [new Samples(), new Samples()];
  #barrier = [new Samples(), new Samples()];
  #plots;
  #waits = element('ol', { class: 'waits' });
  #noWaits = element('p', { class: 'muted' });
  #lastFrame = null;
  #awake = performance.now();
  #timer = 0;

  /**
   * @param {HTMLElement} panel
   * @param {import('./connection.js').Connection} connection
   * @param {import('./wall-status.js').WallStatus} status
   */
  constructor(panel, connection, status) {
    const halves = ([half, most]) => [{ name: 'half below', samples: half }, { name: '99 % below', samples: most }];
    this.#plots = [
      new Plot('From frame to frame', 'ms', [{ name: 'as they come here', samples: this.#between }], true),
      new Plot('Frame time since the server has started', 'ms', halves(this.#frame)),
      new Plot('Wait at the barrier since the server has started', 'ms', halves(this.#barrier)),
    ];
    panel.append(element('div', { class: 'plots' }, ...this.#plots.map((plot) => plot.node)),
                 element('div', { class: 'columns' },
                         element('section', {}, element('h2', { text: 'Who the others waited for' }), this.#noWaits,
                                 this.#waits),
                         new FaultList(connection, status).node));
    status.addEventListener('frame', ({ detail: { at } }) => {
      const hasSlept = at - this.#awake > kAsleep;
      if (this.#lastFrame !== null && !hasSlept) this.#between.add(at, at - this.#lastFrame);
      this.#lastFrame = at;
      if (hasSlept) this.#awake = at;
    });
    status.addEventListener('status', ({ detail }) => {
      this.#onStatus(detail);
      if (status.tellsFrames || status.frameRate === null) return;
      this.#between.add(performance.now(), 1000 / status.frameRate);
      this.#lastFrame = null;
    });
    connection.addEventListener('lost', () => {
      this.#lastFrame = null;
    });
    setInterval(() => {
      const now = performance.now();
      if (now - this.#awake > kAsleep) this.#lastFrame = null;  // this may be called before the first frame is told
      this.#awake = now;
    }, kHeartbeat);
  }

  set isShown(isShown) {
    clearInterval(this.#timer);
    if (!isShown) return;
    this.#draw();
    this.#timer = setInterval(() => this.#draw(), kDrawPeriod);
  }

  #draw() {
    const now = performance.now();
    for (const plot of this.#plots) plot.draw(now);
  }

  #onStatus(status) {
    const now = performance.now();
    for (const [samples, figures] of [[this.#frame, status.frames], [this.#barrier, status.barrier]]) {
      if (!figures || figures.count === 0) continue;
      samples[0].add(now, figures.half_ms);
      samples[1].add(now, figures.p99_ms);
    }
    const waits = status.waits.slice(0, kMostWaits);
    setText(this.#noWaits, waits.length > 0 ? `Of the last ${status.wait_frames} frames.` : 'Nobody of late.');
    const most = Math.max(...waits.map((wait) => wait.ms), 1e-9);
    setChildren(this.#waits, waits.map((wait, i) => waitNode(this.#waits.children[i], wait, most)));
  }
}

/** @param {Element | undefined} node one that is there, or none yet */
function waitNode(node, { tile, host, frames, ms, reason }, most) {
  const item = node ?? element('li', {}, element('span', { class: 'share' }), element('span'));
  item.firstChild.style.width = `${(100 * ms) / most}%`;
  const who = tile === host ? tile : `${tile} (${host})`;
  setText(item.lastChild, `${who}: ${ms.toFixed(1)} ms, ${frames} frames${reason ? `, ${reason}` : ''}`);
  return item;
}
