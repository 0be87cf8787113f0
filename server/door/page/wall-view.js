// The wall as it hangs: each tile in its place with what it shows now and how its host is.
import { element, freshId, setChildren, setText } from './elements.js';
import { PictureTools } from './picture-tools.js';
import { Preview } from './preview.js';
import { TileButton, TileDialog } from './tile-view.js';
import { unfold } from './unfold.js';
import { signOf } from './wall-status.js';

export class WallView {
  #connection;
  #status;
  #preview;
  #isShown = false;
  #plan = null;            // the answer of GetWall; null: the wall tells none
  #buttons = new Map();    // of tiles, by name
  #rows = new Map();       // of the list below, by name
  #pictures = new Map();   // tile -> {frame, at}
  #missing = new Set();
  #whole = element('canvas', { class: 'whole', role: 'img', 'aria-label': 'Picture of the whole wall' });
  #sheets = element('div', { class: 'sheets' });
  #list = element('ul', { class: 'tile-list' });
  #dialog = new TileDialog();
  #tools;

  /**
   * @param {HTMLElement} panel
   * @param {import('./connection.js').Connection} connection
   * @param {import('./wall-status.js').WallStatus} status
   * @param {(node: number) => void} showInScene
   */
  constructor(panel, connection, status, showInScene) {
    this.#connection = connection;
    this.#status = status;
    this.#preview = new Preview(connection);
    const heading = freshId('tiles');
    this.#tools = new PictureTools(connection, status, showInScene);
    panel.append(this.#tools.node, element('div', { class: 'stage' }, this.#sheets, this.#tools.side),
                 element('h2', { id: heading, text: 'Tiles' }), this.#list, this.#dialog.node);
    this.#list.setAttribute('aria-labelledby', heading);

    this.#preview.addEventListener('tile', ({ detail }) => {
      this.#pictures.set(detail.tile, { frame: detail.frame, at: performance.now() });
      const button = this.#buttons.get(detail.tile);
      if (button) button.showPicture(detail.picture);
      else detail.picture.close();
    });
    this.#preview.addEventListener('missing', ({ detail }) => {
      this.#missing = new Set(detail);
    });
    this.#preview.addEventListener('whole', ({ detail: { picture } }) => this.#showWhole(picture));
    connection.addEventListener('open', () => this.#load());
    connection.addEventListener('lost', () => this.#preview.stop());
    status.addEventListener('status', () => this.#showStates());
    document.addEventListener('visibilitychange', () => this.#restart());
  }

  set isShown(isShown) {
    this.#isShown = isShown;
    this.#tools.isShown = isShown;
    this.#restart();
  }

  #restart() {
    this.#preview.stop();
    if (this.#isShown && document.visibilityState === 'visible' && this.#connection.isOpen) this.#preview.start();
  }

  async #load() {
    try {
      this.#plan = await this.#connection.ask('GetWall');
    } catch (error) {
      if (error.code === 'network') return;
      this.#plan = null;
    }
    this.#build();
    this.#showStates();
    this.#preview.forget();
    this.#restart();
  }

  #build() {
    this.#buttons.clear();
    this.#rows.clear();
    this.#pictures.clear();
    this.#tools.uncover();
    this.#tools.node.hidden = !this.#plan;
    this.#tools.side.hidden ||= !this.#plan;
    if (!this.#plan) {
      setChildren(this.#sheets, [this.#whole]);
      return;
    }
    const sheets = unfold(this.#plan);
    setChildren(this.#sheets, sheets.map((sheet) => this.#sheetNode(sheet, sheets.length)));
    this.#tools.begin();
    const widest = Math.max(...this.#plan.tiles.map((tile) => tile.width));
    // As many pixels as a page is wide are enough for the whole wall.
    const across = sheets.reduce((sum, sheet) => sum + pixelsAcross(sheet), 0);
    const wanted = Math.max(1, across / Math.max(640, innerWidth * devicePixelRatio));
    this.#preview.shrink = Math.min(32, widest, 2 ** Math.round(Math.log2(wanted)));
  }

  #sheetNode(sheet, count) {
    const area = element('div', { class: sheet.isFlat ? 'sheet flat' : 'sheet' });
    area.style.aspectRatio = `${sheet.width} / ${sheet.height}`;
    for (const place of sheet.tiles) {
      const button = new TileButton(place.name, () => this.#open(place.name));
      button.place(place, sheet);
      this.#buttons.set(place.name, button);
      area.append(button.node);
    }
    this.#tools.cover(area, sheet);
    const figure = element('figure', {}, area);
    figure.style.setProperty('--share', sheet.width);
    figure.style.setProperty('--shape', sheet.width / sheet.height);
    if (count > 1) figure.append(element('figcaption', { text: sheet.name }));
    return figure;
  }

  /** Tiles with their hosts; where the wall tells none, hosts alone. */
  #tiles() {
    if (this.#plan) return this.#plan.tiles;
    return (this.#status.newest?.hosts ?? []).map((host) => ({ name: host.name, host: host.name }));
  }

  #hostOf(tile) {
    return this.#status.newest?.hosts.find((host) => host.name === tile.host);
  }

  #showStates() {
    for (const tile of this.#tiles()) {
      const state = this.#hostOf(tile)?.state ?? 'absent';
      this.#buttons.get(tile.name)?.showState(state);
      let row = this.#rows.get(tile.name);
      if (!row) {
        const sign = element('span', { class: 'sign' }), what = element('span', { class: 'muted' });
        const button = element('button', { type: 'button', onclick: () => this.#open(tile.name) }, sign,
                               element('span', { class: 'name', text: tile.name }), what);
        row = { node: element('li', {}, button), sign, what };
        this.#rows.set(tile.name, row);
      }
      const { sign, tone } = signOf(state);
      setText(row.sign, sign);
      row.sign.dataset.tone = tone;
      setText(row.what, tile.host === tile.name ? state : `${state}, ${tile.host}`);
    }
    setChildren(this.#list, this.#tiles().map((tile) => this.#rows.get(tile.name).node));
    this.#dialog.refresh();
  }

  #showWhole(picture) {
    this.#whole.width = picture.width;
    this.#whole.height = picture.height;
    this.#whole.getContext('2d').drawImage(picture, 0, 0);
    picture.close();
  }

  #open(name) {
    this.#dialog.open(`Tile ${name}`, () => this.#facts(name));
  }

  /** @returns {[string, string][]} */
  #facts(name) {
    const tile = this.#tiles().find((one) => one.name === name);
    const status = this.#status.newest;
    if (!status) return [['State', 'not known: the connection is lost']];
    if (!tile) return [['State', 'the wall has no such tile any more']];
    const host = this.#hostOf(tile);
    const facts = [['State', host?.state ?? 'absent'], ['Host', tile.host]];
    if (tile.screen) {
      facts.push(['Screen', tile.screen], ['Eye', tile.eye], ['Size', `${tile.width} × ${tile.height} pixels`],
                 ['Place', `${tile.x}, ${tile.y} pixels from the upper left`]);
    }
    if (host) {
      const behind = Math.max(0, status.frame - 1 - host.last_shown);
      facts.push(['Last frame shown', `${host.last_shown}, ${behind} behind`],
                 ['Round trip', `${host.round_trip_ms.toFixed(1)} ms`]);
    }
    const waits = status.waits.find((wait) => wait.tile === name || (!tile.screen && wait.host === name));
    const waited = waits && `${waits.frames} of ${status.wait_frames} frames, ${waits.ms.toFixed(1)} ms in all`;
    facts.push(['Waited for', waited ?? 'never of late']);
    if (waits?.reason) facts.push(['Because of', waits.reason]);
    const picture = this.#pictures.get(name);
    if (picture) facts.push(['Picture here', `of frame ${picture.frame}`]);
    if (this.#missing.has(name)) facts.push(['Drawn by', 'nobody now']);
    return facts;
  }
}

/** Of the tiles of a sheet, if they all lay in a row as they do. */
function pixelsAcross(sheet) {
  const densest = Math.max(...sheet.tiles.map(({ width, tile }) => tile.width / width), 0);
  return densest * sheet.width;
}
