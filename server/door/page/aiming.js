// From a place on the picture to a ray in the world, and back; and what stands there.
import { seen } from './elements.js';
import { apart, cross, dot, minus, plus, times, turned, turnedBack, unit } from './vectors.js';

/**
 * @typedef {{tile: string, u: number, v: number}} Aim a place in a tile's picture, 0 to 1 from its upper left; a drag
 *     goes on beyond
 * @typedef {{origin: number[], direction: number[]}} Ray
 * @typedef {{node: number, point: number[], distance: number, label: string, movable: number}} Thing
 */

const tileOf = (plan, name) => plan.tiles.find((tile) => tile.name === name);
const edges = ({ lower_left, lower_right, upper_left }) => ({ right: minus(lower_right, lower_left),
                                                              down: minus(lower_left, upper_left) });

function toWorld(plan, place) {
  return plus(plan.position, times(turned(place, plan.orientation), plan.world_units_per_metre));
}
function toWall(plan, world) {
  return times(turnedBack(minus(world, plan.position), plan.orientation), 1 / plan.world_units_per_metre);
}

/**
 * @param {object} plan an answer of GetWall
 * @param {Aim} aim
 * @returns {Ray | null} null: there is no such tile any more
 */
export function rayOf(plan, aim) {
  const tile = tileOf(plan, aim.tile);
  if (!tile) return null;
  const { right, down } = edges(tile);
  const onScreen = plus(tile.upper_left, plus(times(right, aim.u), times(down, aim.v)));
  const origin = toWorld(plan, tile.seen_from);
  return { origin, direction: unit(minus(toWorld(plan, onScreen), origin)) };
}

/** Where a point of the world is seen in a tile's picture; null: it lies behind who looks. */
export function placeIn(plan, tile, point) {
  const { right, down } = edges(tile), normal = cross(right, down);
  const towards = minus(toWall(plan, point), tile.seen_from);
  const along = dot(minus(tile.upper_left, tile.seen_from), normal) / dot(towards, normal);
  if (!(along > 0) || !Number.isFinite(along)) return null;
  const from = minus(plus(tile.seen_from, times(towards, along)), tile.upper_left);
  return { u: dot(from, right) / dot(right, right), v: dot(from, down) / dot(down, down) };
}

/** Of a tile's screen, in the world. */
export function normalOf(plan, aim) {
  const { right, down } = edges(tileOf(plan, aim.tile));
  return turned(unit(cross(right, down)), plan.orientation);
}

/** Where a ray meets the plane through a point; null: nowhere ahead, or too far away to be meant. */
export function onPlane({ origin, direction }, point, normal) {
  const t = dot(minus(point, origin), normal) / dot(direction, normal);
  return t > 0 && t < 1000 * apart(point, origin) ? plus(origin, times(direction, t)) : null;
}

export class Aiming {
  #connection;
  /** The newest plan that was asked for: where the wall stood then. */
  plan = null;

  /** @param {import('./connection.js').Connection} connection */
  constructor(connection) {
    this.#connection = connection;
  }

  /** Where the wall and its heads are now. */
  async look() {
    this.plan = await this.#connection.ask('GetWall');
    if (!this.plan.position) throw new Error('The wall stands nowhere: its camera is gone from the scene.');
    return this.plan;
  }

  /** @param {Aim} aim @returns {Promise<Ray>} as the wall stands now */
  async ray(aim) {
    const ray = rayOf(await this.look(), aim);
    if (!ray) throw new Error(`The wall has no tile ${aim.tile} any more.`);
    return ray;
  }

  /** @param {Ray} ray @returns {Promise<Thing | null>} null: nothing stands there */
  async pick(ray) {
    const picked = await this.#connection.ask('PickAt', { ray });
    if (!picked.hit) return null;
    const { path, movable } = await this.describe(picked.node);
    return { node: picked.node, point: picked.point, distance: picked.t, label: path, movable: movable ?? 0 };
  }

  /** A node as the wall tells it: its path, its parent, what moves when it is moved. */
  async describe(node, wishes = {}) {
    const told = await this.#connection.ask('GetObjects', { names: [`#${node}`], ...wishes });
    const [object] = told.objects;
    if (!object.id) throw new Error(`#${node} is gone.`);
    return { ...object, path: seen(object.path), place: told.places?.[0] };
  }
}

/** @param {number} units of the world @param {object} plan */
export function lengthText(units, plan) {
  const metres = units / plan.world_units_per_metre;
  return `${written(units)} units · ${written(metres)} m in the room`;
}

/** Seven digits that count, without an end of zeros. */
export function written(value) {
  return String(Number(value.toPrecision(7)));
}

/** @param {number[]} point */
export function pointText(point) {
  return point.map(written).join(', ');
}
