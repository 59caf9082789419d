// Turns pictures of cable robots, as scene.js says. The formulas are those of view.py and marks.py.
(function () {
  "use strict";
  function list(el, name) { return el.hasAttribute(name) ? numbers(el.getAttribute(name)) : null; }
  function numbers(text) { return text.trim().split(/\s+/).map(Number); }
  var n = scene.n;
  document.querySelectorAll("svg[data-eye]").forEach(function (svg) {
    var eye = Number(svg.getAttribute("data-eye")), it = scene.state(numbers(svg.getAttribute("data-view")), 0, draw);
    var at = numbers(svg.getAttribute("data-at")), room = numbers(svg.getAttribute("data-room"));
    var marks = svg.querySelector('g[data-part="marks"]');
    var items = Array.prototype.map.call(svg.querySelectorAll("[data-p]"), function (el) {
      return {el: el, p: numbers(el.getAttribute("data-p")), lift: Number(el.getAttribute("data-lift") || 0), tag: el.tagName,
        body: list(el, "data-b"), piece: list(el, "data-c"), rim: list(el, "data-r"), origin: el.hasAttribute("data-o"),
        closed: /z$/.test(el.getAttribute("d") || ""), wide: Number(el.getAttribute("data-w") || 0), xy: [], depth: 0,
        side: el.hasAttribute("data-n") ? numbers(el.getAttribute("data-n")) : null, sorted: el.parentNode === marks};
    });
    var still = svg.hasAttribute("data-still"), led = svg.hasAttribute("data-rows") ? JSON.parse(svg.getAttribute("data-rows")) : null;
    var sorted = items.filter(function (i) { return i.sorted; }), words = items.filter(function (i) { return i.wide; });

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
      return still ? 1 : fit * it.zoom;
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
      var f = scene.axes(it.view), scale = seen(f);
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
    // Where a piece of a cable begins (k) or ends (k + 1): along the free stretch, then from knot to knot round the pulley.
    function point(knots, k) {
      var c, s = Math.min(k / led.pieces, 1), from = k > led.pieces ? 3 * (k - led.pieces + 1) : 0, out = [];
      for (c = 0; c < 3; c++) out.push(from ? knots[from + c] : knots[c] + s * (knots[3 + c] - knots[c]));
      return out;
    }
    function show(row) {
      items.forEach(function (item) {
        if (item.body) item.p = [].concat.apply([], item.body.map(function (i) { return row.knots[i].slice(0, 3); }));
        if (item.origin) item.p = row.origin;
        if (item.rim) item.p = row.rims[item.rim[0]];
        if (item.piece) {
          var i = item.piece[0], k = item.piece[1], el = item.el, state = row.states && row.states[i];
          item.p = point(row.knots[i], k).concat(point(row.knots[i], k + 1));
          if (!state) return;
          el.setAttribute("visibility", k % 2 && (state === "slack" || state === "none") ? "hidden" : "visible");
          if (!el.hasAttribute("data-cable")) return;
          el.setAttribute("class", "rope " + state);
          el.setAttribute("stroke", row.colours[i] || "none");
          if (!row.colours[i]) el.removeAttribute("stroke");
          el.firstChild.textContent = el.firstChild.textContent.split(":")[0] + ": " + row.words[i];
        }
      });
      if (row.states) {
        words.forEach(function (w, i) {
          var said = w.el.querySelector(".said");
          if (said) said.textContent = row.words[i];
        });
        svg.querySelectorAll(".notch").forEach(function (el, i) {
          var y = row.notches[i];
          el.setAttribute("visibility", y === null ? "hidden" : "visible");
          if (y !== null) el.setAttribute("d", el.getAttribute("d").replace(/^(M\S+) [-\d.]+/, "$1 " + n(y)));
        });
      }
      var caption = svg.querySelector(".caption");
      if (caption) caption.textContent = row.name;
      it.redraw();
    }
    if (led) {
      var controls = document.createElement("p"), name = document.createElement("label"), range = document.createElement("input"), told = document.createElement("output");
      controls.className = "controls rows screen";
      name.textContent = "Row ";
      range.type = "range";
      range.min = 0;
      range.max = led.rows.length - 1;
      range.value = led.first;
      told.textContent = led.rows[led.first].name;
      name.appendChild(range);
      name.appendChild(told);
      controls.appendChild(name);
      svg.parentNode.parentNode.appendChild(controls);
      range.addEventListener("input", function () { told.textContent = led.rows[range.value].name; show(led.rows[range.value]); });
    }
    if (still) return;
    scene.live(svg, it);
    svg.style.overflow = "hidden";
    var note = document.createElement("p");
    note.className = "note screen";
    note.textContent = "Drag, or use the arrow keys, to turn it; + and − zoom; a double click or Home returns.";
    svg.parentNode.parentNode.appendChild(note);
  });
})();
