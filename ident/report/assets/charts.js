// Draws the charts of a page with uPlot; their data are the JSON in #charts.
(() => {
  "use strict";
  const GLYPHS = { circle: "●", square: "■", diamond: "◆", triangle: "▲", down: "▼", ring: "○", cross: "✕", plus: "✚" };
  const INK = "#1b1b1b", GREY = "#6b6b6b", RULE = "#dcdcdc", PALE = "rgba(90, 90, 90, .13)", FONT = "12px system-ui, sans-serif";
  const specs = JSON.parse(document.getElementById("charts").textContent);
  const groups = new Map(); // what zooms together
  const ruler = document.createElement("canvas").getContext("2d"), LINE = 15;

  const text = v => v == null || Number.isNaN(v) ? "–" : (+v.toPrecision(4)).toString().replace("-", "−");
  const span = (low, high) => uPlot.rangeNum(low, high, 0.06, true);
  const make = (tag, parent, props = {}) => parent.appendChild(Object.assign(document.createElement(tag), props));

  function axis(scale, side, label, more = {}) {
    const measure = (u, values) => {
      if (side % 2 == 0 || !values) return 30;
      u.ctx.font = FONT;
      return 14 + Math.max(0, ...values.map(v => u.ctx.measureText(v).width));
    };
    const grid = { stroke: RULE, width: 1 };
    return { scale, side, label, labelSize: label ? 20 : 0, labelFont: FONT, font: FONT, stroke: INK, size: measure, grid, ticks: { show: false }, values: (u, s) => s.map(v => v == null ? "" : text(v)), ...more };
  }

  // Something drawn on the canvas in the plot's own coordinates, clipped to its frame.
  function painter(paint) {
    return u => {
      const { ctx, bbox } = u, px = bbox.width / u.over.clientWidth;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left - 8 * px, bbox.top - 8 * px, bbox.width + 16 * px, bbox.height + 16 * px);
      ctx.clip();
      paint(ctx, (v, scale) => u.valToPos(v, scale, true), px, u);
      ctx.restore();
    };
  }

  function glyph(ctx, x, y, sign, px) {
    ctx.font = `${13 * px}px system-ui, sans-serif`;
    ctx.textAlign = "center";
    ctx.textBaseline = "middle";
    ctx.lineWidth = 2 * px;
    ctx.strokeStyle = "#fff";
    ctx.strokeText(GLYPHS[sign.shape], x, y);
    ctx.fillStyle = sign.colour;
    ctx.fillText(GLYPHS[sign.shape], x, y);
  }

  // A name in lines of at most so many pixels: cut between words only, never short.
  function wrapped(name, most) {
    ruler.font = FONT;
    const lines = [""];
    for (const word of name.split(/(?<=[ _])/)) {
      const last = lines[lines.length - 1];
      if (last && ruler.measureText((last + word).trimEnd()).width > most) lines.push(word);
      else lines[lines.length - 1] = last + word;
    }
    return lines.map(line => line.trimEnd());
  }

  function legend(box, entries, plots) {
    const list = make("ul", box, { className: "signs" }), shown = make("li", list, { className: "readout" });
    const outputs = entries.map(({ name, sign, places }) => {
      const item = make("li", list), button = make("button", item, { type: "button" });
      button.setAttribute("aria-pressed", "true");
      const mark = make("span", button, { textContent: GLYPHS[sign.shape] || (sign.dash.length ? "┅┅" : sign.shape == "band" ? "▒" : "━━") });
      mark.style.color = sign.colour;
      mark.setAttribute("aria-hidden", "true");
      button.append(` ${name}`);
      button.onclick = () => {
        const show = button.getAttribute("aria-pressed") != "true";
        button.setAttribute("aria-pressed", show);
        for (const [panel, i] of places) plots()[panel].setSeries(i, { show });
      };
      return make("output", item);
    });
    list.append(shown);
    return [shown, outputs];
  }

  function lines(box, spec, key) {
    const plots = [], known = [], entries = [], outputs = [];
    let room = 46; // of the values beside the panels, alike for all of them
    const beside = (u, values) => {
      ruler.font = FONT;
      const most = Math.max(room, ...(values || []).map(v => 14 + ruler.measureText(v).width));
      if (most > room) setTimeout(() => plots.forEach(p => p.redraw(false, true)));
      return room = most;
    };
    spec.panels.forEach((panel, p) => {
      const data = [spec.x], series = [{}], bands = [];
      for (const s of panel.series) {
        const y = s.minus ? known[s.minus[0]].map((v, i) => v == null || known[s.minus[1]][i] == null ? null : v - known[s.minus[1]][i]) : s.y;
        known.push(y);
        const sign = s.sign, drawn = sign.shape == "line", place = [p, data.length];
        if (sign.shape == "band") {
          bands.push({ series: [data.length + 1, data.length], fill: sign.colour + "38" });
          data.push(y[0], y[1]);
          series.push({ width: 0, points: { show: false } }, { width: 0, points: { show: false } });
        } else {
          data.push(y);
          const points = { show: sign.shape == "circle" || !!s.points, size: 7, fill: sign.colour, stroke: "#fff" };
          series.push({ stroke: sign.colour, width: sign.width, dash: sign.dash, points, paths: drawn || s.points ? undefined : () => null });
        }
        const same = entries.find(e => e.name == s.name);
        if (same) same.places.push(place);
        else entries.push({ name: s.name, sign, places: [place] });
      }
      const marks = painter((ctx, at, px, u) => {
        const { left, top, width, height } = u.bbox;
        ctx.fillStyle = PALE;
        for (const [a, b] of spec.shaded || []) ctx.fillRect(at(a, "x"), top, Math.max(at(b, "x") - at(a, "x"), px), height);
        ctx.setLineDash([6 * px, 3 * px]);
        ctx.lineWidth = 1.4 * px;
        ctx.strokeStyle = "#d55e00";
        for (const v of panel.limits || []) { ctx.beginPath(); ctx.moveTo(left, at(v, "y")); ctx.lineTo(left + width, at(v, "y")); ctx.stroke(); }
        ctx.strokeStyle = INK;
        if (spec.at) { ctx.beginPath(); ctx.moveTo(at(spec.at, "x"), top); ctx.lineTo(at(spec.at, "x"), top + height); ctx.stroke(); }
      });
      const whole = u => { const [first, last] = u.series[0].idxs || [0, 0]; return last - first >= spec.x.length - 1 || last == first; };
      const range = (u, low, high) => panel.reach && whole(u) ? [-1.1 * panel.reach, 1.1 * panel.reach] : span(Math.min(low ?? 0, ...panel.limits || []), Math.max(high ?? 1, ...panel.limits || []));
      const last = p == spec.panels.length - 1;
      plots.push(new uPlot({
        width: box.clientWidth, height: panel.height + (last ? 50 : 14), padding: [8, 12, last ? 0 : 8, 0], legend: { show: false },
        scales: { x: { time: false }, y: { range } }, series, bands,
        axes: [axis("x", 2, last ? spec.x_label : null, last ? {} : { size: 0, values: (u, s) => s.map(() => "") }), axis("y", 3, panel.label, { size: beside, space: (u, i, low, high, tall) => Math.min(26, tall / 5) })],
        cursor: { sync: { key, scales: ["x", null] }, drag: { x: true, y: false }, y: false },
        hooks: { drawClear: [marks], setCursor: [u => entries.forEach((e, i) => {
          for (const [q, s] of e.places) if (q == p && outputs[i]) outputs[i].textContent = u.cursor.idx == null ? "" : text(u.data[s][u.cursor.idx]);
        })] },
      }, data, box));
    });
    const [shown, values] = legend(box, entries, () => plots);
    outputs.push(...values);
    plots[0].hooks.setCursor.push(u => { shown.textContent = u.cursor.idx == null ? "" : `${spec.x_label}: ${text(u.data[0][u.cursor.idx])}`; });
    return plots;
  }

  function rows(box, spec) {
    ruler.font = FONT;
    const names = spec.rows, values = spec.series.flatMap(s => s.y).filter(v => v != null && (!spec.log || v > 0));
    const plots = [], low = Math.min(...values), high = Math.max(...values);
    const range = spec.log ? [low / 1.3, high * 1.3] : span(Math.min(0, low), Math.max(0, high));
    const steps = high > 300 * low ? [1] : [1, 2, 5], decades = [-9, -8, -7, -6, -5, -4, -3, -2, -1, 0, 1, 2, 3, 4, 5, 6];
    const factors = decades.flatMap(d => steps.map(k => +`${k}e${d}`)).filter(v => v >= range[0] && v <= range[1]);
    const ticks = spec.log ? { splits: () => factors, values: (u, s) => s.map(text), filter: (u, s) => s } : {};
    const draw = painter((ctx, at, px, u) => {
      names.forEach((_, i) => {
        const y = at(i, "x"), ends = spec.joined.map(k => spec.series[k].y[i]);
        ctx.strokeStyle = GREY;
        ctx.lineWidth = 2.5 * px;
        if (ends.length && ends.every(v => v != null)) { ctx.beginPath(); ctx.moveTo(at(ends[0], "v"), y); ctx.lineTo(at(ends[1], "v"), y); ctx.stroke(); }
        spec.series.forEach((s, k) => {
          const v = s.y[i];
          if (v == null || !u.series[k + 1].show || (spec.log && v <= 0)) return;
          const x = at(v, "v");
          ctx.fillStyle = s.sign.colour;
          if (s.sign.shape == "bar") ctx.fillRect(at(0, "v"), y - 7 * px, x - at(0, "v"), 14 * px);
          else if (s.sign.shape == "line") ctx.fillRect(x - px, y - 9 * px, 2 * px, 18 * px);
          else glyph(ctx, x, y, s.sign, px);
        });
      });
    });
    const all = names.map((_, i) => i);
    const labels = width => names.map(name => wrapped(name, Math.max(0.42 * width, 110)));
    const room = u => 14 + Math.max(...labels(u.width).flat().map(line => ruler.measureText(line).width));
    const tall = width => names.length * Math.max(24, 9 + LINE * Math.max(...labels(width).map(lines => lines.length))) + 62;
    const name = u => {
      const { ctx, bbox } = u, px = bbox.width / u.over.clientWidth;
      ctx.save();
      ctx.font = FONT.replace("12px", `${12 * px}px`);
      ctx.fillStyle = INK;
      ctx.textAlign = "right";
      ctx.textBaseline = "middle";
      labels(u.width).forEach((lines, i) => lines.forEach((line, k) =>
        ctx.fillText(line, bbox.left - 8 * px, u.valToPos(i, "x", true) + (k - (lines.length - 1) / 2) * LINE * px)));
      ctx.restore();
    };
    let shown;
    plots.push(new uPlot({
      width: box.clientWidth, height: tall(box.clientWidth), padding: [4, Math.max(18, ruler.measureText(text(range[1])).width / 2), 0, 0], legend: { show: false },
      scales: { x: { time: false, ori: 1, dir: -1, range: [-0.6, names.length - 0.4] }, v: { ori: 0, distr: spec.log ? 3 : 1, range } },
      axes: [axis("x", 3, null, { splits: () => all, values: (u, s) => s.map(() => ""), space: 10, size: room }), axis("v", 2, spec.label, { space: 60, ...ticks })],
      series: [{}, ...spec.series.map(s => ({ scale: "v", stroke: s.sign.colour, paths: () => null, points: { show: false } }))],
      cursor: { x: false, drag: { setScale: false, x: false, y: false }, points: { show: false } },
      hooks: { draw: [draw, name], setCursor: [u => {
        const i = u.cursor.idx;
        if (shown) shown.textContent = i == null ? "" : `${names[i]}: ${spec.series.map(s => `${s.name} ${text(s.y[i])}`).join(", ")}`;
      }] },
    }, [all, ...spec.series.map(s => s.y)], box));
    plots[0].tall = tall;
    const named = spec.series.length > 1 ? spec.series : [];
    [shown] = legend(box, named.map((s, k) => ({ ...s, places: [[0, k + 1]] })), () => plots);
    return plots;
  }

  // From nearly white to dark blue; with a sign, from vermilion through white to blue.
  function shade(v, most, signed) {
    const s = Math.min(Math.abs(v) / most, 1), dark = signed && v < 0 ? [179, 66, 0] : [0, 62, 107], pale = signed ? [255, 255, 255] : [236, 243, 250];
    return `rgb(${pale.map((p, i) => Math.round(p + s * (dark[i] - p)))})`;
  }

  const brief = name => name.includes(" ") ? name.split(" ")[0] + "…" : name;

  function map(box, spec) {
    const { x, y, z } = spec, middle = e => e.slice(1).map((v, i) => (v + e[i]) / 2), mx = middle(x), my = middle(y);
    const draw = painter((ctx, at) => z.forEach((column, i) => column.forEach((v, k) => {
      if (v == null) return;
      const [x0, x1, y0, y1] = [at(x[i], "x"), at(x[i + 1], "x"), at(y[k], "y"), at(y[k + 1], "y")].map(Math.round);
      ctx.fillStyle = shade(v, spec.most, spec.signed);
      ctx.fillRect(Math.min(x0, x1), Math.min(y0, y1), Math.abs(x1 - x0) || 1, Math.abs(y1 - y0) || 1);
    })));
    let shown;
    const ends = e => [e[0], e[e.length - 1]];
    const naming = spec.names ? { values: (u, s) => s.map(v => brief(spec.names[Math.round(v)] ?? "")), incrs: [1, 2, 5, 10, 20], space: 44 } : {};
    const plot = new uPlot({
      width: box.clientWidth, height: spec.names ? Math.min(box.clientWidth, 620) : 240, padding: [8, 12, 0, 0], legend: { show: false },
      scales: { x: { time: false, range: (u, a, b) => a == mx[0] && b == mx[mx.length - 1] ? ends(x) : [a, b] }, y: { range: ends(y), dir: spec.names ? -1 : 1 } },
      axes: [axis("x", 2, spec.x_label, { ...naming, ...spec.names && { rotate: -90, size: 56, space: 24 } }), axis("y", 3, spec.y_label, { ...naming, space: 24 })],
      series: [{}, { paths: () => null, points: { show: false } }],
      cursor: { drag: { x: false, y: false, setScale: false }, points: { show: false } },
      hooks: { draw: [draw], setCursor: [u => {
        const i = u.cursor.idx, value = u.posToVal(u.cursor.top, "y"), k = y.findIndex((e, n) => value >= e && value < y[n + 1]);
        const word = (v, n) => spec.names ? spec.names[n] : text(v);
        if (shown) shown.textContent = i == null || k < 0 || u.cursor.top < 0 ? "" : `${word(mx[i], i)}, ${word(my[k], k)}: ${text(z[i][k])}${spec.unit || ""}`;
      }] },
    }, [mx, mx.map(() => y[0])], box);
    [shown] = legend(box, [], () => [plot]);
    return [plot];
  }

  function keys(box, key) {
    box.addEventListener("keydown", event => {
      const plots = groups.get(key), u = plots.find(p => box.contains(p.root)), data = u.data[0], { min, max } = u.scales.x;
      const i = u.cursor.idx ?? u.valToIdx((min + max) / 2), step = event.shiftKey ? 10 : 1;
      const show = (a, b) => plots.forEach(p => p.setScale("x", { min: Math.max(a, data[0]), max: Math.min(b, data[data.length - 1]) }));
      const move = n => {
        const k = Math.min(Math.max(n, 0), data.length - 1), place = u.valToPos(data[k], "x"), upright = u.scales.x.ori == 1;
        box.querySelectorAll("output, .readout").forEach(o => o.setAttribute("aria-live", "polite"));
        u.setCursor({ left: upright ? 5 : place, top: upright ? place : u.over.clientHeight / 2 }, true, true);
      };
      const around = f => show(data[i] - f * (max - min), data[i] + f * (max - min));
      const act = { ArrowRight: () => move(i + step), ArrowDown: () => move(i + step), ArrowLeft: () => move(i - step), ArrowUp: () => move(i - step), Home: () => move(0), End: () => move(data.length),
        "+": () => around(0.25), "-": () => around(1), 0: () => show(data[0], data[data.length - 1]) }[event.key];
      if (!act) return;
      event.preventDefault();
      act();
    });
  }

  const draws = { lines, rows, map };
  document.querySelectorAll("[data-chart]").forEach(box => {
    const spec = specs[+box.dataset.chart], key = box.closest("figure").id + spec.kind;
    const plots = draws[spec.kind](box, spec, key);
    groups.set(key, [...groups.get(key) || [], ...plots]);
    keys(box, key);
    new ResizeObserver(() => {
      const width = box.clientWidth;
      if (width) plots.forEach(u => u.width != width && u.setSize({ width, height: u.tall?.(width) ?? u.height }));
    }).observe(box);
  });

  // The joint chooser: one for each figure with several joints; all of a page go together.
  const choosers = [];
  document.querySelectorAll("figure[data-joints]").forEach(figure => {
    const boxes = [...figure.querySelectorAll("[data-joint]")], label = make("label", figure, { className: "chooser", textContent: "Show " });
    const choice = make("select", label);
    for (const name of ["all joints", ...new Set(boxes.map(b => b.dataset.joint))]) make("option", choice, { textContent: name });
    figure.querySelector(".charts").before(label);
    choosers.push([choice, boxes]);
    choice.onchange = () => choosers.forEach(([other, all]) => {
      const there = all.some(b => b.dataset.joint == choice.value);
      other.value = there ? choice.value : "all joints";
      all.forEach(b => { b.hidden = there && b.dataset.joint != choice.value; b.classList.toggle("alone", there); });
    });
  });

  // Tables that are sorted by a click on a head, and filtered by a word.
  document.querySelectorAll("[data-sortable]").forEach(box => {
    const body = box.querySelector("tbody"), all = [...body.rows], heads = [...box.querySelectorAll("thead th")];
    const words = all.map(row => row.textContent.toLowerCase());
    const value = (row, k) => row.cells[k].dataset.value ?? row.cells[k].textContent.trim();
    const digits = v => parseFloat(v.replace("−", "-").replace(/[\s\u202f+]/g, ""));
    heads.forEach((head, k) => {
      const button = make("button", head, { type: "button", className: "sort", textContent: head.textContent });
      head.replaceChildren(button);
      button.onclick = () => {
        const down = head.getAttribute("aria-sort") == "descending" ? 1 : -1, numbers = head.classList.contains("numbers");
        heads.forEach(h => h.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", down == 1 ? "ascending" : "descending");
        const key = new Map(all.map(row => [row, numbers ? digits(value(row, k)) : value(row, k)]));
        all.sort((a, b) => {
          const x = key.get(a), y = key.get(b);
          return numbers ? (Number.isNaN(x) - Number.isNaN(y)) || down * (x - y) : down * x.localeCompare(y, undefined, { numeric: true });
        });
        body.append(...all);
      };
    });
    if (all.length < 13) return;
    const label = document.createElement("label"), field = make("input", label, { type: "search", placeholder: "any word of a row" });
    label.className = "chooser";
    label.prepend("Show rows with ");
    box.before(label);
    const index = new Map(all.map((row, i) => [row, words[i]]));
    field.oninput = () => { const wanted = field.value.toLowerCase(); all.forEach(row => { row.hidden = !index.get(row).includes(wanted); }); };
  });

  // On paper, what is folded away is open, but for long tables behind figures.
  addEventListener("beforeprint", () => document.querySelectorAll("details:not([open])").forEach(d => {
    if (!d.querySelector(".table:not(.short)") || !d.closest("figure")) { d.open = true; d.dataset.closed = ""; }
  }));
  addEventListener("afterprint", () => document.querySelectorAll("details[data-closed]").forEach(d => { d.open = false; delete d.dataset.closed; }));
})();
