// Unpacks a recorded episode; heights of any moment by key moments and the changes after them.

const KEY_EVERY = 32;

async function inflate(text) {
  const bytes = Uint8Array.from(atob(text), (char) => char.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

async function columns(text, count) {
  const all = new Float32Array(await inflate(text));
  return Array.from({ length: all.length / count }, (_, k) => all.subarray(k * count, (k + 1) * count));
}

async function decodeEpisode(packed) {
  const { rows, cols, frames, unit } = packed;
  const [heights, target, mask, poses, times, stats] = await Promise.all([
    inflate(packed.heights), inflate(packed.target), inflate(packed.mask),
    columns(packed.poses, frames), columns(packed.times, frames), columns(packed.stats, frames),
  ]);
  const episode = {
    label: packed.label, rows, cols, cell: packed.cell, frames, unit, times: times[0], names: packed.stat_names, stats,
    target: Float32Array.from(new Int32Array(target), (value) => value * unit), mask: new Uint8Array(mask),
    poses: { x: poses[0], y: poses[1], heading: unwrap(poses[2]), z: poses[3], pitch: poses[4], roll: poses[5],
      edge: poses[6], speed: poses[7], yaw_rate: poses[8], load: poses[9] },
  };
  if (packed.cells) {
    const { bottom, dy, levels, per_fill, fills } = packed.cells;
    const reader = fillReader(await inflate(fills), rows * cols * levels, frames);
    episode.voxels = { bottom, dy, levels, perFill: per_fill, fills: reader };
  }
  return Object.assign(episode, heightReader(heights, rows * cols, frames, unit));
}

// `millimetres(frame)` gives the heights of a moment; `range` the lowest and highest height of all moments in metres.
function heightReader(buffer, cells, frames, unit) {
  const changes = new Uint8Array(buffer, 4 * cells);
  const keys = [];
  const now = new Int32Array(buffer.slice(0, 4 * cells));
  let low = Infinity, high = -Infinity;
  let at = 0;
  const forward = () => {
    const base = 2 * cells * at;
    for (let k = 0; k < cells; k++) now[k] += ((changes[base + k] | (changes[base + cells + k] << 8)) << 16) >> 16;
    at++;
  };
  for (let frame = 0; frame < frames; frame++) {
    if (frame > 0) forward();
    if (frame % KEY_EVERY === 0) {
      keys.push(now.slice());
      for (const value of now) { low = Math.min(low, value); high = Math.max(high, value); }
    }
  }
  const millimetres = (frame) => {
    if (frame < at || frame - at > KEY_EVERY) {
      at = Math.floor(frame / KEY_EVERY) * KEY_EVERY;
      now.set(keys[at / KEY_EVERY]);
    }
    while (at < frame) forward();
    return now;
  };
  return { millimetres, range: [low * unit, high * unit] };
}

// fills(frame) gives the cells' fills of a moment, a byte each; see cell_track.py for the form.
function fillReader(buffer, cells, frames) {
  const bytes = new Uint8Array(buffer), view = new DataView(buffer), now = bytes.slice(0, cells);
  const keys = [], starts = [cells];
  let at = 0;
  const forward = () => {
    const start = starts[at], count = view.getUint32(start, true);
    for (let k = 0, place = 0, p = start + 4; k < count; k++, p++) {
      place += bytes[p] | (bytes[p + count] << 8) | (bytes[p + 2 * count] << 16) | (bytes[p + 3 * count] << 24);
      now[place] = bytes[p + 4 * count];
    }
    at++;
    starts[at] = start + 4 + 5 * count;
  };
  for (let frame = 0; frame < frames; frame++) {
    if (frame > 0) forward();
    if (frame % KEY_EVERY === 0) keys.push(now.slice());
  }
  return (frame) => {
    if (frame < at || frame - at > KEY_EVERY) {
      at = Math.floor(frame / KEY_EVERY) * KEY_EVERY;
      now.set(keys[at / KEY_EVERY]);
    }
    while (at < frame) forward();
    return now;
  };
}

// Headings without jumps, so that one can be blended into the next.
function unwrap(angles) {
  const out = Float32Array.from(angles);
  for (let k = 1; k < out.length; k++) out[k] = out[k - 1] + wrap(angles[k] - angles[k - 1]);
  return out;
}

function wrap(angle) {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}
