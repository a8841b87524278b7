// The page in Chromium, against a server of its own. See docs/page.md.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';
import {after, before, describe, it} from 'node:test';
import pngjs from 'pngjs';
import {idle, on_screen, open_page, shown, wait_data, wait_shown} from './support/open_page.mjs';
import {PROGRAM, browser_or_reason, make_data, read_raster, remove_folder, run, serve, temporary_folder} from './support/programs.mjs';

const {PNG} = pngjs;
const AXE = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
// On a ridge and in the middle of the DEM.
const EYE = {lon: -84.2461, lat: 36.5829};
const {launch, reason} = browser_or_reason();
if (reason) console.log(`Left out: the page in a browser (${reason})`);

describe('the page', {skip: reason}, () => {
  let folder, server, browser;
  before(async () => {
    folder = temporary_folder();
    make_data(folder);
    server = await serve(['jacksboro.tif', 'part.scene'], {cwd: folder});
    browser = await launch();
  }, {timeout: 300_000});
  after(async () => {
    await browser?.close();
    await server?.stop();
    remove_folder(folder);
  });

  /** Opens the page, does something, and holds it to a clean console. */
  async function with_page(work, {hash = '#scene=jacksboro', expected = [], ...options} = {}) {
    const opened = await open_page(browser, server.address, {hash, ...options});
    try {
      await work(opened.page);
      assert.deepEqual(opened.wrong.filter((text) => !expected.some((pattern) => pattern.test(text))), []);
    } finally {
      await opened.close();
    }
  }
  const right_click = async (page, {lon, lat}) => {
    const {x, y} = await on_screen(page, lon, lat);
    await page.mouse.click(x, y, {button: 'right'});
  };
  const run_command = async (page) => {
    const command = await page.locator('#command').textContent();
    return run('bash', ['-c', command.replace(/^scarp /, `${PROGRAM} `)], {cwd: folder});
  };
  async function download(page, button) {
    const [file] = await Promise.all([page.waitForEvent('download'), page.click(button)]);
    const path = join(folder, `downloaded-${file.suggestedFilename()}`);
    await file.saveAs(path);
    return path;
  }
  const middle = (page) => page.evaluate(() => document.getElementById('map').map.getCenter());
  const picture = async (page) => PNG.sync.read(await page.screenshot());

  it('answers a right click with the viewshed that the command line has', async () => {
    await with_page(async (page) => {
      await page.addStyleTag({content: '.maplibregl-marker, .maplibregl-ctrl, #readout { visibility: hidden }'});
      await page.evaluate(() => document.getElementById('map').map.setLayoutProperty('limits', 'visibility', 'none'));
      await idle(page);
      const bare = await picture(page);
      await right_click(page, EYE);
      await wait_shown(page);
      const at_once = await picture(page);
      await idle(page);
      const seen = await picture(page);
      // When the page says that it is there, it is there.
      let late = 0;
      for (let i = 0; i < seen.data.length; i += 4) late += Math.abs(at_once.data[i] - seen.data[i]) > 6;
      assert.ok(late < 0.002 * seen.data.length / 4, `${late} pixels came later`);
      assert.match(await page.locator('#viewshed-answer').textContent(), /Eye A sees [\d.,]+ km².*of the scene, looking 15\.00 km far · \d+ ms/);

      await run_command(page);
      const raster = read_raster(join(folder, 'seen.tif'), folder);
      const cells = await cells_on_screen(page, raster);
      const changed = (x, y) => [0, 1, 2].some((c) => Math.abs(bare.data[4 * (y * bare.width + x) + c] - seen.data[4 * (y * bare.width + x) + c]) > 6);
      let right = 0, inner = 0;
      for (const {x, y, visible, alone} of cells) {
        const same = changed(x, y) === visible;
        right += same;
        if (alone) continue;
        ++inner;
        assert.ok(same, `cell at ${x},${y} is ${visible ? 'visible' : 'hidden'} and drawn otherwise`);
      }
      assert.ok(cells.filter(({visible}) => visible).length > 500, 'too little is seen to compare');
      assert.ok(inner > 0.5 * cells.length && right > 0.97 * cells.length, `${right} of ${cells.length} as the raster has them`);
    }, {hash: `#scene=jacksboro&show=none&view=12/${EYE.lat}/${EYE.lon}/0/0`});
  });

  /** The cells whose middles are on the map: where, what the raster has, and whether a neighbour
   *  differs, so that half a pixel could. */
  async function cells_on_screen(page, {values, columns, rows, transform: [x0, dx, , y0, , dy]}) {
    const places = [];
    for (let row = 1; row + 1 < rows; ++row) {
      for (let column = 1; column + 1 < columns; ++column) places.push([row * columns + column, x0 + (column + 0.5) * dx, y0 + (row + 0.5) * dy]);
    }
    const found = await page.evaluate((all) => {
      const element = document.getElementById('map');
      const box = element.getBoundingClientRect();
      return all.map(([index, lon, lat]) => {
        const at = element.map.project([lon, lat]);
        return [index, Math.floor(box.x + at.x), Math.floor(box.y + at.y), at.x > 4 && at.y > 4 && at.x < box.width - 4 && at.y < box.height - 4];
      }).filter(([, , , inside]) => inside);
    }, places);
    return found.map(([index, x, y]) => {
      const around = [-1, 0, 1].flatMap((r) => [-1, 0, 1].map((c) => values[index + r * columns + c]));
      return {x, y, visible: values[index] === 1, alone: around.some((value) => value !== values[index])};
    });
  }

  it('follows the eye while it is dragged, the newest place last', async () => {
    await with_page(async (page) => {
      await right_click(page, EYE);
      await wait_shown(page);
      const before = await shown(page);
      const box = await page.locator('.handle.eye').boundingBox();
      const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
      await page.mouse.move(x, y);
      await page.mouse.down();
      for (let i = 1; i <= 40; ++i) {
        await page.mouse.move(x + 3 * i, y - i);
        await page.waitForTimeout(15);
      }
      assert.ok(await shown(page) > before + 1, 'nothing was shown on the way');
      await page.mouse.up();
      const end = await page.locator('#eyes .where').inputValue();
      await page.waitForFunction((at) => document.getElementById('map').dataset.eyes === at.replace(' ', ''), end);
      const [lon, lat] = end.split(',').map(Number);
      assert.ok(lon > EYE.lon && lat > EYE.lat);
    });
  });

  it('downloads what the command line writes', async () => {
    await with_page(async (page) => {
      await wait_shown(page);
      await run_command(page);
      const [ours, theirs] = [await download(page, '#download-tiff'), join(folder, 'count.tif')].map((path) => read_raster(path, folder));
      assert.deepEqual(ours, theirs);
      const outlines = JSON.parse(readFileSync(await download(page, '#download-geojson'), 'utf8'));
      assert.equal(outlines.type, 'FeatureCollection');
      assert.ok(outlines.features.length > 0);
    }, {hash: `#scene=jacksboro&mode=count&radius=6000&refraction=0.13&target=2&azimuth=300,120&eye=${EYE.lon},${EYE.lat},2,Tower&eye=-84.2,36.6,30,Mast`});
  });

  it('answers a sight line of two clicks with a profile and the first blocker', async () => {
    await with_page(async (page) => {
      await page.click('#tab-sight');
      for (const [lon, lat] of [[-84.30, 36.55], [-84.15, 36.62]]) {
        const {x, y} = await on_screen(page, lon, lat);
        await page.mouse.click(x, y);
        await page.waitForTimeout(400); // or the two are a double click
      }
      await wait_data(page, 'sight');
      const said = await page.locator('#sight-answer').textContent();
      const judged = JSON.parse(await run_command_json(page));
      const blocked = judged.first_blocker !== null && judged.first_blocker !== undefined;
      assert.match(said, blocked ? /They do not see each other.*blocks first/ : /They see each other/);
      assert.ok(blocked, 'choose ends with ground between them');
      await page.waitForSelector('#sight-plot .uplot canvas');
      const blocker = await page.locator('.handle.blocker').boundingBox();
      const along = judged.first_blocker.distance_m / judged.distance_m;
      const expected = await on_screen(page, -84.30 + 0.15 * along, 36.55 + 0.07 * along);
      assert.ok(Math.hypot(blocker.x + blocker.width / 2 - expected.x, blocker.y + blocker.height / 2 - expected.y) < 4);
      // The plot points at the map.
      const plot = await page.locator('#sight-plot .u-over').boundingBox();
      await page.mouse.move(plot.x + plot.width / 2, plot.y + 20);
      await page.waitForSelector('.handle.spot');
      assert.match(await page.locator('#tool-sight .says').textContent(), /^At [\d.]+ km: ground [\d.]+ m, line [\d.]+ m$/);
    });
  });
  const run_command_json = async (page) => {
    const command = await page.locator('#command').textContent();
    return run('bash', ['-c', `${command.replace(/^scarp /, `${PROGRAM} `)} --json`], {cwd: folder});
  };

  it('links the horizon and the map, both ways', async () => {
    await with_page(async (page) => {
      await page.click('#tab-horizon');
      const at = await on_screen(page, EYE.lon, EYE.lat);
      await page.mouse.click(at.x, at.y);
      await wait_data(page, 'horizon', '360');
      await page.waitForSelector('#horizon-plot .uplot canvas');
      // To the east of the place the plot says 90 degrees.
      await page.mouse.move(at.x + 120, at.y, {steps: 3});
      assert.match(await page.locator('#tool-horizon .says').textContent(), /^(89|90|91)° E: -?[\d.]+° up, [\d.]+ k?m away$/);
      assert.equal(await page.locator('.handle.spot').count(), 1);
      // The arrow keys walk around.
      await page.focus('#horizon-plot');
      await page.keyboard.press('ArrowRight');
      assert.match(await page.locator('#tool-horizon .says').textContent(), /° (N|E): /);
      // The same angles as the program's.
      await run_command(page);
      const theirs = readFileSync(join(folder, 'horizon.csv'), 'utf8').trim().split('\n').slice(1).map((row) => Number(row.split(',')[1]));
      const ours = readFileSync(await download(page, '#horizon-download'), 'utf8').trim().split('\n').slice(1).map((row) => row.split(',').slice(1, 3).map(Number));
      assert.equal(ours.length, theirs.length);
      ours.forEach(([low, high], i) => assert.ok(low - 1e-6 <= theirs[i] && theirs[i] <= high + 1e-6, `${i}°: ${theirs[i]} is not in ${low}..${high}`));
    });
  });

  it('shows what a camera culls', async () => {
    await with_page(async (page) => {
      await page.click('#tab-camera');
      const box = await page.locator('#map').boundingBox();
      await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
      await wait_data(page, 'culled');
      const culled = Number(await page.locator('#map').evaluate((map) => map.dataset.culled));
      const judged = JSON.parse(await run_command(page));
      assert.match(await page.locator('#camera-answer').textContent(), new RegExp(`${culled.toLocaleString('en')} hidden by ground`));
      assert.equal(culled, judged.groups - judged.visible_groups.length);
      assert.ok(culled > 0);
      // In their two colours, on the map.
      await idle(page);
      const {data} = await picture(page);
      const count = {drawn: 0, culled: 0};
      for (let i = 0; i < data.length; i += 4) {
        if (data[i + 1] > data[i] + 25) ++count.drawn;
        if (data[i] > data[i + 1] + 45) ++count.culled;
      }
      assert.ok(count.drawn > 1000 && count.culled > 1000, JSON.stringify(count));
    }, {hash: '#scene=part&show=none'});
  });

  it('says in words what went wrong, and goes on', async () => {
    await with_page(async (page) => {
      await page.click('#tab-viewshed');
      await right_click(page, EYE);
      await wait_shown(page);
      await page.fill('#eyes .where', '-70, 36.58');
      await page.keyboard.press('Enter');
      const problem = page.locator('#problem');
      await problem.waitFor({state: 'visible'});
      const said = await problem.textContent();
      assert.ok(said.length > 30 && !/undefined|\{|Error/.test(said), said);
      const before = await shown(page);
      await page.fill('#eyes .where', `${EYE.lon}, ${EYE.lat}`);
      await page.keyboard.press('Enter');
      await wait_shown(page, before);
      assert.equal(await problem.isVisible(), false);
      // What cannot be read is marked, and nothing is asked.
      await page.fill('#eyes .tall', 'high');
      await page.keyboard.press('Enter');
      assert.equal(await page.locator('#eyes .tall').getAttribute('aria-invalid'), 'true');
    }, {expected: [/status of 4\d\d/]});
  });

  it('says that the server is gone', async () => {
    await with_page(async (page) => {
      await page.route('**/processes/**', (route) => route.abort());
      await right_click(page, EYE);
      await page.locator('#problem').waitFor({state: 'visible'});
      assert.match(await page.locator('#problem').textContent(), /does not answer/);
    }, {expected: [/net::ERR_FAILED/]});
  });

  it('works with the keyboard alone', async () => {
    await with_page(async (page) => {
      await page.keyboard.press('v');
      await wait_shown(page);
      const focused = () => page.evaluate(() => document.activeElement.getAttribute('aria-label'));
      assert.match(await focused(), /^Eye A: drag, or move with the arrow keys/);
      const where = () => page.locator('#eyes .where').first().inputValue();
      const start = await where();
      const before = await shown(page);
      await page.keyboard.press('ArrowRight');
      await page.keyboard.press('Shift+ArrowUp');
      await wait_shown(page, before);
      const [lon0, lat0] = start.split(',').map(Number);
      const [lon, lat] = (await where()).split(',').map(Number);
      assert.ok(lon > lon0 && lat > lat0 && lat - lat0 > lon - lon0);
      await page.keyboard.press('Delete');
      assert.equal(await page.locator('#eyes li').count(), 0);
      // Enter on the map answers for its middle; with the sight line, twice.
      await page.keyboard.press('2');
      await page.keyboard.press('m');
      await page.keyboard.press('Enter');
      const west = (await middle(page)).lng;
      await page.keyboard.press('ArrowRight');
      await page.waitForFunction((before) => {
        const {map} = document.getElementById('map');
        return !map.isMoving() && map.getCenter().lng > before;
      }, west);
      await page.keyboard.press('Enter');
      await wait_data(page, 'sight');
      // Tabs with arrows, help with ? and Escape.
      await page.focus('#tab-sight');
      await page.keyboard.press('ArrowRight');
      assert.equal(await page.locator('#tab-horizon').getAttribute('aria-selected'), 'true');
      await page.keyboard.press('?');
      assert.equal(await page.locator('#help').evaluate((dialog) => dialog.open), true);
      await page.keyboard.press('Escape');
      assert.equal(await page.locator('#help').evaluate((dialog) => dialog.open), false);
      // A key typed into a field is text.
      await page.focus('#horizon-places input');
      await page.keyboard.press('4');
      assert.equal(await page.locator('#tab-horizon').getAttribute('aria-selected'), 'true');
    });
  });

  it('keeps everything in its address', async () => {
    const hash = `#scene=jacksboro&view=11.5/36.58/-84.25/0/0&mode=count&eye=${EYE.lon},${EYE.lat},2,Tower&eye=-84.2,36.6,1200asl,Mast&chosen=1&radius=8000&target=1.5&refraction=0.13&azimuth=300,120&show=none`;
    await with_page(async (page) => {
      await wait_shown(page);
      assert.deepEqual(await page.locator('#eyes .called').evaluateAll((inputs) => inputs.map(({value}) => value)), ['Tower', 'Mast']);
      assert.equal(await page.locator('#radius').inputValue(), '8');
      assert.equal(await page.locator('#azimuth-from').inputValue(), '300');
      await page.fill('#target-height', '10');
      await page.waitForFunction(() => location.hash.includes('target=10'));
      const params = (text) => Object.fromEntries(text.slice(1).split('&').map((part) => part.split('=')).filter(([key]) => !['view', 'eye'].includes(key)));
      assert.deepEqual(params(await page.evaluate(() => location.hash)), {...params(hash), target: '10'});
      // An address that is changed is followed.
      await page.evaluate(() => (location.hash = location.hash.replace('target=10', 'target=0').replace(',Mast', ',Pole')));
      await page.waitForFunction(() => document.getElementById('target-height').value === '0');
      assert.equal(await page.locator('#eyes .called').last().inputValue(), 'Pole');
    }, {hash});
  });

  it('shows the ground in 3D, with the viewshed on it', async () => {
    await with_page(async (page) => {
      await wait_shown(page);
      await page.click('#show-terrain');
      await idle(page);
      const height = await page.evaluate(() => document.getElementById('map').map.queryTerrainElevation([-84.2461, 36.5829]));
      const {ground_m} = await (await fetch(`${server.address}/scenes/jacksboro/height?at=${EYE.lon},${EYE.lat}`)).json();
      const offset = await page.evaluate(() => document.getElementById('map').map.getCenter && document.getElementById('map').map.transform.elevation);
      assert.ok(Math.abs(height + offset - ground_m) < 40 || Math.abs(height - ground_m) < 40, `${height} + ${offset} is far from ${ground_m}`);
      const bare = await picture(page);
      await page.focus('.handle.eye');
      const before = await shown(page);
      await page.keyboard.press('Shift+ArrowRight');
      await wait_shown(page, before);
      await idle(page);
      const moved = await picture(page);
      let differing = 0;
      for (let i = 0; i < bare.data.length; i += 4) differing += Math.abs(bare.data[i] - moved.data[i]) > 12;
      assert.ok(differing > 500, `only ${differing} pixels changed with the eye`);
    }, {hash: `#scene=jacksboro&view=11/36.58/-84.25/0/0&eye=${EYE.lon},${EYE.lat},2`, viewport: {width: 760, height: 440}});
  });

  it('fits a phone, and answers a long press', async () => {
    await with_page(async (page) => {
      const {x, y} = await on_screen(page, EYE.lon, EYE.lat);
      const touch = await page.context().newCDPSession(page);
      await touch.send('Input.dispatchTouchEvent', {type: 'touchStart', touchPoints: [{x, y}]});
      await page.waitForTimeout(800);
      await touch.send('Input.dispatchTouchEvent', {type: 'touchEnd', touchPoints: []});
      await wait_shown(page);
      assert.equal(await page.locator('#eyes li').count(), 1);
      const wide = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
      assert.equal(wide[0], wide[1]);
      const small = await page.locator('#panel button:visible, #panel input:visible, #panel select:visible').evaluateAll((all) => all
        .map((element) => ({name: element.id || element.ariaLabel, ...element.getBoundingClientRect().toJSON()}))
        .filter(({left, right, height, name}) => left < 0 || right > innerWidth || (height < 24 && !/Choose|slider/.test(name))));
      assert.deepEqual(small, []);
      await page.click('#fold');
      assert.equal(await page.locator('#panel-body').isVisible(), false);
    }, {hash: '#scene=jacksboro', viewport: {width: 390, height: 844}, hasTouch: true, isMobile: true});
  });

  it('has nothing that axe-core finds, in every tool, light and dark', async () => {
    const hash = `#scene=jacksboro&eye=${EYE.lon},${EYE.lat},2,Tower&eye=-84.2,36.6,2&from=-84.3,36.55,2&to=-84.15,36.62,2&point=${EYE.lon},${EYE.lat},2`;
    const all = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice'];
    // In the dark only colours are others.
    for (const [colorScheme, rules] of [['light', all], ['dark', ['color-contrast']]]) {
      await with_page(async (page) => {
        await page.evaluate(AXE.replace(/^/, 'globalThis.module = undefined;'));
        await page.evaluate(() => (document.getElementById('limits').open = true));
        for (const tool of ['viewshed', 'sight', 'horizon', 'camera']) {
          await page.click(`#tab-${tool}`);
          await page.waitForTimeout(300);
          const {violations} = await page.evaluate((rules) => globalThis.axe.run(document, {runOnly: rules}), rules);
          assert.deepEqual(violations.map(({id, nodes}) => [id, nodes.map(({html}) => html.slice(0, 120))]), [], `${tool}, ${colorScheme}`);
        }
      }, {hash, colorScheme});
    }
  });
});
