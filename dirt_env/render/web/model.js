// The bulldozer and the obstacles as faces in three dimensions: side profiles drawn out to a width.
// Machine's own axes: s ahead of the pivot, u to the left, z up, in metres.

const PAINT = {
  yellow: [0.97, 0.71, 0.07], shade: [0.78, 0.54, 0.03], dark: [0.13, 0.13, 0.14], rubber: [0.19, 0.19, 0.2],
  steel: [0.46, 0.47, 0.5], glass: [0.16, 0.27, 0.36], block: [0.34, 0.36, 0.4],
};
const BLADE_PAINT = { above: [0.34, 0.71, 0.91], level: [0.96, 0.96, 0.96], below: [0.84, 0.24, 0] };

function bladePaint(edge) {
  return Math.abs(edge) <= 0.02 ? BLADE_PAINT.level : edge > 0 ? BLADE_PAINT.above : BLADE_PAINT.below;
}

// Faces of a convex profile [[s, z], ...] (counter-clockwise seen from the right) between u0 and u1, narrowed at the top.
function extrude(profile, u0, u1, paint, options = {}) {
  const { taper = 0, band = 0 } = options;
  const top = Math.max(...profile.map((p) => p[1])), low = Math.min(...profile.map((p) => p[1]));
  const inward = (z) => taper * (z - low) / Math.max(top - low, 1e-9);
  const right = profile.map(([s, z]) => [s, u0 + inward(z), z]), left = profile.map(([s, z]) => [s, u1 - inward(z), z]);
  const faces = [{ points: right }, { points: left.slice().reverse() }];
  for (let k = 0; k < profile.length; k++) {
    const next = (k + 1) % profile.length;
    faces.push({ points: [right[k], left[k], left[next], right[next]], band });
  }
  return faces.map((face) => ({ band: 0, ...face, paint, normal: normalOf(face.points) }));
}

function normalOf(points) {
  return unit(cross(sub(points[1], points[0]), sub(points[2], points[0])));
}

function boxProfile(s0, s1, z0, z1) {
  return [[s0, z0], [s1, z0], [s1, z1], [s0, z1]];
}

function dozerFaces(machine) {
  const half = machine.length / 2, wide = machine.width / 2, track = 0.25 * machine.width, k = machine.length / 2.5;
  const high = 0.62 * k, round = 0.3 * k, faces = [];
  const loop = [[-half + round, 0], [half - round, 0], [half - 0.06 * k, 0.24 * k], [half - 0.1 * k, 0.45 * k],
    [half - 0.34 * k, high], [-half + 0.34 * k, high], [-half + 0.1 * k, 0.45 * k], [-half + 0.06 * k, 0.24 * k]];
  const inner = loop.map(([s, z]) => [s * 0.86, 0.31 * k + (z - 0.31 * k) * 0.62]);
  for (const side of [-1, 1]) {
    const a = side > 0 ? wide - track : -wide, b = side > 0 ? wide : -wide + track;
    faces.push(...extrude(loop, a, b, PAINT.rubber, { band: 1 }));
    faces.push(...extrude(inner, side > 0 ? b - 0.01 : a - 0.03, side > 0 ? b + 0.03 : a + 0.01, PAINT.shade));
    for (const s of [-0.62, -0.21, 0.21, 0.62]) {
      const wheel = Array.from({ length: 10 }, (_, n) => [s * half + 0.12 * k * Math.cos(0.2 * Math.PI * n), 0.2 * k + 0.12 * k * Math.sin(0.2 * Math.PI * n)]);
      faces.push(...extrude(wheel, side > 0 ? b : a - 0.05, side > 0 ? b + 0.05 : a, PAINT.dark));
    }
  }
  const hood = [[0.02 * half, 0.3 * k], [0.84 * half, 0.3 * k], [0.84 * half, 1.12 * k], [0.02 * half, 1.28 * k]];
  faces.push(...extrude(hood, -0.4 * wide, 0.4 * wide, PAINT.yellow, { taper: 0.04 * k }));
  faces.push(...extrude(boxProfile(0.84 * half, 0.87 * half, 0.4 * k, 1.06 * k), -0.34 * wide, 0.34 * wide, PAINT.dark));
  faces.push(...extrude(boxProfile(-0.9 * half, 0.02 * half, 0.3 * k, 0.95 * k), -0.46 * wide, 0.46 * wide, PAINT.yellow));
  faces.push(...extrude(boxProfile(-0.98 * half, -0.9 * half, 0.35 * k, 0.85 * k), -0.4 * wide, 0.4 * wide, PAINT.dark));
  const cab = [[-0.66 * half, 0.95 * k], [0.06 * half, 0.95 * k], [-0.02 * half, 1.85 * k], [-0.6 * half, 1.85 * k]];
  faces.push(...extrude(cab, -0.46 * wide, 0.46 * wide, PAINT.glass, { taper: 0.06 * k }));
  faces.push(...extrude(boxProfile(-0.7 * half, 0.06 * half, 1.85 * k, 1.97 * k), -0.47 * wide, 0.47 * wide, PAINT.yellow));
  for (const [s, u] of [[0.03, -1], [0.03, 1], [-0.64, -1], [-0.64, 1]]) {
    faces.push(...extrude(boxProfile(s * half - 0.04, s * half + 0.04, 0.95 * k, 1.86 * k), u * 0.445 * wide - 0.04, u * 0.445 * wide + 0.04, PAINT.yellow));
  }
  const pipe = boxProfile(0.42 * half - 0.05, 0.42 * half + 0.05, 1.15 * k, 1.72 * k);
  faces.push(...extrude(pipe, -0.22 * wide - 0.05, -0.22 * wide + 0.05, PAINT.dark));
  return faces;
}

// The blade in its own axes: s from its cutting edge, z from its cutting edge; with the arms back to the tracks.
function bladeFaces(blade, machine) {
  const half = blade.width / 2, h = blade.height, faces = [], steps = 6;
  const curve = (t) => [-0.16 * h * Math.sin(Math.PI * Math.min(1, t * 1.05)) + 0.04 * h * t, t * h];
  for (let k = 0; k < steps; k++) {
    const [s0, z0] = curve(k / steps), [s1, z1] = curve((k + 1) / steps);
    const strip = [[s0 - 0.09, z0], [s0, z0], [s1, z1], [s1 - 0.09, z1]];
    faces.push(...extrude(strip, -half, half, null));
  }
  faces.push(...extrude([[-0.06, -0.01], [0.03, 0], [-0.02, 0.13 * h], [-0.12, 0.13 * h]], -half, half, PAINT.steel));
  for (const side of [-1, 1]) {
    const end = [[-0.22 * h, 0.02], [0.16, 0.02], [0.1, h], [-0.1, h]];
    faces.push(...extrude(end, side * half - (side > 0 ? 0.05 : 0), side * half + (side > 0 ? 0 : 0.05), null));
    const u = side * Math.min(machine.width / 2 + 0.1, half - 0.12), back = -blade.reach;
    const arm = [[back - 0.1, 0.26], [-0.1, 0.1], [-0.1, 0.26], [back - 0.1, 0.42]];
    faces.push(...extrude(arm, u - 0.07, u + 0.07, PAINT.shade));
  }
  const lift = [[-blade.reach + machine.length * 0.36, 0.78 * h], [-0.14 * h, 0.6 * h], [-0.14 * h, 0.7 * h], [-blade.reach + machine.length * 0.36, 0.9 * h]];
  for (const u of [-0.3, 0.3]) faces.push(...extrude(lift, u * machine.width - 0.05, u * machine.width + 0.05, PAINT.steel));
  return faces;
}

// Blocks over the solid cells: a top for each, walls only where the neighbour is not solid.
function obstacleFaces(episode, heights, tall) {
  const { rows, cols, cell, mask } = episode, faces = [];
  const solid = (r, c) => r >= 0 && c >= 0 && r < rows && c < cols && (mask[r * cols + c] & 8) > 0;
  const face = (points, normal) => faces.push({ points, normal, paint: PAINT.block, band: 2 });
  for (let r = 0; r < rows; r++) for (let c = 0; c < cols; c++) {
    if (!solid(r, c)) continue;
    const [x0, x1, y0, y1] = [c * cell, (c + 1) * cell, r * cell, (r + 1) * cell];
    const ground = heights[r * cols + c] * tall, top = solidTop(episode, heights, r, c) * tall + 1.4;
    const low = r && c && r < rows - 1 && c < cols - 1 ? ground - 0.5 : ground - 0.05;
    face([[x0, y0, top], [x1, y0, top], [x1, y1, top], [x0, y1, top]], [0, 0, 1]);
    if (!solid(r - 1, c)) face([[x0, y0, low], [x1, y0, low], [x1, y0, top], [x0, y0, top]], [0, -1, 0]);
    if (!solid(r + 1, c)) face([[x1, y1, low], [x0, y1, low], [x0, y1, top], [x1, y1, top]], [0, 1, 0]);
    if (!solid(r, c - 1)) face([[x0, y1, low], [x0, y0, low], [x0, y0, top], [x0, y1, top]], [-1, 0, 0]);
    if (!solid(r, c + 1)) face([[x1, y0, low], [x1, y1, low], [x1, y1, top], [x1, y0, top]], [1, 0, 0]);
  }
  return faces;
}

// The highest ground under the solid cells around one, so that a post on a slope has a level top.
function solidTop({ rows, cols, mask }, heights, r, c) {
  let top = -Infinity;
  for (let y = Math.max(0, r - 2); y <= Math.min(rows - 1, r + 2); y++) for (let x = Math.max(0, c - 2); x <= Math.min(cols - 1, c + 2); x++) {
    if (mask[y * cols + x] & 8) top = Math.max(top, heights[y * cols + x]);
  }
  return top;
}

// Matrices that put machine and blade where a pose says; slopes grow with the drawn heights.
function placeMachine(pose, blade, tall) {
  const c = Math.cos(pose.heading), s = Math.sin(pose.heading);
  const ahead = unit([c, s, pose.pitch * tall]);
  const up = unit(cross(ahead, unit([-s, c, pose.roll * tall])));
  const left = cross(up, ahead);
  const pivot = [pose.x, pose.y, pose.z * tall];
  const edge = add(add(pivot, scale(ahead, blade.reach)), scale(up, pose.edge * tall));
  return { body: frame(ahead, left, up, pivot), blade: frame(ahead, left, up, edge) };
}
