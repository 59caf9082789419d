// Turns the two arrow pictures: drag or arrow keys rotate, wheel with Ctrl or the buttons zoom, a slider sets the length of the arrows.
(function () {
  "use strict";
  var holder = document.getElementById("arrow-data"), figure = document.getElementById("arrows");
  if (!holder || !figure) return;
  var data = JSON.parse(holder.textContent), controls = document.getElementById("arrow-controls");
  var WIDE = 460, HIGH = 440, view = data.view.slice(), zoom = 1, boost = 1, same = false, queued = false;
  var panels = ["before", "after"].map(function (key, k) {
    var svg = figure.querySelector('svg[data-panel="' + key + '"]');
    var part = function (name) { return svg.querySelector('[data-part="' + name + '"]'); };
    return {svg: svg, errors: data[key], mag: data.mag[k], box: part("box"), sets: [part("0"), part("1")], bar: part("bar"),
      barText: part("bar-text"), magText: part("mag"), names: svg.querySelectorAll(".axis-name")};
  });
  controls.hidden = false;

  function frame() {
    var a = view[0] * Math.PI / 180, e = view[1] * Math.PI / 180;
    return [-Math.sin(a), Math.cos(a), 0, -Math.sin(e) * Math.cos(a), -Math.sin(e) * Math.sin(a), Math.cos(e)];
  }
  function flat(f, x, y, z) {
    return [WIDE / 2 + zoom * (x * f[0] + y * f[1] + z * f[2]), HIGH / 2 - 14 - zoom * (x * f[3] + y * f[4] + z * f[5])];
  }
  function n(v) { return v.toFixed(1); }
  function arrow(f, p, e, s) {
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
    queued = false;
    var f = frame(), b = data.bounds;
    panels.forEach(function (p, k) {
      var mag = (same ? panels[0].mag : p.mag) * boost, s = data.scale * mag, sets = ["", ""], box = "", corners = [], i, c;
      for (i = 0; i < data.at.length; i++) sets[data.out[i]] += arrow(f, data.at[i], p.errors[i], s);
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
      var value = round(90 / (s * zoom)), foot = HIGH - 14;
      p.bar.setAttribute("d", "M14 " + foot + "m0-4v8m0-4h" + n(value * s * zoom) + "m0-4v8");
      p.barText.textContent = "error of " + Number(value.toPrecision(1)) + " mm";
      p.magText.textContent = "arrows × " + Number(mag.toPrecision(2));
    });
  }
  function redraw() { if (!queued) { queued = true; window.requestAnimationFrame(draw); } }
  function turn(a, e) { view[0] += a; view[1] = Math.max(-90, Math.min(90, view[1] + e)); redraw(); }
  function scale(by) { zoom = Math.max(0.4, Math.min(8, zoom * by)); redraw(); }
  panels.forEach(function (p) {
    var last = null;
    p.svg.setAttribute("tabindex", "0");
    p.svg.classList.add("live");
    p.svg.addEventListener("pointerdown", function (ev) { last = [ev.clientX, ev.clientY]; p.svg.setPointerCapture(ev.pointerId); });
    p.svg.addEventListener("pointermove", function (ev) {
      if (!last) return;
      turn((last[0] - ev.clientX) * 0.5, (ev.clientY - last[1]) * 0.5);
      last = [ev.clientX, ev.clientY];
    });
    ["pointerup", "pointercancel"].forEach(function (name) { p.svg.addEventListener(name, function () { last = null; }); });
    p.svg.addEventListener("wheel", function (ev) {
      if (!ev.ctrlKey && document.activeElement !== p.svg) return;
      ev.preventDefault();
      scale(Math.exp(-ev.deltaY * 0.0015));
    }, {passive: false});
    p.svg.addEventListener("keydown", function (ev) {
      var step = {ArrowLeft: [5, 0], ArrowRight: [-5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5]}[ev.key];
      if (step) { ev.preventDefault(); turn(step[0], step[1]); }
      if (ev.key === "+") scale(1.15);
      if (ev.key === "-") scale(1 / 1.15);
    });
  });
  document.getElementById("arrow-length").addEventListener("input", function () { boost = Math.pow(10, Number(this.value)); redraw(); });
  document.getElementById("arrow-same").addEventListener("change", function () { same = this.checked; redraw(); });
  document.getElementById("arrow-in").addEventListener("click", function () { scale(1.25); });
  document.getElementById("arrow-out").addEventListener("click", function () { scale(0.8); });
  document.getElementById("arrow-reset").addEventListener("click", function () {
    view = data.view.slice(); zoom = 1; boost = 1;
    document.getElementById("arrow-length").value = 0;
    redraw();
  });
})();
