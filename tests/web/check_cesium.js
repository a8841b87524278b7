// CesiumJS draws a tileset along a flight, once with all groups and once with those only that a camera there may see:
//   check_cesium.js TILESET SCENE SCARP [PICTURE [--from LON,LAT --to LON,LAT --above M --frames N --heading DEG]]
// Pictures must be the same. Groups come from the run-time library (tiles/runtime/scarp.mjs, with what `SCARP export
// --to groups` writes), asked in the page for the engine's own camera; without it from `SCARP cull SCENE --json`.
// Left out, with a line, where Chromium is not installed.
import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { chromium } from "playwright-core";
import { serveFolders } from "./serve_folders.js";
import { readTileset } from "./tileset_files.js";

const { values: options, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    from: { type: "string" },
    to: { type: "string" },
    above: { type: "string", default: "60" },
    frames: { type: "string", default: "3" },
    heading: { type: "string" },
    above_view: { type: "string" },
  },
});
const [folder, scene, scarp, picture] = positionals;
const program = process.env.SCARP_CHROMIUM ?? "/usr/bin/chromium";
if (!existsSync(program)) {
  console.log(`left out: ${program} is not there`);
  process.exit(77); // skipped, for CTest
}

const degrees = (radians) => (radians * 180) / Math.PI;

/** Longitude and latitude of a tileset point, degrees. */
function placeOf(transform, [x, y, z]) {
  const at = (row) => transform[row] * x + transform[4 + row] * y + transform[8 + row] * z + transform[12 + row];
  const a = 6378137;
  const e2 = 0.0066943799901413165;
  const [X, Y, Z] = [at(0), at(1), at(2)];
  const p = Math.hypot(X, Y);
  let latitude = Math.atan2(Z, p * (1 - e2));
  for (let i = 0; i < 5; ++i) {
    const n = a / Math.sqrt(1 - e2 * Math.sin(latitude) ** 2);
    latitude = Math.atan2(Z + e2 * n * Math.sin(latitude), p);
  }
  return [degrees(Math.atan2(Y, X)), degrees(latitude)];
}

/** The flight: over the middle of the scene unless told. */
function flight() {
  const { transform, boundingVolume } = readTileset(folder).root;
  const [cx, cy, cz, hx, , , , hy] = boundingVolume.box;
  const parse = (text) => text.split(",").map(Number);
  const from = options.from ? parse(options.from) : placeOf(transform, [cx - hx / 2, cy - hy / 3, cz]);
  const to = options.to ? parse(options.to) : placeOf(transform, [cx + hx / 2, cy + hy / 4, cz]);
  const frames = Number(options.frames);
  const east = (to[0] - from[0]) * Math.cos((from[1] * Math.PI) / 180);
  const heading = options.heading ? Number(options.heading) : degrees(Math.atan2(east, to[1] - from[1]));
  return Array.from({ length: frames }, (_, i) => {
    const t = frames > 1 ? i / (frames - 1) : 0;
    return { longitude: from[0] + t * (to[0] - from[0]), latitude: from[1] + t * (to[1] - from[1]), heading, pitch: -8 };
  });
}

const cesium = join(dirname(fileURLToPath(import.meta.url)), "../node_modules/cesium/Build/Cesium/");
const here = dirname(fileURLToPath(import.meta.url));
const runtime = process.env.SCARP_RUNTIME ?? join(here, "../../tiles/runtime");
const hasRuntime = existsSync(join(runtime, "scarp.mjs"));
const work = mkdtempSync(join(tmpdir(), "scarp-cesium-"));
if (hasRuntime) execFileSync(scarp, ["export", scene, "--to", "groups", "-o", join(work, "groups")]);
const server = await serveFolders({
  "/tileset/": folder,
  "/cesium/": cesium,
  "/runtime/": runtime,
  "/groups/": join(work, "groups"),
  "/": here,
});
const browser = await chromium.launch({
  executablePath: program,
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
let faults = 0;
try {
  const page = await browser.newPage({ viewport: { width: 640, height: 400 } });
  page.on("pageerror", (error) => console.error(`page: ${error}`));
  page.on("console", (message) => message.type() === "error" && console.error(`page: ${message.text()}`));
  await page.goto(`${server.address}/cesium_page.html`);
  await page.evaluate((url) => open(url), `${server.address}/tileset/tileset.json`);
  if (hasRuntime)
    await page.evaluate(([module, file]) => openCulling(module, file), [
      `${server.address}/runtime/scarp.mjs`,
      `${server.address}/groups/groups.scarp`,
    ]);
  console.log(hasRuntime ? "groups by the run-time library" : "groups by scarp cull");
  let drawn = 0;
  let all = 0;
  let best;
  for (const camera of flight()) {
    const told = JSON.parse(
      execFileSync(scarp, [
        "cull",
        scene,
        "--camera",
        `${camera.longitude},${camera.latitude},${options.above}`,
        "--crs",
        "OGC:CRS84",
        "--json",
      ]),
    );
    // The height of the same place, as the scene has it; map coordinates may be of another CRS.
    camera.height = told.camera.height_m;
    const whole = await page.evaluate((c) => show(c), camera);
    const groups = hasRuntime ? (await page.evaluate((c) => groupsFrom(c), camera)).groups : told.visible_groups;
    const culled = await page.evaluate(([c, visible]) => show(c, visible), [camera, groups]);
    const { different, most, ground, all: pixels } = await page.evaluate(
      ([a, b]) => compare(a, b),
      [whole.picture, culled.picture],
    );
    const share = (100 * culled.hidden) / (culled.hidden + culled.drawn);
    console.log(
      `${camera.longitude.toFixed(5)},${camera.latitude.toFixed(5)} at ${camera.height.toFixed(1)} m: ` +
        `${culled.hidden} of ${culled.hidden + culled.drawn} triangles hidden (${share.toFixed(1)} %), ` +
        `${different} pixels differ, by ${most} of 255; ${((100 * ground) / pixels).toFixed(0)} % is ground`,
    );
    drawn += culled.drawn;
    all += culled.drawn + culled.hidden;
    if (whole.features === 0 || whole.hidden !== 0 || ground === 0 || culled.hidden === 0) ++faults;
    if (different > 0) ++faults;
    if (!best || share > best.share) best = { share, whole, culled, camera, groups };
  }
  console.log(`in all ${(100 * (1 - drawn / all)).toFixed(1)} % of triangles hidden`);
  if (server.missed.length) {
    console.error(`not found on the server: ${server.missed.join(" ")}`);
    ++faults;
  }
  // The page's own check: with what the camera sees hidden, the picture has to change.
  const hiddenToo = await page.evaluate(([c, groups]) => show(c, groups), [best.camera, []]);
  const change = await page.evaluate(([a, b]) => compare(a, b), [best.whole.picture, hiddenToo.picture]);
  if (change.different === 0) {
    console.error("hiding all groups changes nothing: the check does not check");
    ++faults;
  }
  if (picture) {
    // From above and behind, where what is left out shows.
    const aside = { ...best.camera, height: best.camera.height + Number(options.above_view ?? 6000), pitch: -35 };
    const back = Number(options.above_view ?? 6000) / 111_000;
    aside.latitude -= back * Math.cos((aside.heading * Math.PI) / 180);
    aside.longitude -= (back * Math.sin((aside.heading * Math.PI) / 180)) / Math.cos((aside.latitude * Math.PI) / 180);
    const left = await page.evaluate(([c, groups]) => show(c, groups), [best.camera, best.groups]);
    const right = await page.evaluate(([c, groups]) => show(c, groups), [aside, best.groups]);
    const url = await page.evaluate(
      ([a, b, texts]) => beside(a, b, texts),
      [
        left.picture,
        right.picture,
        [
          `From the camera: ${left.drawn} of ${left.drawn + left.hidden} triangles, each pixel as with all of them`,
          "The same groups from behind and above",
        ],
      ],
    );
    writeFileSync(picture, Buffer.from(url.split(",")[1], "base64"));
  }
} finally {
  await browser.close();
  server.close();
  rmSync(work, { recursive: true });
}
if (faults) process.exit(1);
