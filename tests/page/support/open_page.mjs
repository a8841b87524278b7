// The page, opened and watched: what its console says and what it asks others for is kept.

// Much: a browser that draws in software, on a machine that may have other things to do.
const PATIENCE_MS = 90_000;
export const MAP = '#map';

export async function open_page(browser, address, {hash = '', ...options} = {}) {
  const context = await browser.newContext({viewport: {width: 1000, height: 660}, acceptDownloads: true, reducedMotion: 'reduce', ...options});
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  const wrong = [];
  page.on('console', (message) => ['error', 'warning'].includes(message.type()) && wrong.push(message.text()));
  page.on('pageerror', (error) => wrong.push(error.message));
  page.on('request', (request) => {
    if (!request.url().startsWith(address) && !/^(blob|data):/.test(request.url())) wrong.push(`asked ${request.url()}`);
  });
  await page.goto(`${address}/${hash}`);
  await page.waitForSelector('html[data-ready]');
  await idle(page);
  return {page, wrong, close: () => context.close()};
}

/** Waits until the map has drawn all that it wants to. */
export const idle = (page) => page.evaluate(() => new Promise((done) => {
  const {map} = document.getElementById('map');
  map.once('idle', done);
  map.triggerRepaint();
}));

export const shown = (page) => page.locator(MAP).evaluate((map) => Number(map.dataset.shown ?? 0));

/** Waits for another viewshed than the first `before`. */
export const wait_shown = (page, before = 0) =>
  page.waitForFunction((least) => Number(document.getElementById('map').dataset.shown ?? 0) > least, before, {timeout: PATIENCE_MS});

export const wait_data = (page, key, value) =>
  page.waitForFunction(([name, wanted]) => {
    const is = document.getElementById('map').dataset[name];
    return wanted === undefined ? Boolean(is) : is === wanted;
  }, [key, value], {timeout: PATIENCE_MS});

/** Where a place of the map is on the screen. */
export const on_screen = (page, lon, lat) => page.evaluate(([x, y]) => {
  const element = document.getElementById('map');
  const at = element.map.project([x, y]);
  const box = element.getBoundingClientRect();
  return {x: box.x + at.x, y: box.y + at.y};
}, [lon, lat]);
