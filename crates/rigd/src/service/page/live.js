// The live page: asks for state and new TE points, draws them. Everything comes from this host; nothing is loaded from elsewhere.
"use strict";
const PERIOD_MS = 400;
const STALE_S = 3;
const KEPT = 8000;
const ARCSEC = 180 * 3600 / Math.PI;
const at = id => document.getElementById(id);
let token = "";
let next = 0;
let log = null;
let points = [];

async function ask(path, method = "GET") {
  const headers = token ? { Authorization: "Bearer " + token } : {};
  const answer = await fetch(path, { method, headers, cache: "no-store" });
  const body = await answer.json().catch(() => ({}));
  if (!answer.ok) {
    const error = new Error(body.error || answer.statusText);
    error.status = answer.status;
    throw error;
  }
  return body;
}

function banner(text, kind) {
  at("banner").textContent = text;
  at("banner").className = kind;
}

function number(value, digits, unit) {
  return value === null || value === undefined || !isFinite(value) ? "–" : value.toFixed(digits).replace("-", "−") + (unit ? " " + unit : "");
}

function tile(name, text, kind = "") {
  const box = document.createElement("div");
  box.className = "tile " + kind;
  const value = document.createElement("b");
  value.textContent = text;
  value.title = text;
  const label = document.createElement("span");
  label.textContent = name;
  box.append(value, label);
  return box;
}

function show(status) {
  const s = status.state;
  const tiles = [];
  if (s) {
    const lost = s.samples_lost;
    tiles.push(
      tile("phase", s.phase.toLowerCase() + (s.direction ? ", " + s.direction : "")),
      tile("driver, set " + number(s.speed_setpoint_rpm, 1, "rpm"), number(s.speed_rpm, 2, "rpm")),
      tile("load, set " + number(s.load_setpoint_nm, 1, "N·m"), number(s.load_nm, 2, "N·m")),
      tile("brake coil", number(s.brake_current_a, 3, "A")),
      tile("brake temperature", number(s.brake_temperature_c, 1, "°C")),
      tile("samples lost", String(lost), lost ? "bad" : "good"),
      tile("samples", Number(status.samples).toLocaleString("en")),
    );
    if (s.servo_alarm) tiles.push(tile("servo alarm", "0x" + s.servo_alarm.toString(16).padStart(4, "0"), "bad"));
  }
  const te = status.te;
  if (te) tiles.push(tile("latest TE − model", number((te.te_rad - te.model_te_rad) * ARCSEC, 1, "″")), tile("revolution", String(te.revolution + 1)));
  tiles.push(tile("disk free", status.free_mb === null ? "–" : number(status.free_mb / 1000, 1, "GB")));
  if (status.plan) tiles.push(tile("plan " + status.plan.plan, status.plan.exit_code === null ? "running" : "exit " + status.plan.exit_code));
  at("tiles").replaceChildren(...tiles);

  const run = status.run || {};
  const what = status.log ? status.log + (run.operator ? ", " + run.operator : "") + (run.backend === "sim" ? " · SIMULATED" : "") : "";
  if (!status.log) banner("no log yet", "warn");
  else if (status.trouble) banner(status.trouble, "bad");
  else if (status.ended) banner("ended: " + what, "");
  else if (status.age_s > STALE_S) banner("NO NEW DATA for " + Math.round(status.age_s) + " s: " + what, "bad");
  else banner("live: " + what, "good");

  at("events").replaceChildren(...status.events.map(event => {
    const item = document.createElement("li");
    item.className = event.level >= 4 ? "error" : event.level === 3 ? "warning" : "";
    const time = document.createElement("time");
    time.textContent = new Date(event.time_unix_ns / 1e6).toISOString().slice(11, 19);
    const name = document.createElement("em");
    name.textContent = event.name;
    const text = document.createElement("span");
    text.textContent = event.message;
    item.append(time, name, text);
    return item;
  }));
  at("control").hidden = !status.control;
}

// Round steps of an axis: 1, 2 or 5 times a power of ten.
function steps(low, high, wanted) {
  const raw = (high - low) / wanted;
  const power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = [1, 2, 5, 10].map(m => m * power).find(s => s >= raw);
  const list = [];
  for (let v = Math.ceil(low / step) * step; v <= high + 1e-9 * step; v += step) list.push(v);
  return list;
}

// Curves over the driver's angle: every revolution faint, the current one strong, and where there is one, the model dashed above.
function plot(canvas, of, model) {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const c = canvas.getContext("2d");
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, width, height);
  if (!points.length) return;
  const style = getComputedStyle(document.documentElement);
  const colour = name => style.getPropertyValue("--" + name).trim();
  let low = Infinity, high = -Infinity;
  for (const p of points) {
    for (const v of model ? [of(p), model(p)] : [of(p)]) { low = Math.min(low, v); high = Math.max(high, v); }
  }
  const margin = Math.max((high - low) * 0.06, 0.5);
  low -= margin; high += margin;
  const [left, right, top, bottom] = [62, 22, 8, 26];
  const x = angle => left + angle / (2 * Math.PI) * (width - left - right);
  const y = arcsec => top + (high - arcsec) / (high - low) * (height - top - bottom);
  c.font = "12px system-ui, sans-serif";
  c.fillStyle = colour("soft");
  c.strokeStyle = colour("line");
  c.lineWidth = 1;
  c.textAlign = "right"; c.textBaseline = "middle";
  for (const v of steps(low, high, height > 250 ? 6 : 4)) {
    c.beginPath(); c.moveTo(left, y(v)); c.lineTo(width - right, y(v)); c.stroke();
    c.fillText(String(Math.round(v * 100) / 100).replace("-", "−"), left - 6, y(v));
  }
  c.textAlign = "center"; c.textBaseline = "top";
  for (let degrees = 0; degrees <= 360; degrees += 60) {
    const px = x(degrees * Math.PI / 180);
    c.beginPath(); c.moveTo(px, top); c.lineTo(px, height - bottom); c.stroke();
    c.fillText(degrees + "°", px, height - bottom + 6);
  }
  c.save(); c.translate(12, (height - bottom) / 2); c.rotate(-Math.PI / 2); c.textBaseline = "middle"; c.fillText("arcsec", 0, 0); c.restore();

  const line = (list, value, dash, alpha, thick) => {
    c.setLineDash(dash); c.globalAlpha = alpha; c.lineWidth = thick;
    c.beginPath();
    let before = null;
    for (const p of list) {
      const joined = before && Math.abs(p.angle - before.angle) < 0.1 && p.revolution === before.revolution && p.load === before.load;
      if (joined) c.lineTo(x(p.angle), y(value(p))); else c.moveTo(x(p.angle), y(value(p)));
      before = p;
    }
    c.stroke();
    c.setLineDash([]); c.globalAlpha = 1;
  };
  for (const [sense, name] of [[1, "ccw"], [-1, "cw"]]) {
    const own = points.filter(p => p.sense === sense);
    if (!own.length) continue;
    const last = own[own.length - 1];
    const current = own.filter(p => p.revolution === last.revolution && p.load === last.load);
    c.strokeStyle = colour(name);
    line(own, of, [], 0.3, 1);
    line(current, of, [], 1, 1.8);
    c.strokeStyle = colour("ink");
    if (model) line(current, model, [2, 6], 0.8, 1);
  }
  const pen = points[points.length - 1];
  c.fillStyle = colour(pen.sense > 0 ? "ccw" : "cw");
  c.beginPath(); c.arc(x(pen.angle), y(of(pen)), 4, 0, 7); c.fill();
}

function draw() {
  at("te-note").hidden = points.length > 0;
  plot(at("te"), p => p.te * ARCSEC, p => p.model * ARCSEC);
  // The zero of TE is the mounting's own: each sense and load by itself is looked at about its mean.
  const means = new Map();
  const key = p => p.sense + " " + p.load;
  for (const p of points) {
    const sum = means.get(key(p)) || [0, 0];
    means.set(key(p), [sum[0] + p.te - p.model, sum[1] + 1]);
  }
  plot(at("gap"), p => (p.te - p.model - means.get(key(p))[0] / means.get(key(p))[1]) * ARCSEC, null);
}

async function step() {
  try {
    const status = await ask("api/status");
    at("token-form").hidden = !status.control || token !== "";
    show(status);
    const te = await ask("api/te?since=" + next);
    if (te.log !== log || te.next < next) { points = []; log = te.log; }
    next = te.next;
    for (const [angle, value, model, sense, revolution, load] of te.points) points.push({ angle, te: value, model, sense, revolution, load: Math.round(load) });
    if (points.length > KEPT) points.splice(0, points.length - KEPT);
    draw();
  } catch (error) {
    if (error.status === 401) { at("token-form").hidden = false; token = ""; banner(error.message, "warn"); }
    else banner("service does not answer: " + error.message, "bad");
  }
  setTimeout(step, document.hidden ? 5 * PERIOD_MS : PERIOD_MS);
}

async function wish(path) {
  try {
    const told = await ask(path, "POST");
    banner(JSON.stringify(told), "warn");
  } catch (error) {
    if (error.status === 401) { at("token-form").hidden = false; token = ""; }
    banner(error.message, "bad");
  }
}

at("legend").innerHTML = "<span class=ccw>━</span><i>ccw</i><span class=cw>━</span><i>cw</i>┄<i>model</i>";
at("token-form").addEventListener("submit", event => { event.preventDefault(); token = at("token").value.trim(); at("token").value = ""; });
at("pause").addEventListener("click", () => wish("api/pause"));
at("stop").addEventListener("click", () => { if (confirm("Stop the run? The shafts ramp down and the log is ended.")) wish("api/stop"); });
window.addEventListener("resize", draw);
step();
