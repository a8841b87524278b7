// The map: our own tiles as its base, the picture of a viewshed over them, lines and markers.
import maplibregl from 'maplibre-gl';
import 'maplibre-gl/dist/maplibre-gl.css';
import {ring, line} from './geometry.js';
import {tile_json} from './api.js';
import {CulledTiles} from './culled_tiles.js';
import {ink, dark} from './theme.js';

const calm = () => matchMedia('(prefers-reduced-motion: reduce)').matches;

const feature = (coordinates, properties = {}, type = 'LineString') => ({
  type: 'Feature',
  properties,
  geometry: {type, coordinates},
});

export class MapView {
  /** @param element  of the page  @param store  state: the view is kept there */
  constructor(element, store) {
    this.store = store;
    this.element = element;
    this.layers = new Set();
    this.culled = new CulledTiles();
    const {view} = store.state;
    this.map = new maplibregl.Map({
      container: element,
      style: {version: 8, sources: {}, layers: [{id: 'paper', type: 'background', paint: {'background-color': ink('--paper')}}]},
      center: view ? [view.lon, view.lat] : [0, 0],
      zoom: view?.zoom ?? 1,
      bearing: view?.bearing_deg ?? 0,
      pitch: view?.pitch_deg ?? 0,
      maxPitch: 80,
      attributionControl: false,
      fadeDuration: calm() ? 0 : 150,
      pixelRatio: Math.min(devicePixelRatio, 2),
      locale: {'Map.Title': 'Map. Arrow keys move it, plus and minus zoom; Enter answers for the middle.'},
    });
    element.map = this.map;
    this.map.addControl(new maplibregl.NavigationControl({visualizePitch: true}), 'top-right');
    this.map.addControl(new maplibregl.ScaleControl({maxWidth: 120}), 'bottom-left');
    this.map.on('moveend', () => this.#keep_view());
    this.loaded = new Promise((done) => this.map.once('load', done));
  }

  #keep_view() {
    const centre = this.map.getCenter();
    this.store.set({
      view: {
        lon: centre.lng, lat: centre.lat, zoom: this.map.getZoom(),
        bearing_deg: this.map.getBearing(), pitch_deg: this.map.getPitch(),
      },
    });
  }

  /** Shows another scene. Throws Problem. */
  async show_scene(scene, keep_view) {
    await this.loaded;
    const [hillshade, terrain, groups, ids] = await Promise.all(
      ['hillshade', 'terrain-rgb', ...(scene.groups ? ['groups', 'group-ids'] : [])].map((layer) => tile_json(scene.name, layer)));
    const absolute = (template) => new URL(template, document.baseURI).href.replaceAll('%7B', '{').replaceAll('%7D', '}');
    const tiles = (json) => ({
      tiles: json.tiles.map(absolute),
      minzoom: json.minzoom ?? 0,
      maxzoom: json.maxzoom ?? 16,
      bounds: json.bounds ?? scene.bounds,
      tileSize: 256,
    });
    const empty = {type: 'geojson', data: {type: 'FeatureCollection', features: []}};
    const [w, s, e, n] = scene.bounds;
    const frame = [[w, s], [e, s], [e, n], [w, n], [w, s]];
    const sources = {
      hillshade: {type: 'raster', ...tiles(hillshade)},
      terrain: {type: 'raster-dem', encoding: terrain.encoding ?? 'mapbox', ...tiles(terrain)},
      ...(groups && {
        groups: {type: 'raster', ...tiles(groups)},
        culled: {type: 'raster', ...tiles(ids), tiles: [this.culled.over(absolute(ids.tiles[0]))]},
      }),
      picture: {type: 'canvas', canvas: Object.assign(document.createElement('canvas'), {width: 2, height: 2}), animate: false, coordinates: corners([w, s, e, n])},
      limits: empty, sight: empty, horizon: empty, camera: empty, edge: {...empty, data: feature(frame)},
      // Beyond the scene tiles have heights that mean nothing.
      beyond: {...empty, data: feature([[[-180, -85], [180, -85], [180, 85], [-180, 85], [-180, -85]], [...frame].reverse()], {}, 'Polygon')},
    };
    const round = {'line-cap': 'round', 'line-join': 'round'};
    const layers = [
      {id: 'paper', type: 'background'},
      {id: 'hillshade', type: 'raster', source: 'hillshade'},
      ...(groups ? [{id: 'groups', type: 'raster', source: 'groups', paint: {'raster-resampling': 'nearest', 'raster-opacity': 0.8}},
        {id: 'culled', type: 'raster', source: 'culled', paint: {'raster-resampling': 'nearest', 'raster-fade-duration': 0}}] : []),
      {id: 'beyond', type: 'fill', source: 'beyond', paint: {'fill-antialias': false}},
      {id: 'picture', type: 'raster', source: 'picture', layout: {visibility: 'none'}, paint: {'raster-fade-duration': 0, 'raster-resampling': 'nearest'}},
      {id: 'edge', type: 'line', source: 'edge', paint: {'line-width': 1, 'line-opacity': 0.4}},
      {id: 'limits', type: 'line', source: 'limits', layout: round, paint: {'line-width': 1.5, 'line-opacity': 0.8, 'line-dasharray': [2, 3]}},
      {id: 'camera', type: 'fill', source: 'camera', paint: {'fill-opacity': 0.12}},
      {id: 'camera-edge', type: 'line', source: 'camera', layout: round, paint: {'line-width': 2}},
      {id: 'horizon', type: 'line', source: 'horizon', layout: round, paint: {'line-width': 2}},
      {id: 'sight-casing', type: 'line', source: 'sight', layout: round, paint: {'line-width': 6, 'line-opacity': 0.85}},
      {id: 'sight', type: 'line', source: 'sight', filter: ['==', ['get', 'seen'], true], layout: round, paint: {'line-width': 3}},
      {id: 'sight-hidden', type: 'line', source: 'sight', filter: ['==', ['get', 'seen'], false], paint: {'line-width': 3, 'line-dasharray': [1.5, 1.5]}},
    ];
    this.layers = new Set(layers.map(({id}) => id));
    this.map.setTerrain(null);
    // No transitions: ground in 3D is painted once, and would keep what is half way.
    this.map.setStyle({version: 8, sources, layers, transition: {duration: 0, delay: 0}}, {diff: false});
    await new Promise((done) => this.map.once('style.load', done));
    this.colour();
    this.show_layers(this.store.state);
    if (!keep_view) this.map.fitBounds([[w, s], [e, n]], {padding: 24, animate: false});
    this.map.setMaxBounds(null);
  }

  /** Takes the page's colours. */
  colour() {
    const paint = (layer, key, value) => this.layers.has(layer) && this.map.setPaintProperty(layer, key, value);
    paint('paper', 'background-color', ink('--paper'));
    paint('beyond', 'fill-color', ink('--paper'));
    // Quiet enough for a viewshed over it.
    paint('hillshade', 'raster-brightness-min', dark() ? 0 : 0.2);
    paint('hillshade', 'raster-brightness-max', dark() ? 0.6 : 1);
    paint('edge', 'line-color', ink('--ink'));
    paint('limits', 'line-color', ink('--ink'));
    paint('horizon', 'line-color', ink('--horizon'));
    paint('camera', 'fill-color', ink('--camera'));
    paint('camera-edge', 'line-color', ink('--camera'));
    paint('sight-casing', 'line-color', ink('--panel'));
    paint('sight', 'line-color', ink('--seen'));
    paint('sight-hidden', 'line-color', ink('--hidden'));
  }

  show_layers(state) {
    const show = (layer, on) => this.layers.has(layer) && this.map.setLayoutProperty(layer, 'visibility', on ? 'visible' : 'none');
    // The server's hillshade is tinted by height.
    if (this.layers.has('hillshade')) this.map.setPaintProperty('hillshade', 'raster-saturation', state.relief ? -0.3 : -1);
    show('groups', state.groups);
    show('culled', state.tool === 'camera' && Boolean(state.camera));
    show('limits', state.tool === 'viewshed');
    for (const id of ['sight', 'sight-hidden', 'sight-casing']) show(id, state.tool === 'sight');
    show('horizon', state.tool === 'horizon');
    for (const id of ['camera', 'camera-edge']) show(id, state.tool === 'camera');
    if (!this.layers.size || !this.map.getSource('terrain')) return;
    const is = Boolean(this.map.getTerrain());
    if (state.terrain === is) return;
    this.map.setTerrain(state.terrain ? {source: 'terrain', exaggeration: 1} : null);
    const pitch = state.terrain ? Math.max(this.map.getPitch(), 55) : 0;
    if (this.settled) this.map.easeTo({pitch, duration: calm() ? 0 : 600});
  }

  /** The picture of an answer; called back when it is on the screen.
   *  @param bounds  [w, s, e, n] degrees of its edges */
  show_picture(bitmap, bounds, shown) {
    const source = this.map.getSource('picture');
    // As it is, without the way over a canvas, which would be read back. A width that is not the
    // source's own makes it upload, once; play() would do so in every frame.
    const before = source.canvas;
    source.canvas = bitmap;
    source.width = 0;
    source.setCoordinates(corners(bounds));
    before.close?.();
    this.map.setLayoutProperty('picture', 'visibility', 'visible');
    // Ground in 3D keeps what was painted on it until a style changes.
    if (this.map.getTerrain()) this.map.setPaintProperty('picture', 'raster-opacity', (this.odd = !this.odd) ? 1 : 0.9999);
    this.map.triggerRepaint();
    this.map.once('render', () => requestAnimationFrame(() => shown?.()));
  }

  hide_picture() {
    if (this.layers.has('picture')) this.map.setLayoutProperty('picture', 'visibility', 'none');
  }

  #draw(source, features) {
    this.map.getSource(source)?.setData({type: 'FeatureCollection', features});
  }

  draw_limits(eyes, radius_m, azimuth_deg) {
    this.#draw('limits', eyes.map((eye) => feature(ring(eye, radius_m, azimuth_deg))));
  }

  /** @param blocked_part  of the way, 0 to 1, or null where nothing blocks */
  draw_sight(from, to, blocked_part) {
    if (!from || !to) return this.#draw('sight', []);
    if (blocked_part === null) return this.#draw('sight', [feature(line(from, to), {seen: true})]);
    const along = line(from, to, 256);
    const at = Math.max(1, Math.min(255, Math.round(blocked_part * 256)));
    this.#draw('sight', [feature(along.slice(0, at + 1), {seen: true}), feature(along.slice(at), {seen: false})]);
  }

  /** Points may be null where no ground is: the line breaks there. */
  draw_horizon(points) {
    const pieces = [[]];
    for (const point of points) {
      if (point) pieces.at(-1).push(point);
      else if (pieces.at(-1).length) pieces.push([]);
    }
    this.#draw('horizon', pieces.filter((piece) => piece.length > 1).map((piece) => feature(piece)));
  }

  /** Which groups a camera's picture has, and which not.
   *  @param visible  numbers of groups, or null: nothing is shown */
  show_drawn(visible) {
    this.map.getSource('culled')?.setTiles([this.culled.draw(visible)]);
  }

  draw_camera(camera, heading_deg, field_deg, reach_m) {
    if (!camera) return this.#draw('camera', []);
    const half = field_deg / 2;
    const edge = heading_deg === null ? ring(camera, reach_m) : ring(camera, reach_m, [heading_deg - half, heading_deg + half]);
    this.#draw('camera', [feature([edge], {}, 'Polygon')]);
  }
}

const corners = ([w, s, e, n]) => [[w, n], [e, n], [e, s], [w, s]];
