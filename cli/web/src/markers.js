// Things on the map that can be dragged, and moved with the arrow keys.
import maplibregl from 'maplibre-gl';
import {longitude, rounded} from './store.js';

const STEP_PX = 4;
const LONG_STEP_PX = 40;
const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};

export class Handle {
  /** @param kind  of the marker, a class of style.css
   *  @param on.move  called with {lon, lat} while it moves  @param on.remove, on.choose  or none */
  constructor(map, kind, label, on) {
    this.button = Object.assign(document.createElement('button'), {type: 'button', className: `handle ${kind}`});
    this.marker = new maplibregl.Marker({element: this.button, draggable: Boolean(on.move), anchor: 'center', opacityWhenCovered: '0.6'});
    this.map = map;
    this.on = on;
    this.label(label);
    this.marker.on('drag', () => {
      const at = this.marker.getLngLat();
      on.move({lon: longitude(at.lng), lat: rounded(at.lat)});
    });
    this.marker.on('dragstart', () => on.choose?.());
    this.button.addEventListener('click', (event) => {
      event.stopPropagation();
      on.choose?.();
    });
    this.button.addEventListener('keydown', (event) => this.#key(event));
  }

  label(text, letter = '') {
    this.text = text;
    this.button.setAttribute('aria-label', text);
    this.button.title = text;
    this.button.dataset.letter = letter;
  }

  #key(event) {
    const arrow = ARROWS[event.key];
    if (arrow && this.on.move && !event.ctrlKey && !event.metaKey && !event.altKey) {
      const step = event.shiftKey ? LONG_STEP_PX : STEP_PX;
      const at = this.map.project(this.marker.getLngLat());
      const to = this.map.unproject([at.x + arrow[0] * step, at.y + arrow[1] * step]);
      this.on.choose?.();
      this.on.move({lon: longitude(to.lng), lat: rounded(to.lat)});
    } else if ((event.key === 'Delete' || event.key === 'Backspace') && this.on.remove) {
      this.on.remove();
    } else {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  }

  /** Shows it at a place; without one, hides it. */
  put(place) {
    if (!place) {
      this.marker.remove();
      return this;
    }
    this.marker.setLngLat([place.lon, place.lat]);
    if (!this.button.isConnected) {
      this.marker.addTo(this.map);
      this.button.setAttribute('aria-label', this.text); // MapLibre gives it one of its own
      this.button.removeAttribute('role');
      this.button.tabIndex = 0;
    }
    return this;
  }

  remove() {
    this.marker.remove();
  }
}
