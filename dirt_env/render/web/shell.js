// What every page around a replay has: what its address asks for, speeds, canvases that fit, notices, a start.

const SPEEDS = [0.5, 1, 2, 4, 8, 16, 32];
const wish = new URLSearchParams(location.hash.slice(1));

// The slowest speed at which so many seconds are over in 40.
function speedFor(seconds) {
  return SPEEDS.find((speed) => seconds / speed <= 40) || SPEEDS[SPEEDS.length - 1];
}

function wishedView() {
  return ["follow", "top"].includes(wish.get("camera")) ? wish.get("camera") : "overview";
}

// The episode that the address asks for, of `count`.
function wishedEpisode(count) {
  return Math.min(count - 1, Math.max(0, Number(wish.get("episode")) || 0));
}

// A renderer in a new canvas in `place`: of the graphics card, or where that is not wanted or not to be had, a flat one.
function makeRenderer(place, { machine, blade }, withCard, lost) {
  const fresh = () => { const canvas = document.createElement("canvas"); place.replaceChildren(canvas); return canvas; };
  try {
    if (!withCard) throw new Error("not wanted");
    const renderer = new GlRenderer(fresh(), machine, blade);
    renderer.canvas.addEventListener("webglcontextlost", lost);
    return renderer;
  } catch {
    return new FlatRenderer(fresh(), machine, blade);
  }
}

// Gives a canvas as many pixels as it takes up; says whether that has changed.
function fit(canvas) {
  const ratio = Math.min(2, window.devicePixelRatio || 1);
  const wide = Math.max(1, Math.round(canvas.clientWidth * ratio)), high = Math.max(1, Math.round(canvas.clientHeight * ratio));
  if (canvas.width === wide && canvas.height === high) return false;
  Object.assign(canvas, { width: wide, height: high });
  return true;
}

function notice(text) {
  byId("notice").textContent = text;
  byId("notice").hidden = false;
}

// Runs `show(data)` and says how that went, to people and to whoever waits for the page.
async function start(show) {
  if (typeof DecompressionStream === "undefined") {
    notice("This replay needs a browser of 2023 or newer (DecompressionStream).");
    return;
  }
  try {
    await show(JSON.parse(byId("replay").textContent));
    document.documentElement.dataset.state = "ready";
    window.dispatchEvent(new Event("replay-ready"));
  } catch (problem) {
    document.documentElement.dataset.state = "failed";
    console.error(problem);
    notice(`The replay could not be shown: ${problem.message}`);
  }
}
