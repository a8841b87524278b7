// How long a click takes to be pixels, and how many viewsheds a drag shows: scripts/bench page
// Bars: a click under 150 ms, 10 a second while dragging; 15 km radius, 30 m cells.
import {basename, join} from 'node:path';
import {open_page, on_screen, shown, wait_shown} from './support/open_page.mjs';
import {SHARED, browser_or_reason, serve} from './support/programs.mjs';

const CLICKS = 25;
const DRAG_S = 5;
const MOST_MOVES = 3;
const [dem = join(SHARED, 'projected/bigtujunga_srtm30m_utm11.tif')] = process.argv.slice(2);

const {launch, reason} = browser_or_reason();
if (reason) {
  console.error(`The page cannot be timed: ${reason}`);
  process.exit(1);
}

const middle = (values, part = 0.5) => [...values].sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(part * values.length))];
const ms = (values) => `${middle(values).toFixed(0)} ms (least ${Math.min(...values).toFixed(0)}, 90 % ${middle(values, 0.9).toFixed(0)}, most ${Math.max(...values).toFixed(0)})`;

async function clicks(page, bounds) {
  const [w, s, e, n] = bounds;
  for (let i = 0; i < CLICKS; ++i) {
    // A low-discrepancy walk over the middle of the DEM.
    const [u, v] = [(0.5 + i * 0.7548776662) % 1, (0.5 + i * 0.5698402909) % 1];
    const {x, y} = await on_screen(page, w + (e - w) * (0.2 + 0.6 * u), s + (n - s) * (0.2 + 0.6 * v));
    const before = await shown(page);
    await page.mouse.move(x, y);
    await page.mouse.click(x, y, {button: 'right'});
    await wait_shown(page, before);
    await page.waitForTimeout(150);
  }
  return page.evaluate(() => {
    const took = performance.getEntriesByName('viewshed').map(({duration}) => duration);
    const asked = performance.getEntriesByType('resource').filter(({name}) => name.includes('/processes/viewshed/')).map(({duration}) => duration);
    return {took, asked};
  });
}

async function drag(page) {
  const box = await page.locator('.handle.eye').boundingBox();
  const stage = await page.locator('#map').boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  const [begun, before] = [performance.now(), await shown(page)];
  const under_way = new Set();
  let steps = 0;
  while (performance.now() - begun < 1000 * DRAG_S) {
    const turn = (performance.now() - begun) / 1000;
    // As a hand does, without waiting for what the page makes of it; but not ahead of it either.
    if (under_way.size < MOST_MOVES) {
      ++steps;
      const move = page.mouse.move(stage.x + stage.width * (0.5 + 0.2 * Math.cos(turn)), stage.y + stage.height * (0.5 + 0.12 * Math.sin(2 * turn)))
        .finally(() => under_way.delete(move));
      under_way.add(move);
    }
    await new Promise((done) => setTimeout(done, 8));
  }
  const [after, seconds] = [await shown(page), (performance.now() - begun) / 1000];
  await Promise.all(under_way);
  await page.mouse.up();
  return {shown_a_second: (after - before) / seconds, moves_a_second: steps / seconds};
}

const server = await serve([dem]);
const browser = await launch();
try {
  const {scenes: [scene]} = await (await fetch(`${server.address}/scenes`)).json();
  const {page} = await open_page(browser, server.address, {hash: '#radius=15000', viewport: {width: 1280, height: 800}});
  const {took, asked} = await clicks(page, scene.bounds);
  console.log(`${basename(dem)}, cells of ${scene.cell_m.toFixed(0)} m, 15 km radius, 1280 x 800 pixels, software WebGL`);
  console.log(`first click to pixels   ${took[0].toFixed(0)} ms`);
  console.log(`click to pixels         ${ms(took)}`);
  console.log(`  of which the request  ${ms(asked)}`);
  const {shown_a_second, moves_a_second} = await drag(page);
  console.log(`viewsheds while dragging ${shown_a_second.toFixed(1)} a second (${moves_a_second.toFixed(0)} moves a second)`);
} finally {
  await browser.close();
  await server.stop();
}
