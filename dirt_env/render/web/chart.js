// What a job is judged by over time as a small curve, with the present moment marked.

// Which of the names that is: the grade error of a design, or else the share in the goal; -1 if there is neither.
function mainFigure(names) {
  return names.indexOf(names.includes("grade_error_m") ? "grade_error_m" : "share_in_goal");
}

// Of a main figure its title, the value at the top of the chart, and how values are written at its side.
function scaleOf(name, curves) {
  if (name === "share_in_goal") return { title: "share in goal", top: 1, text: (value) => `${100 * value}%` };
  const most = Math.max(...curves.flat().filter(Number.isFinite), 1e-3), ten = 10 ** Math.floor(Math.log10(most));
  const top = [1, 2, 4, 10].map((step) => step * ten).find((value) => value >= most);
  return { title: "grade error, m", top, text: (value) => `${Number(value.toPrecision(2))}` };
}

function drawChart(canvas, name, times, values, at) {
  const { title, top: most, text } = scaleOf(name, [Array.from(values)]);
  const ratio = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight;
  canvas.width = Math.round(wide * ratio);
  canvas.height = Math.round(high * ratio);
  const pen = canvas.getContext("2d"), left = 34, bottom = high - 16, top = 6;
  const end = Math.max(times[times.length - 1], 1e-6);
  const x = (t) => left + (wide - left - 8) * t / end, y = (v) => bottom - (bottom - top) * Math.min(1, Math.max(0, v / most));
  pen.scale(ratio, ratio);
  pen.font = "10px system-ui, sans-serif";
  pen.textBaseline = "middle";
  for (const level of [0, 0.5 * most, most]) {
    pen.fillStyle = "#9aa7b5";
    pen.textAlign = "right";
    pen.fillText(text(level), left - 5, y(level));
    pen.fillStyle = "rgba(255,255,255,.14)";
    pen.fillRect(left, y(level), wide - left - 8, 1);
  }
  pen.fillStyle = "#9aa7b5";
  pen.textAlign = "center";
  pen.fillText(title, (left + wide) / 2, high - 6);
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
