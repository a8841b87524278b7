// The command line that gives the same answer, exactly: the same positions, digit for digit.
import {position} from './store.js';

/** As a shell takes one word. */
export const quoted = (word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

/** Words of a command, an option with its value together, or null while there is nothing to ask.
 *  @param scene  as the server describes it */
export function words(state, scene) {
  const source = scene.file ?? scene.name;
  const crs = ['--crs', 'OGC:CRS84'];
  const refraction = state.refraction ?? scene.refraction ?? 0;
  // A scene has its own air and earth.
  const air = scene.kind === 'scene' ? [] : [
    ...(refraction ? [['--refraction', String(refraction)]] : []),
    ...(scene.earth === 'flat' ? [['--earth', 'flat']] : [])];
  if (state.tool === 'viewshed') {
    if (!state.eyes.length) return null;
    const options = [...state.eyes.map((eye) => ['--observer', position(eye)]), crs];
    options.push(['--max-distance', String(state.radius_m)]);
    if (state.min_distance_m) options.push(['--min-distance', String(state.min_distance_m)]);
    if (state.target_height_m) options.push(['--target-height', String(state.target_height_m)]);
    if (state.azimuth_deg) options.push(['--azimuth', state.azimuth_deg.join(',')]);
    if (state.pitch_deg) options.push(['--pitch', state.pitch_deg.join(',')]);
    if (state.mode !== 'visible') options.push(['--mode', state.mode]);
    return [['scarp', 'viewshed', source], ...options, ...air, ['-o', `${state.mode === 'visible' ? 'seen' : state.mode}.tif`]];
  }
  if (state.tool === 'sight') {
    if (!state.from || !state.to) return null;
    return [['scarp', 'sight', source], ['--from', position(state.from)], ['--to', position(state.to)], crs, ...air];
  }
  if (state.tool === 'horizon') {
    if (!state.point) return null;
    return [['scarp', 'horizon', source], ['--at', position(state.point)], crs, ...air, ['-o', 'horizon.csv']];
  }
  if (!state.camera) return null;
  const view = state.heading_deg === null ? [] : [['--azimuth', String(state.heading_deg)], ['--field-of-view', String(state.field_of_view_deg)]];
  return [['scarp', 'cull', source], ['--camera', position(state.camera)], crs, ...view, ['--json']];
}

/** The same as pieces of one line, which may be broken between them. */
export const pieces = (state, scene) => words(state, scene)?.map((piece) => piece.map(quoted).join(' ')) ?? [];

export const command = (state, scene) => pieces(state, scene).join(' ');
