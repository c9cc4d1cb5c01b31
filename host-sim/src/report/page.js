"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);

  // Headline table: the same cells in another measure.
  const counts = ["diverged", "rejected", "restarted", "not_tracked", "outside"];
  const text = (value, measure) => {
    if (value === null) return "-";
    if (measure === "coverage90") return (100 * value).toFixed(1) + "%";
    if (counts.includes(measure)) return String(value);
    const size = Math.abs(value);
    if (size !== 0 && (size < 0.01 || size >= 1e4)) return value.toExponential(2);
    return size < 10 ? value.toFixed(3) : value.toFixed(size < 100 ? 2 : 1);
  };
  // How far a value is from the best that it could be.
  const distance = {
    ed_mean_m: v => v, ed_median_m: v => v,
    nees_mean: v => Math.abs(Math.log(v / 3)), d_mean: v => Math.abs(Math.log(v / 1.596)),
    coverage90: v => Math.abs(v - 0.9), nll: v => v, det_p_median_m6: () => 0,
  };
  const show = measure => {
    for (const button of document.querySelectorAll("#measures button")) {
      button.setAttribute("aria-pressed", String(button.dataset.measure === measure));
    }
    const columns = new Map();
    for (const cell of document.querySelectorAll("td[data-cell]")) {
      const own = data.cells[Number(cell.dataset.cell)];
      // Zero is not what a method says that does not know where it was trained.
      const value = measure === "outside" && !own.knows_outside ? null : own[measure];
      cell.textContent = text(value, measure);
      cell.classList.remove("best");
      cell.classList.toggle("tie", measure === "ed_mean_m" && cell.dataset.tie === "1");
      const column = columns.get(cell.dataset.column) || [];
      // Of a flight that was never tracked every number is an estimate's that was held.
      const tracked = own.not_tracked < own.steps;
      if (value !== null && tracked && measure in distance) column.push([distance[measure](value), cell]);
      columns.set(cell.dataset.column, column);
    }
    for (const cell of document.querySelectorAll("td[data-floor]")) {
      cell.textContent = measure === "ed_mean_m" ? cell.dataset.floor : "";
    }
    if (measure === "det_p_median_m6" || counts.includes(measure)) return;
    for (const column of columns.values()) {
      const best = Math.min(...column.map(([d]) => d));
      for (const [d, cell] of column) if (d === best) cell.classList.add("best");
    }
  };
  for (const button of document.querySelectorAll("#measures button")) {
    button.addEventListener("click", () => show(button.dataset.measure));
  }

  // 3-D view: orthographic, turned about the vertical (yaw) and tilted (pitch), radians.
  const canvas = document.getElementById("view");
  const pen = canvas.getContext("2d");
  const select = document.getElementById("flight");
  const toggles = document.getElementById("toggles");
  const play = document.getElementById("play");
  const withRadar = document.getElementById("radar");
  const state = { yaw: 0, pitch: 0, zoom: 1, flight: 0, until: 1, wide: false, hidden: new Set() };
  const night = window.matchMedia("(prefers-color-scheme: dark)");
  const ink = name => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
  data.examples.forEach((example, index) => select.append(new Option(example.title, index)));
  const tracks = data.examples.length ? data.examples[0].tracks : [];
  for (const { method, symbol, shown } of [{ method: "readings", shown: false }, ...tracks]) {
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = shown;
    if (!shown) state.hidden.add(method);
    box.addEventListener("change", () => {
      if (box.checked) state.hidden.delete(method); else state.hidden.add(method);
      draw();
    });
    label.append(box);
    if (symbol) {
      const space = "http://www.w3.org/2000/svg";
      const swatch = document.createElementNS(space, "svg");
      swatch.setAttribute("class", "swatch");
      const use = document.createElementNS(space, "use");
      use.setAttribute("href", "#" + symbol);
      swatch.append(use);
      label.append(swatch);
    }
    label.append(method);
    toggles.append(label);
  }

  const reach = example => {
    let most = 1;
    for (const [x, y, z] of example.truth) most = Math.max(most, Math.hypot(x, y), z);
    return most;
  };
  // What the view holds, and its middle, which turns do not move: the flight, or the radar and the flight's shadow too.
  const corners = example => state.wide
    ? [[0, 0, 0], ...example.truth, ...example.truth.map(([x, y]) => [x, y, 0])] : example.truth;
  const middle = example => [0, 1, 2].map(axis => {
    const values = corners(example).map(point => point[axis]);
    return (Math.min(...values) + Math.max(...values)) / 2;
  });
  const project = ([x, y, z]) => {
    const [sy, cy, sp, cp] = [Math.sin(state.yaw), Math.cos(state.yaw), Math.sin(state.pitch), Math.cos(state.pitch)];
    return [cy * x - sy * y, cp * z + sp * (sy * x + cy * y)];
  };
  // Looks across the line from the radar to the flight: the canvas is wide.
  const home = () => {
    const example = data.examples[state.flight];
    if (!example) return;
    const [x, y] = middle(example);
    state.yaw = 0.3 - Math.atan2(y, x);
    state.pitch = 0.45;
    state.zoom = 1;
    const centre = project(middle(example));
    state.half = [0, 1].map(axis => Math.max(1, ...corners(example).map(point => Math.abs(project(point)[axis] - centre[axis]))));
  };
  const draw = () => {
    const example = data.examples[state.flight];
    const ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    if (!example) return;
    const far = reach(example);
    const scale = 0.4 * Math.min(width / state.half[0], height / state.half[1]) * state.zoom;
    const centre = project(middle(example));
    const at = point => {
      const [across, up] = project(point);
      return [width / 2 + scale * (across - centre[0]), height / 2 - scale * (up - centre[1])];
    };
    const path = (points, colour, thick, dash) => {
      pen.beginPath();
      points.forEach((point, index) => {
        const [x, y] = at(point);
        if (index) pen.lineTo(x, y); else pen.moveTo(x, y);
      });
      pen.strokeStyle = colour;
      pen.lineWidth = thick;
      pen.setLineDash(dash || []);
      pen.stroke();
      pen.setLineDash([]);
    };
    // Words are written last, inside the view, with a rim, and where no other is.
    const words = [];
    const say = (name, x, y, weight) => words.push({ name, x, y, weight });
    const write = () => {
      const taken = [];
      pen.lineWidth = 3;
      pen.lineJoin = "round";
      pen.strokeStyle = ink("soft");
      for (const word of words.sort((a, b) => b.weight - a.weight)) {
        const wide = pen.measureText(word.name).width;
        const x = Math.min(width - 4 - wide, Math.max(4, word.x)), y = Math.min(height - 4, Math.max(14, word.y));
        if (taken.some(([left, top, right]) => x < right + 3 && x + wide > left - 3 && Math.abs(y - top) < 14)) continue;
        taken.push([x, y, x + wide]);
        pen.fillStyle = ink(word.weight > 2 ? "ink" : "faint");
        pen.strokeText(word.name, x, y);
        pen.fillText(word.name, x, y);
      }
    };
    // Ground: rings around the radar.
    const step = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000].find(m => far / m <= 4) || far;
    pen.font = "12px Helvetica, Arial, sans-serif";
    pen.fillStyle = ink("faint");
    for (let radius = step; radius <= 1.05 * far; radius += step) {
      const ring = [];
      for (let i = 0; i <= 72; i++) ring.push([radius * Math.cos(i * Math.PI / 36), radius * Math.sin(i * Math.PI / 36), 0]);
      path(ring, ink("ring"), 1);
      // Named where the ring comes nearest to the viewer on the flight's side.
      const turn = Math.atan2(middle(example)[1], middle(example)[0]) - 0.5;
      const [x, y] = at([radius * Math.cos(turn), radius * Math.sin(turn), 0]);
      if (x > 0 && x < width && y > 0 && y < height) say(radius + " m", x + 4, y - 4, 0);
    }
    // The directions, in a corner that is always in view.
    const [cx, cy] = [width - 64, 52];
    for (const [end, name] of [[[1, 0, 0], "x east"], [[0, 1, 0], "y north"], [[0, 0, 1], "z up"]]) {
      const [across, up] = project(end);
      const [x, y] = [cx + 34 * across, cy - 34 * up];
      pen.beginPath();
      pen.moveTo(cx, cy);
      pen.lineTo(x, y);
      pen.strokeStyle = ink("faint");
      pen.lineWidth = 1.2;
      pen.stroke();
      say(name, x + (across < 0 ? -4 - pen.measureText(name).width : 4), y + (up < 0 ? 12 : 0), 1);
    }
    const [x0, y0] = at([0, 0, 0]);
    if (x0 > 0 && x0 < width && y0 > 0 && y0 < height) {
      pen.fillRect(x0 - 4, y0 - 4, 8, 8);
      say("radar", x0 + 8, y0 + 14, 3);
    } else {
      // An arrow at the edge: its tip lies towards the radar.
      const [dx, dy] = [x0 - width / 2, y0 - height / 2];
      const part = Math.min((width / 2 - 12) / Math.abs(dx), (height / 2 - 12) / Math.abs(dy));
      const [tx, ty, turned] = [width / 2 + part * dx, height / 2 + part * dy, Math.atan2(dy, dx)];
      pen.beginPath();
      for (const [away, aside] of [[0, 0], [-14, 6], [-14, -6]]) {
        pen.lineTo(tx + away * Math.cos(turned) - aside * Math.sin(turned), ty + away * Math.sin(turned) + aside * Math.cos(turned));
      }
      pen.fill();
      say("radar", tx + (dx > 0 ? -22 - pen.measureText("radar").width : 22), ty + (dy > 0 ? -12 : 18), 3);
    }
    // A length to compare with, at right angles to the line of sight, on the side where the radar is not.
    const bar = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000].find(m => m * scale >= 60) || 2000;
    const left = x0 < width / 2 ? width - 16 - bar * scale : 16;
    pen.fillStyle = ink("faint");
    pen.fillRect(left, height - 18, bar * scale, 2);
    say(bar + " m", left, height - 24, 2);
    // Shadow of the truth on the ground and a few plumb lines give depth.
    const count = Math.max(2, Math.round(state.until * example.truth.length));
    const truth = example.truth.slice(0, count);
    path(truth.map(([x, y]) => [x, y, 0]), ink("rule"), 1, [3, 3]);
    for (let i = 0; i < truth.length; i += 15) path([truth[i], [truth[i][0], truth[i][1], 0]], ink("line"), 1);
    if (!state.hidden.has("readings")) {
      pen.fillStyle = ink("dot");
      for (const [index, point] of example.readings) {
        if (index >= count) break;
        const [x, y] = at(point);
        pen.fillRect(x - 1.5, y - 1.5, 3, 3);
      }
    }
    path(truth, ink("truth"), 7);
    for (const track of example.tracks) {
      const points = track.points.slice(0, count - 1);
      if (state.hidden.has(track.method) || !points.length) continue;
      const colour = night.matches ? track.night : track.colour;
      path(points, colour, 1.6, track.dash);
      // Its marker where it is now, as in the figures.
      pen.save();
      pen.translate(...at(points[points.length - 1]));
      const marker = new Path2D(track.marker);
      pen.fillStyle = track.hollow ? ink("soft") : colour;
      pen.strokeStyle = track.hollow ? colour : ink("soft");
      pen.lineWidth = track.hollow ? 1.6 : 1;
      pen.fill(marker);
      pen.stroke(marker);
      pen.restore();
    }
    const [x, y] = at(truth[0]);
    pen.beginPath();
    pen.arc(x, y, 5, 0, 2 * Math.PI);
    pen.strokeStyle = ink("ink");
    pen.lineWidth = 1.6;
    pen.stroke();
    say("start", x + 8, y - 8, 4);
    write();
    canvas.dataset.drawn = String(Number(canvas.dataset.drawn || 0) + 1);
  };

  const turn = (yaw, pitch) => {
    state.yaw += yaw;
    state.pitch = Math.min(1.5, Math.max(0.02, state.pitch + pitch));
    canvas.dataset.yaw = state.yaw.toFixed(4);
    draw();
  };
  const zoom = factor => {
    state.zoom = Math.min(12, Math.max(0.3, state.zoom * factor));
    draw();
  };
  let last = null;
  canvas.addEventListener("pointerdown", event => {
    last = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", event => {
    if (!last) return;
    turn((event.clientX - last[0]) * 0.008, (event.clientY - last[1]) * 0.008);
    last = [event.clientX, event.clientY];
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, () => { last = null; });
  canvas.addEventListener("wheel", event => {
    // Who only scrolls past goes on scrolling.
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    zoom(Math.exp(-0.0012 * event.deltaY));
  }, { passive: false });
  canvas.addEventListener("keydown", event => {
    const keys = {
      ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, -0.1),
      ArrowDown: () => turn(0, 0.1), "+": () => zoom(1.15), "-": () => zoom(1 / 1.15),
    };
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });
  select.addEventListener("change", () => {
    state.flight = Number(select.value);
    home();
    draw();
  });
  let timer = null;
  const stop = () => {
    clearInterval(timer);
    timer = null;
    play.setAttribute("aria-pressed", "false");
  };
  play.addEventListener("click", () => {
    if (timer) {
      stop();
      state.until = 1;
      draw();
      return;
    }
    play.setAttribute("aria-pressed", "true");
    state.until = 0;
    timer = setInterval(() => {
      state.until = Math.min(1, state.until + 0.005);
      draw();
      if (state.until === 1) stop();
    }, 33);
  });
  canvas.addEventListener("dblclick", () => {
    home();
    draw();
  });
  withRadar.addEventListener("click", () => {
    state.wide = !state.wide;
    withRadar.setAttribute("aria-pressed", String(state.wide));
    home();
    draw();
  });
  night.addEventListener("change", draw);
  window.addEventListener("resize", draw);
  // Names of rows stay at a figure's left edge when it is scrolled sideways, as those of a table do. Heights do not: panels
  // beside have their own.
  for (const box of document.querySelectorAll("figure .scroll")) {
    const svg = box.querySelector("svg");
    const names = [...svg.querySelectorAll("text[text-anchor=end]:not([transform])")]
      .filter(text => Number(text.getAttribute("x")) < 150 && /^[a-z]/i.test(text.textContent));
    if (names.length === 0) continue;
    const [group, back] = ["g", "rect"].map(name => document.createElementNS(svg.namespaceURI, name));
    const { width, height } = svg.viewBox.baseVal;
    const edge = Math.max(...names.map(text => Number(text.getAttribute("x")))) + 6;
    const looks = { x: 0, y: 0, width: edge, height, fill: svg.querySelector("rect").getAttribute("fill"), visibility: "hidden" };
    for (const [name, value] of Object.entries(looks)) back.setAttribute(name, value);
    group.append(back, ...names);
    svg.append(group);
    const spare = Math.min(...names.map(text => text.getBBox().x)) - 6;
    box.addEventListener("scroll", () => {
      const along = Math.max(0, box.scrollLeft * width / svg.getBoundingClientRect().width - spare);
      group.setAttribute("transform", `translate(${along})`);
      back.setAttribute("visibility", along > 0 ? "visible" : "hidden");
    });
  }
  show("ed_mean_m");
  home();
  draw();
})();
