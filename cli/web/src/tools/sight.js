// Do two places see each other: the line, what blocks it first, and the profile under it.
import {$, element, save} from '../dom.js';
import {execute, sight_inputs} from '../api.js';
import {between} from '../geometry.js';
import {Handle} from '../markers.js';
import {Newest} from '../newest.js';
import {place_fields} from '../place_fields.js';
import {ProfilePlot} from '../plot.js';
import {distance, metres} from '../words.js';

export class SightTool {
  #newest = new Newest();
  #answer = null;

  constructor(page) {
    this.page = page;
    const {store} = page;
    const move = (key) => (at) => store.set({[key]: {...store.state[key], ...at}});
    const handle = (key, name, letter) => {
      const made = new Handle(page.map.map, 'end', name, {move: move(key), remove: () => store.set({[key]: null})});
      made.label(`${name}: drag, or move with the arrow keys`, letter);
      return made;
    };
    this.handles = {from: handle('from', 'From', 'A'), to: handle('to', 'To', 'B')};
    this.blocker = new Handle(page.map.map, 'blocker', 'What blocks the line first', {});
    this.spot = new Handle(page.map.map, 'spot', 'The place in the profile', {});
    for (const mark of [this.blocker, this.spot]) mark.button.inert = true;
    this.plot = new ProfilePlot($('sight-plot'), (index) => this.#point(index));
    place_fields($('sight-places'), store, 'from', 'From');
    place_fields($('sight-places'), store, 'to', 'To');
    $('sight-swap').addEventListener('click', () => store.set({from: store.state.to, to: store.state.from}));
    $('sight-clear').addEventListener('click', () => store.set({from: null, to: null}));
    $('sight-download').addEventListener('click', () => save(new Blob([JSON.stringify(this.#answer, null, 1)], {type: 'application/json'}), 'sight.json'));
    store.on(['scene', 'from', 'to', 'refraction', 'tool'], () => this.refresh());
    store.on(['theme'], () => this.#draw());
  }

  /** First one end, then the other, then one end anew. */
  look_from(place) {
    const {from, to} = this.page.store.state;
    const end = {...place, height: '2'};
    this.page.store.set(from && !to ? {to: {...end}} : {from: {...end, height: from?.height ?? '2'}, to: null});
  }

  focus() {
    this.handles.from.button.focus();
  }

  refresh() {
    const {state} = this.page.store;
    const on = state.tool === 'sight';
    this.handles.from.put(on ? state.from : null);
    this.handles.to.put(on ? state.to : null);
    $('tool-sight').querySelector('[data-empty]').hidden = Boolean(state.from && state.to);
    if (this.#is_asked()) return this.#newest.ask((signal) => this.#question(state, signal));
    this.#newest.stop();
    this.#show(null);
  }

  #is_asked() {
    const {tool, from, to} = this.page.store.state;
    return Boolean(tool === 'sight' && from && to);
  }

  #question(state, signal) {
    return this.page.answer({
      ask: () => execute('line-of-sight', sight_inputs(state), {signal}),
      stop: () => this.#newest.stop(),
      is_wanted: () => this.#is_asked(),
      show: (answer) => this.#show(answer && {...answer, from: state.from, to: state.to}),
    });
  }

  #show(answer) {
    this.#answer = answer;
    $('sight-download').disabled = !answer;
    const text = $('sight-answer');
    text.classList.toggle('seen', answer?.sight === 'visible');
    text.classList.toggle('blocked', answer?.sight === 'hidden');
    text.replaceChildren(...(answer ? this.#words(answer) : []));
    this.blocker.put(answer?.blocker ?? null);
    this.#draw();
    this.page.map.element.dataset.sight = answer ? answer.sight : '';
  }

  #words({sight, distance_m, clearance_m, blocker, least_target_height_m, least_eye_height_m}) {
    if (sight === 'unknown') return [element('b', {textContent: 'Unknown'}), element('small', {textContent: `The line of ${distance(distance_m)} runs over ground of which nothing is known.`})];
    if (sight === 'visible') {
      const clear = Number.isFinite(clearance_m) ? `, ${metres(clearance_m)} clear of the ground at the closest` : '';
      return [element('b', {textContent: 'They see each other'}), element('small', {textContent: `${distance(distance_m)} apart${clear}.`})];
    }
    const need = [];
    if (Number.isFinite(least_target_height_m)) need.push(`a target ${metres(least_target_height_m)} high would be seen`);
    if (Number.isFinite(least_eye_height_m)) need.push(`an eye ${metres(least_eye_height_m)} high would see it`);
    const where = blocker ? `Ground ${distance(blocker.distance_m)} from A blocks first. ` : '';
    const said = need.length ? `${need.join(', or ')}.` : '';
    return [element('b', {textContent: 'They do not see each other'}),
      element('small', {textContent: `${distance(distance_m)} apart. ${where}${said.charAt(0).toUpperCase()}${said.slice(1)}`})];
  }

  #draw() {
    const answer = this.#answer;
    if (!answer) {
      this.plot.clear();
      this.spot.put(null);
      return this.page.map.draw_sight(null, null, null);
    }
    const {from, to, blocker, profile, distance_m} = answer;
    this.page.map.draw_sight(from, to, blocker ? blocker.distance_m / distance_m : null);
    $('sight-plot').setAttribute('aria-label', `Profile over ${distance(distance_m)}; arrow keys walk along it`);
    this.plot.draw(profile, blocker);
  }

  #point(index) {
    const answer = this.#answer;
    if (index === null || !answer) return this.spot.put(null);
    const [lon, lat] = between(answer.from, answer.to, answer.profile[index][0] / answer.distance_m);
    this.spot.put({lon, lat});
  }
}
