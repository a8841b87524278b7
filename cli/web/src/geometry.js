// Places on a ball, for drawing only: what is decided is decided by the server.

const EARTH_M = 6371008.8;
const rad = Math.PI / 180;

/** The place at a distance and azimuth from another, along a great circle. */
export function destination({lon, lat}, azimuth_deg, distance_m) {
  const arc = distance_m / EARTH_M;
  const [a, phi] = [azimuth_deg * rad, lat * rad];
  const sin_phi2 = Math.sin(phi) * Math.cos(arc) + Math.cos(phi) * Math.sin(arc) * Math.cos(a);
  const lambda2 = lon * rad + Math.atan2(Math.sin(a) * Math.sin(arc) * Math.cos(phi), Math.cos(arc) - Math.sin(phi) * sin_phi2);
  return [lambda2 / rad, Math.asin(sin_phi2) / rad];
}

/** Degrees clockwise from north, 0 to 360. */
export function azimuth_deg(from, to) {
  const [phi1, phi2, d] = [from.lat * rad, to.lat * rad, (to.lon - from.lon) * rad];
  const a = Math.atan2(Math.sin(d) * Math.cos(phi2), Math.cos(phi1) * Math.sin(phi2) - Math.sin(phi1) * Math.cos(phi2) * Math.cos(d));
  return (a / rad + 360) % 360;
}

/** A circle or a sector as a line around it. */
export function ring(place, radius_m, azimuths_deg) {
  const [from, to] = azimuths_deg ?? [0, 360];
  const span = azimuths_deg ? (((to - from) % 360) + 360) % 360 || 360 : 360;
  const steps = Math.max(8, Math.round(span / 3));
  const edge = Array.from({length: steps + 1}, (_, i) => destination(place, from + (span * i) / steps, radius_m));
  return span === 360 ? edge : [[place.lon, place.lat], ...edge, [place.lon, place.lat]];
}

/** A straight line on the map, in pieces, so that 3D terrain can carry it. */
export function line(from, to, pieces = 64) {
  return Array.from({length: pieces + 1}, (_, i) => between(from, to, i / pieces));
}

export const between = (from, to, part) => [from.lon + (to.lon - from.lon) * part, from.lat + (to.lat - from.lat) * part];
