// What the tests stand on: the program, a DEM, a scene of a part of it, the browser.
// SCARP_PROGRAM is the program; SCARP_CHROMIUM a browser, else Debian's.
import {execFileSync, spawn} from 'node:child_process';
import {existsSync, mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {fileURLToPath} from 'node:url';

export const REPOSITORY = fileURLToPath(new URL('../../..', import.meta.url));
export const PROGRAM = process.env.SCARP_PROGRAM ?? join(REPOSITORY, 'build/ci/scarp');
export const CHROMIUM = process.env.SCARP_CHROMIUM ?? '/usr/bin/chromium';
export const SHARED = process.env.SCARP_SHARED_DATA ?? join(REPOSITORY, '../shared/data');
const START_MS = 60_000;

export const run = (program, args, options = {}) => execFileSync(program, args, {encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'], maxBuffer: 1 << 28, ...options});

export const temporary_folder = () => mkdtempSync(join(tmpdir(), 'scarp-page-'));
export const remove_folder = (folder) => rmSync(folder, {recursive: true, force: true});

/** The Jacksboro fault, Tennessee, as jacksboro.tif, and a part of it as scene part.scene. */
export function make_data(folder) {
  run(join(REPOSITORY, 'scripts/jacksboro'), [join(folder, 'jacksboro.vrt')]);
  run('gdal_translate', ['-q', 'jacksboro.vrt', 'jacksboro.tif'], {cwd: folder});
  run('gdal_translate', ['-q', '-srcwin', '150', '120', '97', '97', 'jacksboro.vrt', 'part.tif'], {cwd: folder});
  run(PROGRAM, ['build', 'part.tif', '-o', 'part.scene', '--max-error', '15'], {cwd: folder});
}

/** Starts scarp serve on a free port; `stop` ends it and gives its exit code. */
export async function serve(sources, {cwd, args = []} = {}) {
  const child = spawn(PROGRAM, ['serve', ...sources, '--port', '0', ...args], {cwd, stdio: ['ignore', 'pipe', 'pipe']});
  let said = '';
  const ended = new Promise((done) => child.on('exit', done));
  const address = await new Promise((found, failed) => {
    const timer = setTimeout(() => failed(new Error(`scarp serve did not say where it is: ${said}`)), START_MS);
    const listen = (piece) => {
      said += piece;
      const match = /https?:\/\/[\d.:[\]a-z]+\d+/.exec(said);
      if (!match) return;
      clearTimeout(timer);
      found(match[0]);
    };
    child.stdout.on('data', listen);
    child.stderr.on('data', listen);
    child.on('exit', (code) => failed(new Error(`scarp serve ended with ${code}: ${said}`)));
  });
  return {
    address,
    said: () => said,
    async stop() {
      child.kill('SIGTERM');
      return ended;
    },
  };
}

/** playwright-core and the browser, or a line on what is missing. */
export function browser_or_reason() {
  try {
    const {chromium} = createRequire(import.meta.url)('playwright-core');
    if (!existsSync(CHROMIUM)) return {reason: `${CHROMIUM} is not there`};
    return {
      launch: () => chromium.launch({
        executablePath: CHROMIUM,
        args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
      }),
    };
  } catch {
    return {reason: 'playwright-core is not there: npm ci in tests'};
  }
}

/** A one-band raster as numbers: {values, columns, rows, transform}. */
export function read_raster(path, folder) {
  const out = join(folder, 'raster.bin');
  run('gdal_translate', ['-q', '-of', 'ENVI', path, out]);
  const info = JSON.parse(run('gdalinfo', ['-json', path]));
  const bytes = readFileSync(out);
  const kinds = {Byte: Uint8Array, UInt32: Uint32Array, Float32: Float32Array};
  const Kind = kinds[info.bands[0].type];
  return {
    values: new Kind(bytes.buffer, bytes.byteOffset, bytes.length / Kind.BYTES_PER_ELEMENT),
    columns: info.size[0],
    rows: info.size[1],
    transform: info.geoTransform,
  };
}
