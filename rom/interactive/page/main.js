/** The page: one state, shown by view, figures and chart, changed by controls, clicks and keys. */

import {Controls} from "./controls.js";
import {ResponseChart} from "./frf.js";
import * as figures from "./figures.js";
import {Pad} from "./pad.js";
import {power} from "./numbers.js";
import {copy, pictureOf, save} from "./saving.js";
import {fromQuery, MOST_FORCES, toQuery} from "./state.js";
import {View} from "./view.js";

const AT = id => document.getElementById(id);
const CYCLE_SECONDS = 2;
const FRF_WAIT_MS = 150, ADDRESS_WAIT_MS = 250, SLOW_WAIT_MS = 300;
const NEW_FORCE = 0.1;
const HINT = "Click the pad to press it; drag to turn it.";

/** @param {object} engine server or modal */
export async function start(engine) {
  const {header: hello, arrays} = await engine.hello();
  const nodes = [...arrays.vertex_node.data], pad = [...arrays.pad_vertex.data];
  const vertexOf = new Map(nodes.map((node, vertex) => [node, vertex]).reverse());
  const known = {padNodes: new Set(pad.map(vertex => nodes[vertex])), surfaceNodes: new Set(nodes),
                 methods: hello.methods.map(one => one.name), quantities: hello.quantities,
                 padCenter: hello.pad_center};
  const restored = fromQuery(engine.local ? location.hash.slice(1) : location.search, known);
  let {state} = restored, selected = 0, scale = restored.scale, custom = restored.view !== null;
  let inFlight = null, waiting = null, shown = null, comparing = null;
  let shownCut = "null", frfKey = "", shownOnce = false;

  const net = new Pad(pad, arrays.triangles.data);
  const view = new View(AT("view"), arrays, {
    onPick: pick, onView: () => { custom = true; writeAddress(); }, onPhase: null});
  if (restored.view) view.viewpoint = restored.view;
  const controls = new Controls(hello, engine.local, {
    change: (patch, event) => change(patch, event),
    amplitude: (value, event) => change({forces: withSelected(([node]) => [node, value])}, event),
    select: i => select(i), remove: i => remove(i),
    scale: value => { scale = value; controls.showScale(view.setScale(scale), scale === null); writeAddress(); }});
  if (engine.local && state.cut) state.cut = null;
  const chart = new ResponseChart(AT("frf"), frequency => change({frequency}, new Event("click")));

  // ---- the state changes --------------------------------------------------------------------------------------

  function change(patch, event) {
    state = {...state, ...patch};
    const other = controls.replacement(state);
    if (other) {
      say(`${state.method} cannot answer at ${state.frequency} Hz, so ${other} does.`);
      state = {...state, method: other};
    }
    refresh(event);
  }

  function refresh(event) {
    controls.show(state, selected);
    view.mark(state.forces.map(([node, force]) => ({vertex: vertexOf.get(node), force})), selected,
              state.probe === null ? null : vertexOf.get(state.probe));
    chart.mark(state.frequency);
    AT("slowness").value = figures.slownessWords(state.frequency, CYCLE_SECONDS);
    AT("play").disabled = state.frequency === 0;
    if (!engine.local && !comparing) AT("comparison").textContent = "";
    writeAddress();
    ask(event?.timeStamp ?? null);
    askResponse();
  }

  function withSelected(turn) {
    return state.forces.map((one, i) => (i === selected ? turn(one) : one));
  }

  function select(i) {
    selected = Math.min(i, state.forces.length - 1);
    refresh();
  }

  function remove(i) {
    if (state.forces.length === 1) return say("One force must stay: move it instead.");
    const forces = state.forces.filter((_, k) => k !== i);
    selected = Math.min(selected, forces.length - 1);
    return change({forces});
  }

  function place(node, event) {
    if (state.forces.some(([other], i) => other === node && i !== selected)) return say("Another force stands there.");
    say(`Force ${selected + 1} at node ${node}.`, true);
    return change({forces: withSelected(([, force]) => [node, force])}, event);
  }

  function add(node, event) {
    if (state.forces.length >= MOST_FORCES) return say(`${MOST_FORCES} forces are the most.`);
    if (state.forces.some(([other]) => other === node)) return say("A force stands there already.");
    selected = state.forces.length;
    controls.clickMode = "move";
    say(`Force ${selected + 1} added at node ${node}.`, true);
    return change({forces: [...state.forces, [node, NEW_FORCE]]}, event);
  }

  function pick({vertex, pad: padVertex, event}) {
    hint("");
    if (controls.clickMode === "probe" || event.altKey) {
      say(`Probe at node ${nodes[vertex]}.`, true);
      return change({probe: nodes[vertex]}, event);
    }
    if (padVertex === null) return hint("Forces act on the pad, the region within the line.");
    const act = controls.clickMode === "add" || event.shiftKey ? add : place;
    return act(nodes[padVertex], event);
  }

  // ---- the answers --------------------------------------------------------------------------------------------

  /** Ask for the field; one question at a time, and of those that wait only the newest. */
  function ask(since) {
    waiting = {state, since};
    if (inFlight && slow(inFlight.state)) inFlight.abort.abort();
    if (!inFlight) next();
  }

  async function next() {
    const {state: asked, since} = waiting, abort = new AbortController();
    waiting = null;
    inFlight = {state: asked, abort};
    const timer = slow(asked) && setTimeout(() => {
      figures.showWaiting();
      busy(`${asked.method} is solving …`);
    }, SLOW_WAIT_MS);
    view.expect(!slow(asked));
    try {
      await showCut(asked);
      const answer = await engine.field(asked, {signal: abort.signal, onIndicators: header => {
        if (shown?.state === asked) figures.showIndicators({...shown.header, ...header}, engine.local);
      }});
      if (answer) showField(answer, asked, since);
      else if (!waiting) say("Cancelled; the picture is the one before.");
    } catch (error) {
      hint(error.message, true);
    } finally {
      clearTimeout(timer);
      view.expect(false);
      if (!comparing) busy(null);
      inFlight = null;
      if (waiting) next();
    }
  }

  async function showCut(asked) {
    const key = JSON.stringify(asked.cut);
    if (key === shownCut) return;
    const found = asked.cut ? await engine.cut(asked) : null;
    view.setSection(asked.cut, found?.arrays);
    shownCut = key;
  }

  function showField({header, arrays: answer}, asked, since) {
    shown = {state: asked, header};
    view.expect(false);
    const drawn = view.show(answer.u.data, {quantity: asked.quantity, strain: answer.strain?.data ?? null,
                                            cutU: answer.cut_u?.data, moving: asked.frequency > 0, scale});
    controls.showScale(drawn.scale, scale === null);
    figures.showField(header, asked, engine.local);
    figures.showLegend(asked.quantity, drawn);
    if (header.validity) hint(`${header.validity[0].toUpperCase()}${header.validity.slice(1)}.`, true);
    else if (AT("hint").classList.contains("problem")) hint("");
    view.draw(() => {
      if (since !== null) performance.measure("slider-to-picture", {start: since, end: performance.now()});
      performance.clearMeasures("slider-to-picture"); // who observes them has them; nobody else keeps them
      AT("view").dataset.shown = toQuery(asked);
    });
    if (!shownOnce) hint(HINT);
    shownOnce = true;
  }

  let frfTimer = null;
  function askResponse() {
    const node = state.probe ?? state.forces[0][0], key = JSON.stringify([state.forces, state.loss_factor, node]);
    if (key === frfKey) return;
    clearTimeout(frfTimer);
    frfTimer = setTimeout(async () => {
      frfKey = key;
      try {
        const answer = await engine.frf(state, node);
        if (!answer || frfKey !== key) return;
        chart.show(answer.arrays);
        chart.mark(state.frequency);
        AT("frf-title").textContent = `Motion into the skin at node ${node}, by modal-krylov`;
      } catch (error) {
        frfKey = "";
        AT("frf-title").textContent = `No frequency response: ${error.message}`;
      }
    }, FRF_WAIT_MS);
  }

  async function compare() {
    const asked = state;
    comparing = new AbortController();
    busy("solving directly, for comparison …");
    AT("compare").disabled = true;
    try {
      const answer = await engine.error(asked, {signal: comparing.signal});
      if (!answer) AT("comparison").textContent = "Cancelled.";
      else {
        const {error, direct_seconds: seconds, speedup} = answer.header;
        AT("comparison").textContent = `${asked.method} is off by ${power(error)} of the field (relative L2); `
          + `direct took ${seconds.toPrecision(2)} s.`;
        AT("comparison").dataset.error = error;
        if (shown?.state === asked) figures.showSpeedup(speedup);
      }
    } catch (error) {
      AT("comparison").textContent = error.message;
    }
    comparing = null;
    AT("compare").disabled = false;
    busy(null);
  }

  const slow = one => hello.methods.find(method => method.name === one.method)?.slow ?? one.method === "direct";

  // ---- words --------------------------------------------------------------------------------------------------

  function hint(text, problem = false) {
    AT("hint").textContent = text;
    AT("hint").classList.toggle("problem", problem);
  }

  function say(text, quiet = false) {
    AT("announcer").textContent = text;
    if (!quiet) hint(text);
  }

  function busy(text) {
    AT("cancel").hidden = !text;
    if (text) AT("comparison").textContent = text[0].toUpperCase() + text.slice(1);
    else if (AT("comparison").textContent.endsWith("…")) AT("comparison").textContent = "";
  }

  const mark = engine.local ? "#" : "?"; // a file has no queries
  let addressTimer = null;
  function query() {
    return toQuery(state, {view: custom ? view.viewpoint : null, scale});
  }
  function writeAddress() {
    clearTimeout(addressTimer);
    addressTimer = setTimeout(() => history.replaceState(null, "", mark + query()), ADDRESS_WAIT_MS);
  }

  // ---- keys and buttons ---------------------------------------------------------------------------------------

  const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
  AT("view").addEventListener("keydown", event => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const {key} = event, arrow = ARROWS[key];
    if (arrow && event.shiftKey) view.turn(-0.12 * arrow[0], 0.12 * arrow[1]);
    else if (arrow) {
      const to = net.towards(vertexOf.get(state.forces[selected][0]), arrow, vertex => view.onScreen(vertex));
      if (to === null) say("The pad ends here.");
      else place(nodes[to], event);
    } else if (key === "Delete" || key === "Backspace") remove(selected);
    else if (key === "a" || key === "A") addBeside(event);
    else if (["1", "2", "3"].includes(key) && Number(key) <= state.forces.length) select(Number(key) - 1);
    else if (key === "+" || key === "=") view.zoom(0.87);
    else if (key === "-") view.zoom(1.15);
    else if (key === "Home") goHome();
    else if (key === " ") AT("play").click();
    else return;
    event.preventDefault();
  });

  /** A new force beside the selected one, for those who have no mouse. */
  function addBeside(event) {
    const taken = new Set(state.forces.map(([node]) => node));
    const free = net.beside.get(vertexOf.get(state.forces[selected][0])).find(vertex => !taken.has(nodes[vertex]));
    if (free !== undefined) add(nodes[free], event);
  }

  function goHome() {
    view.home();
    custom = false;
    writeAddress();
  }

  function play(on) {
    AT("play").setAttribute("aria-pressed", String(on));
    AT("play").querySelector(".word").textContent = on ? "Pause" : "Play";
    view.play(on);
  }

  AT("play").addEventListener("click", () => play(AT("play").getAttribute("aria-pressed") !== "true"));
  AT("home").addEventListener("click", goHome);
  AT("compare").addEventListener("click", compare);
  AT("cancel").addEventListener("click", () => {
    comparing?.abort();
    if (inFlight && slow(inFlight.state)) inFlight.abort.abort();
  });
  AT("save-png").addEventListener("click", () => view.draw(async () => {
    view.renderer.render(view.scene, view.camera); // its pixels are there until the next frame alone
    const forces = state.forces.map(([node, force]) => `${force} N at node ${node}`).join(", ");
    const motion = state.frequency ? `${state.frequency} Hz, loss factor ${state.loss_factor}` : "static";
    const blob = await pictureOf(AT("view"), {
      quantity: shown.state.quantity, range: view.range, clipped: view.clipped,
      dark: matchMedia("(prefers-color-scheme: dark)").matches,
      caption: [`${forces}; ${motion}; ${state.method}`,
                `motion magnified ${view.scale} times; fingertip of ${hello.n_nodes} nodes`]});
    save(URL.createObjectURL(blob), "fingertip.png");
  }));
  for (const kind of ["vtu", "nc"]) {
    const write = () => save(engine.download(kind, toQuery(state)), `fingertip.${kind}`);
    AT(`save-${kind}`).addEventListener("click", write);
  }
  AT("copy-link").addEventListener("click", async () => {
    const link = `${location.href.split(/[?#]/)[0]}${mark}${query()}`;
    AT("saved").textContent = await copy(link) ? "Link copied." : `Copy this: ${link}`;
  });

  if (restored.problems.length) hint(restored.problems.join(" "), true);
  const other = controls.replacement(state);
  if (other) state = {...state, method: other};
  refresh();
  play(!matchMedia("(prefers-reduced-motion: reduce)").matches);
  return {again: () => { shownCut = ""; frfKey = ""; refresh(); }, hint};
}
