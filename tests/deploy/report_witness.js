// Uses the report page as a reader does, and writes down what came of it, for test_report_page.py.
const seen = [];
addEventListener("error", (e) => seen.push(String(e.message)));
addEventListener("securitypolicyviolation", (e) => seen.push("request: " + e.blockedURI));
const say = console.error; console.error = (...a) => { seen.push(a.join(" ")); say(...a); };
addEventListener("load", () => {
  document.getElementById("play").click();
  setTimeout(() => {
    document.getElementById("play").click();
    const played = Number(document.documentElement.dataset.time);
    const key = (name) => document.body.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true }));
    key("Home"); key("ArrowRight"); key("ArrowRight");
    const stepped = Number(document.documentElement.dataset.time);
    document.querySelector("[data-at]").click();
    const jumped = Number(document.documentElement.dataset.time), asked = Number(document.querySelector("[data-at]").dataset.at);
    document.querySelector("#charts-tracking .robot").click();
    const pressed = [...document.querySelectorAll(".robot[aria-pressed=true]")].map((b) => b.textContent);
    key("End");
    document.getElementById("theme").click(); // draws at once
    const box = (e) => { const b = e.getBoundingClientRect(); return [b.left, b.top + scrollY, b.right, b.bottom + scrollY].map(Math.round); };
    const boxes = (chosen) => [...document.querySelectorAll(chosen)].map((e) => [e.id || e.className, box(e)]);
    const deaf = [...document.querySelectorAll("button, input, select, canvas[role=img]")].filter((e) =>
      !(e.getAttribute("aria-label") || e.textContent.trim() || e.closest("label")?.textContent.trim())).map((e) => e.outerHTML);
    const out = document.createElement("pre");
    const pixels = (c) => { const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
      const colours = new Set();
      for (let i = 0; i < d.length; i += 4) colours.add(d[i] * 65536 + d[i+1] * 256 + d[i+2]);
      return colours.size; };
    out.id = "witness";
    out.textContent = JSON.stringify({ errors: seen, played, stepped,
      start: Number(document.getElementById("scrub").min), jumped, asked, pressed, deaf,
      sections: boxes("main > section, header"), figures: boxes(".chart, .stage, .maps figure"), bar: box(document.getElementById("bar")),
      maps: [...document.querySelectorAll(".maps canvas")].map(pixels), ergodicity: Number(document.getElementById("map-ergodicity").dataset.ergodicity),
      charts: Object.fromEntries([...document.querySelectorAll(".chart")].map((f) =>
        [f.id, [Number(f.querySelector("canvas").dataset.points), pixels(f.querySelector("canvas"))]])),
      scene: pixels(document.getElementById("scene")), width: document.documentElement.scrollWidth });
    document.body.append(out);
  }, 1500);
});
