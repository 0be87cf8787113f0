// A ball of a material in a studio, in the light that walls know (`Lighting.glsl` of client/draw), worked out here: no
// picture is asked for. Light adds up linearly; each of red, green and blue goes its own way.
import { element, setText } from './elements.js';
import { isReference, spaced } from './schema.js';

const kSky = [0.3, 0.33, 0.38], kGround = [0.12, 0.11, 0.1];  // an Environment's, when nobody has said anything
const kSuns = [{ towards: unit([-0.5, 0.75, 0.65]), radiance: 1.45 },
               { towards: unit([0.85, 0.1, 0.4]), radiance: 0.35 }];
const kRadius = 0.9;   // of half the canvas
const kPattern = [150, 205];  // greys behind what is seen through
const kSide = 224;     // pixels
const kSmallestRoughness = 0.045;

function unit(v) {
  const length = Math.hypot(...v);
  return v.map((part) => part / length);
}
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const mix = (a, b, share) => a + (b - a) * share;
const within = (value, least, most) => Math.min(most, Math.max(least, value));
const each = (make) => [make(0), make(1), make(2)];
/** From 0 at `from` to 1 at `to`, without a corner. */
function step(value, from, to) {
  const at = within((value - from) / (to - from), 0, 1);
  return at * at * (3 - 2 * at);
}

/** What comes from a direction: sky, ground and three lamps; a rough surface sees it blurred. */
function environment(d, roughness) {
  const blur = 0.06 + 0.94 * roughness, breadth = 0.18 + 0.6 * roughness;
  const up = step(0.5 + (0.5 * d[1]) / blur, 0, 1);
  const lamp = (towards, edge) => step(towards, edge - 0.7 * blur, edge + 0.06 * blur);
  const lamps = 2.2 * lamp(d[1], 0.9) + 3 * lamp(0.64 * d[0] + 0.48 * d[1] + 0.6 * d[2], 0.93)
    + 1.6 * lamp(-0.8 * d[0] + 0.36 * d[1] + 0.48 * d[2], 0.95);
  const glow = (0.35 * breadth * breadth) / (breadth * breadth + 4 * d[1] * d[1])
    + lamps / (1 + 5 * roughness * roughness);
  return each((i) => mix(kGround[i], kSky[i], up) + kSky[i] * glow);
}

/** Of a white environment a lobe reflects f0 times the first, f90 times the second (Karis 2014). */
function environmentFactors(roughness, nv) {
  const x = 1 - roughness, y = 0.0425 - 0.0275 * roughness, z = 1.04 - 0.572 * roughness, w = 0.022 * roughness - 0.04;
  const a = Math.min(x * x, 2 ** (-9.28 * nv)) * x + y;
  return [z - 1.04 * a, w + 1.04 * a];
}

/** GGX with Smith's visibility (Hammon 2017), before Fresnel's term. */
function lobe(alpha, nl, nv, hv) {
  const hv2 = Math.max(hv * hv, 2.5e-7), both = nl + nv, twice = 2 * nl * nv, alpha2 = alpha * alpha;
  const nh2 = Math.min(0.25 * both * both, hv2), q = nh2 * (alpha2 - 1) + hv2;
  const below = Math.max(q * q * (twice + (both - twice) * alpha), 1e-6 * hv2 * hv2);
  return Math.min(40, (0.5 * alpha2 * hv2 * hv2) / below);
}

/** Khronos PBR Neutral without its toe: colours stay what they are up to 0.8. */
function toneMapped(c) {
  const peak = Math.min(Math.max(...c), 1e8);
  if (peak <= 0.8) return c;
  const newPeak = 1 - 0.04 / (peak - 0.6), whiter = 1 - 1 / (0.15 * (peak - newPeak) + 1);
  return c.map((part) => mix((part * newPeak) / peak, newPeak, whiter));
}
const encoded = (c) => 255 * (c <= 0.0031308 ? 12.92 * within(c, 0, 1) : 1.055 * Math.min(c, 1) ** (1 / 2.4) - 0.055);

/** What is the same on all of the ball. @param {Record<string, any>} m fields of a Material */
function lookOf(m) {
  const isPhong = m.shading === 'phong', metal = isPhong ? 0 : m.metallic, root = (m.ior - 1) / (m.ior + 1);
  const straight = isPhong ? m.specularColor.map((part) => part * m.specular)
                           : m.specularColor.map((part) => m.specular * Math.min(1, root * root * part));
  const isSeenThrough = m.alphaMode === 'blend' || m.transmission > 0 || m.alphaMode === 'auto';
  const cut = m.alphaMode === 'mask' && m.baseColor[3] < m.alphaCutoff ? 0 : 1;
  return { ...m, isPhong, metal, roughness: Math.max(kSmallestRoughness, m.roughness),
           f0: each((i) => mix(straight[i], m.baseColor[i], metal)), f90: mix(isPhong ? 0 : m.specular, 1, metal),
           through: m.transmission * (1 - metal), alpha: isSeenThrough ? within(m.baseColor[3], 0, 1) : cut };
}

/** @returns {number[]} red, green, blue as a screen has them, and how dense it is, from 0 to 1 */
function shade(look, n) {
  if (look.unlit) return [...each((i) => encoded(look.baseColor[i])), look.alpha];
  const nv = Math.max(n[2], 1e-3), mirror = [2 * n[2] * n[0], 2 * n[2] * n[1], 2 * n[2] * n[2] - 1];
  const [scale, bias] = environmentFactors(look.roughness, nv);
  const around = environment(mirror, look.roughness), coat = Math.max(look.clearcoatRoughness, 0.045);
  const mirrored = each((i) => (look.isPhong ? 0 : look.f0[i] * scale + look.f90 * bias));
  const diffuse = each((i) => mix(kGround[i], kSky[i], 0.5 + 0.5 * n[1]) * (1 - mirrored[i]));
  const specular = each((i) => mirrored[i] * around[i]);
  const [coatScale, coatBias] = environmentFactors(coat, nv);
  const coated = environment(mirror, coat).map((part) => (0.04 * coatScale + coatBias) * part);
  for (const { towards, radiance } of kSuns) {
    const nl = within(dot(n, towards), 0, 1);
    if (nl === 0) continue;
    const hv = Math.sqrt(0.5 + 0.5 * towards[2]), grazing = (1 - Math.min(hv, 1)) ** 5;
    const nh = Math.min(1, (nl + nv) / (2 * hv));
    const shine = look.isPhong ? radiance * nh ** look.shininess
                               : radiance * nl * lobe(look.roughness * look.roughness, nl, nv, hv);
    for (let i = 0; i < 3; ++i) {
      const fresnel = look.isPhong ? look.f0[i] : look.f0[i] + (look.f90 - look.f0[i]) * grazing;
      diffuse[i] += radiance * nl * (look.isPhong ? 1 : 1 - fresnel);
      specular[i] += shine * fresnel;
      coated[i] += radiance * nl * lobe(coat * coat, nl, nv, hv) * (0.04 + 0.96 * grazing);
    }
  }
  const below = 1 - look.clearcoat * (0.04 + 0.96 * (1 - nv) ** 5);
  const shown = each((i) => specular[i] * below + look.clearcoat * coated[i]);
  const a = 1 - look.through * Math.max(...look.baseColor.slice(0, 3));
  const dense = a + (1 - a) * Math.min(1, Math.max(...shown));
  const c = toneMapped(each((i) => ((diffuse[i] * look.baseColor[i] * (1 - look.metal) * below * (1 - look.through)
    + look.emissive[i]) * a + shown[i]) / Math.max(dense, 1e-3)));
  return [...c.map(encoded), look.alpha * dense];
}

/** Of what is drawn as lines or points alone: whether something is there. Turned a little, so that a pole is seen. */
function isInked(fill, n) {
  const turned = [n[0], 0.9 * n[1] + 0.436 * n[2], 0.9 * n[2] - 0.436 * n[1]];
  const height = Math.asin(within(turned[1], -1, 1)) / (Math.PI / 8);
  const around = Math.atan2(turned[0], turned[2]) / (Math.PI / 10);
  const off = (at, thick) => Math.abs(at - Math.round(at)) < thick;
  const narrow = 0.06 / Math.max(0.2, Math.cos(height * (Math.PI / 8)));
  return fill === 'corners' ? off(height, 0.1) && off(around, 2 * narrow) : off(height, 0.05) || off(around, narrow);
}

/** @param {HTMLCanvasElement} canvas @param {Record<string, any>} fields of a Material */
export function drawMaterial(canvas, fields) {
  const look = lookOf(fields), isFilled = look.fill === 'filled', flat = { ...look, unlit: true };
  const side = canvas.width, half = side / 2, radius = kRadius * half;
  const context = canvas.getContext('2d');
  const picture = context.createImageData(side, side);
  for (let row = 0; row < side; ++row)
    for (let column = 0; column < side; ++column) {
      const x = (column + 0.5 - half) / radius, y = (half - row - 0.5) / radius, far = Math.hypot(x, y);
      const covered = within((1 - far) * radius + 0.5, 0, 1), at = 4 * (row * side + column);
      if (covered === 0) continue;
      const inside = Math.min(1, 0.999 / Math.max(far, 1e-6)), nx = x * inside, ny = y * inside;
      const n = [nx, ny, Math.sqrt(Math.max(0, 1 - nx * nx - ny * ny))];
      const [r, g, b, alpha] = shade(isFilled ? look : flat, n);
      const dense = isFilled || isInked(look.fill, n) ? alpha : 0;
      const grey = kPattern[(Math.floor((8 * row) / side) + Math.floor((8 * column) / side)) % 2];
      [r, g, b].forEach((part, i) => { picture.data[at + i] = mix(grey, part, dense); });
      picture.data[at + 3] = 255 * covered;
    }
  context.putImageData(picture, 0, 0);
}

const kSlice = 8;  // ms of drawing at a time: a page full of materials leaves room for hands
const waiting = [];  // [canvas, fields]
let isDue = false;

/** The same when there is time for it; of what is not on the page any more nothing. */
export function drawMaterialSoon(canvas, fields) {
  waiting.push([canvas, fields]);
  dueSoon();
}
function dueSoon() {
  if (isDue || waiting.length === 0) return;
  isDue = true;
  setTimeout(drawSome);
}
function drawSome() {
  isDue = false;
  const end = performance.now() + kSlice;
  while (waiting.length > 0 && performance.now() < end) {
    const [canvas, fields] = waiting.shift();
    if (canvas.isConnected) drawMaterial(canvas, fields);
  }
  dueSoon();
}

/** Beside a material's fields: drawn anew when they change. */
export class MaterialPreview {
  #canvas = element('canvas', { width: kSide, height: kSide, role: 'img', 'aria-label': 'A ball of this material' });
  #says = element('figcaption', { class: 'muted' });
  #drawn = '';

  constructor() {
    this.node = element('figure', { class: 'preview' }, this.#canvas, this.#says);
  }

  /** @param {Record<string, any>} fields @param {import('./schema.js').Type} type */
  show(fields, type) {
    const drawn = JSON.stringify(fields);
    if (drawn === this.#drawn) return;
    this.#drawn = drawn;
    drawMaterial(this.#canvas, fields);
    const left = type.fields.filter((field) => isReference(field) && [fields[field.name] ?? []].flat().length > 0)
      .map(({ name }) => spaced(name));
    setText(this.#says, left.length > 0 ? `Drawn without ${left.join(', ')}.` : '');
  }
}
