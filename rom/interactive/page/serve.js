/** The page of `rom serve`: starts it on the server's engine, and mends a lost connection. */

import {start} from "./main.js";
import {ServerEngine} from "./server_engine.js";

let page = null;
const engine = new ServerEngine(connected => {
  page?.hint(connected ? "" : "The connection to the server was lost; trying again …", !connected);
  if (connected) page?.again();
});
try {
  page = await start(engine);
} catch (error) {
  const hint = document.getElementById("hint");
  hint.textContent = error.message;
  hint.classList.add("problem");
}
