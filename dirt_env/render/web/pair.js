// Two policies on one layout: two views, one clock, cameras that turn together.
// The address may say #at=60&camera=follow&episode=1&renderer=canvas.

const COLORS = ["#56b4e9", "#f0a35e"];
const SHOWN = ["grade_error_m", "share_in_goal", "volume_moved_m3", "spilled_m3", "distance_m", "work_kj", "load_m3"];

// One half of the page: a policy's view and its figures.
class Side {
  constructor(replay, section, pair) {
    Object.assign(this, { replay, pair, decoded: new Map() });
    this.view = section.querySelector(".view");
    this.list = section.querySelector("dl");
    section.querySelector("h1").textContent = replay.title;
    this.makeRenderer(wish.get("renderer") !== "canvas");
  }

  makeRenderer(withCard) {
    this.renderer = makeRenderer(this.view, this.replay, withCard, () => this.makeRenderer(false));
    steer(this.renderer.canvas, () => this.pair.sides.map((side) => side.camera), () => { this.pair.dirty = true; });
    if (this.episode) this.renderer.setEpisode(this.episode);
    this.pair.dirty = true;
  }

  async choose(number) {
    if (!this.decoded.has(number)) this.decoded.set(number, decodeEpisode(this.replay.episodes[number]));
    const episode = await this.decoded.get(number);
    this.episode = episode;
    this.end = episode.times[episode.frames - 1];
    const main = mainFigure(episode.names);
    this.main = episode.names[main];
    this.curve = episode.stats[main];
    this.camera = new Camera([episode.cols * episode.cell, episode.rows * episode.cell]);
    this.renderer.setEpisode(episode);
    this.list.replaceChildren();
    this.cells = SHOWN.filter((name) => episode.names.includes(name)).map((name) => {
      const { label, unit } = parseName(name), [term, value] = [document.createElement("dt"), document.createElement("dd")];
      term.textContent = label;
      if (name === this.main) term.className = value.className = "main";
      this.list.append(term, value);
      return { k: episode.names.indexOf(name), unit, value };
    });
    const [term, value] = [document.createElement("dt"), document.createElement("dd")];
    term.textContent = "ends at";
    value.textContent = formatTime(this.end);
    this.list.append(term, value);
  }

  // Draws the moment; says whether the camera is still on its way.
  show(seconds, passed) {
    const moment = { ...momentAt(this.episode, Math.min(seconds, this.end)), tall: 1 }, { x, y, z, heading } = moment.pose;
    const moving = this.camera.track([x, y, z + 0.8], heading, passed);
    this.renderer.draw(this.camera, moment);
    for (const { k, unit, value } of this.cells) value.textContent = formatValue(this.episode.stats[k][moment.first], unit);
    return moving;
  }
}

class Pair {
  constructor({ description, sides }) {
    this.sides = [];
    const sections = document.querySelectorAll(".side");
    sides.forEach((replay, k) => this.sides.push(new Side(replay, sections[k], this)));
    this.count = Math.min(...sides.map((replay) => replay.episodes.length));
    byId("description").textContent = description;
    for (const { label } of sides[0].episodes.slice(0, this.count)) byId("episode").append(new Option(label));
    byId("episodes").hidden = this.count < 2;
    this.listen();
  }

  async choose(number) {
    await Promise.all(this.sides.map((side) => side.choose(number)));
    byId("episode").selectedIndex = number;
    this.start = this.sides[0].episode.times[0];
    this.end = Math.max(...this.sides.map((side) => side.end));
    this.seconds = this.start;
    byId("scrub").min = this.start;
    byId("scrub").max = this.end;
    this.setView(this.view || "overview");
  }

  tick(now) {
    const passed = Math.min(0.1, (now - (this.before ?? now)) / 1000);
    this.before = now;
    if (this.playing) {
      this.seconds = Math.min(this.end, this.seconds + passed * this.speed);
      if (this.seconds >= this.end) this.play(false);
      this.dirty = true;
    }
    const resized = this.sides.map((side) => fit(side.renderer.canvas)).includes(true);
    if (resized || this.dirty) {
      this.dirty = this.sides.map((side) => side.show(this.seconds, passed)).includes(true);
      byId("clock").textContent = `${formatTime(this.seconds)} / ${formatTime(this.end)}`;
      byId("scrub").value = this.seconds;
      drawCurves(byId("chart"), this.sides, this.seconds, this.end);
    }
    requestAnimationFrame((next) => this.tick(next));
  }

  play(on) {
    if (on && this.seconds >= this.end) this.seconds = this.start;
    this.playing = on;
    byId("play").classList.toggle("playing", on);
    this.dirty = true;
  }

  seek(seconds) {
    this.seconds = Math.min(this.end, Math.max(this.start, seconds));
    this.dirty = true;
  }

  setView(view) {
    this.view = view;
    for (const side of this.sides) side.camera.reset(view);
    for (const button of document.querySelectorAll("[data-view]")) button.classList.toggle("on", button.dataset.view === view);
    this.dirty = true;
  }

  setSpeed(speed) {
    this.speed = speed;
    byId("speed").value = String(speed);
  }

  listen() {
    for (const speed of SPEEDS) byId("speed").append(new Option(`${speed}×`, speed));
    byId("play").onclick = () => this.play(!this.playing);
    byId("scrub").oninput = (event) => { this.play(false); this.seek(Number(event.target.value)); };
    byId("speed").onchange = (event) => this.setSpeed(Number(event.target.value));
    byId("episode").onchange = (event) => this.choose(event.target.selectedIndex);
    for (const button of document.querySelectorAll("[data-view]")) button.onclick = () => this.setView(button.dataset.view);
    window.addEventListener("resize", () => { this.dirty = true; });
    window.addEventListener("keydown", (event) => this.key(event));
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
    const faster = (by) => this.setSpeed(SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, SPEEDS.indexOf(this.speed) + by))]);
    const step = (by) => { this.play(false); this.seek(this.seconds + by); };
    const keys = {
      " ": () => this.play(!this.playing), ArrowLeft: () => step(-1), ArrowRight: () => step(1),
      Home: () => this.seek(this.start), End: () => this.seek(this.end), "[": () => faster(-1), "]": () => faster(1),
      1: () => this.setView("overview"), 2: () => this.setView("follow"), 3: () => this.setView("top"),
    };
    if (!(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
  }
}

// What the job is judged by over time, of both in one picture: what is to come is faint.
function drawCurves(canvas, sides, at, end) {
  const { title, top: most, text } = scaleOf(sides[0].main, sides.map(({ curve }) => Array.from(curve || [])));
  const ratio = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight;
  canvas.width = Math.round(wide * ratio);
  canvas.height = Math.round(high * ratio);
  const pen = canvas.getContext("2d"), left = 34, right = wide - 8, bottom = high - 16, top = 6;
  const x = (t) => left + (right - left) * t / Math.max(end, 1e-6), y = (v) => bottom - (bottom - top) * Math.min(1, Math.max(0, v / most));
  pen.scale(ratio, ratio);
  pen.font = "10px system-ui, sans-serif";
  pen.textBaseline = "middle";
  pen.textAlign = "right";
  for (const level of [0, 0.5 * most, most]) {
    pen.fillStyle = "#9aa7b5";
    pen.fillText(text(level), left - 5, y(level));
    pen.fillStyle = "rgba(255,255,255,.14)";
    pen.fillRect(left, y(level), right - left, 1);
  }
  pen.fillStyle = "#9aa7b5";
  pen.textAlign = "center";
  pen.fillText(title, (left + wide) / 2, high - 6);
  sides.forEach(({ episode, curve: values }, k) => {
    if (!values) return;
    for (const [until, alpha, width] of [[Infinity, 0.4, 1.5], [at, 1, 2]]) {
      curve(pen, episode.times, values, until, x, y);
      Object.assign(pen, { strokeStyle: COLORS[k], globalAlpha: alpha, lineWidth: width });
      pen.stroke();
    }
  });
  pen.globalAlpha = 1;
  pen.fillStyle = "#f7ba16";
  pen.fillRect(x(at) - 0.75, top, 1.5, bottom - top);
}

start(async (data) => {
  const pair = new Pair(data);
  await pair.choose(wishedEpisode(pair.count));
  pair.setSpeed(speedFor(pair.end - pair.start));
  pair.setView(wishedView());
  if (wish.has("at")) pair.seek(Number(wish.get("at")));
  pair.play(!wish.has("at"));
  pair.tick(performance.now());
  document.documentElement.dataset.renderer = pair.sides[0].renderer.name;
});
