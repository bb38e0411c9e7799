// Charts over time: panels of curves with limits, and spans for meetings; all follow the one cursor.

const RIGHT = 12, TOP = 10, BOTTOM = 24, GAP = 26, LEFT = 52;

function timeAxis(width, left = LEFT) {
  const span = tEnd - play.t0 || 1, inner = width - left - RIGHT;
  return { left, x: (t) => left + ((t - play.t0) / span) * inner, t: (x) => play.t0 + ((x - left) / inner) * span };
}

function drawTimeAxis(context, axis, height, bottom) {
  context.font = FONT; context.fillStyle = colours.soft; context.textAlign = "center"; context.textBaseline = "top";
  const most = Math.max(2, Math.floor((axis.x(tEnd) - axis.left) / 60));
  for (const t of ticks(play.t0, tEnd, Math.min(8, most))) context.fillText(String(+t.toFixed(2)) + (t === 0 ? " s" : ""), axis.x(t), height - bottom + 7);
}

// The search is a white page, the rest of the flight is shaded; what went wrong is ticked off at the top.
function drawWindow(context, axis, top, height) {
  context.fillStyle = colours.line; context.globalAlpha = 0.35;
  const a = axis.x(Math.max(0, play.t0)), b = axis.x(Math.min(play.searched ?? play.duration, tEnd));
  context.fillRect(axis.x(play.t0), top, a - axis.x(play.t0), height);
  context.fillRect(b, top, axis.x(tEnd) - b, height);
  context.globalAlpha = 1;
  for (const mark of play.marks) {
    const x = axis.x(mark.t);
    context.fillStyle = mark.level === "fault" ? colours.fail : colours.warn;
    context.beginPath(); context.moveTo(x - 4, top - 6); context.lineTo(x + 4, top - 6); context.lineTo(x, top); context.fill();
  }
}

function drawCursor(context, axis, top, height) {
  const x = axis.x(cursor.t);
  context.strokeStyle = colours.accent; context.lineWidth = 1.25;
  context.beginPath(); context.moveTo(x, top); context.lineTo(x, top + height); context.stroke();
}

function valueAt(curve, t) {
  const times = curve.times, values = curve.values;
  const near = times.length ? Math.max(0.3, 2 * (times[times.length - 1] - times[0]) / times.length) : 0;
  if (!times.length || t < times[0] - near || t > times[times.length - 1] + near) return NaN;
  let low = 0, high = times.length - 1;
  while (low < high) { const middle = (low + high) >> 1; if (times[middle] < t) low = middle + 1; else high = middle; }
  return values[low > 0 && t - times[low - 1] < times[low] - t ? low - 1 : low];
}

function range(panel) {
  let low = Infinity, high = -Infinity;
  for (const curve of panel.curves) for (const y of curve.values) if (!Number.isNaN(y) && (!panel.log || y > 0)) { low = Math.min(low, y); high = Math.max(high, y); }
  const span = high - low;
  // A limit far from everything would flatten the curves: it is drawn where it can be seen.
  for (const limit of panel.limits) if (panel.zero || !(limit.y < low - 2 * span || limit.y > high + 2 * span)) { low = Math.min(low, limit.y); high = Math.max(high, limit.y); }
  if (low > high) return panel.log ? [0.1, 1] : [0, 1];
  if (panel.zero) { low = Math.min(0, low); high = Math.max(0, high); }
  if (panel.log) return [low / 1.3, high * 1.15];
  const margin = (high - low || Math.abs(high) || 1) * 0.08;
  return [panel.zero && low === 0 ? 0 : low - margin, panel.zero && high === 0 ? 0 : high + margin];
}

const short = (v) => (Number.isNaN(v) ? "–" : Math.abs(v) < 0.01 && v !== 0 ? v.toExponential(1) : Math.abs(v) < 10 ? v.toFixed(2) : v.toFixed(1));
const curveColour = (curve) => (curve.flight !== undefined ? `--r${curve.flight % ROBOT_COLOURS}` : curve.robot === null ? { planned: "--soft", certified: "--ink", flown: "--accent" }[curve.style] : `--r${curve.robot % ROBOT_COLOURS}`);

function drawPanel(context, panel, axis, width, top, height) {
  const [low, high] = panel.range;
  const part = panel.log ? (v) => Math.log(v / low) / Math.log(high / low) : (v) => (v - low) / (high - low);
  const y = (v) => top + height * (1 - part(v));
  drawWindow(context, axis, top, height);
  context.font = FONT; context.textAlign = "right"; context.textBaseline = "middle"; context.lineWidth = 1;
  for (const v of panel.log ? decades(low, high) : ticks(low, high, height > 120 ? 4 : 3)) {
    context.strokeStyle = colours.line; context.beginPath(); context.moveTo(axis.left, y(v)); context.lineTo(width - RIGHT, y(v)); context.stroke();
    context.fillStyle = colours.soft; context.fillText(panel.log ? v.toExponential(0) : String(+v.toPrecision(4)), axis.left - 8, y(v));
  }
  context.save();
  context.beginPath(); context.rect(axis.left, top - 1, width - RIGHT - axis.left, height + 2); context.clip();
  for (const curve of panel.curves) drawCurve(context, curve, axis, y);
  context.restore();
  context.font = FONT; context.textAlign = "left"; context.textBaseline = "bottom";
  for (const limit of panel.limits) {
    if (part(limit.y) < 0 || part(limit.y) > 1) continue;
    context.strokeStyle = context.fillStyle = colours.fail; context.lineWidth = 1; context.setLineDash([5, 3]);
    context.beginPath(); context.moveTo(axis.left, y(limit.y)); context.lineTo(width - RIGHT, y(limit.y)); context.stroke();
    context.setLineDash([]); context.fillText(limit.name, axis.left + 6, y(limit.y) + (part(limit.y) > 0.85 ? 15 : -3));
  }
  drawCursor(context, axis, top, height);
}

function drawLines(chart, canvas) {
  const { context, width, height } = fit(canvas);
  const axis = timeAxis(width), count = chart.panels.length;
  const each = (height - TOP - BOTTOM - GAP * (count - 1) - (count > 1 ? 12 : 0)) / count;
  chart.panels.forEach((panel, k) => {
    const top = TOP + (count > 1 ? 12 : 0) + k * (each + GAP);
    drawPanel(context, panel, axis, width, top, each);
    if (count > 1) {
      context.font = FONT; context.textAlign = "left"; context.textBaseline = "bottom"; context.fillStyle = colours.soft;
      context.fillText(panel.unit, axis.left, top - 5);
    }
  });
  drawTimeAxis(context, axis, height, BOTTOM);
  for (const row of chart.key) row.output.textContent = row.curves.map((curve) => short(valueAt(curve, cursor.t))).join(" · ");
}

function decades(low, high) {
  const out = [];
  for (let e = Math.floor(Math.log10(low)); e <= Math.log10(high); e++) for (const m of high / low < 12 ? [1, 2, 5] : [1]) if (m * 10 ** e >= low && m * 10 ** e <= high) out.push(m * 10 ** e);
  return out;
}

function drawCurve(context, curve, axis, y) {
  context.strokeStyle = colours.of(curveColour(curve));
  context.globalAlpha = focus.dims(curve.robot) ? 0.12 : 1;
  context.lineWidth = 1.6; context.lineJoin = "round";
  context.setLineDash({ planned: [2, 3], certified: [6, 3] }[curve.style] || []);
  context.beginPath();
  let pen = false;
  for (let k = 0; k < curve.times.length; k++) {
    const v = curve.values[k];
    if (Number.isNaN(v)) { pen = false; continue; }
    if (pen) context.lineTo(axis.x(curve.times[k]), y(v)); else context.moveTo(axis.x(curve.times[k]), y(v));
    pen = true;
  }
  context.stroke(); context.setLineDash([]); context.globalAlpha = 1;
}

function drawSpans(chart, canvas) {
  const { context, width, height } = fit(canvas);
  context.font = FONT;
  const names = Math.min(width / 3, Math.max(...chart.rows.map((row) => context.measureText(row.name).width)) + 14);
  const axis = timeAxis(width, canvas.left = Math.max(LEFT, names)), inner = height - TOP - BOTTOM, row = inner / chart.rows.length;
  drawWindow(context, axis, TOP, inner);
  drawTimeAxis(context, axis, height, BOTTOM);
  context.strokeStyle = colours.faint; context.lineWidth = 1;
  for (const t of chart.periods) { context.beginPath(); context.moveTo(axis.x(t), TOP); context.lineTo(axis.x(t), TOP + inner); context.stroke(); }
  chart.rows.forEach((pair, k) => {
    const top = TOP + k * row, bar = Math.min(row * 0.62, 14), middle = top + row / 2;
    const now = pair.flown.some(([a, b]) => a <= cursor.t && cursor.t <= b);
    context.font = (now ? "600 " : "") + FONT; context.fillStyle = now ? colours.ink : colours.soft; context.textAlign = "right"; context.textBaseline = "middle";
    if (row >= 11 || k % 2 === 0) context.fillText(pair.name, axis.left - 6, middle, axis.left - 8);
    context.fillStyle = colours.accent; context.globalAlpha = 0.85;
    for (const [a, b] of pair.flown) context.fillRect(axis.x(a), middle - bar / 2, Math.max(1.5, axis.x(b) - axis.x(a)), bar);
    context.globalAlpha = 1; context.strokeStyle = colours.ink; context.lineWidth = 1;
    for (const [a, b] of pair.planned) context.strokeRect(axis.x(a), middle - bar / 2 - 1.5, Math.max(2, axis.x(b) - axis.x(a)), bar + 3);
  });
  drawCursor(context, axis, TOP, inner);
}

// One line of the key for every name: its curves in all panels, and their values at the cursor.
function makeKey(chart) {
  const list = element("ul", undefined, "key"), rows = new Map();
  for (const panel of chart.panels) for (const curve of panel.curves) {
    if (!rows.has(curve.name)) {
      const item = element("li"), output = element("b", "–");
      if (curve.robot === null) {
        const swatch = element("i", undefined, curve.style);
        swatch.style.setProperty("--c", `var(${curveColour(curve)})`);
        item.append(swatch, curve.name, output);
      } else item.append(robotButton(curve.name, curve.robot), output);
      list.append(item);
      rows.set(curve.name, { output, curves: [] });
    }
    rows.get(curve.name).curves.push(curve);
  }
  chart.key = [...rows.values()];
  return list;
}

function prepare(chart) {
  for (const panel of chart.panels) {
    for (const curve of panel.curves) { curve.times = unpack(curve.t); curve.values = unpack(curve.y); }
    panel.range = range(panel);
  }
  return chart.panels.reduce((sum, panel) => sum + panel.curves.reduce((n, curve) => n + curve.values.filter((v) => !Number.isNaN(v)).length, 0), 0);
}

function makeChart(chart) {
  const figure = element("figure", undefined, "chart" + (chart.wide ? " wide" : "")), spans = chart.kind === "spans";
  figure.id = "chart-" + chart.id;
  const title = element("h3", chart.title), canvas = element("canvas");
  title.append(element("small", spans ? chart.unit : chart.panels.length === 1 ? chart.panels[0].unit : ""));
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", `${chart.title}. ${chart.reading}`);
  figure.append(title, element("p", chart.reading, "reading"), canvas);
  if (spans) {
    canvas.style.height = Math.min(900, Math.max(110, TOP + BOTTOM + (chart.rows.length > 15 ? 15 : 20) * chart.rows.length)) + "px";
    canvas.dataset.points = chart.rows.reduce((sum, pair) => sum + pair.flown.length + pair.planned.length, 0);
  } else {
    canvas.dataset.points = prepare(chart);
    canvas.style.height = (chart.panels.length === 1 ? 220 : 60 + 118 * chart.panels.length) + "px";
    figure.append(makeKey(chart));
  }
  follow(canvas);
  document.getElementById("charts-" + chart.group).append(figure);
  return () => (spans ? drawSpans : drawLines)(chart, canvas);
}

// A click or drag on anything with a time axis moves the cursor.
function follow(canvas) {
  const move = (e) => cursor.set(timeAxis(canvas.clientWidth, canvas.left).t(e.clientX - canvas.getBoundingClientRect().left));
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
    context.fillRect(a, 8, b - a, 18); context.globalAlpha = 1;
    context.fillStyle = colours.ink;
    if (b - a > context.measureText(phase.name).width + 10) context.fillText(phase.name, a + 5, 17.5);
  });
  for (const mark of play.marks) {
    const x = axis.x(mark.t);
    context.fillStyle = mark.level === "fault" ? colours.fail : colours.warn;
    context.beginPath(); context.moveTo(x - 5, 1); context.lineTo(x + 5, 1); context.lineTo(x, 9); context.fill();
  }
  drawTimeAxis(context, axis, height, 20);
  drawCursor(context, axis, 4, 24);
}
