// The pictures of docs/page.md: scripts/figures page
import {join} from 'node:path';
import {idle, on_screen, open_page, wait_data, wait_shown} from './support/open_page.mjs';
import {REPOSITORY, SHARED, browser_or_reason, run, serve, temporary_folder, remove_folder, PROGRAM} from './support/programs.mjs';

const {launch, reason} = browser_or_reason();
if (reason) throw new Error(`No pictures of the page: ${reason}`);
const folder = temporary_folder();
const dem = join(SHARED, 'projected/bigtujunga_srtm30m_utm11.tif');
run('gdal_translate', ['-q', '-srcwin', '420', '160', '385', '385', dem, join(folder, 'tujunga.tif')]);
run(PROGRAM, ['build', 'tujunga.tif', '-o', 'tujunga.scene', '--max-error', '10'], {cwd: folder});
run('ln', ['-s', dem, join(folder, 'big-tujunga.tif')]);
const server = await serve(['big-tujunga.tif', 'tujunga.scene'], {cwd: folder});
const browser = await launch();
const into = (name) => join(REPOSITORY, 'docs/pictures', `page-${name}.jpg`);

async function picture(name, hash, act, options) {
  const {page, close} = await open_page(browser, server.address, {hash, viewport: {width: 1280, height: 800}, ...options});
  await act(page);
  await idle(page);
  await page.waitForTimeout(300);
  await page.screenshot({path: into(name), type: 'jpeg', quality: 80});
  await close();
}

const eyes = 'eye=-118.1009,34.3092,2,Ridge&eye=-118.2156,34.2781,10,Mast';
try {
  await picture('viewshed', `#scene=big-tujunga&${eyes}`, wait_shown);
  await picture('terrain', '#scene=big-tujunga&show=relief,terrain&view=11.6/34.30/-118.12/25/62&eye=-118.1009,34.3092,2&theme=dark', wait_shown);
  await picture('sight', '#scene=big-tujunga&tool=sight&from=-118.1806,34.3126,2&to=-118.0797,34.3467,2', async (page) => {
    await wait_data(page, 'sight');
    const plot = await page.locator('#sight-plot .u-over').boundingBox();
    await page.mouse.move(plot.x + plot.width * 0.45, plot.y + 40);
  });
  await picture('horizon', '#scene=big-tujunga&tool=horizon&point=-118.1009,34.3092,2', async (page) => {
    await wait_data(page, 'horizon');
    const at = await on_screen(page, -118.14, 34.30);
    await page.mouse.move(at.x, at.y);
  });
  await picture('camera', '#scene=tujunga&tool=camera&camera=-118.15,34.31,50&heading=60&fov=90', (page) => wait_data(page, 'culled'));
  await picture('phone', `#scene=big-tujunga&${eyes.split('&')[0]}`, wait_shown, {viewport: {width: 390, height: 844}, hasTouch: true, isMobile: true, deviceScaleFactor: 2});
} finally {
  await browser.close();
  await server.stop();
  remove_folder(folder);
}
