// What the page knows and what was chosen, in one object that is replaced, never changed.

/** @typedef {{lon: number, lat: number, height: string}} Place  degrees; height as the program
 *  takes it: metres above ground ("2"), or above the datum ("1200asl") */
/** @typedef {Place & {name: string}} Eye */

export const DEFAULTS = Object.freeze({
  scene: '',
  view: null, // {lon, lat, zoom, bearing_deg, pitch_deg}; null: all of the scene
  tool: 'viewshed',
  eyes: Object.freeze([]),
  chosen: 0,
  radius_m: 15000,
  min_distance_m: 0,
  target_height_m: 0,
  refraction: null, // null: the scene's own
  azimuth_deg: null, // [from, to]
  pitch_deg: null, // [lowest, highest]
  mode: 'visible',
  from: null,
  to: null,
  point: null,
  camera: null,
  heading_deg: null, // null: all around
  field_of_view_deg: 90,
  relief: true,
  groups: false,
  terrain: false,
  theme: 'auto',
});

export const TOOLS = ['viewshed', 'sight', 'horizon', 'camera'];
export const MODES = ['visible', 'count', 'ground'];
export const THEMES = ['auto', 'light', 'dark'];

export function createStore(initial) {
  let state = {...DEFAULTS, ...initial};
  const listeners = new Set();
  return {
    get state() {
      return state;
    },
    set(patch) {
      const before = state;
      state = {...state, ...patch};
      for (const listener of listeners) listener(state, before);
    },
    /** Calls back with the state now and before, when one of the keys has changed. */
    on(keys, call) {
      listeners.add((now, before) => {
        if (keys.some((key) => now[key] !== before[key])) call(now, before);
      });
    },
  };
}

/** Degrees as they are kept, asked and written: 7 decimals, a centimetre. */
export const rounded = (degrees) => Math.round(degrees * 1e7) / 1e7;

export const longitude = (degrees) => rounded(((((degrees + 180) % 360) + 360) % 360) - 180);

export const HEIGHT = /^\s*(-?\d+(?:\.\d+)?)\s*(?:m\s*)?(asl)?\s*$/;

/** "2", "12.5" and "1200asl"; null for anything else. */
export function height(text) {
  const found = HEIGHT.exec(text);
  return found ? `${Number(found[1])}${found[2] ?? ''}` : null;
}

/** "8.65, 46.55": longitude and latitude in degrees; null for anything else. */
export function coordinates(text) {
  const found = /^\s*(-?\d+(?:\.\d+)?)\s*[,; ]\s*(-?\d+(?:\.\d+)?)\s*$/.exec(text);
  if (!found) return null;
  const [lon, lat] = [Number(found[1]), Number(found[2])];
  return Math.abs(lon) <= 180 && Math.abs(lat) <= 90 ? {lon: rounded(lon), lat: rounded(lat)} : null;
}

/** A place as the program and the server take it. */
export const position = (place) => `${place.lon},${place.lat},${place.height}`;
