// The share in the goal over time as a small curve, with the present moment marked.

function drawChart(canvas, times, values, at) {
  const ratio = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight;
  canvas.width = Math.round(wide * ratio);
  canvas.height = Math.round(high * ratio);
  const pen = canvas.getContext("2d"), left = 34, bottom = high - 16, top = 6;
  const end = Math.max(times[times.length - 1], 1e-6);
  const x = (t) => left + (wide - left - 8) * t / end, y = (v) => bottom - (bottom - top) * Math.min(1, Math.max(0, v));
  pen.scale(ratio, ratio);
  pen.font = "10px system-ui, sans-serif";
  pen.textBaseline = "middle";
  for (const level of [0, 0.5, 1]) {
    pen.fillStyle = "#9aa7b5";
    pen.textAlign = "right";
    pen.fillText(`${100 * level}%`, left - 5, y(level));
    pen.fillStyle = "rgba(255,255,255,.14)";
    pen.fillRect(left, y(level), wide - left - 8, 1);
  }
  pen.fillStyle = "#9aa7b5";
  pen.textAlign = "center";
  pen.fillText("share in goal", (left + wide) / 2, high - 6);
  curve(pen, times, values, Infinity, x, y);
  pen.strokeStyle = "rgba(86,180,233,.45)";
  pen.lineWidth = 1.5;
  pen.stroke();
  curve(pen, times, values, at, x, y);
  pen.strokeStyle = "#56b4e9";
  pen.lineWidth = 2;
  pen.stroke();
  pen.fillStyle = "#f7ba16";
  pen.fillRect(x(at) - 0.75, top, 1.5, bottom - top);
}

function curve(pen, times, values, until, x, y) {
  pen.beginPath();
  for (let k = 0; k < times.length && times[k] <= until; k++) {
    if (Number.isFinite(values[k])) pen.lineTo(x(times[k]), y(values[k]));
  }
}
