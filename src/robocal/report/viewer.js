// Turns the pictures of space, as scene.js says; buttons zoom too, sliders set the length of arrows and the row at which the machine is shown.
(function () {
  "use strict";
  var holder = document.getElementById("arrow-data"), figure = document.getElementById("arrows");
  if (!holder || !figure) return;
  var data = JSON.parse(holder.textContent), controls = document.getElementById("arrow-controls");
  var WIDE = 460, HIGH = 440, n = scene.n, it = scene.state(data.view, -90, draw), boost = 1, same = false, shown = 0;
  var panels = data.panels.map(function (key, k) {
    var svg = figure.querySelector('svg[data-panel="' + key + '"]');
    var part = function (name) { return svg.querySelector('[data-part="' + name + '"]'); };
    return {svg: svg, errors: data[key], mag: data.mag[k], box: part("box"), sets: [part("0"), part("1")], bar: part("bar"),
      barText: part("bar-text"), magText: part("mag"), said: part("said"), name: part("said").textContent, names: svg.querySelectorAll(".axis-name"),
      here: part("here"),
      instruments: svg.querySelectorAll(".instrument-name")};
  });
  controls.hidden = false;

  function flat(f, x, y, z) {
    return [WIDE / 2 + it.zoom * (x * f[0] + y * f[1] + z * f[2]), HIGH / 2 - 14 - it.zoom * (x * f[3] + y * f[4] + z * f[5])];
  }
  function line(f, points) {
    return "M" + points.map(function (at) { return flat(f, at[0], at[1], at[2]).map(n).join(" "); }).join("L") + (points.length > 1 ? "" : "h0");
  }
  function arrow(f, p, e, s) {
    if (!e) return line(f, [p]);
    var u = flat(f, p[0], p[1], p[2]), v = flat(f, p[0] + s * e[0], p[1] + s * e[1], p[2] + s * e[2]);
    var dx = v[0] - u[0], dy = v[1] - u[1], long = Math.hypot(dx, dy);
    if (long < 1) return "M" + n(u[0]) + " " + n(u[1]) + "h0";
    var h = Math.min(5, long * 0.45) / long, bx = v[0] - dx * h, by = v[1] - dy * h, wx = dy * h / 2, wy = -dx * h / 2;
    var tip = n(v[0]) + " " + n(v[1]);
    return "M" + n(u[0]) + " " + n(u[1]) + "L" + tip + "M" + n(bx + wx) + " " + n(by + wy) + "L" + tip + "L" + n(bx - wx) + " " + n(by - wy);
  }
  function round(raw) {
    var power = Math.pow(10, Math.floor(Math.log10(raw)));
    return (raw >= 4.9999 * power ? 5 : raw >= 1.9999 * power ? 2 : 1) * power;
  }
  function draw() {
    var f = scene.axes(it.view), b = data.bounds;
    panels.forEach(function (p, k) {
      var mag = p.errors ? (same ? panels[0].mag : p.mag) * boost : 1, s = data.scale * mag, sets = ["", ""], box = "", corners = [], i, c;
      for (i = 0; i < data.at.length; i++) sets[data.out[i]] += arrow(f, data.at[i], p.errors && p.errors[i], s);
      p.sets[0].setAttribute("d", sets[0]);
      p.sets[1].setAttribute("d", sets[1]);
      for (i = 0; i < 8; i++) corners.push(flat(f, b[i & 1][0], b[i >> 1 & 1][1], b[i >> 2 & 1][2]));
      for (i = 0; i < 8; i++) for (c = 0; c < 3; c++) if (!(i >> c & 1)) {
        box += "M" + n(corners[i][0]) + " " + n(corners[i][1]) + "L" + n(corners[i | 1 << c][0]) + " " + n(corners[i | 1 << c][1]);
      }
      p.box.setAttribute("d", box);
      for (c = 0; c < 3; c++) {
        var best = -Infinity, from, to;
        for (i = 0; i < 8; i++) if (!(i >> c & 1)) {
          var q = corners[i], r = corners[i | 1 << c], x = (q[0] + r[0] - WIDE) / 2, y = (q[1] + r[1] - HIGH) / 2 + 14;
          var far = Math.hypot(x, y) + 0.05 * y;
          if (far > best) { best = far; from = q; to = r; }
        }
        var long = Math.hypot(to[0] - from[0], to[1] - from[1]) || 1;
        p.names[c].setAttribute("x", n(to[0] + 11 * (to[0] - from[0]) / long));
        p.names[c].setAttribute("y", n(to[1] + 11 * (to[1] - from[1]) / long + 4));
      }
      var robot = data.robots[shown] || {}, part;
      for (part in robot) {
        p.svg.querySelector('[data-part="' + part + '"]').setAttribute("d", robot[part].map(function (l) { return line(f, l); }).join(""));
      }
      (data.ends[shown] || []).forEach(function (end, i) {
        var q = flat(f, end[0], end[1], end[2]), left = q[0] > WIDE / 2, text = p.instruments[i];
        text.setAttribute("x", n(q[0]));
        text.setAttribute("y", n(q[1] + (q[1] > HIGH / 2 - 14 ? 16 : -8)));
        text.setAttribute("text-anchor", left ? "end" : "start");
      });
      if (data.robots.length > 1) p.here.setAttribute("d", line(f, [data.at[shown]]));
      var value = round(90 / (s * it.zoom)), foot = HIGH - 14;
      p.bar.setAttribute("d", "M14 " + foot + "m0-4v8m0-4h" + n(value * s * it.zoom) + "m0-4v8");
      p.barText.textContent = (p.errors ? "error of " : "") + Number(value.toPrecision(1)) + " mm";
      if (p.errors) p.magText.textContent = "arrows × " + Number(mag.toPrecision(2));
    });
  }
  // The arrow whose start is nearest to the pointer, by its configuration and the size of its error.
  function name(p, ev) {
    var box = p.svg.getBoundingClientRect(), f = scene.axes(it.view), near = 14, said = p.name, at = -1;
    var x = (ev.clientX - box.left) * WIDE / box.width, y = (ev.clientY - box.top) * HIGH / box.height;
    data.at.forEach(function (p3, i) {
      var q = flat(f, p3[0], p3[1], p3[2]), far = Math.hypot(q[0] - x, q[1] - y), e = p.errors && p.errors[i];
      if (far < near) { near = far; at = i; said = data.names[i] + (e ? ": " + Number(Math.hypot(e[0], e[1], e[2]).toPrecision(3)) + " mm" : ""); }
    });
    p.said.textContent = said;
    if (at >= 0 && slider) show(at);
  }
  panels.forEach(function (p) {
    scene.live(p.svg, it);
    p.svg.addEventListener("pointermove", function (ev) { name(p, ev); });
    p.svg.addEventListener("pointerleave", function () { p.said.textContent = p.name; });
  });
  var length = document.getElementById("arrow-length"), slider = document.getElementById("arrow-row");
  function show(row) {
    shown = row;
    slider.value = row;
    document.getElementById("arrow-row-name").textContent = data.names[row];
    it.redraw();
  }
  if (slider) {
    slider.addEventListener("input", function () { show(Number(this.value)); });
    show(0);
  }
  if (length) {
    length.addEventListener("input", function () { boost = Math.pow(10, Number(this.value)); it.redraw(); });
    document.getElementById("arrow-same").addEventListener("change", function () { same = this.checked; it.redraw(); });
  }
  document.getElementById("arrow-in").addEventListener("click", function () { it.scale(1.25); });
  document.getElementById("arrow-out").addEventListener("click", function () { it.scale(0.8); });
  document.getElementById("arrow-reset").addEventListener("click", function () {
    boost = 1;
    if (length) length.value = 0;
    it.home();
  });
})();
