// Tiles of a scene's groups, painted by whether a camera's picture has them: the server says once
// which group is where, and each answer about a camera only paints that anew.
import maplibregl from 'maplibre-gl';
import {ask} from './api.js';
import {ink} from './theme.js';

const KEPT_TILES = 64;
const SIDE_PX = 256;
const ORPHAN = 0xffffff; // triangles without a group, which are always drawn
const ALPHA = {drawn: 110, culled: 150};

export class CulledTiles {
  #ids = new Map(); // group of each pixel by address, the last ones; -1 where there is no ground
  #drawn = null; // set of groups
  #version = 0;
  #template = '';

  constructor() {
    maplibregl.addProtocol('scarp-culled', async ({url}, {signal}) => ({data: await this.#paint(url, signal)}));
  }

  /** Takes another scene; gives the address of the tiles painted with nothing known.
   *  @param template  address of the tiles of its group numbers */
  over(template) {
    this.#template = template;
    return this.draw(null);
  }

  /** Paints anew; gives the address of the tiles now.
   *  @param visible  numbers of the groups that are drawn, or null */
  draw(visible) {
    this.#drawn = visible && new Set(visible);
    return `scarp-culled://${++this.#version}/${this.#template}`;
  }

  async #paint(url, signal) {
    const drawn = this.#drawn;
    const image = new ImageData(SIDE_PX, SIDE_PX);
    if (drawn) {
      const ids = await this.#ids_of(url.replace(/^scarp-culled:\/\/\d+\//, ''), signal);
      const [seen, culled] = [rgba('--seen', ALPHA.drawn), rgba('--hidden', ALPHA.culled)];
      const pixels = new Uint32Array(image.data.buffer);
      for (let i = 0; i < ids.length; ++i) if (ids[i] >= 0) pixels[i] = ids[i] === ORPHAN || drawn.has(ids[i]) ? seen : culled;
    }
    return createImageBitmap(image);
  }

  async #ids_of(address, signal) {
    let ids = this.#ids.get(address);
    if (!ids) {
      const blob = await (await ask(address, {signal})).blob();
      const bitmap = await createImageBitmap(blob, {colorSpaceConversion: 'none', premultiplyAlpha: 'none'});
      const context = new OffscreenCanvas(SIDE_PX, SIDE_PX).getContext('2d');
      context.drawImage(bitmap, 0, 0);
      const {data} = context.getImageData(0, 0, SIDE_PX, SIDE_PX);
      ids = Int32Array.from({length: SIDE_PX * SIDE_PX}, (_, i) => (data[4 * i + 3] ? (data[4 * i] << 16) | (data[4 * i + 1] << 8) | data[4 * i + 2] : -1));
    }
    this.#ids.delete(address);
    this.#ids.set(address, ids);
    if (this.#ids.size > KEPT_TILES) this.#ids.delete(this.#ids.keys().next().value);
    return ids;
  }
}

/** A colour of style.css as a pixel of ImageData. */
function rgba(name, alpha) {
  const [r, g, b] = ink(name).match(/\d+/g).map(Number);
  return ((alpha << 24) | (b << 16) | (g << 8) | r) >>> 0;
}
