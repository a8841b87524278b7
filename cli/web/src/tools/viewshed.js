// What one eye or several see: a picture on the map, at once, and again while an eye is dragged.
import {$, bind_number, bind_pair, element, fill, save, text_field} from '../dom.js';
import {execute, ground_m, viewshed_inputs} from '../api.js';
import {Handle} from '../markers.js';
import {Newest} from '../newest.js';
import {coordinates, height} from '../store.js';
import {legend} from '../colours.js';
import {area, distance, metres, plural, share} from '../words.js';

const QUESTION = ['scene', 'eyes', 'radius_m', 'min_distance_m', 'target_height_m', 'refraction', 'azimuth_deg', 'pitch_deg', 'mode'];
const MOST_EYES = 32;
const LETTERS = 'ABCDEFGHIJKLMNOPQRSTUVWXYZ';

export class ViewshedTool {
  adding = false;
  #handles = [];
  #newest = new Newest();
  #ground = new Newest();
  #asked_at = null;

  /** @param page  {store, map, scene(), trouble(error), busy(promise, stop)} */
  constructor(page) {
    this.page = page;
    const {store} = page;
    bind_number($('radius'), store, 'radius_m', {scale: 0.001});
    bind_number($('target-height'), store, 'target_height_m', {empty: 0});
    bind_number($('refraction'), store, 'refraction', {empty: null});
    bind_number($('min-distance'), store, 'min_distance_m', {scale: 0.001, empty: 0});
    bind_pair([$('azimuth-from'), $('azimuth-to')], store, 'azimuth_deg');
    bind_pair([$('pitch-low'), $('pitch-high')], store, 'pitch_deg');
    this.#bind_slider();
    $('mode').value = store.state.mode;
    $('mode').addEventListener('change', () => store.set({mode: $('mode').value}));
    store.on(['mode'], ({mode}) => ($('mode').value = mode));
    const {min_distance_m, refraction, azimuth_deg, pitch_deg} = store.state;
    $('limits').open = Boolean(min_distance_m || refraction !== null || azimuth_deg || pitch_deg);
    $('eye-add').addEventListener('click', () => this.#add_next(!this.adding));
    $('eye-clear').addEventListener('click', () => store.set({eyes: [], chosen: 0}));
    $('download-tiff').addEventListener('click', () => this.#download('image/tiff', 'tif'));
    $('download-geojson').addEventListener('click', () => this.#download('application/geo+json', 'geojson'));
    store.on(['eyes', 'chosen'], () => this.#list());
    store.on(['eyes', 'tool', 'chosen'], () => this.#mark());
    store.on(QUESTION, () => this.ask());
    store.on(['radius_m', 'azimuth_deg'], () => this.#limits(store.state));
  }

  /** All anew: after another scene or address. */
  refresh() {
    const scene = this.page.scene();
    $('refraction').disabled = scene.kind === 'scene'; // it was built with its own
    $('refraction').placeholder = String(scene.refraction ?? 0);
    this.#list();
    this.#mark();
    this.#limits(this.page.store.state);
    this.ask();
  }

  /** The chosen eye looks from here, or another one when one is to be added.
   *  @param asked_at  when the hand did it, as of performance.now() */
  look_from(place, {another = this.adding, asked_at = performance.now()} = {}) {
    const {eyes, chosen} = this.page.store.state;
    this.#asked_at = asked_at;
    this.#add_next(false);
    if (eyes.length && !another) return this.#change(chosen, place);
    if (eyes.length >= MOST_EYES) return this.page.trouble(new Error(`There can be ${MOST_EYES} eyes at most.`));
    const eye = {...place, height: eyes[chosen]?.height ?? '2', name: ''};
    this.page.store.set({eyes: [...eyes, eye], chosen: eyes.length});
  }

  focus() {
    const {chosen} = this.page.store.state;
    this.#handles[chosen]?.button.focus();
  }

  stop() {
    this.#newest.stop();
  }

  #add_next(on) {
    this.adding = on;
    $('eye-add').setAttribute('aria-pressed', String(on));
    $('eye-add').textContent = on ? 'Click the map…' : 'Add an eye';
  }

  #change(index, patch) {
    const {eyes} = this.page.store.state;
    this.page.store.set({eyes: eyes.map((eye, i) => (i === index ? {...eye, ...patch} : eye))});
  }

  #remove(index) {
    const {eyes, chosen} = this.page.store.state;
    const left = eyes.filter((_, i) => i !== index);
    this.page.store.set({eyes: left, chosen: Math.max(0, Math.min(chosen > index ? chosen - 1 : chosen, left.length - 1))});
  }

  #bind_slider() {
    // 1 to 100 km in equal steps of ratio.
    const {store} = this.page;
    const show = () => {
      const km = store.state.radius_m / 1000;
      $('radius-slider').value = String(Math.round(50 * Math.log10(Math.max(1, km))));
      $('radius-slider').setAttribute('aria-valuetext', `${Number(km.toPrecision(4))} kilometres`);
    };
    show();
    store.on(['radius_m'], show);
    $('radius-slider').addEventListener('input', () => store.set({radius_m: Math.round(10 ** (Number($('radius-slider').value) / 50) * 10) * 100}));
  }

  #title = (eye, i) => eye.name || `Eye ${LETTERS[i] ?? i + 1}`;

  #list() {
    const {eyes, chosen} = this.page.store.state;
    const list = $('eyes');
    while (list.children.length > eyes.length) list.lastChild.remove();
    while (list.children.length < eyes.length) list.append(this.#row(list.children.length));
    eyes.forEach((eye, i) => {
      const row = list.children[i];
      row.querySelector('[type=radio]').checked = i === chosen;
      fill(row.querySelector('.called'), eye.name);
      fill(row.querySelector('.tall'), eye.height);
      fill(row.querySelector('.where'), `${eye.lon}, ${eye.lat}`);
      row.querySelector('.where').hidden = i !== chosen;
      row.querySelector('.ground').hidden = i !== chosen;
    });
    $('eye-clear').hidden = $('eye-add').hidden = !eyes.length;
    $('tool-viewshed').querySelector('[data-empty]').hidden = eyes.length > 0;
    $('mode').querySelector('[value=count]').disabled = eyes.length < 2 && this.page.store.state.mode !== 'count';
    if (eyes[chosen]) this.#show_ground(eyes[chosen], list.children[chosen].querySelector('.ground'));
  }

  #row(i) {
    const called = `Eye ${LETTERS[i] ?? i + 1}`;
    const radio = element('input', {type: 'radio', name: 'eye', ariaLabel: `Choose ${called}`});
    radio.addEventListener('change', () => this.page.store.set({chosen: i}));
    const bin = element('button', {type: 'button', className: 'plain', textContent: '×', ariaLabel: `Remove ${called}`, title: 'Remove'});
    bin.addEventListener('click', () => this.#remove(i));
    return element('li', {}, radio,
      text_field({className: 'called', placeholder: called, ariaLabel: `Name of ${called}`, maxLength: 80}, (text) => text.trim(), (name) => this.#change(i, {name})),
      text_field({className: 'tall', ariaLabel: `Height of ${called} in metres, or such as 1200asl`, title: 'Metres above ground, or above the datum: 1200asl'}, height, (value) => this.#change(i, {height: value})),
      element('i', {className: 'unit', textContent: 'm'}),
      bin,
      text_field({className: 'where', ariaLabel: `${called}: longitude, latitude`}, coordinates, (at) => this.#change(i, at)),
      element('p', {className: 'ground'}));
  }

  #show_ground({lon, lat}, into) {
    this.#ground.ask(async (signal) => {
      try {
        const height_m = await ground_m(this.page.store.state.scene, lon, lat, signal);
        into.textContent = height_m === null ? 'no ground here' : `on ground at ${metres(height_m)}`;
      } catch {
        into.textContent = ''; // said in words by the viewshed of the same place
      }
    });
  }

  #mark() {
    const {eyes, chosen, tool} = this.page.store.state;
    while (this.#handles.length > eyes.length) this.#handles.pop().remove();
    eyes.forEach((eye, i) => {
      const handle = (this.#handles[i] ??= new Handle(this.page.map.map, 'eye', '', {
        move: (at) => {
          this.#asked_at = performance.now();
          this.#change(i, at);
        },
        remove: () => {
          this.#remove(i);
          (this.#handles[0]?.button ?? this.page.map.map.getCanvas()).focus();
        },
        choose: () => this.page.store.state.chosen !== i && this.page.store.set({chosen: i}),
      }));
      handle.label(`${this.#title(eye, i)}: drag, or move with the arrow keys`, eyes.length > 1 ? LETTERS[i] ?? '' : '');
      handle.button.dataset.chosen = String(i === chosen);
      handle.button.replaceChildren(...(eye.name ? [element('span', {className: 'name', textContent: eye.name})] : []));
      handle.put(tool === 'viewshed' ? eye : null);
    });
  }

  /** Around the eyes that the picture is of: a line for each place of a drag would cost a frame. */
  #limits({eyes, radius_m, azimuth_deg}) {
    this.page.map.draw_limits(eyes, radius_m, azimuth_deg);
  }

  ask() {
    const {state} = this.page.store;
    $('download-tiff').disabled = !state.eyes.length;
    $('download-geojson').disabled = !state.eyes.length || state.mode === 'ground'; // outlines are of areas
    if (!state.eyes.length) {
      this.#newest.stop();
      this.page.map.hide_picture();
      this.#limits(state);
      $('viewshed-answer').textContent = '';
      $('legend').hidden = true;
      return;
    }
    this.#newest.ask((signal) => this.#question(state, signal));
  }

  async #question(state, signal) {
    const asked_at = this.#asked_at;
    this.#asked_at = null;
    try {
      const [response, blob] = await this.page.busy(async () => {
        const answer = await execute('viewshed', viewshed_inputs(state), {accept: 'image/png', signal});
        return [answer, await answer.blob()];
      }, () => this.stop());
      // The next question may go while this one is drawn.
      void this.#show(state, response.headers, blob, asked_at).catch((error) => this.page.trouble(error));
    } catch (error) {
      this.#fail(error);
    }
  }

  #fail(error) {
    if (error.name === 'AbortError') return;
    this.page.map.hide_picture();
    $('viewshed-answer').textContent = '';
    $('legend').hidden = true;
    this.page.trouble(error);
  }

  async #show(state, headers, blob, asked_at) {
    const bitmap = await createImageBitmap(blob, {colorSpaceConversion: 'none'});
    if (this.page.store.state.scene !== state.scene || !this.page.store.state.eyes.length) return bitmap.close();
    this.page.calm();
    const bounds = headers.get('X-Scarp-Bounds').split(',').map(Number);
    this.#limits(state);
    this.page.map.show_picture(bitmap, bounds, () => {
      // From the hand, not from an address that was opened.
      const took = asked_at === null ? '' : ` · ${Math.round(performance.measure('viewshed', {start: asked_at, end: performance.now()}).duration)} ms`;
      const box = this.page.map.element;
      box.dataset.shown = String(Number(box.dataset.shown ?? 0) + 1);
      box.dataset.eyes = state.eyes.map(({lon, lat}) => `${lon},${lat}`).join(' ');
      this.#answer(state, headers, took);
    });
  }

  #answer(state, headers, took) {
    const entries = legend(state.mode, state.eyes.length);
    $('legend').hidden = !entries.length;
    $('legend').replaceChildren(...entries.map(({colour, text}) => element('li', {}, element('b', {style: `background:${colour}`}), text)));
    const [seen, known] = ['X-Scarp-Visible-Cells', 'X-Scarp-Known-Cells'].map((key) => Number(headers.get(key)));
    const cell = this.page.scene().cell_m;
    const cell_m2 = Array.isArray(cell) ? cell[0] * cell[1] : cell * cell;
    const who = state.eyes.length === 1 ? this.#title(state.eyes[0], 0) : plural(state.eyes.length, 'eye');
    $('viewshed-answer').replaceChildren(
      `${who} ${state.eyes.length === 1 ? 'sees' : 'see'} `, element('b', {textContent: area(seen * cell_m2)}),
      element('small', {textContent: `${share(seen, known)} of the scene, looking ${distance(state.radius_m)} far${took}`}));
  }

  async #download(type, suffix) {
    const {state} = this.page.store;
    try {
      const response = await this.page.busy(() => execute('viewshed', viewshed_inputs(state), {accept: type}));
      save(await response.blob(), `${state.mode === 'visible' ? 'seen' : state.mode}.${suffix}`);
    } catch (error) {
      this.page.trouble(error);
    }
  }
}
