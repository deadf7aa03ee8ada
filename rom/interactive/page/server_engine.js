/** The engine behind `rom serve`: questions and answers over one websocket. */

import {decode} from "./wire.js";
import {asRequest} from "./state.js";

const RETRY_MS = [500, 1000, 2000, 4000];

/** A question that was refused; its message is fit to be shown. */
export class Refused extends Error {}

export class ServerEngine {
  #socket = null;
  #asked = new Map();
  #indicators = null; // of the newest field: its id, and whom to tell
  #next = 1;
  #failures = 0;

  /** @param {(connected: boolean) => void} onConnection called when the connection is lost and when it is back */
  constructor(onConnection) {
    this.onConnection = onConnection;
    this.local = false;
  }

  /** Connect, and say what there is. @returns {Promise<{header: object, arrays: object}>} */
  async hello() {
    await this.#connect();
    return this.#ask({ask: "hello"});
  }

  /**
   * The field of a state.
   * @param {import("./state.js").State} state
   * @param {{signal?: AbortSignal, onIndicators?: (header: object) => void}} options
   * @returns {Promise<?{header: object, arrays: object}>} null where it was cancelled or a newer one took its place
   */
  field(state, options = {}) {
    return this.#ask({ask: "field", state: asRequest(state)}, options);
  }

  /** The geometry of a section. */
  cut(state) {
    return this.#ask({ask: "cut", state: asRequest(state)});
  }

  /** Normal displacement at a node over frequency. */
  frf(state, node) {
    return this.#ask({ask: "frf", state: asRequest(state), node});
  }

  /** Error against a direct solve; null where it was cancelled. */
  error(state, options = {}) {
    return this.#ask({ask: "error", state: asRequest(state)}, options);
  }

  /** Where a field can be had as a file. @returns {?string} */
  download(kind, query) {
    return `/save/field.${kind}?${query}`;
  }

  #connect() {
    return new Promise((resolve, reject) => {
      const secure = location.protocol === "https:" ? "wss" : "ws";
      const socket = new WebSocket(`${secure}://${location.host}/socket`);
      socket.binaryType = "arraybuffer";
      socket.onopen = () => {
        this.#socket = socket;
        this.#failures = 0;
        resolve();
      };
      socket.onmessage = event => this.#receive(event.data);
      socket.onclose = () => {
        const was = this.#socket === socket;
        this.#socket = null;
        for (const {reject: fail} of this.#asked.values()) fail(new Refused("The connection to the server was lost."));
        this.#asked.clear();
        if (was) {
          this.onConnection(false);
          this.#retry();
        } else reject(new Refused("The server does not answer: is `rom serve` still running?"));
      };
    });
  }

  #retry() {
    setTimeout(() => this.#connect().then(() => this.onConnection(true), () => this.#retry()),
               RETRY_MS[Math.min(this.#failures++, RETRY_MS.length - 1)]);
  }

  #ask(question, {signal, onIndicators} = {}) {
    if (!this.#socket) return Promise.reject(new Refused("The server does not answer: is `rom serve` still running?"));
    const id = this.#next++;
    return new Promise((resolve, reject) => {
      this.#asked.set(id, {resolve, reject, onIndicators});
      this.#socket.send(JSON.stringify({id, ...question}));
      signal?.addEventListener("abort", () => {
        if (this.#asked.has(id)) this.#socket?.send(JSON.stringify({id, ask: "cancel"}));
      });
    });
  }

  #receive(data) {
    const message = typeof data === "string" ? {header: JSON.parse(data), arrays: {}} : decode(data);
    const {header} = message, asked = this.#asked.get(header.id);
    if (header.answer === "indicators" && this.#indicators?.id === header.id) this.#indicators.tell?.(header);
    if (!asked) return;
    this.#asked.delete(header.id);
    if (header.answer === "field") this.#indicators = {id: header.id, tell: asked.onIndicators};
    if (header.answer === "problem") asked.reject(new Refused(header.text));
    else asked.resolve(header.answer === "superseded" || header.answer === "cancelled" ? null : message);
  }
}
