// An episode at some second: which two recorded moments, how far between them, and the pose blended.

function momentAt({ times, frames, poses }, seconds) {
  let first = 0;
  for (let low = 0, high = frames - 1; low <= high;) {
    const middle = (low + high) >> 1;
    if (times[middle] <= seconds) { first = middle; low = middle + 1; } else high = middle - 1;
  }
  const next = Math.min(first + 1, frames - 1), gap = times[next] - times[first];
  const share = gap > 0 ? Math.min(1, Math.max(0, (seconds - times[first]) / gap)) : 0;
  const pose = {};
  for (const name in poses) pose[name] = poses[name][first] + share * (poses[name][next] - poses[name][first]);
  const driven = pose.x * Math.cos(pose.heading) + pose.y * Math.sin(pose.heading);
  return { first, share, pose, driven };
}
