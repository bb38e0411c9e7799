"use strict";
// What everything shares: the data, the time cursor, colours, canvases.

const data = JSON.parse(document.getElementById("data").textContent);
const play = data.playback;

function floats(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

const tEnd = play.t0 + play.dt * (play.n - 1);

// The one time cursor [s]. Whoever shows time subscribes. It begins where the search ends: all of it is to be seen.
const cursor = {
  t: Math.min(Math.max(play.duration, play.t0), tEnd),
  listeners: [],
  set(t) {
    this.t = Math.min(tEnd, Math.max(play.t0, t));
    document.documentElement.dataset.time = this.t.toFixed(3);
    for (const listener of this.listeners) listener();
  },
};

let colours = {};
function readColours() {
  const style = getComputedStyle(document.documentElement);
  const get = (name) => style.getPropertyValue(name).trim();
  colours = {
    ink: get("--ink"), soft: get("--soft"), faint: get("--faint"), line: get("--line"), card: get("--card"),
    accent: get("--accent"), fail: get("--fail"), warn: get("--warn"), heat: get("--heat"), obstacle: get("--obstacle"),
    robots: Array.from({ length: 8 }, (_, i) => get("--r" + i)),
  };
}
const robotColour = (i) => colours.robots[i % colours.robots.length];

// Fit a canvas to its box and the screen's pixels; returns its context and size in CSS pixels.
function fit(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  const w = Math.round(width * ratio), h = Math.round(height * ratio);
  if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif';

// Round numbers for an axis.
function ticks(low, high, most) {
  const raw = (high - low) / Math.max(1, most);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
  const out = [];
  for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + step * 1e-6; v += step) out.push(Math.abs(v) < step * 1e-6 ? 0 : v);
  return out;
}
