// All that was chosen, as the part of the address after the #, and back.
// Only what differs from the defaults is written. What cannot be read is left at its default.
import {DEFAULTS, MODES, THEMES, TOOLS, coordinates, height, position} from './store.js';

const LAYERS = ['relief', 'groups', 'terrain'];
const PLACES = ['from', 'to', 'point', 'camera'];
const NUMBERS = {
  radius: ['radius_m', 0.1, 1e8],
  nearest: ['min_distance_m', 0, 1e8],
  target: ['target_height_m', 0, 1e5],
  refraction: ['refraction', 0, 1],
  heading: ['heading_deg', 0, 360],
  fov: ['field_of_view_deg', 0.1, 179],
};
const PAIRS = {azimuth: ['azimuth_deg', 0, 360], pitch: ['pitch_deg', -90, 90]};
const CHOICES = {tool: TOOLS, mode: MODES, theme: THEMES};

export function encode(state) {
  const out = [];
  const put = (key, text) => out.push(`${key}=${encodeURIComponent(text).replace(/%2C/g, ',').replace(/%2F/g, '/')}`);
  if (state.scene) put('scene', state.scene);
  const view = state.view;
  if (view) {
    const round = (value, digits) => Number(value.toFixed(digits));
    put('view', [round(view.zoom, 2), round(view.lat, 5), round(view.lon, 5), round(view.bearing_deg, 1), round(view.pitch_deg, 1)].join('/'));
  }
  for (const key in CHOICES) if (state[key] !== DEFAULTS[key]) put(key, state[key]);
  for (const eye of state.eyes) put('eye', `${position(eye)}${eye.name ? `,${eye.name}` : ''}`);
  if (state.chosen) put('chosen', state.chosen);
  for (const [key, [name]] of Object.entries(NUMBERS)) if (state[name] !== DEFAULTS[name]) put(key, state[name]);
  for (const [key, [name]] of Object.entries(PAIRS)) if (state[name]) put(key, state[name].join(','));
  for (const key of PLACES) if (state[key]) put(key, position(state[key]));
  const layers = LAYERS.filter((key) => state[key]);
  if (layers.join() !== LAYERS.filter((key) => DEFAULTS[key]).join()) put('show', layers.join(',') || 'none');
  return out.join('&');
}

function number(text, low, high) {
  const value = text.trim() === '' ? NaN : Number(text);
  return value >= low && value <= high ? value : undefined;
}

function place(text) {
  const [lon, lat, h, ...name] = text.split(',');
  const at = coordinates(`${lon},${lat}`);
  const above = height(h ?? '2');
  return at && above !== null ? {...at, height: above, name: name.join(',').slice(0, 80)} : undefined;
}

export function decode(hash) {
  const state = {...DEFAULTS};
  let given;
  try {
    given = hash.replace(/^#/, '').split('&').filter(Boolean).map((part) => {
      const at = part.indexOf('=');
      return at < 0 ? [part, ''] : [part.slice(0, at), decodeURIComponent(part.slice(at + 1))];
    });
  } catch {
    return state; // a broken escape: an address that was cut off
  }
  const eyes = [];
  for (const [key, text] of given) {
    if (key === 'scene') state.scene = text;
    if (key === 'view') {
      const [zoom, lat, lon, bearing_deg, pitch_deg] = text.split('/').map(Number);
      if ([zoom, lat, lon].every(Number.isFinite) && Math.abs(lat) <= 90) {
        state.view = {zoom, lat, lon, bearing_deg: bearing_deg || 0, pitch_deg: pitch_deg || 0};
      }
    }
    if (CHOICES[key]?.includes(text)) state[key] = text;
    if (key === 'eye') eyes.push(place(text));
    if (key === 'chosen') state.chosen = number(text, 0, 31) ?? 0;
    if (NUMBERS[key]) {
      const [name, low, high] = NUMBERS[key];
      state[name] = number(text, low, high) ?? DEFAULTS[name];
    }
    if (PAIRS[key]) {
      const [name, low, high] = PAIRS[key];
      const pair = text.split(',').map((part) => number(part, low, high));
      if (pair.length === 2 && !pair.includes(undefined)) state[name] = pair;
    }
    if (PLACES.includes(key)) {
      const at = place(text);
      if (at) state[key] = {lon: at.lon, lat: at.lat, height: at.height};
    }
    if (key === 'show') for (const layer of LAYERS) state[layer] = text.split(',').includes(layer);
  }
  state.eyes = eyes.filter(Boolean).slice(0, 32);
  state.chosen = Math.min(state.chosen, Math.max(0, state.eyes.length - 1));
  return state;
}
