/** The form: native inputs that show a state and say what a person changes in it. */

import {AMPLITUDE, FREQUENCY, LOSS_FACTOR, MOST_FORCES} from "./state.js";
import {QUANTITIES} from "./colours.js";

const AT = id => document.getElementById(id);
const QUIET_UNITS = {amplitude: "newtons", frequency: "hertz", loss: ""};

export class Controls {
  /**
   * @param {object} hello header of the engine's first answer
   * @param {boolean} local whether the engine is the browser itself
   * @param {object} on listeners: change(patch, event), select(i), remove(i), scale(value or null)
   */
  constructor(hello, local, on) {
    this.hello = hello;
    this.local = local;
    this.on = on;
    this.#pair("amplitude", AMPLITUDE, (value, event) => value !== 0 && on.amplitude(value, event));
    this.#pair("frequency", FREQUENCY, (value, event) => on.change({frequency: value}, event));
    this.#pair("loss", LOSS_FACTOR, (value, event) => on.change({loss_factor: value}, event));
    this.#pair("cut", {min: -100, max: 100}, (value, event) => on.change({cut: [AT("cut-axis").value, value]}, event));
    for (const name of Object.keys(QUANTITIES)) {
      const missing = !hello.quantities.includes(name);
      AT("quantity").add(new Option(QUANTITIES[name].title + (missing ? " (needs rom serve)" : ""), name));
      AT("quantity").lastElementChild.disabled = missing;
    }
    AT("quantity").addEventListener("input", event => on.change({quantity: event.target.value}, event));
    AT("method").addEventListener("input", event => on.change({method: event.target.value}, event));
    AT("cut-axis").addEventListener("input", event => on.change({cut: this.#cutOf(event.target.value)}, event));
    AT("scale").addEventListener("input", event => {
      AT("scale-auto").checked = false;
      on.scale(Number((10 ** event.target.value).toPrecision(3)));
    });
    AT("scale-auto").addEventListener("input", event => on.scale(event.target.checked ? null : this.scale));
    if (local) {
      for (const id of ["cut-axis", "compare", "save-vtu", "save-nc"]) AT(id).disabled = true;
      AT("picture-note").textContent = "Cuts and strain need the inside of the fingertip: run `rom serve`.";
      AT("comparison").textContent = "Direct solves need `rom serve`; this file holds the modal model of the surface.";
      AT("saved").textContent = "VTU and netCDF hold the whole field, which needs `rom serve`.";
    }
  }

  /** What a click on the skin does: move, add or probe. */
  get clickMode() {
    return document.querySelector("input[name=click]:checked").value;
  }

  set clickMode(value) {
    document.querySelector(`input[name=click][value=${value}]`).checked = true;
  }

  /** A slider and its number, one value. */
  #pair(id, {min, max}, take) {
    const slider = AT(id), number = AT(`${id}-number`);
    const read = event => {
      const value = event.target.valueAsNumber, good = value >= min && value <= max;
      event.target.setAttribute("aria-invalid", String(!good));
      if (good) take(value, event);
    };
    slider.addEventListener("input", read);
    number.addEventListener("input", read);
    number.addEventListener("change", event => {
      event.target.setAttribute("aria-invalid", "false");
      this.show(this.state, this.selected); // a value that was refused gives way to the one that holds
    });
    const unit = QUIET_UNITS[id];
    if (unit) slider.dataset.unit = unit;
  }

  #cutOf(axis) {
    if (axis === "none") return null;
    const [low, high] = this.hello.ranges.cut[axis];
    return [axis, axis === "x" ? Math.round(0.62 * high) : Math.round((low + high) / 2)];
  }

  /** Show a state. @param {import("./state.js").State} state @param {number} selected */
  show(state, selected) {
    this.state = state;
    this.selected = selected;
    const force = state.forces[selected][1], span = Math.max(1, Math.abs(force));
    AT("amplitude").min = -span;
    AT("amplitude").max = span;
    set("amplitude", force, `${force} newtons`);
    set("frequency", state.frequency, state.frequency ? `${state.frequency} hertz` : "0 hertz, static");
    set("loss", state.loss_factor, String(state.loss_factor));
    AT("loss").disabled = AT("loss-number").disabled = state.frequency === 0;
    AT("static-note").hidden = state.frequency !== 0;
    AT("quantity").value = state.quantity;
    AT("cut-axis").value = state.cut ? state.cut[0] : "none";
    AT("cut-row").hidden = !state.cut;
    if (state.cut) {
      const [low, high] = this.hello.ranges.cut[state.cut[0]];
      const ends = {min: low.toFixed(2), max: high.toFixed(2)};
      for (const id of ["cut", "cut-number"]) Object.assign(AT(id), ends);
      set("cut", state.cut[1], `${state.cut[1]} millimetres`);
    }
    if (!this.local) AT("picture-note").textContent = noteOf(state);
    this.#showForces(state, selected);
    this.#showMethods(state);
  }

  #showForces(state, selected) {
    const key = JSON.stringify([state.forces, selected]);
    if (this.drawnForces === key) return;
    this.drawnForces = key;
    const root = AT("forces"), active = document.activeElement;
    const before = active?.closest("#forces") && active.dataset.key;
    root.replaceChildren(...state.forces.map(([node, force], i) => {
      const row = document.createElement("div");
      row.className = "force";
      const label = document.createElement("label"), radio = document.createElement("input");
      Object.assign(radio, {type: "radio", name: "selected", checked: i === selected, value: String(i)});
      radio.dataset.key = `select-${i}`;
      radio.addEventListener("input", () => this.on.select(i));
      const newtons = document.createElement("span");
      newtons.className = "newtons";
      newtons.textContent = `${Number(force.toPrecision(4))} N`.replace("-", "\u2212");
      label.append(radio, `${i + 1}: node ${node}`, newtons);
      row.append(label);
      if (state.forces.length > 1) {
        const remove = document.createElement("button");
        Object.assign(remove, {type: "button", textContent: "Remove"});
        remove.dataset.key = `remove-${i}`;
        remove.setAttribute("aria-label", `Remove force ${i + 1}`);
        remove.addEventListener("click", () => this.on.remove(i));
        row.append(remove);
      }
      return row;
    }));
    if (before) root.querySelector(`[data-key="${before}"]`)?.focus();
    const add = document.querySelector("input[name=click][value=add]");
    add.disabled = state.forces.length >= MOST_FORCES;
    if (add.disabled && add.checked) this.clickMode = "move";
  }

  #showMethods(state) {
    const harmonic = state.frequency > 0, {methods} = this.hello, select = AT("method");
    const reason = one => (harmonic ? one.reason_harmonic : one.reason_static) || one.reason
      || (state.forces.length > (one.max_forces ?? MOST_FORCES) ? `answers ${one.max_forces} force(s) at most` : "");
    const key = JSON.stringify([harmonic, state.forces.length]);
    if (this.drawnMethods !== key) {
      this.drawnMethods = key;
      select.replaceChildren(...methods.map(one => {
        const option = new Option(reason(one) ? `${one.name} (cannot: ${reason(one)})` : one.name, one.name);
        option.disabled = Boolean(reason(one));
        return option;
      }));
      const without = methods.filter(reason);
      AT("reasons").hidden = !without.length;
      AT("reasons").querySelector("summary").textContent =
        `${without.length} of ${methods.length} methods cannot answer this: why`;
      AT("reasons").querySelector("ul").replaceChildren(...grouped(without, reason).map(text => {
        const item = document.createElement("li");
        item.textContent = text;
        return item;
      }));
    }
    select.value = state.method;
    AT("method-summary").textContent = sentence(methods.find(one => one.name === state.method)?.summary ?? "");
  }

  /** The first method that can answer a state, where its own cannot. @returns {?string} */
  replacement(state) {
    const usable = one => (state.frequency > 0 ? one.harmonic : one.static);
    const own = this.hello.methods.find(one => one.name === state.method);
    return own && usable(own) ? null : "modal-krylov";
  }

  /** Show the magnification. */
  showScale(scale, automatic) {
    this.scale = scale;
    AT("scale").value = Math.log10(scale);
    AT("scale").setAttribute("aria-valuetext", `${scale} times`);
    const words = scale >= 1e5 ? scale.toExponential(0) : Number(scale.toPrecision(3)).toLocaleString("en");
    AT("scale-value").textContent = `${words} ×`;
    AT("scale-auto").checked = automatic;
  }
}

function set(id, value, spoken) {
  AT(id).value = value;
  const number = AT(`${id}-number`);
  if (number !== document.activeElement) number.value = value; // nobody is typing there
  AT(id).setAttribute("aria-valuetext", spoken);
}

function noteOf({cut, quantity}) {
  if (quantity === "strain") return "Grey has no value: strain is computed below the pad's skin.";
  return cut && (quantity === "normal" || quantity === "phase") ? "Grey has no value: only the skin has a normal." : "";
}

/** Methods of one reason in one line. */
function grouped(methods, reason) {
  const byReason = new Map();
  for (const one of methods) byReason.set(reason(one), [...(byReason.get(reason(one)) ?? []), one.name]);
  return [...byReason].map(([text, names]) => `${names.join(", ")}: ${text}`);
}

const sentence = text => (text ? `${text[0].toUpperCase()}${text.slice(1)}.` : "");
