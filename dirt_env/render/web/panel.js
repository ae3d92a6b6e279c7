// Text and controls around the view.

const byId = (id) => document.getElementById(id);
const UNITS = { m3: "m³", m4: "m⁴", kj: "kJ", j: "J", kg: "kg", m: "m", s: "s", kn: "kN", deg: "°" };

// "volume_moved_m3" becomes the name "volume moved" and the unit "m³".
function parseName(name) {
  if (name === "m3_per_h") return { label: "output", unit: "m³/h" };
  const words = name.split("_"), last = words[words.length - 1].toLowerCase();
  if (words.length > 1 && last in UNITS) return { label: words.slice(0, -1).join(" "), unit: UNITS[last] };
  return { label: words.join(" "), unit: name.startsWith("share") ? "%" : "" };
}

function formatValue(value, unit) {
  if (!Number.isFinite(value)) return "–";
  const shown = unit === "%" ? 100 * value : value, size = Math.abs(shown);
  const digits = unit === "%" ? 1 : size >= 100 ? 0 : size >= 10 ? 1 : 2;
  return `${shown.toFixed(digits)}${unit ? ` ${unit}` : ""}`;
}

function formatTime(seconds) {
  return `${Math.floor(seconds / 60)}:${String(Math.floor(seconds % 60)).padStart(2, "0")}`;
}

class Panel {
  constructor(replay) {
    byId("title").textContent = replay.title;
    byId("description").textContent = replay.description;
    byId("description").hidden = !replay.description;
    for (const { label } of replay.episodes) byId("episode").append(new Option(label));
    byId("episodes").hidden = replay.episodes.length < 2;
  }

  setEpisode(episode) {
    this.episode = episode;
    this.main = mainFigure(episode.names);
    const order = episode.names.map((_, k) => k).sort((a, b) => (b === this.main) - (a === this.main));
    byId("stats").replaceChildren();
    this.cells = order.map((k) => {
      const { label, unit } = parseName(episode.names[k]);
      const [name, value] = [document.createElement("dt"), document.createElement("dd")];
      name.textContent = label;
      if (k === this.main) name.className = value.className = "main";
      byId("stats").append(name, value);
      return { k, unit, value };
    });
    byId("chart").hidden = this.main < 0;
    byId("grounds").hidden = !episode.voxels;
    byId("hud").hidden = episode.names.length === 0;
    byId("scrub").max = episode.times[episode.frames - 1];
    byId("scrub").min = episode.times[0];
    for (const [id, bit] of [["key-start", 1], ["key-goal", 2], ["key-design", 4]]) {
      byId(id).hidden = !episode.mask.some((value) => value & bit);
    }
  }

  show(index, seconds) {
    const { episode } = this;
    for (const { k, unit, value } of this.cells) {
      const text = formatValue(episode.stats[k][index], unit);
      if (value.textContent !== text) value.textContent = text;
    }
    byId("clock").textContent = `${formatTime(seconds)} / ${formatTime(episode.times[episode.frames - 1])}`;
    byId("scrub").value = seconds;
    if (this.main >= 0) drawChart(byId("chart"), episode.names[this.main], episode.times, episode.stats[this.main], seconds);
  }
}
