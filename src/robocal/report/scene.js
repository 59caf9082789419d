// What every picture of space shares: its camera, whose formulas are those of view.py, and how it is turned: drag or arrow keys rotate, + and - or the wheel with Ctrl zoom, a double click or Home returns.
var scene = (function () {
  "use strict";
  // right, up, towards the eye; azimuth and elevation in degrees
  function axes(view) {
    var a = view[0] * Math.PI / 180, e = view[1] * Math.PI / 180, sa = Math.sin(a), ca = Math.cos(a), se = Math.sin(e), ce = Math.cos(e);
    return [-sa, ca, 0, -se * ca, -se * sa, ce, ce * ca, ce * sa, se];
  }
  // A state: `view`, `zoom`, and what draws it, once for all that changes before the next frame.
  function state(view, lowest, draw) {
    var first = view.slice(), queued = false, it = {view: view.slice(), zoom: 1};
    it.redraw = function () { if (!queued) { queued = true; window.requestAnimationFrame(function () { queued = false; draw(); }); } };
    it.turn = function (a, e) { it.view[0] += a; it.view[1] = Math.max(lowest, Math.min(90, it.view[1] + e)); it.redraw(); };
    it.scale = function (by) { it.zoom = Math.max(0.4, Math.min(8, it.zoom * by)); it.redraw(); };
    it.home = function () { it.view = first.slice(); it.zoom = 1; it.redraw(); };
    return it;
  }
  function live(svg, it) {
    var last = null;
    svg.setAttribute("tabindex", "0");
    svg.classList.add("live");
    svg.addEventListener("pointerdown", function (ev) { last = [ev.clientX, ev.clientY]; svg.setPointerCapture(ev.pointerId); });
    svg.addEventListener("pointermove", function (ev) {
      if (!last) return;
      it.turn((last[0] - ev.clientX) * 0.5, (ev.clientY - last[1]) * 0.5);
      last = [ev.clientX, ev.clientY];
    });
    ["pointerup", "pointercancel"].forEach(function (name) { svg.addEventListener(name, function () { last = null; }); });
    svg.addEventListener("dblclick", it.home);
    svg.addEventListener("wheel", function (ev) {
      if (!ev.ctrlKey && document.activeElement !== svg) return;
      ev.preventDefault();
      it.scale(Math.exp(-ev.deltaY * 0.0015));
    }, {passive: false});
    svg.addEventListener("keydown", function (ev) {
      var step = {ArrowLeft: [5, 0], ArrowRight: [-5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5]}[ev.key];
      if (step) { ev.preventDefault(); it.turn(step[0], step[1]); }
      if (ev.key === "+") it.scale(1.15);
      if (ev.key === "-") it.scale(1 / 1.15);
      if (ev.key === "Home") { ev.preventDefault(); it.home(); }
    });
  }
  return {axes: axes, state: state, live: live, n: function (v) { return v.toFixed(1); }};
})();
