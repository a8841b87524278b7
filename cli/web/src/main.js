// The page of scarp serve: put together here.
import {$, element} from './dom.js';
import {scenes, ground_m} from './api.js';
import {pieces} from './command.js';
import {MapView} from './map.js';
import {Newest} from './newest.js';
import {decode, encode} from './permalink.js';
import {DEFAULTS, THEMES, TOOLS, createStore, longitude, rounded} from './store.js';
import {on_system_change, use_theme} from './theme.js';
import {CameraTool} from './tools/camera.js';
import {HorizonTool} from './tools/horizon.js';
import {SightTool} from './tools/sight.js';
import {ViewshedTool} from './tools/viewshed.js';

const BUSY_AFTER_MS = 400;
const HOLD_MS = 550;
const HOLD_PX = 10;
const ADDRESS_MS = 250;

const store = createStore(decode(location.hash));
use_theme(store.state.theme);
const map = new MapView($('map'), store);
let all = [];

const page = {
  store,
  map,
  scene: () => all.find(({name}) => name === store.state.scene),
  trouble(error) {
    if (error.name === 'AbortError') return;
    const again = error.seconds ? ` Try again in ${error.seconds} s.` : '';
    $('problem').firstElementChild.textContent = error.message + again;
    $('problem').hidden = false;
  },
  /** An answer came: what was wrong is over. */
  calm() {
    $('problem').hidden = true;
  },
  /** Says that it works when that takes a while. */
  async busy(work, stop) {
    const timer = setTimeout(() => {
      $('busy').hidden = false;
      $('busy').lastElementChild.hidden = !stop;
      $('busy').lastElementChild.onclick = stop;
    }, BUSY_AFTER_MS);
    try {
      return await work();
    } finally {
      clearTimeout(timer);
      $('busy').hidden = true;
    }
  },
  /**
   * Asks, and shows the answer, or null and what went wrong: also where the question cannot be put.
   * An answer that comes when nobody wants it any more changes nothing.
   * @param {{ask: () => Promise<Response>, stop: () => void, is_wanted: () => boolean,
   *   show: (answer: ?object) => void}} question
   */
  async answer({ask, stop, is_wanted, show}) {
    try {
      const response = await page.busy(ask, stop);
      const answer = await response.json();
      if (!is_wanted()) return;
      page.calm();
      show(answer);
    } catch (error) {
      if (error.name === 'AbortError') return;
      show(null);
      page.trouble(error);
    }
  },
};

const tools = {
  viewshed: new ViewshedTool(page),
  sight: new SightTool(page),
  horizon: new HorizonTool(page),
  camera: new CameraTool(page),
};
const tool = () => tools[store.state.tool];
const say = (text) => ($('status').textContent = text);

function bind_tools() {
  const tabs = TOOLS.map((name) => $(`tab-${name}`));
  const show = () => TOOLS.forEach((name, i) => {
    const on = name === store.state.tool;
    tabs[i].setAttribute('aria-selected', String(on));
    tabs[i].tabIndex = on ? 0 : -1;
    $(`tool-${name}`).hidden = !on;
  });
  tabs.forEach((tab, i) => {
    tab.addEventListener('click', () => store.set({tool: TOOLS[i]}));
    tab.addEventListener('keydown', (event) => {
      const step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
      if (!step) return;
      const next = (i + step + TOOLS.length) % TOOLS.length;
      store.set({tool: TOOLS[next]});
      tabs[next].focus();
    });
  });
  store.on(['tool'], (state) => {
    show();
    map.show_layers(state);
    if (state.tool !== 'viewshed') map.hide_picture();
    else tools.viewshed.ask();
  });
  show();
}

function bind_layers() {
  for (const layer of ['relief', 'groups', 'terrain']) {
    const button = $(`show-${layer}`);
    const show = () => button.setAttribute('aria-pressed', String(store.state[layer]));
    button.addEventListener('click', () => store.set({[layer]: !store.state[layer]}));
    store.on([layer], show);
    show();
  }
  store.on(['relief', 'groups', 'terrain'], (state) => map.show_layers(state));
}

function bind_theme() {
  const named = {auto: 'as the system has them', light: 'light', dark: 'dark'};
  const show = () => {
    use_theme(store.state.theme);
    $('theme').setAttribute('aria-label', `Colours: ${named[store.state.theme]}`);
    $('theme').textContent = {auto: '◐', light: '○', dark: '●'}[store.state.theme];
    map.colour();
  };
  $('theme').addEventListener('click', () => store.set({theme: THEMES[(THEMES.indexOf(store.state.theme) + 1) % THEMES.length]}));
  store.on(['theme'], show);
  on_system_change(() => store.set({theme: store.state.theme === 'auto' ? 'auto' : store.state.theme}) ?? show());
  show();
}

const place_at = ({lng, lat}) => ({lon: longitude(lng), lat: rounded(lat)});

function bind_map() {
  const gl = map.map;
  let held_at = 0;
  const look = (lngLat, asked_at, another) => {
    if (store.state.tool !== 'viewshed') store.set({tool: 'viewshed'});
    tools.viewshed.look_from(place_at(lngLat), {asked_at, another: another || tools.viewshed.adding});
  };
  gl.on('contextmenu', (event) => {
    event.preventDefault();
    if (performance.now() - held_at > 1000) look(event.lngLat, event.originalEvent.timeStamp, event.originalEvent.shiftKey);
  });
  gl.on('click', (event) => {
    if (performance.now() - held_at < 1000) return;
    const at = place_at(event.lngLat);
    if (store.state.tool !== 'viewshed') tool().look_from(at);
    else if (tools.viewshed.adding || !store.state.eyes.length) look(event.lngLat, event.originalEvent.timeStamp);
  });
  let timer = 0;
  const let_go = () => clearTimeout(timer);
  let start = null;
  gl.on('touchstart', (event) => {
    let_go();
    if (event.points.length !== 1) return;
    start = event.point;
    timer = setTimeout(() => {
      held_at = performance.now();
      look(event.lngLat, held_at);
    }, HOLD_MS);
  });
  gl.on('touchmove', ({point}) => start && point.dist(start) > HOLD_PX && let_go());
  gl.on('touchend', let_go);
  gl.on('touchcancel', let_go);
  gl.getCanvas().addEventListener('keydown', (event) => {
    if (event.key !== 'Enter') return;
    const at = place_at(gl.getCenter());
    if (store.state.tool === 'viewshed') look(gl.getCenter(), event.timeStamp, event.shiftKey);
    else tool().look_from(at);
    event.preventDefault();
  });
  bind_readout(gl);
}

function bind_readout(gl) {
  const newest = new Newest();
  let timer = 0;
  gl.on('mousemove', ({lngLat}) => {
    const text = `${lngLat.lng.toFixed(5)}, ${lngLat.lat.toFixed(5)}`;
    $('readout').textContent = text;
    clearTimeout(timer);
    timer = setTimeout(() => newest.ask(async (signal) => {
      try {
        const height_m = await ground_m(store.state.scene, rounded(lngLat.lng), rounded(lngLat.lat), signal);
        if ($('readout').textContent === text) $('readout').textContent = `${text} · ${height_m === null ? 'no ground' : `${height_m.toFixed(1)} m`}`;
      } catch {
        // The coordinates are there; a height is no reason to interrupt.
      }
    }), 150);
  });
  gl.on('mouseout', () => ($('readout').textContent = ''));
}

function bind_keys() {
  const keys = {
    v: ['Viewshed from the middle of the map', () => {
      store.set({tool: 'viewshed'});
      tools.viewshed.look_from(place_at(map.map.getCenter()), {another: false});
      tools.viewshed.focus();
    }],
    a: ['Another eye in the middle of the map', () => {
      store.set({tool: 'viewshed'});
      tools.viewshed.look_from(place_at(map.map.getCenter()), {another: true});
      tools.viewshed.focus();
    }],
    e: ['To the eye, end, place or camera; arrow keys move it, Delete removes it', () => tool().focus()],
    m: ['To the map; arrow keys move it, Enter answers for its middle', () => map.map.getCanvas().focus()],
    1: ['Viewshed', () => $('tab-viewshed').click()],
    2: ['Sight line', () => $('tab-sight').click()],
    3: ['Horizon', () => $('tab-horizon').click()],
    4: ['Camera', () => $('tab-camera').click()],
    r: ['Relief', () => $('show-relief').click()],
    g: ['Groups', () => $('show-groups').click()],
    t: ['3D', () => $('show-terrain').click()],
    c: ['Copy the command', () => $('copy-command').click()],
    l: ['Copy the link', () => $('copy-link').click()],
    '?': ['This help', () => $('help').showModal()],
  };
  $('keys').append(...Object.entries(keys).flatMap(([key, [what]]) => [
    element('dt', {}, element('kbd', {textContent: key})), element('dd', {textContent: what})]),
    element('dt', {}, element('kbd', {textContent: 'Esc'})), element('dd', {textContent: 'Close a message, stop what works'}));
  addEventListener('keydown', (event) => {
    if (event.key === 'Escape') {
      page.calm();
      tools.viewshed.stop();
      return;
    }
    if (!$('keys-on').checked || event.ctrlKey || event.metaKey || event.altKey || $('help').open) return;
    if (event.target.matches('input:not([type=radio], [type=range], [type=checkbox]), select, textarea')) return;
    const key = keys[event.key.toLowerCase()];
    if (!key) return;
    event.preventDefault();
    key[1]();
  });
}

function bind_panel() {
  $('fold').addEventListener('click', () => {
    const folded = $('panel').classList.toggle('folded');
    $('fold').setAttribute('aria-expanded', String(!folded));
    $('fold').setAttribute('aria-label', folded ? 'Unfold the controls' : 'Fold the controls');
  });
  $('help-open').addEventListener('click', () => $('help').showModal());
  $('help-close').addEventListener('click', () => $('help').close());
  $('problem').lastElementChild.addEventListener('click', page.calm);
  const copy = async (text, what) => {
    try {
      await navigator.clipboard.writeText(text);
      say(`${what} copied`);
    } catch {
      page.trouble(new Error(`The browser does not let this page copy. Select the text instead: ${text}`));
    }
  };
  $('copy-command').addEventListener('click', () => copy($('command').textContent, 'Command'));
  $('copy-link').addEventListener('click', () => {
    write_address();
    void copy(location.href, 'Link');
  });
}

function show_command() {
  const scene = page.scene();
  const said = scene ? pieces(store.state, scene) : [];
  $('command').replaceChildren(...said.flatMap((piece, i) => [i ? ' ' : '', element('span', {textContent: piece})]));
  $('command-box').hidden = !said.length;
}

function write_address() {
  const hash = `#${encode(store.state)}`;
  if (hash !== location.hash) history.replaceState(null, '', hash);
}

function bind_address() {
  let timer = 0;
  store.on(Object.keys(DEFAULTS), () => {
    clearTimeout(timer);
    timer = setTimeout(write_address, ADDRESS_MS);
    show_command();
  });
  addEventListener('hashchange', () => {
    const state = decode(location.hash);
    if (!all.some(({name}) => name === state.scene)) state.scene = store.state.scene;
    const {view} = state;
    store.set(state);
    if (view) map.map.jumpTo({center: [view.lon, view.lat], zoom: view.zoom, bearing: view.bearing_deg, pitch: view.pitch_deg});
  });
}

async function show_scene(keep_view) {
  const scene = page.scene();
  $('scene').value = scene.name;
  document.title = `${scene.title ?? scene.name} · Scarp`;
  $('show-groups').hidden = !scene.groups;
  map.settled = false;
  try {
    await map.show_scene(scene, keep_view);
  } catch (error) {
    page.trouble(error);
  }
  map.settled = true;
  for (const each of Object.values(tools)) each.refresh();
  show_command();
}

async function start() {
  bind_tools();
  bind_layers();
  bind_theme();
  bind_map();
  bind_keys();
  bind_panel();
  bind_address();
  try {
    all = await scenes();
  } catch (error) {
    return page.trouble(error);
  }
  $('scene').append(...all.map(({name, title}) => element('option', {value: name, textContent: title ?? name})));
  $('scene').addEventListener('change', () => store.set({scene: $('scene').value, refraction: null, eyes: [], chosen: 0, from: null, to: null, point: null, camera: null}));
  const asked = store.state.scene;
  if (!all.length) return page.trouble(new Error('The server has no scene. Give it one: scarp serve alps.tif'));
  if (!page.scene()) {
    if (asked) page.trouble(new Error(`There is no scene “${asked}” here; this is “${all[0].name}”.`));
    store.set({scene: all[0].name});
  }
  await show_scene(Boolean(store.state.view) && (!asked || asked === store.state.scene));
  store.on(['scene'], () => void show_scene(false));
  document.documentElement.dataset.ready = 'true';
}

void start();
