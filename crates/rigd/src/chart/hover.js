// Over a panel: the nearest point of each curve in x (in a drawing: the nearest point of all), with a mark and its values.
const NS = "http://www.w3.org/2000/svg";
const svg = document.querySelector("#chart svg");
const box = document.getElementById("values");
// The drawing counts in parts of a pixel, the pointer in pixels.
const marks = svg.appendChild(document.createElementNS(NS, "g"));
marks.setAttribute("transform", `scale(${svg.viewBox.baseVal.width / svg.width.baseVal.value})`);
const number = (value) => Number(value.toPrecision(6)).toString();

svg.addEventListener("pointerleave", () => { box.style.display = "none"; marks.replaceChildren(); });
svg.addEventListener("pointermove", (event) => {
  marks.replaceChildren();
  const bounds = svg.getBoundingClientRect();
  const px = event.clientX - bounds.left, py = event.clientY - bounds.top;
  const panel = panels.find((p) => px >= p.px[0] && px <= p.px[1] && py >= p.px[2] && py <= p.px[3]);
  if (!panel) { box.style.display = "none"; return; }
  const [left, right, top, bottom] = panel.px, [x0, x1, y0, y1] = panel.at;
  const toX = (x) => left + (x - x0) / (x1 - x0) * (right - left);
  const height = (y) => (panel.log ? Math.log10(y) : y);
  const toY = (y) => bottom - (height(y) - y0) / (y1 - y0) * (bottom - top);
  let found = [];
  for (const series of panel.series) {
    let best = null, least = Infinity;
    for (const [x, y] of series.points) {
      const away = Math.hypot(toX(x) - px, panel.nearest ? toY(y) - py : 0);
      if (away < least) { least = away; best = [x, y]; }
    }
    if (best) found.push({ series, point: best, away: least });
  }
  if (panel.nearest && found.length) found = [found.reduce((a, b) => (a.away <= b.away ? a : b))];
  if (!found.length) { box.style.display = "none"; return; }
  for (const { series, point } of found) {
    const mark = document.createElementNS(NS, "circle");
    mark.setAttribute("cx", toX(point[0]));
    mark.setAttribute("cy", toY(point[1]));
    mark.setAttribute("r", 4);
    mark.setAttribute("fill", series.colour);
    marks.appendChild(mark);
  }
  const lines = [`${panel.x}: ${number(found[0].point[0])}`];
  for (const { series, point } of found) lines.push(`${series.name}, ${panel.y}: ${number(point[1])}`);
  box.textContent = lines.join("\n");
  box.style.display = "block";
  box.style.left = `${px + 14 + box.offsetWidth > bounds.width ? px - 14 - box.offsetWidth : px + 14}px`;
  box.style.top = `${py + 14}px`;
});
