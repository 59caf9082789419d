// Turns pictures of cable robots: drag or arrow keys rotate, + and - or the wheel with Ctrl zoom, a double click returns. The formulas are those of view.py and marks.py.
(function () {
  "use strict";
  function numbers(text) { return text.trim().split(/\s+/).map(Number); }
  function n(v) { return v.toFixed(1); }
  document.querySelectorAll("svg[data-eye]").forEach(function (svg) {
    var eye = Number(svg.getAttribute("data-eye")), first = numbers(svg.getAttribute("data-view"));
    var at = numbers(svg.getAttribute("data-at")), room = numbers(svg.getAttribute("data-room"));
    var view = first.slice(), zoom = 1, queued = false, last = null;
    var marks = svg.querySelector('g[data-part="marks"]');
    var items = Array.prototype.map.call(svg.querySelectorAll("[data-p]"), function (el) {
      return {el: el, p: numbers(el.getAttribute("data-p")), lift: Number(el.getAttribute("data-lift") || 0), tag: el.tagName,
        closed: /z$/.test(el.getAttribute("d") || ""), wide: Number(el.getAttribute("data-w") || 0), xy: [], depth: 0,
        side: el.hasAttribute("data-n") ? numbers(el.getAttribute("data-n")) : null, sorted: el.parentNode === marks};
    });
    var sorted = items.filter(function (i) { return i.sorted; }), words = items.filter(function (i) { return i.wide; });

    function axes() {
      var a = view[0] * Math.PI / 180, e = view[1] * Math.PI / 180, sa = Math.sin(a), ca = Math.cos(a), se = Math.sin(e), ce = Math.cos(e);
      return [-sa, ca, 0, -se * ca, -se * sa, ce, ce * ca, ce * sa, se];
    }
    function seen(f) {
      var fit = 1;
      items.forEach(function (item) {
        var p = item.p, sum = 0, k, d, x, y, z, near;
        item.xy.length = 0;
        for (k = 0; k < p.length; k += 3) {
          x = p[k] * f[0] + p[k + 1] * f[1] + p[k + 2] * f[2];
          y = p[k] * f[3] + p[k + 1] * f[4] + p[k + 2] * f[5];
          z = p[k] * f[6] + p[k + 1] * f[7] + p[k + 2] * f[8];
          near = eye / (eye - z);
          item.xy.push(x * near, -y * near);
          sum += z;
          if (item.tag !== "text") {
            d = x * near > 0 ? room[0] - 12 - at[0] : at[0] - 12;
            fit = Math.min(fit, d / Math.abs(x * near));
            d = y * near < 0 ? room[1] - 50 - at[1] : at[1] - room[2];
            fit = Math.min(fit, d / Math.abs(y * near));
          }
        }
        item.depth = 3 * sum / p.length + item.lift;
      });
      return fit * zoom;
    }
    function place() {
      var right = room[0], bottom = room[1] - 22, k, i, j, gap, push, shift, most;
      words.forEach(function (w) {
        w.s = w.x < at[0] ? -1 : 1;
        if (w.s < 0 ? w.x - 9 - w.wide < 4 : w.x + 9 + w.wide > right) w.s = -w.s;
        w.tx = w.x + 9 * w.s;
        w.ty = w.y + (w.y < at[1] ? -3 : 11);
        w.from = w.s < 0 ? w.tx - w.wide : w.tx;
      });
      for (k = 0; k < 60; k++) {
        most = 0;
        shift = words.map(function () { return 0; });
        for (i = 0; i < words.length; i++) for (j = 0; j < i; j++) {
          if (words[i].from < words[j].from + words[j].wide && words[j].from < words[i].from + words[i].wide) {
            gap = words[i].ty - words[j].ty;
            push = Math.max(15 - Math.abs(gap), 0) * (gap < 0 ? -0.5 : 0.5);
            shift[i] += push; shift[j] -= push;
            most = Math.max(most, Math.abs(push));
          }
        }
        if (most < 0.05) break;
        for (i = 0; i < words.length; i++) words[i].ty = Math.min(Math.max(words[i].ty + shift[i], room[2] + 12), bottom - 4);
      }
      words.forEach(function (w) {
        w.el.setAttribute("x", n(w.tx));
        w.el.setAttribute("y", n(w.ty));
        w.el.setAttribute("text-anchor", w.s < 0 ? "end" : "start");
      });
    }
    function draw() {
      queued = false;
      var f = axes(), scale = seen(f);
      items.forEach(function (item) {
        var xy = item.xy, el = item.el, d = "", k;
        item.x = at[0] + scale * xy[0];
        item.y = at[1] + scale * xy[1];
        if (item.tag === "circle") {
          el.setAttribute("cx", n(item.x));
          el.setAttribute("cy", n(item.y));
        } else if (item.tag === "path") {
          for (k = 0; k < xy.length; k += 2) d += (k ? "L" : "M") + n(at[0] + scale * xy[k]) + " " + n(at[1] + scale * xy[k + 1]);
          el.setAttribute("d", d + (item.closed ? "z" : ""));
        } else if (!item.wide) {
          el.setAttribute("x", n(item.x));
          el.setAttribute("y", n(item.y + 4));
          if (item.side) el.setAttribute("visibility", item.side[0] * f[6] + item.side[1] * f[7] > 0 ? "visible" : "hidden");
        }
      });
      sorted.sort(function (a, b) { return a.depth - b.depth; });
      var all = document.createDocumentFragment();
      sorted.forEach(function (item) { all.appendChild(item.el); });
      marks.appendChild(all);
      place();
    }
    function redraw() { if (!queued) { queued = true; window.requestAnimationFrame(draw); } }
    function turn(a, e) { view[0] += a; view[1] = Math.max(0, Math.min(90, view[1] + e)); redraw(); }
    function scale(by) { zoom = Math.max(0.5, Math.min(8, zoom * by)); redraw(); }
    function home() { view = first.slice(); zoom = 1; redraw(); }
    svg.setAttribute("tabindex", "0");
    svg.classList.add("live");
    svg.style.overflow = "hidden";
    svg.addEventListener("pointerdown", function (ev) { last = [ev.clientX, ev.clientY]; svg.setPointerCapture(ev.pointerId); });
    svg.addEventListener("pointermove", function (ev) {
      if (!last) return;
      turn((last[0] - ev.clientX) * 0.4, (ev.clientY - last[1]) * 0.4);
      last = [ev.clientX, ev.clientY];
    });
    ["pointerup", "pointercancel"].forEach(function (name) { svg.addEventListener(name, function () { last = null; }); });
    svg.addEventListener("dblclick", home);
    svg.addEventListener("wheel", function (ev) {
      if (!ev.ctrlKey && document.activeElement !== svg) return;
      ev.preventDefault();
      scale(Math.exp(-ev.deltaY * 0.0015));
    }, {passive: false});
    svg.addEventListener("keydown", function (ev) {
      var step = {ArrowLeft: [5, 0], ArrowRight: [-5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5]}[ev.key];
      if (step) { ev.preventDefault(); turn(step[0], step[1]); }
      if (ev.key === "+") scale(1.15);
      if (ev.key === "-") scale(1 / 1.15);
      if (ev.key === "Home") { ev.preventDefault(); home(); }
    });
    var note = document.createElement("p");
    note.className = "note screen";
    note.textContent = "Drag, or use the arrow keys, to turn it; + and − zoom; a double click or Home returns.";
    svg.parentNode.parentNode.appendChild(note);
  });
})();
