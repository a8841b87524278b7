// A place as fields: longitude and latitude in one, the height in another.
import {coordinates, height} from './store.js';
import {element, fill, text_field} from './dom.js';

/** @param key  of the store  @param name  shown  @param above  the height of a new place */
export function place_fields(parent, store, key, name, above = '2') {
  const set = (patch) => store.set({[key]: {height: above, ...store.state[key], ...patch}});
  const where = text_field({placeholder: 'longitude, latitude', ariaLabel: `${name}: longitude, latitude`}, coordinates, set);
  const tall = text_field({placeholder: 'height', ariaLabel: `${name}: height in metres, or such as 1200asl`, title: 'Metres above ground, or above the datum: 1200asl'},
    height, (value) => store.state[key] && set({height: value}));
  parent.append(element('div', {className: 'place'}, element('span', {textContent: name}), where, tall, element('i', {className: 'unit', textContent: 'm'})));
  const show = (place) => {
    fill(where, place ? `${place.lon}, ${place.lat}` : '');
    fill(tall, place ? place.height : above);
  };
  show(store.state[key]);
  store.on([key], (state) => show(state[key]));
}
