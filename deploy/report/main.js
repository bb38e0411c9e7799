// Put it together: theme, playback, keyboard.

const charts = data.charts.map(makeChart);
const scrub = document.getElementById("scrub"), button = document.getElementById("play"), speed = document.getElementById("speed");
scrub.min = play.t0; scrub.max = tEnd;

function drawAll() {
  scene.draw(); drawPhases(); maps.draw();
  charts.forEach((draw) => draw());
  scrub.value = cursor.t;
  scrub.setAttribute("aria-valuetext", cursor.t.toFixed(1) + " seconds");
  document.getElementById("now").textContent = cursor.t.toFixed(1) + " s";
}

// Many changes within one frame are drawn once.
let pending = false;
function soon() {
  if (pending) return;
  pending = true;
  requestAnimationFrame(() => { pending = false; drawAll(); });
}

function setTheme(name) {
  document.documentElement.dataset.theme = name;
  readColours(); scene.restyle(); drawAll();
}

let playing = false, last = 0, touched = false, frame = 0, timer = 0;
// Time goes on even where no frames are drawn (a covered window, a printer's preview): the timer stands in.
function schedule() {
  frame = requestAnimationFrame(step);
  timer = setTimeout(step, 100);
}
function step() {
  cancelAnimationFrame(frame); clearTimeout(timer);
  if (!playing) return;
  const now = performance.now();
  cursor.set(cursor.t + (Math.min(now - last, 250) / 1000) * Number(speed.value));
  last = now;
  if (cursor.t >= tEnd) setPlaying(false); else schedule();
}
function setPlaying(on) {
  playing = on;
  button.textContent = on ? "❚❚" : "▶";
  button.setAttribute("aria-label", on ? "Pause" : "Play");
  if (!on) return;
  if (!touched) cursor.set(Math.max(0, play.t0)); // the first time from the start of the search
  else if (cursor.t >= tEnd - 1e-3) cursor.set(play.t0);
  last = performance.now();
  schedule();
}

button.addEventListener("click", () => setPlaying(!playing));
scrub.addEventListener("input", () => cursor.set(Number(scrub.value)));
document.getElementById("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
document.addEventListener("keydown", (e) => {
  const target = e.target;
  if (e.ctrlKey || e.metaKey || e.altKey || target.matches?.("select, summary, pre, input[type=checkbox]")) return;
  const moves = { ArrowLeft: -1, ArrowRight: 1 };
  if (e.key === " " && target.matches?.("button")) return; // a button's own key
  if (e.key === " ") setPlaying(!playing);
  else if (e.key in moves) cursor.set(cursor.t + moves[e.key] * (e.shiftKey ? 1 : 0.1));
  else if (e.key === "Home") cursor.set(play.t0);
  else if (e.key === "End") cursor.set(tEnd);
  else return;
  e.preventDefault();
});

follow(document.getElementById("phases"));
window.addEventListener("resize", soon);
const dark = window.matchMedia("(prefers-color-scheme: dark)");
dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
let before = "light";
window.addEventListener("beforeprint", () => { before = document.documentElement.dataset.theme; setTheme("light"); });
window.addEventListener("afterprint", () => setTheme(before));
setTheme(document.documentElement.dataset.theme || (dark.matches ? "dark" : "light"));
cursor.set(cursor.t);
cursor.listeners.push(soon, () => { touched = true; });
