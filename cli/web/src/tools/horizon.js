// The horizon of a place: its angles and distances as a plot, its line on the map, each pointing at
// the other.
import {$, element, save} from '../dom.js';
import {execute, horizon_inputs} from '../api.js';
import {azimuth_deg} from '../geometry.js';
import {Handle} from '../markers.js';
import {Newest} from '../newest.js';
import {place_fields} from '../place_fields.js';
import {HorizonPlot} from '../plot.js';
import {compass, distance} from '../words.js';

export class HorizonTool {
  #newest = new Newest();
  #answer = null;

  constructor(page) {
    this.page = page;
    const {store} = page;
    this.handle = new Handle(page.map.map, 'point', 'Place', {
      move: (at) => store.set({point: {...store.state.point, ...at}}),
      remove: () => store.set({point: null}),
    });
    this.handle.label('Place of the horizon: drag, or move with the arrow keys');
    this.spot = new Handle(page.map.map, 'spot', 'The place in the plot', {});
    this.spot.button.inert = true;
    this.plot = new HorizonPlot($('horizon-plot'), (index) => this.#point(index));
    place_fields($('horizon-places'), store, 'point', 'Place');
    $('horizon-clear').addEventListener('click', () => store.set({point: null}));
    $('horizon-download').addEventListener('click', () => save(new Blob([this.#csv()], {type: 'text/csv'}), 'horizon.csv'));
    page.map.map.on('mousemove', ({lngLat}) => this.#follow(lngLat));
    page.map.map.on('mouseout', () => this.#answer && this.plot.mark(null));
    store.on(['scene', 'point', 'refraction', 'tool'], () => this.refresh());
    store.on(['theme'], () => this.#draw());
  }

  look_from(place) {
    this.page.store.set({point: {...place, height: this.page.store.state.point?.height ?? '2'}});
  }

  focus() {
    this.handle.button.focus();
  }

  refresh() {
    const {state} = this.page.store;
    const on = state.tool === 'horizon' && state.point;
    this.handle.put(on ? state.point : null);
    $('tool-horizon').querySelector('[data-empty]').hidden = Boolean(state.point);
    if (on) return this.#newest.ask((signal) => this.#question(state, signal));
    this.#newest.stop();
    this.#show(null);
  }

  #question(state, signal) {
    return this.page.answer({
      ask: () => execute('horizon', horizon_inputs(state), {signal}),
      stop: () => this.#newest.stop(),
      is_wanted: () => this.page.store.state.tool === 'horizon' && Boolean(this.page.store.state.point),
      show: (answer) => this.#show(answer && {...answer, at: state.point}),
    });
  }

  #show(answer) {
    this.#answer = answer;
    $('horizon-download').disabled = !answer;
    $('horizon-answer').replaceChildren(...(answer ? this.#words(answer) : []));
    this.page.map.element.dataset.horizon = answer ? String(answer.azimuths_deg.length) : '';
    this.#draw();
  }

  #words({azimuths_deg, upper_deg, distance_m}) {
    const best = (values) => values.reduce((top, value, i) => (value !== null && (top < 0 || value > values[top]) ? i : top), -1);
    const [steep, far] = [best(upper_deg), best(distance_m)];
    if (steep < 0) return [element('b', {textContent: 'No ground around'})];
    const at = (i) => `${compass(azimuths_deg[i])} (${Math.round(azimuths_deg[i])}°)`;
    return [element('b', {textContent: `Highest ${upper_deg[steep].toFixed(1)}° in the ${at(steep)}`}),
      element('small', {textContent: `${distance(distance_m[steep])} away. Farthest: ${distance(distance_m[far])}, in the ${at(far)}.`})];
  }

  #draw() {
    const answer = this.#answer;
    this.spot.put(null);
    if (!answer) {
      this.plot.clear();
      return this.page.map.draw_horizon([]);
    }
    const {points} = answer;
    this.page.map.draw_horizon([...points, points[0]]);
    $('horizon-plot').setAttribute('aria-label', `Horizon angles by azimuth; arrow keys walk around. ${$('horizon-answer').textContent}`);
    this.plot.draw(answer);
  }

  #point(index) {
    const point = index === null ? null : this.#answer?.points[index];
    this.spot.put(point ? {lon: point[0], lat: point[1]} : null);
  }

  #follow({lng, lat}) {
    if (!this.#answer) return;
    const {at, azimuths_deg} = this.#answer;
    const turned = azimuth_deg(at, {lon: lng, lat});
    const step = 360 / azimuths_deg.length;
    this.plot.mark(Math.round(turned / step) % azimuths_deg.length);
  }

  #csv() {
    const {azimuths_deg, lower_deg, upper_deg, distance_m, points} = this.#answer;
    const rows = azimuths_deg.map((azimuth, i) => [azimuth, lower_deg[i], upper_deg[i], distance_m[i], ...(points[i] ?? [null, null])].map((value) => value ?? '').join(','));
    return ['azimuth_deg,lower_deg,upper_deg,distance_m,longitude,latitude', ...rows, ''].join('\n');
  }
}
