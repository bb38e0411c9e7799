"use strict";
// What everything shares: the data, the time cursor, colours, canvases.

const data = JSON.parse(document.getElementById("data").textContent);
const play = data.playback;

// Numbers as packing.py packs them: 16-bit steps between the least and the largest; a plain array is taken as it is.
function unpack(packed) {
  if (Array.isArray(packed)) return Float32Array.from(packed, (v) => (v === null ? NaN : v));
  const bytes = Uint8Array.from(atob(packed.data), (c) => c.charCodeAt(0));
  const view = new DataView(bytes.buffer), scale = (packed.hi - packed.lo) / 65534;
  return Float32Array.from({ length: bytes.length / 2 }, (_, k) => {
    const step = view.getUint16(2 * k, true);
    return step === 65535 ? NaN : packed.lo + step * scale;
  });
}

function element(name, text, className) {
  const out = document.createElement(name);
  if (text !== undefined) out.textContent = text;
  if (className) out.className = className;
  return out;
}

let tEnd = play.t0 + play.dt * (play.n - 1); // grows while a flight is watched live

// The one time cursor [s]. Whoever shows time subscribes. It begins where something went wrong, or where the
// search ends: all of it is to be seen.
const cursor = {
  t: Math.min(Math.max(play.look ?? play.duration, play.t0), tEnd),
  listeners: [],
  set(t) {
    this.t = Math.min(tEnd, Math.max(play.t0, t));
    document.documentElement.dataset.time = this.t.toFixed(3);
    for (const listener of this.listeners) listener();
  },
};

// The one robot that is looked at, or null for all: the others step back in the scene and in every chart.
const focus = {
  robot: null,
  set(robot) {
    this.robot = this.robot === robot ? null : robot;
    for (const item of document.querySelectorAll("[data-robot]")) item.setAttribute("aria-pressed", String(Number(item.dataset.robot) === this.robot));
    for (const listener of cursor.listeners) listener();
  },
  dims(robot) { return this.robot !== null && robot !== null && robot !== this.robot; },
};

// A robot's name as a button that puts it into focus.
function robotButton(name, i) {
  const button = element("button", undefined, "robot");
  button.type = "button"; button.dataset.robot = i; button.setAttribute("aria-pressed", "false");
  button.style.setProperty("--c", `var(--r${i % ROBOT_COLOURS})`);
  button.append(element("i"), element("span", name));
  button.addEventListener("click", () => focus.set(i));
  return button;
}

const ROBOT_COLOURS = 10;
let colours = {};
function readColours() {
  const style = getComputedStyle(document.documentElement);
  const get = (name) => style.getPropertyValue(name).trim(), known = {};
  colours = {
    ink: get("--ink"), soft: get("--soft"), faint: get("--faint"), line: get("--line"), card: get("--card"),
    accent: get("--accent"), fail: get("--fail"), warn: get("--warn"), heat: get("--heat"), over: get("--over"), under: get("--under"), obstacle: get("--obstacle"),
    of: (name) => (known[name] ??= get(name)),
    robots: Array.from({ length: ROBOT_COLOURS }, (_, i) => get("--r" + i)),
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

// A click on a moment in a text goes there.
for (const link of document.querySelectorAll("[data-at]")) link.addEventListener("click", () => cursor.set(Number(link.dataset.at)));

const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif';

// Round numbers for an axis.
function ticks(low, high, most) {
  if (!(high > low)) return [low];
  const raw = (high - low) / Math.max(1, most);
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= raw);
  const out = [];
  for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + step * 1e-6; v += step) out.push(Math.abs(v) < step * 1e-6 ? 0 : v);
  return out;
}
