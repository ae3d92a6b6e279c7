// Puts it together: one clock, one camera, one renderer. The address may say #at=60&camera=follow&episode=1&renderer=canvas&ground=cells.

class Player {
  constructor(replay) {
    this.replay = replay;
    this.panel = new Panel(replay);
    this.decoded = new Map();
    this.tall = 1;
    this.cells = false;
    this.makeRenderer(wish.get("renderer") !== "canvas");
    this.listen();
  }

  makeRenderer(withCard) {
    this.renderer = makeRenderer(byId("stage"), this.replay, withCard, () => this.makeRenderer(false));
    this.renderer.canvas.tabIndex = 0;
    steer(this.renderer.canvas, () => [this.camera], () => { this.dirty = true; });
    if (this.episode) this.renderer.setEpisode(this.episode);
    this.dirty = true;
    document.documentElement.dataset.renderer = this.renderer.name;
  }

  async choose(number) {
    if (!this.decoded.has(number)) this.decoded.set(number, decodeEpisode(this.replay.episodes[number]));
    const episode = await this.decoded.get(number);
    this.number = number;
    this.episode = episode;
    byId("episode").selectedIndex = number;
    this.panel.setEpisode(episode);
    this.renderer.setEpisode(episode);
    const camera = new Camera([episode.cols * episode.cell, episode.rows * episode.cell]);
    camera.reset(this.camera && this.camera.view !== "free" ? this.camera.view : "overview");
    this.camera = camera;
    this.seconds = episode.times[0];
    this.dirty = true;
  }

  moment() {
    const cells = this.cells && this.episode.voxels !== undefined;
    return { ...momentAt(this.episode, this.seconds), tall: this.tall, cells };
  }

  tick(now) {
    const passed = Math.min(0.1, (now - (this.before ?? now)) / 1000);
    this.before = now;
    const end = this.episode.times[this.episode.frames - 1];
    if (this.playing) {
      this.seconds = Math.min(end, this.seconds + passed * this.speed);
      if (this.seconds >= end) this.play(false);
      this.dirty = true;
    }
    if (fit(this.renderer.canvas) || this.dirty) {
      const moment = this.moment(), { x, y, z, heading } = moment.pose;
      this.dirty = this.camera.track([x, y, z + 0.8], heading, passed);
      this.renderer.draw(this.camera, moment);
      this.panel.show(moment.first, this.seconds);
    }
    requestAnimationFrame((next) => this.tick(next));
  }

  play(on) {
    const { times, frames } = this.episode;
    if (on && this.seconds >= times[frames - 1]) this.seconds = times[0];
    this.playing = on;
    byId("play").classList.toggle("playing", on);
    this.dirty = true;
  }

  seek(seconds) {
    const { times, frames } = this.episode;
    this.seconds = Math.min(times[frames - 1], Math.max(times[0], seconds));
    this.dirty = true;
  }

  step(by) {
    this.play(false);
    const { first } = this.moment(), { times, frames } = this.episode;
    this.seek(times[Math.min(frames - 1, Math.max(0, first + by))]);
  }

  setView(view) {
    this.camera.reset(view);
    for (const button of document.querySelectorAll("[data-view]")) button.classList.toggle("on", button.dataset.view === view);
    this.dirty = true;
  }

  // Show the ground as the paper's cells, where an episode has them, or as a surface.
  setCells(cells) {
    this.cells = cells;
    for (const button of document.querySelectorAll("[data-ground]")) button.classList.toggle("on", (button.dataset.ground === "cells") === cells);
    this.dirty = true;
  }

  setSpeed(speed) {
    this.speed = speed;
    byId("speed").value = String(speed);
  }

  setTall(tall) {
    this.tall = Math.min(4, Math.max(1, tall));
    byId("tall").value = this.tall;
    byId("tall-value").textContent = this.tall;
    this.dirty = true;
  }

  listen() {
    for (const speed of SPEEDS) byId("speed").append(new Option(`${speed}×`, speed));
    byId("play").onclick = () => this.play(!this.playing);
    byId("scrub").oninput = (event) => { this.play(false); this.seek(Number(event.target.value)); };
    byId("speed").onchange = (event) => this.setSpeed(Number(event.target.value));
    byId("tall").oninput = (event) => this.setTall(Number(event.target.value));
    byId("help").onclick = () => { byId("keys").hidden = !byId("keys").hidden; };
    byId("episode").onchange = (event) => this.choose(event.target.selectedIndex);
    byId("chart").onclick = (event) => this.seek(this.episode.times[this.episode.frames - 1] * (event.offsetX - 34) / (event.target.clientWidth - 42));
    for (const button of document.querySelectorAll("[data-view]")) button.onclick = () => this.setView(button.dataset.view);
    for (const button of document.querySelectorAll("[data-ground]")) button.onclick = () => this.setCells(button.dataset.ground === "cells");
    window.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("resize", () => { this.dirty = true; });
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
    const faster = (by) => this.setSpeed(SPEEDS[Math.min(SPEEDS.length - 1, Math.max(0, SPEEDS.indexOf(this.speed) + by))]);
    const count = this.replay.episodes.length, { times, frames } = this.episode;
    const keys = {
      " ": () => this.play(!this.playing), ArrowLeft: () => this.step(-1), ArrowRight: () => this.step(1),
      Home: () => this.seek(times[0]), End: () => this.seek(times[frames - 1]), "[": () => faster(-1), "]": () => faster(1),
      1: () => this.setView("overview"), 2: () => this.setView("follow"), 3: () => this.setView("top"),
      "+": () => this.setTall(this.tall + 0.25), "=": () => this.setTall(this.tall + 0.25), "-": () => this.setTall(this.tall - 0.25),
      n: () => this.choose((this.number + 1) % count), p: () => this.choose((this.number + count - 1) % count),
      c: () => this.setCells(!this.cells),
      "?": () => byId("help").click(),
    };
    if (!(event.key in keys)) return;
    event.preventDefault();
    keys[event.key]();
  }
}

start(async (replay) => {
  const player = new Player(replay);
  await player.choose(wishedEpisode(replay.episodes.length));
  const { times, frames } = player.episode;
  player.setSpeed(speedFor(times[frames - 1] - times[0]));
  player.setView(wishedView());
  player.setCells(wish.get("ground") === "cells");
  if (wish.has("tall")) player.setTall(Number(wish.get("tall")) || 1);
  if (wish.has("at")) player.seek(Number(wish.get("at")));
  player.play(!wish.has("at"));
  player.tick(performance.now());
});
