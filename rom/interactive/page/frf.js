/** The frequency response: amplitude and phase over frequency, natural frequencies, the chosen frequency. */

import uPlot from "uplot";

const STEPS = [[1], [1, 2, 5], [1, 1.5, 2, 3, 4, 5, 6, 8],
               [1, 1.1, 1.2, 1.3, 1.4, 1.6, 1.8, 2, 2.2, 2.5, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 9]];
const HEIGHTS = {amplitude: 190, phase: 130};

export class ResponseChart {
  #plots = [];
  #frequency = 0;
  #natural = [];
  #data = null;

  /**
   * @param {HTMLElement} root
   * @param {(frequency: number) => void} onChoose
   */
  constructor(root, onChoose) {
    this.root = root;
    this.onChoose = onChoose;
    const fit = plot => plot.setSize({width: root.clientWidth, height: plot.height});
    new ResizeObserver(() => this.#plots.forEach(fit)).observe(root);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#data && this.#draw());
  }

  /** Take a response. @param {object} arrays of `frf` */
  show(arrays) {
    const {frequency: {data: frequency}, receptance: {data: u}} = arrays;
    const amplitude = [], phase = [];
    for (let i = 0; i < frequency.length; i++) {
      amplitude.push(1e6 * Math.hypot(u[2 * i], u[2 * i + 1]));
      phase.push(Math.atan2(u[2 * i + 1], u[2 * i]) * 180 / Math.PI);
    }
    this.#natural = [...arrays.natural_frequencies.data].filter(f => f <= frequency.at(-1));
    this.#data = [[...frequency], amplitude, unwrapped(phase)];
    if (this.#plots.length) {
      this.#plots[0].setData([this.#data[0], amplitude]);
      this.#plots[1].setData([this.#data[0], this.#data[2]]);
    } else this.#draw();
  }

  /** Mark the chosen frequency. */
  mark(frequency) {
    this.#frequency = frequency;
    this.#plots.forEach(plot => plot.redraw(false));
  }

  #draw() {
    this.#plots.forEach(plot => plot.destroy());
    this.#plots = [
      this.#plot("amplitude", [this.#data[0], this.#data[1]], "Amplitude [µm]", {distr: 3}),
      this.#plot("phase", [this.#data[0], this.#data[2]], "Phase [°]", {}),
    ];
  }

  #plot(kind, data, label, scale) {
    const style = getComputedStyle(document.documentElement), colour = name => style.getPropertyValue(name).trim();
    const axis = {stroke: colour("--faint"), grid: {stroke: colour("--line"), width: 0.5},
                  ticks: {stroke: colour("--line")}, font: "11px system-ui", labelFont: "12px system-ui"};
    const plot = new uPlot({
      width: this.root.clientWidth, height: HEIGHTS[kind], padding: [8, 10, 0, 0],
      cursor: {y: false, drag: {x: false, y: false}, sync: {key: "frf"}, points: {size: 6}},
      scales: {x: {time: false, range: [0, 300]},
               y: kind === "phase" ? {range: phaseRange} : {distr: 3, range: around}},
      axes: [kind === "phase" ? {...axis, space: 44, size: 26, label: "Frequency [Hz]", labelSize: 18, labelGap: 0}
             : {...axis, space: 44, size: 6, values: () => [], ticks: {show: false}},
             {...axis, size: 44, label, labelSize: 16, space: 26,
              ...(kind === "phase" ? {incrs: [15, 30, 45, 90, 180]}
                 : {
                   splits: (_, __, low, high) => roundSteps(low, high), filter: (_, splits) => splits,
                   values: (_, splits) => splits.map(String)})}],
      series: [{}, {stroke: colour("--accent"), width: 2, points: {show: false}}],
      hooks: {draw: [one => this.#marks(one, colour)]},
    }, data, this.root);
    plot.over.addEventListener("click", () => {
      const {left} = plot.cursor;
      if (left >= 0) this.onChoose(Math.round(Math.min(Math.max(plot.posToVal(left, "x"), 0), 300)));
    });
    plot.root.setAttribute("role", "img");
    plot.root.setAttribute("aria-label", `${label} over frequency`);
    return plot;
  }

  #marks(plot, colour) {
    const {ctx: pen} = plot, {left, top, width, height} = plot.bbox, ratio = devicePixelRatio;
    const line = (frequency, dash, stroke, thick) => {
      const x = Math.round(plot.valToPos(frequency, "x", true));
      if (x < left || x > left + width) return x;
      pen.beginPath();
      pen.setLineDash(dash.map(d => d * ratio));
      pen.strokeStyle = stroke;
      pen.lineWidth = thick * ratio;
      pen.moveTo(x, top);
      pen.lineTo(x, top + height);
      pen.stroke();
      return x;
    };
    pen.save();
    for (const frequency of this.#natural) line(frequency, [2, 3], colour("--faint"), 1);
    const x = line(this.#frequency, [], "#d9480f", 1.5);
    const y = plot.valToPos(interpolate(plot.data[0], plot.data[1], this.#frequency), "y", true);
    pen.beginPath();
    pen.setLineDash([]);
    pen.fillStyle = "#d9480f";
    pen.arc(x, y, 4 * ratio, 0, 2 * Math.PI);
    pen.fill();
    pen.restore();
  }
}

/** Without jumps of a whole turn. */
function unwrapped(phase) {
  let turns = 0;
  return phase.map((value, i) => {
    if (i > 0) turns -= Math.round((value - phase[i - 1]) / 360);
    return value + 360 * turns;
  });
}

function around(_, low, high) {
  if (!(high > 0)) return [0.1, 10];
  return [Math.max(low, high * 1e-6) / 1.15, high * 1.15];
}

function phaseRange(_, low, high) {
  return [Math.min(45 * Math.floor((low - 8) / 45), -45), Math.max(45 * Math.ceil((high + 8) / 45), 0)];
}

function interpolate(x, y, at) {
  const i = Math.min(Math.max(x.findIndex(value => value >= at), 1), x.length - 1);
  const part = Math.min(Math.max((at - x[i - 1]) / (x[i] - x[i - 1]), 0), 1);
  return y[i - 1] + part * (y[i] - y[i - 1]);
}

/** Round numbers between two: 1, 2, 5, 10 ..., or closer where few of those lie between. */
function roundSteps(low, high) {
  for (const steps of STEPS) {
    const found = [];
    for (let e = Math.floor(Math.log10(low)); e <= Math.log10(high); e++) {
      for (const step of steps) found.push(Number((step * 10 ** e).toPrecision(3)));
    }
    const inside = found.filter(x => x >= low && x <= high);
    if (inside.length >= 3) return inside;
  }
  return [Number(low.toPrecision(3)), Number(high.toPrecision(3))];
}
