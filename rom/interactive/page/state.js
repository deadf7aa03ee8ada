/** What the page shows, as one plain object, and its form in the address; the server checks the same form again. */

export const MOST_FORCES = 3;
export const AMPLITUDE = {min: -10, max: 10, smallest: 1e-6};
export const FREQUENCY = {min: 0, max: 300};
export const LOSS_FACTOR = {min: 0, max: 1};
const AXES = ["x", "y", "z"];

/**
 * @typedef {object} State
 * @property {[number, number][]} forces pad node and amplitude [N], positive into the skin
 * @property {number} frequency [Hz]
 * @property {number} loss_factor
 * @property {string} method
 * @property {string} quantity
 * @property {?[string, number]} cut axis and place [mm]
 * @property {?number} probe node; null is the first force's
 */

/**
 * The state of a first visit.
 * @param {number} padCenter node
 * @returns {State}
 */
export function defaultState(padCenter) {
  return {forces: [[padCenter, 0.1]], frequency: 0, loss_factor: 0.1, method: "modal-krylov", quantity: "magnitude",
          cut: null, probe: null};
}

/** What a server is asked with: the state alone. @param {State} state */
export function asRequest({forces, frequency, loss_factor, method, quantity, cut, probe}) {
  return {forces, frequency, loss_factor, method, quantity, cut, probe};
}

/**
 * The state as a query string.
 * @param {State} state
 * @param {{view?: ?number[], scale?: ?number}} page what is the page's alone
 */
export function toQuery(state, page = {}) {
  const parts = [`forces=${state.forces.map(([node, force]) => `${node}:${short(force)}`).join(",")}`,
    `f=${short(state.frequency)}`, `eta=${short(state.loss_factor)}`, `method=${state.method}`,
    `quantity=${state.quantity}`, `cut=${state.cut ? `${state.cut[0]}:${short(state.cut[1])}` : "none"}`];
  if (state.probe !== null) parts.push(`probe=${state.probe}`);
  if (page.view) parts.push(`view=${page.view.map(x => Number(x.toFixed(2))).join(",")}`);
  if (page.scale) parts.push(`scale=${short(page.scale)}`);
  return parts.join("&");
}

const short = x => String(Number(x.toPrecision(12)));

/**
 * The state that an address holds.
 * @param {string} query
 * @param {object} known what there is: padNodes, surfaceNodes (sets), methods, quantities (arrays), padCenter
 * @returns {{state: State, view: ?number[], scale: ?number, problems: string[]}}
 *   what cannot be is left at its default and named in a sentence
 */
export function fromQuery(query, known) {
  const given = new URLSearchParams(query), state = defaultState(known.padCenter), problems = [];
  const use = (key, read) => {
    if (!given.has(key)) return undefined;
    const value = read(given.get(key).slice(0, 200));
    if (value === undefined) problems.push(`The link's ${key} cannot be used, so the default stands.`);
    return value;
  };
  const within = range => text => {
    const x = text.trim() === "" ? NaN : Number(text);
    return x >= range.min && x <= range.max ? x : undefined;
  };
  const oneOf = list => text => (list.includes(text) ? text : undefined);
  state.forces = use("forces", text => readForces(text, known.padNodes)) ?? state.forces;
  state.frequency = use("f", within(FREQUENCY)) ?? state.frequency;
  state.loss_factor = use("eta", within(LOSS_FACTOR)) ?? state.loss_factor;
  state.method = use("method", oneOf(known.methods)) ?? state.method;
  state.quantity = use("quantity", oneOf(known.quantities)) ?? state.quantity;
  state.cut = use("cut", readCut) ?? null;
  state.probe = use("probe", text => (known.surfaceNodes.has(Number(text)) ? Number(text) : undefined)) ?? null;
  const view = use("view", text => readNumbers(text, 6)) ?? null;
  const scale = use("scale", within({min: 1e-3, max: 1e9})) ?? null;
  return {state, view, scale, problems};
}

function readForces(text, padNodes) {
  const forces = text.split(",").map(one => one.split(":").map(Number));
  const nodes = new Set(forces.map(([node]) => node));
  const good = forces.length <= MOST_FORCES && nodes.size === forces.length && forces.every(one =>
    one.length === 2 && padNodes.has(one[0]) && Math.abs(one[1]) <= AMPLITUDE.max
    && Math.abs(one[1]) >= AMPLITUDE.smallest);
  return good ? forces : undefined;
}

function readCut(text) {
  if (text === "none") return null;
  const [axis, place] = text.split(":");
  return AXES.includes(axis) && place !== "" && Math.abs(Number(place)) <= 100 ? [axis, Number(place)] : undefined;
}

function readNumbers(text, count) {
  const found = text.split(",").map(Number);
  return found.length === count && found.every(x => Number.isFinite(x) && Math.abs(x) < 1e4) ? found : undefined;
}
