// Two plots: a sight line's profile, and a horizon. Both can be walked with the arrow keys.
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import {ink} from './theme.js';
import {compass, distance} from './words.js';

const HEIGHT_PX = 190;
const FONT = '12px system-ui, sans-serif';

const axis = (more) => ({stroke: ink('--soft'), font: FONT, grid: {stroke: ink('--rule'), width: 1}, ticks: {show: false}, size: 44, gap: 6, ...more});

const height = (m) => (m === null ? 'unknown' : `${m.toFixed(1)} m`);

/** A plot that fills its element and follows its width.
 *  @param point  called with the index under the cursor, or null */
class Plot {
  constructor(element, point) {
    this.element = element;
    this.point = point;
    this.plot = null;
    this.says = document.createElement('p');
    this.says.className = 'says';
    this.says.hidden = true;
    element.after(this.says);
    new ResizeObserver(() => this.plot?.setSize({width: element.clientWidth, height: HEIGHT_PX})).observe(element);
    element.addEventListener('keydown', (event) => this.#key(event));
    element.addEventListener('blur', () => this.mark(null));
  }

  #key(event) {
    const step = {ArrowLeft: -1, ArrowRight: 1, PageUp: -10, PageDown: 10}[event.key];
    if (!step || !this.plot) return;
    event.preventDefault();
    const last = this.plot.data[0].length - 1;
    this.mark(Math.max(0, Math.min(last, (this.plot.cursor.idx ?? 0) + step)));
  }

  /** Puts the cursor over a sample. */
  mark(index) {
    if (!this.plot) return;
    const left = index === null ? -10 : this.plot.valToPos(this.plot.data[0][index], 'x');
    this.plot.setCursor({left, top: index === null ? -10 : 10});
  }

  clear() {
    this.plot?.destroy();
    this.plot = null;
    this.element.hidden = this.says.hidden = true;
  }

  /** @param words  what is said of the sample at an index */
  show(options, data, words) {
    this.element.hidden = this.says.hidden = false;
    this.plot?.destroy();
    this.plot = new uPlot({
      width: this.element.clientWidth,
      height: HEIGHT_PX,
      cursor: {y: false, drag: {x: false, y: false}, points: {size: 8}},
      legend: {show: false},
      ...options,
      hooks: {...options.hooks, setCursor: [(plot) => this.#cursor(plot.cursor.idx ?? null, words)]},
    }, data, this.element);
    this.#cursor(null, words);
  }

  #cursor(index, words) {
    this.says.textContent = index === null ? 'Along the plot, the place is shown on the map.' : words(index);
    this.point(index);
  }
}

export class ProfilePlot extends Plot {
  /** @param profile  [[distance_m, ground_m | null, line_m], ...]
   *  @param blocker  {distance_m, height_m} or null */
  draw(profile, blocker) {
    const data = [0, 1, 2].map((column) => profile.map((row) => (column ? row[column] : row[0] / 1000)));
    const spot = (plot) => {
      if (!blocker) return;
      const [x, y] = [plot.valToPos(blocker.distance_m / 1000, 'x', true), plot.valToPos(blocker.height_m, 'y', true)];
      plot.ctx.save();
      plot.ctx.fillStyle = ink('--hidden');
      plot.ctx.beginPath();
      plot.ctx.arc(x, y, 5 * devicePixelRatio, 0, 2 * Math.PI);
      plot.ctx.fill();
      plot.ctx.restore();
    };
    this.show({
      scales: {x: {time: false}},
      axes: [axis({size: 30, values: (_, ticks) => ticks.map((km) => `${km} km`)}), axis({values: (_, ticks) => ticks.map((m) => `${m}`)})],
      series: [
        {},
        {stroke: ink('--ground'), fill: ink('--ground-fill'), width: 1.5},
        {stroke: ink(blocker ? '--hidden' : '--seen'), width: 2, dash: blocker ? [6, 4] : undefined},
      ],
      hooks: {draw: [spot]},
    }, data, (i) => `At ${distance(profile[i][0])}: ground ${height(profile[i][1])}, line ${height(profile[i][2])}`);
  }
}

export class HorizonPlot extends Plot {
  draw({azimuths_deg, upper_deg, distance_m}) {
    const km = distance_m.map((m) => (m === null ? null : m / 1000));
    this.show({
      scales: {x: {time: false, range: [0, 360]}, km: {range: (_, low, high) => [0, (high || 1) * 1.1]}},
      axes: [
        axis({size: 30, splits: () => [0, 90, 180, 270, 360], values: () => ['N', 'E', 'S', 'W', 'N']}),
        axis({values: (_, ticks) => ticks.map((deg) => `${deg}°`)}),
        axis({scale: 'km', side: 1, grid: {show: false}, values: (_, ticks) => ticks.map((v) => `${v} km`), size: 52}),
      ],
      series: [
        {},
        {stroke: ink('--horizon'), fill: ink('--horizon-fill'), width: 1.5},
        {scale: 'km', stroke: ink('--soft'), width: 1, dash: [2, 3]},
      ],
    }, [azimuths_deg, upper_deg, km], (i) => (upper_deg[i] === null ? `${azimuths_deg[i]}°: no ground` : `${azimuths_deg[i]}° ${compass(azimuths_deg[i])}: ${upper_deg[i].toFixed(2)}° up, ${distance(distance_m[i])} away`));
  }
}
