/**
 * The engine of an exported page: the modal ROM of the surface, computed in the browser.
 *
 * With s = omega^2 / (1 + i eta), u = 1 / (1 + i eta) * (sum_k phi_k (phi_k^T f) / (lambda_k - s) + R(s) f), R a power
 * series in s whose terms share one basis; rom/interactive/surface_model.py says the same in Python.
 */

import {decode} from "./wire.js";

const ELSEWHERE = "not inside this file: it needs `rom serve`";
const NAMES = {
  direct: "factorise and solve", "direct-reused": "the factor kept", "coarse-fem": "a coarser mesh",
  superposition: "unit loads added up", modal: "natural modes", "modal-static": "modes plus residual flexibility",
  "pod-galerkin": "projection on snapshots", "pod-regression": "regression on snapshots", transformer: "a network",
  mlp: "a network", "mlp-residual": "a network", "pole-network": "a network",
  "lookup-table": "stored responses, interpolated",
};
const FRF_POINTS = 150;
const HIGHEST_HZ = 300;

export class ModalEngine {
  /** @param {ArrayBuffer} buffer what `rom export-page` put into the file */
  constructor(buffer) {
    const {header, arrays} = decode(buffer);
    this.local = true;
    this.header = header;
    this.arrays = arrays;
    this.load = new Map([...arrays.pad_vertex.data].map((vertex, i) => [arrays.vertex_node.data[vertex], i]));
    this.vertex = new Map();
    arrays.vertex_node.data.forEach((node, i) => this.vertex.has(node) || this.vertex.set(node, i));
    this.modes = this.#rows("mode", arrays.mode_factor.data);
    this.rest = this.#rows("rest", arrays.rest_factor.data);
  }

  #rows(name, factor) {
    const {data, shape: [count, length]} = this.arrays[name];
    const rows = new Float32Array(data.length);
    for (let k = 0; k < data.length; k++) rows[k] = data[k] * factor[Math.floor(k / length)];
    return {rows, count, length};
  }

  /** Say what there is, as the server does. */
  async hello() {
    const {arrays, header} = this;
    const others = Object.entries(NAMES).map(([name, summary]) => ({
      name, summary, static: false, harmonic: false, reason: ELSEWHERE, reason_static: ELSEWHERE,
      reason_harmonic: ELSEWHERE}));
    const own = {name: header.method, summary: "natural modes plus load-dependent vectors",
                 static: true, harmonic: true,
                 reason: "", reason_static: "", reason_harmonic: ""};
    return {arrays, header: {...header, methods: [own, ...others],
                             quantities: ["magnitude", "x", "y", "z", "normal", "phase"], ready: true}};
  }

  /** The field of a state; in the browser there is nothing to wait for. */
  async field(state) {
    const start = performance.now();
    const {re, im} = this.#coordinates(state, state.frequency);
    const length = this.modes.length, u = new Float32Array(2 * length);
    const sums = [new Float64Array(length), new Float64Array(length)];
    this.#add(sums, this.modes, re.modes, im.modes);
    this.#add(sums, this.rest, re.rest, im.rest);
    for (let k = 0; k < length; k++) {
      u[2 * k] = sums[0][k];
      u[2 * k + 1] = sums[1][k];
    }
    const seconds = (performance.now() - start) / 1000;
    const at = node => this.#at(sums, node);
    return {
      arrays: {u: {data: u, shape: [length / 3, 3, 2]}},
      header: {answer: "field", method: state.method, seconds, validity: "", residual: null, speedup: null,
               bound: this.header.measured?.bound ?? null, probes: state.forces.map(([node]) => at(node)),
               probe: at(state.probe ?? state.forces[0][0])}};
  }

  /** Normal displacement at a node over frequency. */
  async frf(state, node) {
    const start = performance.now(), vertex = this.vertex.get(node), {data: normal} = this.arrays.vertex_normal;
    const inward = [0, 1, 2].map(c => -normal[3 * vertex + c]);
    const along = block => Float64Array.from({length: block.count}, (_, i) =>
      inward.reduce((sum, n, c) => sum + n * block.rows[i * block.length + 3 * vertex + c], 0));
    const modes = along(this.modes), rest = along(this.rest);
    const frequency = new Float64Array(FRF_POINTS), receptance = new Float64Array(2 * FRF_POINTS);
    for (let i = 0; i < FRF_POINTS; i++) {
      frequency[i] = HIGHEST_HZ * (i + 1) / FRF_POINTS;
      const {re, im} = this.#coordinates(state, frequency[i]);
      receptance[2 * i] = dot(re.modes, modes) + dot(re.rest, rest);
      receptance[2 * i + 1] = dot(im.modes, modes) + dot(im.rest, rest);
    }
    const natural = Float64Array.from(this.arrays.eigenvalue.data, x => Math.sqrt(x) / (2 * Math.PI));
    return {header: {answer: "frf", node, seconds: (performance.now() - start) / 1000},
            arrays: {frequency: {data: frequency}, receptance: {data: receptance},
                     natural_frequencies: {data: natural}}};
  }

  /** Nothing here solves directly. */
  async error() {
    throw new Error("A comparison with direct solves needs `rom serve`.");
  }

  async cut() {
    throw new Error("The inside of the fingertip is not in this file: a cut needs `rom serve`.");
  }

  /** Files are written by the server alone. */
  download() {
    return null;
  }

  /** Complex coordinates of the modes and of the remainder's basis. */
  #coordinates(state, frequency) {
    const eta = frequency > 0 ? state.loss_factor : 0, size = 1 + eta * eta;
    const turn = [1 / size, -eta / size]; // 1 / (1 + i eta)
    const omega2 = (2 * Math.PI * frequency) ** 2, s = [omega2 * turn[0], omega2 * turn[1]];
    const {eigenvalue, participation, rest_term: term} = this.arrays;
    const n = this.modes.count, [terms, loads, r] = term.shape;
    const re = {modes: new Float64Array(n), rest: new Float64Array(r)};
    const im = {modes: new Float64Array(n), rest: new Float64Array(r)};
    const forces = state.forces.map(([node, force]) => [this.load.get(node), force]);
    for (let k = 0; k < n; k++) {
      const load = forces.reduce((sum, [l, force]) => sum + force * participation.data[l * n + k], 0);
      const a = eigenvalue.data[k] - s[0], b = -s[1], scale = load / (a * a + b * b);
      re.modes[k] = scale * (a * turn[0] + b * turn[1]);
      im.modes[k] = scale * (a * turn[1] - b * turn[0]);
    }
    const step = s.map(x => x / this.header.s_unit);
    let power = turn;
    for (let j = 0; j < terms; j++) {
      for (const [l, force] of forces) {
        const from = (j * loads + l) * r;
        for (let i = 0; i < r; i++) {
          const value = force * term.data[from + i];
          re.rest[i] += power[0] * value;
          im.rest[i] += power[1] * value;
        }
      }
      power = [power[0] * step[0] - power[1] * step[1], power[0] * step[1] + power[1] * step[0]];
    }
    return {re, im};
  }

  #add([real, imaginary], {rows, count, length}, re, im) {
    for (let i = 0; i < count; i++) {
      const a = re[i], b = im[i], from = i * length;
      for (let k = 0; k < length; k++) {
        real[k] += a * rows[from + k];
        imaginary[k] += b * rows[from + k];
      }
    }
  }

  #at(sums, node) {
    const vertex = this.vertex.get(node), {data: normal} = this.arrays.vertex_normal;
    const u = [0, 1, 2].map(c => [sums[0][3 * vertex + c], sums[1][3 * vertex + c]]);
    const inward = [0, 1].map(part => -u.reduce((sum, one, c) => sum + one[part] * normal[3 * vertex + c], 0));
    return {node, u, normal: inward};
  }
}

const dot = (a, b) => {
  let sum = 0;
  for (let i = 0; i < a.length; i++) sum += a[i] * b[i];
  return sum;
};
