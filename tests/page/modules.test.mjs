// The page's modules that need no browser. Only Node: nothing to install.
import assert from 'node:assert/strict';
import {describe, it} from 'node:test';
import {command, quoted} from '../../cli/web/src/command.js';
import {azimuth_deg, destination, ring} from '../../cli/web/src/geometry.js';
import {Newest} from '../../cli/web/src/newest.js';
import {decode, encode} from '../../cli/web/src/permalink.js';
import {DEFAULTS, coordinates, height, longitude} from '../../cli/web/src/store.js';
import {area, compass, distance} from '../../cli/web/src/words.js';

// A small generator with a seed, so that a failure can be had again.
function random(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

function any_state(next) {
  const pick = (list) => list[Math.floor(next() * list.length)];
  const place = () => ({lon: longitude(next() * 360 - 180), lat: coordinates(`0,${(next() * 170 - 85).toFixed(7)}`).lat, height: pick(['2', '0', '12.5', '-3', '1200asl'])});
  const maybe = (make) => (next() < 0.5 ? null : make());
  return {
    ...DEFAULTS,
    scene: pick(['alps', 'a b', 'ü&=#%,/', "o'hare"]),
    tool: pick(['viewshed', 'sight', 'horizon', 'camera']),
    eyes: Array.from({length: Math.floor(next() * 4)}, () => ({...place(), name: pick(['', 'Tower', 'a,b', 'ä&=#', "x'y"])})),
    radius_m: Math.round(next() * 1e5) + 1,
    min_distance_m: pick([0, 250]),
    target_height_m: pick([0, 1.75]),
    refraction: pick([null, 0, 0.13, 0.25]),
    azimuth_deg: maybe(() => [350, 10.5]),
    pitch_deg: maybe(() => [-12, 30]),
    mode: pick(['visible', 'count', 'ground']),
    from: maybe(place),
    to: maybe(place),
    point: maybe(place),
    camera: maybe(place),
    heading_deg: maybe(() => 45),
    field_of_view_deg: pick([90, 30]),
    relief: next() < 0.5,
    groups: next() < 0.5,
    terrain: next() < 0.5,
    theme: pick(['auto', 'light', 'dark']),
  };
}

describe('permalink', () => {
  it('keeps every state', () => {
    for (let seed = 1; seed <= 300; ++seed) {
      const state = any_state(random(seed));
      assert.deepEqual(decode(`#${encode(state)}`), state, `seed ${seed}`);
    }
  });

  it('opens whatever it is given', () => {
    const next = random(7);
    const good = encode({...any_state(random(3)), view: {lon: 1, lat: 2, zoom: 3, bearing_deg: 4, pitch_deg: 5}});
    for (let i = 0; i < 2000; ++i) {
      const cut = good.slice(0, Math.floor(next() * good.length));
      const at = Math.floor(next() * cut.length);
      const state = decode(`#${cut.slice(0, at)}${String.fromCharCode(32 + Math.floor(next() * 95))}${cut.slice(at + 1)}`);
      assert.ok(state.radius_m > 0 && state.eyes.length <= 32 && Math.abs(state.view?.lat ?? 0) <= 90);
    }
    assert.deepEqual(decode('#%E0%A4%A'), {...DEFAULTS});
    assert.deepEqual(decode('#radius=-5&refraction=NaN&mode=all&eye=1,95,2&eye=&azimuth=1&theme=x'), {...DEFAULTS});
  });
});

describe('command', () => {
  const state = {...DEFAULTS, eyes: [{lon: -84.1, lat: 36.5, height: '2', name: ''}]};

  it('says all that was asked, and nothing else', () => {
    assert.equal(command(state, {name: 'alps', file: 'alps.tif'}), 'scarp viewshed alps.tif --observer -84.1,36.5,2 --crs OGC:CRS84 --max-distance 15000 -o seen.tif');
    const more = {...state, target_height_m: 1.5, azimuth_deg: [350, 10], pitch_deg: [-5, 5], mode: 'count', refraction: 0.13, min_distance_m: 100};
    assert.equal(command(more, {name: 'alps', file: 'alps.tif'}), 'scarp viewshed alps.tif --observer -84.1,36.5,2 --crs OGC:CRS84 --max-distance 15000 --min-distance 100 --target-height 1.5 --azimuth 350,10 --pitch -5,5 --mode count --refraction 0.13 -o count.tif');
  });

  it('takes over the air that a DEM is served with, and leaves a scene its own', () => {
    assert.match(command(state, {name: 'a', file: 'a.tif', refraction: 0.25, earth: 'flat'}), / --refraction 0.25 --earth flat -o /);
    assert.doesNotMatch(command(state, {name: 'a', kind: 'scene', refraction: 0.25}), /refraction/);
  });

  it('is empty while there is nothing to ask', () => {
    for (const tool of ['viewshed', 'sight', 'horizon', 'camera']) assert.equal(command({...DEFAULTS, tool}, {name: 'a'}), '');
  });

  it('quotes for a shell', () => {
    assert.equal(quoted("o'hare $(x).tif"), `'o'\\''hare $(x).tif'`);
    assert.equal(quoted('-84.1,36.5,2'), '-84.1,36.5,2');
  });
});

describe('newest', () => {
  it('has one under way and drops what was overtaken', async () => {
    const newest = new Newest();
    const begun = [];
    let together = 0;
    const finish = [];
    for (let i = 0; i < 5; ++i) {
      newest.ask(() => {
        begun.push(i);
        assert.equal(++together, 1);
        return new Promise((done) => finish.push(() => { --together; done(); }));
      });
    }
    assert.deepEqual(begun, [0]);
    finish.shift()();
    await new Promise(setImmediate);
    assert.deepEqual(begun, [0, 4]);
    finish.shift()();
    await new Promise(setImmediate);
    newest.ask(async () => void begun.push(9));
    assert.deepEqual(begun, [0, 4, 9]);
  });

  it('leaves what is under way when it is stopped', async () => {
    const newest = new Newest();
    let told = null;
    newest.ask((signal) => new Promise((done) => signal.addEventListener('abort', () => { told = true; done(); })));
    newest.ask(() => assert.fail('was dropped'));
    newest.stop();
    await new Promise(setImmediate);
    assert.equal(told, true);
  });
});

describe('fields', () => {
  it('reads heights as the program does', () => {
    for (const [text, is] of [['2', '2'], [' 12.50 m', '12.5'], ['1200asl', '1200asl'], ['1200 m asl', '1200asl'], ['-3', '-3'], ['high', null], ['', null], ['1e5', null]]) assert.equal(height(text), is, text);
  });

  it('reads coordinates within the world only', () => {
    assert.deepEqual(coordinates('8.65, 46.55'), {lon: 8.65, lat: 46.55});
    for (const text of ['46.55', '8.65,95', '200,0', 'a,b', '1,2,3', '']) assert.equal(coordinates(text), null, text);
  });
});

describe('geometry', () => {
  it('goes there and looks back', () => {
    const next = random(11);
    for (let i = 0; i < 500; ++i) {
      const at = {lon: next() * 340 - 170, lat: next() * 140 - 70};
      const turned = next() * 360;
      const [lon, lat] = destination(at, turned, 1000 + next() * 50000);
      const off = Math.abs(azimuth_deg(at, {lon, lat}) - turned) % 360;
      assert.ok(Math.min(off, 360 - off) < 1e-6);
    }
  });

  it('draws a sector over north in one piece', () => {
    const edge = ring({lon: 0, lat: 0}, 1000, [350, 10]);
    assert.deepEqual(edge[0], [0, 0]);
    assert.deepEqual(edge.at(-1), [0, 0]);
    assert.ok(edge.every(([, lat]) => lat >= 0));
  });
});

describe('words', () => {
  it('reads as people do', () => {
    assert.equal(distance(850), '850 m');
    assert.equal(distance(4213), '4.21 km');
    assert.equal(area(3_280_000), '3.28 km²');
    assert.deepEqual([0, 44, 350, 359].map(compass), ['N', 'NE', 'N', 'N']);
  });
});
