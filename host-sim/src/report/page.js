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
      const value = data.cells[Number(cell.dataset.cell)][measure];
      cell.textContent = text(value, measure);
      cell.classList.remove("best");
      cell.classList.toggle("tie", measure === "ed_mean_m" && cell.dataset.tie === "1");
      const column = columns.get(cell.dataset.column) || [];
      if (value !== null && measure in distance) column.push([distance[measure](value), cell]);
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
  const state = { yaw: 0, pitch: 0, zoom: 1, flight: 0, until: 1, hidden: new Set() };
  data.examples.forEach((example, index) => select.append(new Option(example.title, index)));
  const methods = data.examples.length ? data.examples[0].tracks.map(track => [track.method, track.colour]) : [];
  for (const [method, colour] of [["readings", "#9aa0a6"], ...methods]) {
    const label = document.createElement("label");
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = method !== "readings";
    if (!box.checked) state.hidden.add(method);
    box.addEventListener("change", () => {
      if (box.checked) state.hidden.delete(method); else state.hidden.add(method);
      draw();
    });
    const swatch = document.createElement("span");
    swatch.className = "swatch";
    swatch.style.background = colour;
    swatch.style.marginRight = "0";
    label.append(box, swatch, method);
    label.style.marginRight = "14px";
    toggles.append(label);
  }

  const reach = example => {
    let most = 1;
    for (const [x, y, z] of example.truth) most = Math.max(most, Math.hypot(x, y), z);
    return most;
  };
  // Radar, flight and its shadow: what the first view holds, and its middle, which turns do not move.
  const corners = example => [[0, 0, 0], ...example.truth, ...example.truth.map(([x, y]) => [x, y, 0])];
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
    state.half = [0, 1].map(axis => Math.max(...corners(example).map(point => Math.abs(project(point)[axis] - centre[axis]))));
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
    const scale = 0.42 * Math.min(width / state.half[0], height / state.half[1]) * state.zoom;
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
    // Ground: rings around the radar, and axes.
    const step = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000].find(m => far / m <= 4) || far;
    pen.font = "12px Helvetica, Arial, sans-serif";
    pen.fillStyle = "#5f6368";
    for (let radius = step; radius <= 1.05 * far; radius += step) {
      const ring = [];
      for (let i = 0; i <= 72; i++) ring.push([radius * Math.cos(i * Math.PI / 36), radius * Math.sin(i * Math.PI / 36), 0]);
      path(ring, "#cfd4da", 1);
      // Named where the ring comes nearest to the viewer on the flight's side.
      const turn = Math.atan2(middle(example)[1], middle(example)[0]) - 0.5;
      const [x, y] = at([radius * Math.cos(turn), radius * Math.sin(turn), 0]);
      pen.fillText(radius + " m", x + 4, y - 4);
    }
    const axis = 0.15 * far;
    for (const [end, name] of [[[axis, 0, 0], "x east"], [[0, axis, 0], "y north"], [[0, 0, axis], "z up"]]) {
      path([[0, 0, 0], end], "#8a9097", 1.2);
      const [x, y] = at(end);
      pen.fillText(name, x + 4, y);
    }
    const [x0, y0] = at([0, 0, 0]);
    pen.fillRect(x0 - 4, y0 - 4, 8, 8);
    // Shadow of the truth on the ground and a few plumb lines give depth.
    const count = Math.max(2, Math.round(state.until * example.truth.length));
    const truth = example.truth.slice(0, count);
    path(truth.map(([x, y]) => [x, y, 0]), "#b8bcc2", 1, [3, 3]);
    for (let i = 0; i < truth.length; i += 15) path([truth[i], [truth[i][0], truth[i][1], 0]], "#d8dce0", 1);
    if (!state.hidden.has("readings")) {
      pen.fillStyle = "#9aa0a6";
      for (const [index, point] of example.readings) {
        if (index >= count) break;
        const [x, y] = at(point);
        pen.fillRect(x - 1.5, y - 1.5, 3, 3);
      }
    }
    path(truth, "#c3c8ce", 7);
    for (const track of example.tracks) {
      if (!state.hidden.has(track.method)) path(track.points.slice(0, count - 1), track.colour, 1.4);
    }
    const [x, y] = at(truth[truth.length - 1]);
    pen.beginPath();
    pen.arc(x, y, 5, 0, 2 * Math.PI);
    pen.fillStyle = "#1a1a1a";
    pen.fill();
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
  window.addEventListener("resize", draw);
  show("ed_mean_m");
  home();
  draw();
})();
