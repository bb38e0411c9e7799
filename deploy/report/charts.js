// Charts over time: curves with limits, and spans for meetings; all follow the one cursor.

const LEFT = 52, RIGHT = 12, TOP = 10, BOTTOM = 24;

function timeAxis(width) {
  const span = tEnd - play.t0 || 1;
  const inner = width - LEFT - RIGHT;
  return { x: (t) => LEFT + ((t - play.t0) / span) * inner, t: (x) => play.t0 + ((x - LEFT) / inner) * span };
}

function drawTimeAxis(context, axis, height, bottom) {
  context.font = FONT; context.fillStyle = colours.soft; context.textAlign = "center"; context.textBaseline = "top";
  for (const t of ticks(play.t0, tEnd, 8)) context.fillText(String(+t.toFixed(2)) + (t === 0 ? " s" : ""), axis.x(t), height - bottom + 7);
}

// The search is a white page, the rest of the flight is shaded.
function drawWindow(context, axis, top, height) {
  context.fillStyle = colours.line; context.globalAlpha = 0.35;
  const a = axis.x(Math.max(0, play.t0)), b = axis.x(Math.min(play.duration, tEnd));
  context.fillRect(axis.x(play.t0), top, a - axis.x(play.t0), height);
  context.fillRect(b, top, axis.x(tEnd) - b, height);
  context.globalAlpha = 1;
}

function drawCursor(context, axis, top, height) {
  const x = axis.x(cursor.t);
  context.strokeStyle = colours.accent; context.lineWidth = 1.25;
  context.beginPath(); context.moveTo(x, top); context.lineTo(x, top + height); context.stroke();
}

function valueAt(curve, t) {
  const times = curve.times, values = curve.values;
  if (!times.length || t < times[0] - 0.3 || t > times[times.length - 1] + 0.3) return NaN;
  let low = 0, high = times.length - 1;
  while (low < high) { const middle = (low + high) >> 1; if (times[middle] < t) low = middle + 1; else high = middle; }
  return values[low > 0 && t - times[low - 1] < times[low] - t ? low - 1 : low];
}

function range(chart) {
  let low = Infinity, high = -Infinity;
  for (const curve of chart.curves) for (const y of curve.values) if (!Number.isNaN(y) && (!chart.log || y > 0)) { low = Math.min(low, y); high = Math.max(high, y); }
  for (const limit of chart.limits) { low = Math.min(low, limit.y); high = Math.max(high, limit.y); }
  if (low > high) return [0, 1];
  if (chart.zero) low = Math.min(0, low);
  if (chart.log) return [low / 1.3, high * 1.15];
  const margin = (high - low || Math.abs(high) || 1) * 0.08;
  return [chart.zero && low === 0 ? 0 : low - margin, high + margin];
}

const short = (v) => (Number.isNaN(v) ? "–" : Math.abs(v) < 0.01 && v !== 0 ? v.toExponential(1) : Math.abs(v) < 10 ? v.toFixed(2) : v.toFixed(1));

function drawLines(chart, canvas) {
  const { context, width, height } = fit(canvas);
  const axis = timeAxis(width), inner = height - TOP - BOTTOM;
  const [low, high] = chart.range;
  const part = chart.log ? (v) => Math.log(v / low) / Math.log(high / low) : (v) => (v - low) / (high - low);
  const y = (v) => TOP + inner * (1 - part(v));
  drawWindow(context, axis, TOP, inner);
  context.font = FONT; context.textAlign = "right"; context.textBaseline = "middle"; context.lineWidth = 1;
  const marks = chart.log ? decades(low, high) : ticks(low, high, 4);
  for (const v of marks) {
    context.strokeStyle = colours.line; context.beginPath(); context.moveTo(LEFT, y(v)); context.lineTo(width - RIGHT, y(v)); context.stroke();
    context.fillStyle = colours.soft; context.fillText(chart.log ? v.toExponential(0) : String(+v.toPrecision(4)), LEFT - 8, y(v));
  }
  drawTimeAxis(context, axis, height, BOTTOM);
  for (const curve of chart.curves) drawCurve(context, curve, axis, y);
  context.font = FONT; context.textAlign = "left"; context.textBaseline = "bottom";
  for (const limit of chart.limits) {
    context.strokeStyle = context.fillStyle = colours.fail; context.lineWidth = 1; context.setLineDash([5, 3]);
    context.beginPath(); context.moveTo(LEFT, y(limit.y)); context.lineTo(width - RIGHT, y(limit.y)); context.stroke();
    context.setLineDash([]); context.fillText(limit.name, LEFT + 6, y(limit.y) - 3);
  }
  drawCursor(context, axis, TOP, inner);
  chart.curves.forEach((curve) => { curve.output.textContent = short(valueAt(curve, cursor.t)); });
}

function decades(low, high) {
  const out = [];
  for (let e = Math.floor(Math.log10(low)); e <= Math.log10(high); e++) for (const m of high / low < 12 ? [1, 2, 5] : [1]) if (m * 10 ** e >= low && m * 10 ** e <= high) out.push(m * 10 ** e);
  return out;
}

function drawCurve(context, curve, axis, y) {
  context.strokeStyle = curve.robot === null ? (curve.style === "planned" ? colours.ink : colours.accent) : robotColour(curve.robot);
  context.lineWidth = 1.6; context.lineJoin = "round";
  context.setLineDash(curve.style === "planned" ? [5, 3] : []);
  context.beginPath();
  let pen = false;
  for (let k = 0; k < curve.times.length; k++) {
    const v = curve.values[k];
    if (Number.isNaN(v)) { pen = false; continue; }
    if (pen) context.lineTo(axis.x(curve.times[k]), y(v)); else context.moveTo(axis.x(curve.times[k]), y(v));
    pen = true;
  }
  context.stroke(); context.setLineDash([]);
}

function drawSpans(chart, canvas) {
  const { context, width, height } = fit(canvas);
  const axis = timeAxis(width), inner = height - TOP - BOTTOM, row = inner / chart.rows.length;
  drawWindow(context, axis, TOP, inner);
  drawTimeAxis(context, axis, height, BOTTOM);
  context.strokeStyle = colours.faint; context.lineWidth = 1;
  for (const t of chart.periods) { context.beginPath(); context.moveTo(axis.x(t), TOP); context.lineTo(axis.x(t), TOP + inner); context.stroke(); }
  chart.rows.forEach((pair, k) => {
    const top = TOP + k * row, bar = Math.min(row * 0.62, 14), middle = top + row / 2;
    const now = pair.flown.some(([a, b]) => a <= cursor.t && cursor.t <= b);
    context.font = (now ? "600 " : "") + FONT; context.fillStyle = now ? colours.ink : colours.soft; context.textAlign = "right"; context.textBaseline = "middle";
    if (row >= 11 || k % 2 === 0) context.fillText(pair.name.length > 9 ? pair.name.slice(0, 8) + "…" : pair.name, LEFT - 4, middle);
    context.fillStyle = colours.accent; context.globalAlpha = 0.85;
    for (const [a, b] of pair.flown) context.fillRect(axis.x(a), middle - bar / 2, Math.max(1.5, axis.x(b) - axis.x(a)), bar);
    context.globalAlpha = 1; context.strokeStyle = colours.ink; context.lineWidth = 1;
    for (const [a, b] of pair.planned) context.strokeRect(axis.x(a), middle - bar / 2 - 1.5, Math.max(2, axis.x(b) - axis.x(a)), bar + 3);
  });
  drawCursor(context, axis, TOP, inner);
}

function element(name, text, className) {
  const out = document.createElement(name);
  if (text !== undefined) out.textContent = text;
  if (className) out.className = className;
  return out;
}

function makeChart(chart) {
  const figure = element("figure", undefined, "chart" + (chart.kind === "spans" ? " wide" : ""));
  figure.id = "chart-" + chart.id;
  const title = element("h3", chart.title);
  title.append(element("small", chart.unit));
  const canvas = element("canvas");
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `${chart.title} (${chart.unit}). ${chart.reading}`);
  figure.append(title, element("p", chart.reading, "reading"), canvas);
  if (chart.kind === "spans") {
    canvas.style.height = Math.min(900, Math.max(110, TOP + BOTTOM + 20 * chart.rows.length)) + "px";
    canvas.dataset.points = chart.rows.reduce((sum, pair) => sum + pair.flown.length + pair.planned.length, 0);
  } else {
    const key = element("ul", undefined, "key");
    for (const curve of chart.curves) {
      curve.times = floats(curve.t); curve.values = floats(curve.y);
      const item = element("li"), swatch = element("i", "", curve.style);
      swatch.style.setProperty("--c", curve.robot === null ? (curve.style === "planned" ? "var(--ink)" : "var(--accent)") : `var(--r${curve.robot % 8})`);
      curve.output = element("b", "–");
      item.append(swatch, curve.name, curve.output);
      key.append(item);
    }
    chart.range = range(chart);
    canvas.dataset.points = chart.curves.reduce((sum, curve) => sum + curve.values.filter((v) => !Number.isNaN(v)).length, 0);
    figure.append(key);
  }
  follow(canvas);
  document.getElementById("charts").append(figure);
  return () => (chart.kind === "spans" ? drawSpans : drawLines)(chart, canvas);
}

// A click or drag on anything with a time axis moves the cursor.
function follow(canvas) {
  const move = (e) => cursor.set(timeAxis(canvas.clientWidth).t(e.clientX - canvas.getBoundingClientRect().left));
  canvas.addEventListener("pointerdown", (e) => { canvas.setPointerCapture(e.pointerId); move(e); });
  canvas.addEventListener("pointermove", (e) => { if (e.buttons) move(e); });
}

function drawPhases() {
  const canvas = document.getElementById("phases");
  const { context, width, height } = fit(canvas);
  const axis = timeAxis(width);
  context.font = FONT; context.textBaseline = "middle"; context.textAlign = "left";
  play.phases.forEach((phase, k) => {
    const a = Math.max(axis.x(play.t0), axis.x(phase.begin)), b = Math.min(axis.x(tEnd), axis.x(phase.end));
    if (b <= a) return;
    context.fillStyle = k % 2 ? colours.line : colours.faint; context.globalAlpha = 0.6;
    context.fillRect(a, 0, b - a, 18); context.globalAlpha = 1;
    context.fillStyle = colours.ink;
    if (b - a > context.measureText(phase.name).width + 10) context.fillText(phase.name, a + 5, 9.5);
  });
  drawTimeAxis(context, axis, height, 20);
  drawCursor(context, axis, 0, 20);
}
