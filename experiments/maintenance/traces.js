"use strict";
// Traces over distance: one canvas a quantity and band, all with the same stretch of track.
const chart = JSON.parse(document.getElementById("traces").textContent);
const along = JSON.parse(document.getElementById("along").textContent), kilometre = s => along.zero + along.slope * s;
const charts = document.getElementById("charts"), readout = document.getElementById("readout"), which = document.getElementById("which");
const HEIGHT = 150, LEFT = 52, RIGHT = 10, TOP = 16, BOTTOM = 20, GONE = -32768;
const LIMIT_COLOURS = ["#e0a800", "#e8590c", "#c1121f"], LIMIT_NAMES = ["alert", "intervention", "immediate action"];
const EARLIER_COLOURS = ["#8d99ae", "#b08968", "#90a955", "#b388eb"];

function unpacked(text) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  const view = new DataView(bytes.buffer), numbers = new Int16Array(bytes.length / 2);
  for (let i = 0; i < numbers.length; i++) numbers[i] = view.getInt16(2 * i, true);
  return numbers;
}
for (const one of chart) {
  one.numbers = unpacked(one.values);
  one.deviations = one.errors ? unpacked(one.errors) : null;
  one.before = one.earlier.map(unpacked);
  one.end = one["start [m]"] + one["cell [m]"] * one.numbers.length;
  let most = 0;
  for (const list of [one.numbers, ...one.before]) for (const value of list) if (value !== GONE) most = Math.max(most, Math.abs(value));
  one.most = Math.max(most * one.step, 0.1);
}
const extent = {from: Math.min(...chart.map(one => one["start [m]"])), to: Math.max(...chart.map(one => one.end))};
let range = {...extent}, pointed = null, chartMarks = [];

function ticks(low, high, about) {
  const raw = (high - low) / about, power = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 5, 10].map(n => n * power).find(n => n >= raw), list = [];
  for (let at = Math.ceil(low / step) * step; at <= high + 1e-9; at += step) list.push(at);
  return {list, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9))};
}
function cellAt(one, s) { return Math.floor((s - one["start [m]"]) / one["cell [m]"]); }

function draw(one) {
  const canvas = one.canvas, width = canvas.clientWidth, ratio = devicePixelRatio || 1;
  if (!width) return;
  canvas.width = width * ratio; canvas.height = HEIGHT * ratio;
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, HEIGHT);
  pen.font = "11px system-ui, sans-serif";
  const inner = width - LEFT - RIGHT, x = s => LEFT + (s - range.from) / (range.to - range.from) * inner;
  const first = Math.max(0, cellAt(one, range.from)), last = Math.min(one.numbers.length - 1, cellAt(one, range.to) + 1);
  let top = 0;
  for (let i = first; i <= last; i++) {
    if (one.numbers[i] !== GONE) top = Math.max(top, Math.abs(one.numbers[i]) * one.step);
    if (one.deviations && one.deviations[i] !== GONE && one.numbers[i] !== GONE) top = Math.max(top, (Math.abs(one.numbers[i]) + 2 * one.deviations[i]) * one.step);
    for (const list of one.before) if (list[i] !== GONE && list[i] !== undefined) top = Math.max(top, Math.abs(list[i]) * one.step);
  }
  top = 1.1 * Math.max(top, 0.02 * one.most);
  const y = v => TOP + (1 - (v / top + 1) / 2) * (HEIGHT - TOP - BOTTOM);
  axes(pen, one, width, x, y, top);
  pen.save();
  pen.beginPath(); pen.rect(LEFT, TOP, inner, HEIGHT - TOP - BOTTOM); pen.clip();
  limits(pen, one, x, y, top);
  if (one.deviations) band(pen, one, x, y, first, last, inner);
  one.before.forEach((list, n) => line(pen, one, list, EARLIER_COLOURS[n % EARLIER_COLOURS.length], 1, x, y, first, last, inner));
  line(pen, one, one.numbers, "#1d3557", 1.3, x, y, first, last, inner);
  for (const s of chartMarks) { pen.strokeStyle = "#c1121f88"; pen.setLineDash([2, 3]); stroke(pen, [[x(s), TOP], [x(s), HEIGHT]]); pen.setLineDash([]); }
  if (pointed !== null) { pen.strokeStyle = "#0006"; pen.lineWidth = 1; stroke(pen, [[x(pointed), TOP], [x(pointed), HEIGHT - BOTTOM]]); }
  pen.restore();
}
function stroke(pen, places) { pen.beginPath(); places.forEach((p, n) => n ? pen.lineTo(...p) : pen.moveTo(...p)); pen.stroke(); }
function axes(pen, one, width, x, y, top) {
  pen.fillStyle = "#333"; pen.strokeStyle = "#e4e6e8"; pen.lineWidth = 1;
  pen.textAlign = "center"; pen.textBaseline = "top";
  const ends = [kilometre(range.from), kilometre(range.to)], across = ticks(Math.min(...ends), Math.max(...ends), Math.max(2, width / 110));
  for (const km of across.list) { const at = x((km - along.zero) / along.slope); stroke(pen, [[at, TOP], [at, HEIGHT - BOTTOM]]); pen.fillText(km.toFixed(across.digits), at, HEIGHT - BOTTOM + 4); }
  pen.textAlign = "right"; pen.textBaseline = "middle";
  const up = ticks(-top, top, 6);
  for (const v of up.list) { stroke(pen, [[LEFT, y(v)], [width - RIGHT, y(v)]]); pen.fillText(v.toFixed(up.digits), LEFT - 5, y(v)); }
  pen.textAlign = "left"; pen.textBaseline = "top"; pen.font = "bold 12px system-ui, sans-serif";
  pen.fillText(one.name + ", " + one.unit, LEFT + 2, 1);
  pen.font = "11px system-ui, sans-serif"; pen.textAlign = "right";
  pen.fillText("km", width - RIGHT, 1);
}
function limits(pen, one, x, y, top) {
  (one.limits || []).forEach((row, n, all) => {
    const to = n + 1 < all.length ? all[n + 1][0] : one.end;
    row.slice(1).forEach((size, level) => {
      if (size === null || size > top) return;
      pen.strokeStyle = LIMIT_COLOURS[level]; pen.lineWidth = 1;
      for (const sign of [-1, 1]) stroke(pen, [[x(row[0]), y(sign * size)], [x(to), y(sign * size)]]);
    });
  });
}
// Where several cells share a pixel, the lowest and the highest of them are drawn.
function columns(list, one, x, first, last, inner, visit) {
  const cells = (range.to - range.from) / one["cell [m]"] / inner;
  if (cells <= 1) {
    for (let i = first; i <= last; i++) visit(x(one["start [m]"] + (i + 0.5) * one["cell [m]"]), list[i], list[i], i);
    return;
  }
  for (let pixel = 0, begin = first; pixel <= inner && begin <= last; pixel++) {
    const end = Math.min(last + 1, Math.max(begin + 1, cellAt(one, range.from + (pixel + 1) / inner * (range.to - range.from))));
    let low = Infinity, high = -Infinity;
    for (let i = begin; i < end; i++) if (list[i] !== GONE) { low = Math.min(low, list[i]); high = Math.max(high, list[i]); }
    visit(x(one["start [m]"] + (begin + 0.5) * one["cell [m]"]), low === Infinity ? GONE : low, low === Infinity ? GONE : high, begin);
    begin = end;
  }
}
function line(pen, one, list, colour, weight, x, y, first, last, inner) {
  pen.strokeStyle = colour; pen.lineWidth = weight;
  pen.beginPath();
  let drawn = false;
  columns(list, one, x, first, last, inner, (at, low, high) => {
    if (low === GONE || low === undefined) { drawn = false; return; }
    if (drawn) pen.lineTo(at, y(low * one.step)); else pen.moveTo(at, y(low * one.step));
    if (high !== low) pen.lineTo(at, y(high * one.step));
    drawn = true;
  });
  pen.stroke();
}
function band(pen, one, x, y, first, last, inner) {
  pen.fillStyle = "#457b9d40";
  let upper = [], lower = [];
  const fill = () => {
    if (upper.length > 1) { pen.beginPath(); [...upper, ...lower.reverse()].forEach((p, n) => n ? pen.lineTo(...p) : pen.moveTo(...p)); pen.fill(); }
    upper = []; lower = [];
  };
  columns(one.numbers, one, x, first, last, inner, (at, low, high, cell) => {
    const deviation = one.deviations[cell];
    if (low === GONE || deviation === GONE) { fill(); return; }
    upper.push([at, y((high + 2 * deviation) * one.step)]);
    lower.push([at, y((low - 2 * deviation) * one.step)]);
  });
  fill();
}
function drawAll() { for (const one of chart) if (!one.canvas.hidden) draw(one); }
function reach(from, to) {
  const least = 5, whole = extent.to - extent.from, width = Math.min(Math.max(to - from, Math.min(least, whole)), whole);
  from = Math.min(Math.max(from, extent.from), extent.to - width);
  range = {from: from, to: from + width};
  document.getElementById("stretch").textContent = "km " + kilometre(range.from).toFixed(3) + " to " + kilometre(range.to).toFixed(3);
  drawAll();
}
function goTo(s, width) { chartMarks = [s]; reach(s - width / 2, s + width / 2); }

function under(event) { return range.from + (event.offsetX - LEFT) / (event.target.clientWidth - LEFT - RIGHT) * (range.to - range.from); }
function tellAt(s) {
  const parts = ["km " + kilometre(s).toFixed(4)];
  for (const one of chart) {
    if (one.canvas.hidden) continue;
    const cell = cellAt(one, s), value = one.numbers[cell];
    if (value === undefined || value === GONE) continue;
    const deviation = one.deviations ? one.deviations[cell] : GONE;
    let text = one.name + " " + (value * one.step).toFixed(2) + (deviation === GONE ? "" : " ± " + (2 * deviation * one.step).toFixed(2)) + " " + one.unit;
    one.before.forEach(list => { if (list[cell] !== GONE) text += ", before " + (list[cell] * one.step).toFixed(2); });
    parts.push(text);
  }
  readout.textContent = parts.join(" | ");
}
let grabbed = null;
for (const one of chart) {
  const canvas = document.createElement("canvas");
  canvas.height = HEIGHT; canvas.className = "trace"; canvas.setAttribute("role", "img"); canvas.setAttribute("aria-label", one.name + " over distance");
  one.canvas = canvas;
  charts.appendChild(canvas);
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    const at = under(event), factor = event.deltaY > 0 ? 1.25 : 0.8;
    reach(at - (at - range.from) * factor, at + (range.to - at) * factor);
  }, {passive: false});
  canvas.addEventListener("pointerdown", event => { grabbed = {at: event.clientX, from: range.from}; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointermove", event => {
    pointed = under(event);
    if (grabbed && event.buttons) {
      const moved = (event.clientX - grabbed.at) / (canvas.clientWidth - LEFT - RIGHT) * (range.to - range.from);
      reach(grabbed.from - moved, grabbed.from - moved + (range.to - range.from));
    } else drawAll();
    tellAt(pointed);
  });
  canvas.addEventListener("pointerup", () => { grabbed = null; });
  canvas.addEventListener("pointerleave", () => { pointed = null; drawAll(); });
  canvas.addEventListener("dblclick", () => reach(extent.from, extent.to));
  const label = document.createElement("label"), box = document.createElement("input");
  box.type = "checkbox";
  box.checked = one.shown;
  canvas.hidden = !one.shown;
  box.onchange = () => { canvas.hidden = !box.checked; drawAll(); };
  label.append(box, " " + one.name);
  which.appendChild(label);
}
const key = document.getElementById("key");
const entries = [["#1d3557", "latest pass"], ["#457b9d66", "two stated deviations"]];
Math.max(...chart.map(one => one.before.length)) > 0 && chart.reduce((a, b) => a.before.length > b.before.length ? a : b).before.forEach((_, n) => entries.push([EARLIER_COLOURS[n % EARLIER_COLOURS.length], "earlier pass " + (n + 1)]));
if (chart.some(one => one.limits)) LIMIT_NAMES.forEach((name, n) => entries.push([LIMIT_COLOURS[n], name + " limit"]));
for (const [colour, text] of entries) {
  const mark = document.createElement("span"), word = document.createElement("span");
  mark.className = "mark"; mark.style.background = colour; word.textContent = text;
  key.append(mark, word);
}
document.getElementById("reset").onclick = () => { chartMarks = []; reach(extent.from, extent.to); };
addEventListener("resize", drawAll);
reach(extent.from, extent.to);
document.body.dataset.drawn = String(chart.length);
