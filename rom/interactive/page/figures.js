/** The figures that matter, and the colour bar. */

import {gradient, QUANTITIES} from "./colours.js";
import {minus, power, prefixOf, withUnit} from "./numbers.js";

const POWERS = {n: "10⁻⁹", "µ": "10⁻⁶", m: "10⁻³"};
const AT = id => document.getElementById(id);

/**
 * Figures of a field.
 * @param {object} header of `field`
 * @param {import("./state.js").State} state
 * @param {boolean} local
 */
export function showField(header, state, local) {
  const probe = header.probe ?? header.probes[0], size = Math.hypot(...probe.u.flat());
  const place = state.probe === null ? "force 1" : "the probe";
  AT("probe-name").textContent = `Displacement at ${place}, node ${probe.node}`;
  figure("probe-value", size, withUnit(size, "m", 7));
  AT("probe-normal").textContent = probe.normal === null ? "" : normalWords(probe.normal, state.frequency > 0);
  Object.assign(AT("probe-normal").dataset, {re: probe.normal?.[0] ?? "", im: probe.normal?.[1] ?? ""});
  figure("seconds", header.seconds, withUnit(header.seconds, "s", 2));
  showSpeedup(header.speedup);
  showIndicators(header, local);
}

/** Residual and bound, which may come later than the picture. */
export function showIndicators(header, local) {
  const {residual, bound} = header;
  figure("residual", residual, Number.isFinite(residual) ? power(residual) : local ? "server only" : "…");
  figure("bound", bound, Number.isFinite(bound) ? `≤ ${power(bound)}` : "none");
  AT("bound").title = local ? "The largest found when this file was made, over frequencies, loss factors, nodes" : "";
}

/** @param {?number} speedup */
export function showSpeedup(speedup) {
  figure("speedup", speedup, speedup ? `${Number(speedup.toPrecision(2)).toLocaleString("en")} ×` : "not yet");
  AT("speedup").title = speedup ? "" : "Compare with direct to measure it";
}

/** Nothing to show while a slow method computes. */
export function showWaiting() {
  for (const id of ["seconds", "residual", "bound"]) figure(id, null, "…");
}

function figure(id, value, text) {
  AT(id).value = text;
  AT(id).dataset.value = value ?? "";
}

function normalWords([re, im], moving) {
  if (!moving) return `into the skin ${withUnit(re, "m", 7)}`;
  const degrees = Math.atan2(im, re) * 180 / Math.PI;
  return `into the skin ${withUnit(Math.hypot(re, im), "m", 7)} at ${minus(degrees.toFixed(2))}°`;
}

/** The colour bar. @param {string} quantity @param {{range: [number, number], clipped: boolean}} drawn */
export function showLegend(quantity, {range, clipped}) {
  const {title, map, unit} = QUANTITIES[quantity];
  AT("legend-bar").style.background = gradient(map, "to top");
  const {words, labels} = legendWords(title, unit, range, clipped);
  AT("legend-title").textContent = words;
  [...AT("legend-ticks").children].forEach((tick, i) => (tick.textContent = labels[i]));
}

/**
 * Title with unit, and labels from top to bottom.
 * @returns {{words: string, labels: string[]}}
 */
export function legendWords(title, unit, [low, high], clipped) {
  const places = [high, (low + high) / 2, low];
  if (unit === "deg") return {words: `${title} [°]`, labels: places.map(x => minus(x.toFixed(0)))};
  const {factor, prefix} = prefixOf(high);
  const words = `${title} [${unit ? prefix + unit : POWERS[prefix] ?? "1"}]`;
  const labels = places.map(x => minus(Number((x / factor).toPrecision(3)).toString()));
  if (clipped) {
    labels[0] = `≥ ${labels[0]}`;
    if (low < 0) labels[2] = `≤ ${labels[2]}`;
  }
  return {words, labels};
}

/** In how slow a motion the cycle runs. */
export function slownessWords(frequency, cycleSeconds) {
  const slower = frequency * cycleSeconds;
  return frequency > 0 ? `${Number(slower.toPrecision(3))} times slower than life` : "";
}
