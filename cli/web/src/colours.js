// The colours of the server's pictures of viewsheds (cli/serve/map_tiles), as a legend.

const ONE = [250, 196, 60];
const ALL = [160, 20, 80];
const MOST_ENTRIES = 6;
const NEEDED = [
  [ONE, 'under 0.5 m'], [[248, 164, 66], '0.5 to 2 m'], [[238, 130, 76], '2 to 5 m'], [[216, 98, 92], '5 to 10 m'],
  [[184, 72, 110], '10 to 25 m'], [[146, 56, 124], '25 to 50 m'], [[106, 46, 126], '50 to 100 m'], [[66, 38, 110], 'more'],
];

const rgb = (channels) => `rgb(${channels.join(' ')})`;

/** Entries of a mode; none where there is but one colour. */
export function legend(mode, eyes) {
  if (mode === 'ground') return NEEDED.map(([colour, text]) => ({colour: rgb(colour), text}));
  if (mode !== 'count' || eyes < 2) return [];
  const length = Math.min(eyes, MOST_ENTRIES);
  const counts = Array.from({length}, (_, i) => 1 + Math.round((i * (eyes - 1)) / (length - 1)));
  return counts.map((n) => {
    const part = (n - 1) / (eyes - 1);
    return {colour: rgb(ONE.map((channel, c) => Math.round(channel + part * (ALL[c] - channel)))), text: `${n} ${n === 1 ? 'eye' : 'eyes'}`};
  });
}
