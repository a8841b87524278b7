// A camera over a scene: which groups of triangles would be drawn, and which culled.
import {$, bind_number, element} from '../dom.js';
import {cull_inputs, execute} from '../api.js';
import {Handle} from '../markers.js';
import {Newest} from '../newest.js';
import {place_fields} from '../place_fields.js';
import {plural, share} from '../words.js';

const HEIGHT = '50';

export class CameraTool {
  #newest = new Newest();
  #answer = null;

  constructor(page) {
    this.page = page;
    const {store} = page;
    this.handle = new Handle(page.map.map, 'camera', 'Camera', {
      move: (at) => store.set({camera: {...store.state.camera, ...at}}),
      remove: () => store.set({camera: null}),
    });
    this.handle.label('Camera: drag, or move with the arrow keys');
    place_fields($('camera-places'), store, 'camera', 'Camera', HEIGHT);
    bind_number($('camera-heading'), store, 'heading_deg');
    bind_number($('camera-fov'), store, 'field_of_view_deg');
    $('camera-around').addEventListener('change', () => store.set({heading_deg: $('camera-around').checked ? null : 0}));
    $('camera-clear').addEventListener('click', () => store.set({camera: null}));
    store.on(['theme'], () => this.#answer && page.map.show_drawn(this.#answer.visible));
    store.on(['scene', 'camera', 'heading_deg', 'field_of_view_deg', 'tool'], () => this.refresh());
  }

  look_from(place) {
    this.page.store.set({camera: {...place, height: this.page.store.state.camera?.height ?? HEIGHT}});
  }

  focus() {
    this.handle.button.focus();
  }

  refresh() {
    const {state} = this.page.store;
    const around = state.heading_deg === null;
    $('camera-around').checked = around;
    $('camera-heading').disabled = $('camera-fov').disabled = around;
    const can = Boolean(this.page.scene()?.groups);
    const hint = $('tool-camera').querySelector('[data-empty]');
    hint.hidden = can && Boolean(state.camera);
    hint.textContent = can
      ? 'Click a place for a camera: what would be left out of its picture, because ground hides it.'
      : 'This is a DEM, and culling is about groups of triangles: make a scene with scarp build, and serve that.';
    const on = can && state.tool === 'camera' && state.camera;
    this.handle.put(on ? state.camera : null);
    this.page.map.draw_camera(on ? state.camera : null, state.heading_deg, state.field_of_view_deg, this.#reach_m());
    if (on) return this.#newest.ask((signal) => this.#question(state, signal));
    this.#newest.stop();
    this.#show(null);
  }

  /** As far as the drawing of the view goes: a sixth of the scene. */
  #reach_m() {
    const [, south, , north] = this.page.scene()?.bounds ?? [0, 0, 0, 0];
    return ((north - south) * 111_000) / 6;
  }

  #question(state, signal) {
    return this.page.answer({
      ask: () => execute('cull', cull_inputs(state), {signal}),
      stop: () => this.#newest.stop(),
      is_wanted: () => this.page.store.state.tool === 'camera' && Boolean(this.page.store.state.camera),
      show: (answer) => this.#show(answer),
    });
  }

  #show(answer) {
    this.#answer = answer;
    this.page.map.show_layers(this.page.store.state);
    $('camera-bar').hidden = $('camera-legend').hidden = !answer;
    this.page.map.show_drawn(answer?.visible ?? null);
    const {total, in_view, visible} = answer?.groups ?? {};
    const hidden = in_view - visible;
    this.page.map.element.dataset.culled = answer ? String(hidden) : '';
    if (!answer) return $('camera-answer').replaceChildren();
    const part = (className, n) => element('i', {className, style: `width:${(100 * n) / total}%`});
    $('camera-bar').replaceChildren(part('seen', visible), part('culled', hidden));
    const all_around = this.page.store.state.heading_deg === null;
    const beyond = total - in_view ? ` ${(total - in_view).toLocaleString('en')} more are too far to be asked about.` : '';
    $('camera-answer').replaceChildren(
      element('b', {textContent: `${share(hidden, in_view)} of the groups are culled`}),
      element('small', {textContent: `${plural(visible, 'group')} drawn, ${hidden.toLocaleString('en')} hidden by ground${all_around ? '' : ' or out of view'}.${beyond}`}));
  }
}
