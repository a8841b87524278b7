// The server, as docs/server.md describes it. What goes wrong comes back as a Problem, in words.
import {position} from './store.js';

export class Problem extends Error {
  /** @param seconds  after which it may be tried again, or 0 */
  constructor(message, {status = 0, seconds = 0} = {}) {
    super(message);
    this.status = status;
    this.seconds = seconds;
  }
}

async function in_words(response) {
  let said = null;
  try {
    said = await response.json();
  } catch {
    // Not from our server, or cut off: the status has to do.
  }
  return new Problem(said?.detail || said?.title || `The server answered ${response.status} ${response.statusText}.`, {
    status: response.status,
    seconds: Number(response.headers.get('Retry-After')) || 0,
  });
}

/** Like fetch, but only of good answers.
 *  Throws Problem; throws AbortError where the signal says so. */
export async function ask(path, options = {}) {
  let response;
  try {
    response = await fetch(new URL(path, document.baseURI), options);
  } catch (error) {
    if (error.name === 'AbortError') throw error;
    throw new Problem('The server does not answer. Is scarp serve still running?');
  }
  if (!response.ok) throw await in_words(response);
  return response;
}

export const scenes = async () => (await (await ask('scenes')).json()).scenes;

export const tile_json = async (scene, layer) => (await ask(`scenes/${encodeURIComponent(scene)}/tiles/${layer}.json`)).json();

export async function ground_m(scene, lon, lat, signal) {
  const response = await ask(`scenes/${encodeURIComponent(scene)}/height?at=${lon},${lat}`, {signal});
  return (await response.json()).ground_m;
}

/** @param accept  the form of the answer */
export const execute = (process, inputs, {accept = 'application/json', signal} = {}) =>
  ask(`processes/${process}/execution`, {
    method: 'POST',
    headers: {'Content-Type': 'application/json', Accept: accept},
    body: JSON.stringify({inputs}),
    signal,
  });

const air = ({refraction}) => (refraction === null ? {} : {refraction});

export function viewshed_inputs(state) {
  const inputs = {
    scene: state.scene,
    observers: state.eyes.map(position),
    max_distance_m: state.radius_m,
    target_height_m: state.target_height_m,
    mode: state.mode,
    ...air(state),
  };
  if (state.min_distance_m) inputs.min_distance_m = state.min_distance_m;
  if (state.azimuth_deg) inputs.azimuth = state.azimuth_deg;
  if (state.pitch_deg) inputs.pitch = state.pitch_deg;
  return inputs;
}

export const sight_inputs = (state) => ({
  scene: state.scene,
  from: position(state.from),
  to: position(state.to),
  ...air(state),
});

export const horizon_inputs = (state) => ({
  scene: state.scene,
  at: position(state.point),
  azimuths: 360,
  ...air(state),
});

export function cull_inputs(state) {
  const inputs = {scene: state.scene, camera: position(state.camera)};
  if (state.heading_deg !== null) {
    inputs.heading_deg = state.heading_deg;
    inputs.field_of_view_deg = state.field_of_view_deg;
  }
  return inputs;
}
