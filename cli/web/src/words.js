// Numbers as people read them.

export const metres = (m) => `${Math.abs(m) < 10 ? Number(m.toFixed(1)) : Math.round(m)} m`;

export const distance = (m) => (m < 1000 ? metres(m) : `${(m / 1000).toFixed(m < 1e5 ? 2 : 0)} km`);

export function area(m2) {
  const km2 = m2 / 1e6;
  return km2 < 0.1 ? `${Math.round(m2).toLocaleString('en')} m²` : `${km2 < 10 ? km2.toFixed(2) : km2 < 1000 ? km2.toFixed(1) : Math.round(km2).toLocaleString('en')} km²`;
}

export const share = (part, whole) => (whole ? `${((100 * part) / whole).toFixed(1)} %` : '');

export const plural = (n, one, many = `${one}s`) => `${n.toLocaleString('en')} ${n === 1 ? one : many}`;

export const compass = (deg) => ['N', 'NE', 'E', 'SE', 'S', 'SW', 'W', 'NW'][Math.round(deg / 45) % 8];
