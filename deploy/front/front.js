// The plans, the one that is chosen, and which of them are good enough. Comes after the report's page.js.

const points = data.points, names = data.names;
const worst = names.map((_, m) => Math.max(...points.map((p) => p.vector[m])));
const limits = worst.slice();
const allowed = (p) => p.vector.every((E, m) => E <= limits[m] * (1 + 1e-12));
// A walk along the front: plans that nothing beats by their first map, then the rest.
const walk = points.map((_, i) => i).sort((a, b) => points[b].best - points[a].best || points[a].vector[0] - points[b].vector[0]);
const number = (E) => (E >= 0.01 ? E.toPrecision(3) : E.toExponential(1));
const label = (i) => points[i].name || `plan ${i}`;

const chosen = {
  index: data.named.compromise ?? 0,
  listeners: [],
  set(index) {
    this.index = index;
    document.documentElement.dataset.chosen = index;
    for (const listener of this.listeners) listener();
  },
  step(by) {
    const good = walk.filter((i) => allowed(points[i]));
    if (good.length) this.set(good[(Math.max(0, good.indexOf(this.index)) + by + good.length) % good.length]);
  },
};

// What a click in a canvas means: the item whose place is nearest, if it is near at all.
function nearest(places, x, y, within = 16) {
  let best = null, least = within;
  for (const [i, px, py] of places) { const d = Math.hypot(px - x, py - y); if (d < least) { least = d; best = i; } }
  return best;
}

function dot(context, i, x, y) {
  const point = points[i], is = i === chosen.index;
  context.globalAlpha = allowed(point) ? 1 : 0.18;
  context.beginPath(); context.arc(x, y, is ? 7 : 4, 0, 2 * Math.PI);
  context.fillStyle = is ? colours.fail : point.best ? colours.accent : colours.card;
  context.strokeStyle = is ? colours.fail : point.best ? colours.accent : colours.soft;
  context.lineWidth = 1.5; context.fill(); context.stroke();
  if (point.name || is) {
    context.fillStyle = colours.ink; context.textAlign = "left"; context.textBaseline = "bottom";
    context.fillText(label(i), x + 8, y - 4);
  }
  context.globalAlpha = 1;
}
