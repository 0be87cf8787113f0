// A small plot of the last minute.
import { element, setText } from './elements.js';
import { colour } from './theme.js';

export const kMinute = 60_000;  // ms
const kDashes = [[], [6, 4], [2, 3], [10, 3, 2, 3]];  // lines are told apart without their colours

/** Samples of the last minute, oldest first. */
export class Samples {
  #samples = [];  // [ms, value]

  add(at, value) {
    this.#samples.push([at, value]);
    const from = this.#samples.findIndex(([time]) => time >= at - kMinute);
    if (from > 64) this.#samples.splice(0, from);  // not with each one
  }
  clear() {
    this.#samples = [];
  }
  since(time) {
    return this.#samples.filter(([at]) => at >= time);
  }
}

/**
 * A figure with lines, a scale, and the newest values in words.
 * @param {string} title
 * @param {string} unit
 * @param {{name: string, samples: Samples}[]} lines at most four
 * @param {boolean} [hasSpread] of the first line it is said what 99 of 100 do not exceed
 */
export class Plot {
  #canvas = element('canvas', { role: 'img' });
  #legend = element('p', { class: 'legend' });
  #values = [];
  #spread = null;
  #most = element('span', { class: 'scale' });
  #title;
  #unit;
  #lines;

  constructor(title, unit, lines, hasSpread = false) {
    this.#title = title;
    this.#unit = unit;
    this.#lines = lines;
    lines.forEach(({ name }, i) => {
      const value = element('strong');
      this.#values.push(value);
      this.#legend.append(element('span', { class: `line line-${i}`, text: `${name} ` }, value));
    });
    if (hasSpread) {
      this.#spread = element('strong');
      this.#legend.append(element('span', { text: '99 % of this minute below ' }, this.#spread));
    }
    const area = element('div', { class: 'plot-area' }, this.#canvas, this.#most,
                         element('span', { class: 'scale scale-from', text: '1 minute ago' }),
                         element('span', { class: 'scale scale-to', text: 'now' }));
    this.node = element('figure', { class: 'plot' }, element('figcaption', { text: `${title}, ${unit}` }),
                        this.#legend, area);
  }

  draw(now) {
    const all = this.#lines.map(({ samples }) => samples.since(now - kMinute));
    const newest = all.map((samples) => (samples.length ? samples.at(-1)[1] : null));
    newest.forEach((value, i) => setText(this.#values[i], value === null ? '–' : written(value)));
    if (this.#spread) setText(this.#spread, all[0].length > 0 ? written(mostOf(all[0], 0.99)) : '–');
    const most = niceAbove(all.flat().reduce((sofar, [, value]) => Math.max(sofar, value), 0));
    setText(this.#most, `${most} ${this.#unit}`);
    this.#canvas.setAttribute('aria-label', `${this.#title} of the last minute: ` + this.#lines
      .map(({ name }, i) => `${name} ${newest[i] === null ? 'not known' : `${written(newest[i])} ${this.#unit}`}`)
      .join(', '));

    const scale = devicePixelRatio;
    const width = this.#canvas.clientWidth, height = this.#canvas.clientHeight;
    if (width === 0) return;
    this.#canvas.width = width * scale;
    this.#canvas.height = height * scale;
    const pen = this.#canvas.getContext('2d');
    pen.scale(scale, scale);
    pen.strokeStyle = colour('line');
    pen.lineWidth = 1;
    for (const part of [0, 0.5]) {
      pen.beginPath();
      pen.moveTo(0, part * height + 0.5);
      pen.lineTo(width, part * height + 0.5);
      pen.stroke();
    }
    all.forEach((samples, i) => {
      pen.strokeStyle = colour(`line-${i}`);
      pen.lineWidth = 2;
      pen.setLineDash(kDashes[i % kDashes.length]);
      pen.beginPath();
      for (const [at, value] of thinned(samples, width))
        pen.lineTo(width * (1 - (now - at) / kMinute), height * (1 - value / most));
      pen.stroke();
    });
  }
}

/** Of more samples than pixels the largest of each pixel: no peak is lost. */
function thinned(samples, width) {
  if (samples.length <= width) return samples;
  const peaks = new Map();
  for (const sample of samples) {
    const column = Math.floor((sample[0] / kMinute) * width);
    const peak = peaks.get(column);
    if (!peak || peak[1] < sample[1]) peaks.set(column, sample);
  }
  return [...peaks.values()];
}

/** What such a part of the samples does not exceed. */
function mostOf(samples, part) {
  const values = Float64Array.from(samples, ([, value]) => value).sort();
  return values[Math.ceil(part * values.length) - 1];
}

/** 1, 2 or 5 times a power of ten. */
function niceAbove(value) {
  if (value <= 0) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((step) => step * power).find((step) => step >= value);
}

function written(value) {
  return value >= 100 ? value.toFixed(0) : value.toFixed(value >= 10 ? 1 : 2);
}
